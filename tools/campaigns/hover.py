"""Station keeping in wind with little or no current, weathervaning and sparing."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Final

from sitl.plant import WaterConfig
from tools.benches.cells.control_cells import Case
from tools.benches.cells.hover_cells import held
from tools.benches.cells.sensed import SensedState

from .campaign import Campaign, Figures, Job, hull

_WINDS_MPS: Final = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
_CURRENTS_MPS: Final = (0.0, 0.05, 0.1, 0.3)
_BARS: Final = {"rms_m": 0.3, "most_m": 1.0, "swept_deg": 180.0, "full_share": 0.05, "spared": 1.0}


def _jobs(hulls: tuple[str, ...], seeds: range) -> Iterator[Job]:
    yield from itertools.product(hulls, _WINDS_MPS, _CURRENTS_MPS, seeds)


def _sail(name: str, wind_mps: float, current_mps: float, seed: int) -> Figures:
    case = Case(hull(name), WaterConfig(wind_mps=wind_mps, current_mps=current_mps), seed=seed, source=SensedState)
    kept, spared = held(case), held(case, "drift")
    return {
        "rms_m": kept.rms_m,
        "most_m": kept.most_m,
        "swept_deg": kept.swept_deg,
        "full_share": kept.full_share,
        "power": kept.power,
        "spared": spared.power / kept.power,
    }


def _misses(_: Job, figures: Figures) -> list[str]:
    return [f"{name} {figures[name]:.3f} ({bar:g})" for name, bar in _BARS.items() if figures[name] > bar]


HOVER: Final = Campaign(
    told="hold a point for 400 s, wind 2 to 10 m/s, current 0 to 0.3 m/s; spared = power of drift over that of weathervane",
    jobs=_jobs,
    sail=_sail,
    misses=_misses,
)
