"""Boats drawn at random, small, heavy and fast: legs, a circle and a point held, by their right files.

Seeds below 24 have been looked at while station keeping and reference were made for heavy boats; from there on nobody has tuned on them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Final

from companion.core.hull import Handling
from tools.benches.cells import control_cells as cells
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.drawn_hulls import KINDS, Kind, drawn
from tools.benches.cells.hover_cells import held
from tools.benches.cells.sensed import SensedState

from .campaign import Campaign, Figures, Job

_SHARE: Final = 0.6
"""Speed of legs and circles over the top speed."""
_FAR_M: Final = 1.0
"""From here on an operator would say that she does not do what she is told."""


def _jobs(_: tuple[str, ...], seeds: range) -> Iterator[Job]:
    yield from itertools.product(KINDS, WATERS, seeds)


def _sail(kind: Kind, water: str, seed: int) -> Figures:
    vessel = drawn(kind, seed)
    handling = Handling(vessel)
    mps = _SHARE * handling.top_mps
    case = Case(vessel, WATERS[water], source=SensedState)
    legs, _ = cells.legs(case, mps, side_m=max(80.0, 20.0 * vessel.hull.length_m))
    circle = cells.ring(case, max(10.0, 2.5 * handling.turn_radius_m(mps)), mps)
    station = held(case)
    return {
        "legs_m": legs.rms,
        "circle_m": circle.rms,
        "station_m": station.rms_m,
        "power": station.power,
        "unfinished": float(not legs.finished) + float(not circle.finished),
    }


def _misses(_: Job, figures: Figures) -> list[str]:
    far = [f"{name} {figures[name]:.2f}" for name in ("legs_m", "circle_m", "station_m") if figures[name] > _FAR_M]
    return [*far, "not finished"] if figures["unfinished"] or not math.isfinite(figures["legs_m"]) else far


DRAWN: Final = Campaign(
    told=f"boats drawn at random, {', '.join(KINDS)}, in {', '.join(WATERS)}: within {_FAR_M:g} m of legs, circle and point, RMS",
    jobs=_jobs,
    sail=_sail,
    misses=_misses,
)
