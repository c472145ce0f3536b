"""Legs sailed by a vessel file that is wrong: one coefficient alone, or all of them at once."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator
from typing import Final

from companion.core.hull import VesselConfig
from tools.benches.cells import control_cells as cells
from tools.benches.cells.control_cells import BREEZE, Case
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.trial_cells import COEFFICIENTS, one_wrong, wrong

from .campaign import Campaign, Figures, Job, hull

_MPS: Final = 1.5
_TIMES: Final = 3.0
_SEED: Final = 1


def _rms_m(name: str, belief: VesselConfig | None) -> float:
    found, _ = cells.legs(Case(hull(name), BREEZE, seed=_SEED, source=SensedState, belief=belief), _MPS)
    return found.rms


@functools.cache
def _right_m(name: str) -> float:
    return _rms_m(name, None)


def _figures(name: str, belief: VesselConfig) -> Figures:
    rms_m = _rms_m(name, belief)
    return {"rms_m": rms_m, "times": rms_m / _right_m(name)}


def _misses(_: Job, figures: Figures) -> list[str]:
    return [] if figures["times"] <= _TIMES else [f"{figures['times']:.2f} times, {figures['rms_m']:.3f} m"]


def _draws(hulls: tuple[str, ...], seeds: range) -> Iterator[Job]:
    yield from itertools.product(hulls, seeds)


def _sail_draw(name: str, seed: int) -> Figures:
    return _figures(name, wrong(hull(name), seed))


def _each(hulls: tuple[str, ...], _: range) -> Iterator[Job]:
    for name, (table, key), factor in itertools.product(hulls, COEFFICIENTS, (0.5, 1.5)):
        if getattr(getattr(hull(name), table), key):
            yield name, table, key, factor


def _sail_each(name: str, table: str, key: str, factor: float) -> Figures:
    return _figures(name, one_wrong(hull(name), table, key, factor))


JOINT: Final = Campaign(
    told="legs in a breeze by a file of which every coefficient is off by up to half; times = RMS over that of the right file",
    jobs=_draws,
    sail=_sail_draw,
    misses=_misses,
)
EACH: Final = Campaign(
    told="legs in a breeze by a file of which one coefficient is half or one and a half of what is right",
    jobs=_each,
    sail=_sail_each,
    misses=_misses,
)
