"""Twelve faults of thrusters and rudders, told by their right names; and hours of rough water in which nothing is wrong."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Final

from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import Loiter
from sitl.plant import WaterConfig
from tools.benches.cells.control_cells import BREEZE, CALM, Case
from tools.benches.cells.control_loop import ControlLoop
from tools.benches.cells.fault_cells import Ears, faults, tell
from tools.benches.cells.sensed import SensedState, late_eyes

from .campaign import Campaign, Figures, Job, hull

_BLOW: Final = WaterConfig(current_mps=0.5, wind_mps=8.0, gust_share=0.25, wave_height_m=0.3)
_GALE: Final = WaterConfig(wind_mps=10.0, gust_share=0.25, wave_height_m=0.3, current_mps=0.3)
_WATERS: Final = {"calm": CALM, "breeze": BREEZE, "blow": _BLOW, "gale": _GALE}
_FAULTY_WATERS: Final = ("calm", "breeze", "blow")
_FIGURES: Final = {"leg": 1.5, "ring": 1.5, "station": 1.0}
"""Speed of each, m/s."""
_CLEAN_FIGURES: Final = {"ring of 10 m": 1.5, "ring of 25 m": 2.5, "station": 1.0}
_IN_TIME_S: Final = 15.0
_CLEAN_S: Final = 1800.0


def _begin(name: str, water: str, figure: str, seed: int) -> ControlLoop:
    source = late_eyes if name == "crooked" else SensedState
    run = Case(hull(name), _WATERS[water], seed=seed, source=source).loop()
    centre = run.frame.to_geodetic(0.0, 0.0)
    if figure == "leg":
        run.place(0.0, 0.0, 0.0, 1.5)
        run.sail(run.goto(600.0, 0.0))
    elif figure == "station":
        run.place(0.0, 0.0, 0.0)
        run.sail(Loiter(0, *centre, figure=Hover()))
    else:
        radius_m = {"ring": 20.0, "ring of 10 m": 10.0, "ring of 25 m": 25.0}[figure]
        run.place(radius_m, 0.0, math.pi / 2.0, _speed_mps(figure))
        run.sail(Loiter(0, *centre, figure=Circle(radius_m=radius_m)))
    return run


def _speed_mps(figure: str) -> float:
    return (_FIGURES | _CLEAN_FIGURES)[figure]


def _faulty(figures: tuple[str, ...], hulls: tuple[str, ...], seeds: range) -> Iterator[Job]:
    for name in hulls:
        yield from itertools.product((name,), _FAULTY_WATERS, figures, faults(hull(name)), seeds)


def _under_way(hulls: tuple[str, ...], seeds: range) -> Iterator[Job]:
    return _faulty(("leg", "ring"), hulls, seeds)


def _on_station(hulls: tuple[str, ...], seeds: range) -> Iterator[Job]:
    return _faulty(("station",), hulls, seeds)


def _sail_faulty(name: str, water: str, figure: str, fault: str, seed: int) -> Figures:
    break_down, cause = faults(hull(name))[fault]
    told = tell(_begin(name, water, figure, seed), break_down, _speed_mps(figure))
    is_right = told.within(_IN_TIME_S, cause)
    if is_right is None:
        return {}
    late_s = math.inf if told.told_s is None else told.told_s
    return {"is_right": float(is_right), "told_s": late_s, "is_silent": float(not told.causes)}


def _not_told(_: Job, figures: Figures) -> list[str]:
    if figures["is_right"]:
        return []
    return ["not told" if figures["is_silent"] else f"another cause after {figures['told_s']:.1f} s"]


def _clean(hulls: tuple[str, ...], seeds: range) -> Iterator[Job]:
    yield from itertools.product(hulls, ("blow", "gale"), _CLEAN_FIGURES, seeds)


def _sail_clean(name: str, water: str, figure: str, seed: int) -> Figures:
    run = _begin(name, water, figure, seed)
    ears, alarms = Ears(hull(name)), 0
    while run.t_s < _CLEAN_S:
        run.tick(_speed_mps(figure))
        alarms += bool(ears.step(run))
    return {"alarms": float(alarms), "hours": run.t_s / 3600.0}


def _false(_: Job, figures: Figures) -> list[str]:
    return [f"{figures['alarms']:.0f} false alarms"] if figures["alarms"] else []


_WHAT: Final = (
    "the right cause is told within 15 s of the first moment at which a fault changes force or moment by a fifth"
)
HEALTH: Final = Campaign(
    told=f"legs and rings in calm, breeze and blow: {_WHAT}",
    jobs=_under_way,
    sail=_sail_faulty,
    misses=_not_told,
    share=0.95,
)
HEALTH_ON_STATION: Final = Campaign(
    told=f"on station in calm, breeze and blow: {_WHAT}",
    jobs=_on_station,
    sail=_sail_faulty,
    misses=_not_told,
    share=0.95,
)
CLEAN: Final = Campaign(
    told="half an hour of rings and station keeping in blow and gale: nothing is told",
    jobs=_clean,
    sail=_sail_clean,
    misses=_false,
)
