"""One straight leg through water that is not the same everywhere: eddy lines, and a current that turns along the way."""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_bridge.language.points import NorthEast
from sitl.plant import SimVessel, Water

from .control_cells import Case, Errors, Route, errors

LEG_M = 300.0
SETTLE_M = 20.0
EDDY_MPS = 0.7
EDDY_M = 25.0
TURNING_MPS = 0.6
TURNING_DEG_PER_M = 4.5
"""The two waters of the trials' control report, part 3."""

Current = Callable[[float, float], tuple[float, float]]
"""North and east of the current, m/s, at a place north and east in m."""


class WaterOfPlaces(Water):
    """Water whose current depends on where the hull is."""

    def __init__(self, still: Water, hull: SimVessel, current: Current) -> None:
        self.__dict__.update(still.__dict__)
        self._hull, self._law = hull, current

    def step(self, dt_s: float) -> None:
        super().step(dt_s)
        self.current_n_mps, self.current_e_mps = self._law(self._hull.north_m, self._hull.east_m)


def eddy_line(north_m: float, _east_m: float) -> tuple[float, float]:
    """Across a leg to the north, changing sign every 25 m."""
    return 0.0, EDDY_MPS if math.floor(north_m / EDDY_M) % 2 == 0 else -EDDY_MPS


def turning(north_m: float, _east_m: float) -> tuple[float, float]:
    """As strong everywhere, its direction turning by 4.5 degrees with each metre to the north."""
    to_rad = math.radians(TURNING_DEG_PER_M * north_m)
    return TURNING_MPS * math.cos(to_rad), TURNING_MPS * math.sin(to_rad)


def leg_through(case: Case, current: Current, speed_mps: float) -> Errors:
    """300 m to the north; cross-track errors after 20 m."""
    run = case.loop()
    run.water = WaterOfPlaces(run.water, run.vessel, current)
    run.place(0.0, 0.0, 0.0, speed_mps)
    route, going, values = Route(run, [NorthEast((0.0, 0.0)), NorthEast((LEG_M, 0.0))], speed_mps), True, []
    while going:
        going = route.tick()
        if run.vessel.north_m > SETTLE_M:
            values.append(run.vessel.east_m)
    return errors(values, run, finished=route.finished)
