"""The seed's law as the prototype measured it: pure pursuit straight at the mark, no drift, no field (vessel-control §4)."""

from __future__ import annotations

import math

from companion.core.guide.paths import Line
from mavlink_bridge.language.messages import Desired
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import wrap_pi
from tools.benches.cells.control_cells import Case, Errors, errors, square
from tools.benches.cells.control_loop import ControlLoop


def pursuit_ring(case: Case, radius_m: float, speed_mps: float, laps: float = 3.0) -> Errors:
    """Circle by pure pursuit of a carrot 2 s ahead, as the prototype's ``seed`` column; radius error after one lap."""
    run = case.loop()
    run.place(radius_m + 8.0, 0.0, math.pi / 2.0, speed_mps)
    carrot_rad = max(3.0, 2.0 * speed_mps) / radius_m
    offset = _origin_offset(run)
    swept, last, values = 0.0, 0.0, []
    end_s = ((laps + 1.0) * 2.0 * math.pi * radius_m + 60.0) / speed_mps * 1.6
    while run.t_s < end_s and abs(swept) < 2.0 * math.pi * (laps + 1.0):
        north, east = _known(run, offset)
        bearing = math.atan2(east, north) + carrot_rad
        aim = (radius_m * math.cos(bearing) - north, radius_m * math.sin(bearing) - east)
        run.steer(Desired(math.atan2(aim[1], aim[0]), speed_mps))
        bearing = math.atan2(run.vessel.east_m, run.vessel.north_m)
        swept += wrap_pi(bearing - last)
        last = bearing
        if abs(swept) > 2.0 * math.pi:
            values.append(math.hypot(run.vessel.north_m, run.vessel.east_m) - radius_m)
    return errors(values, run)


def pursuit_legs(case: Case, speed_mps: float, side_m: float = 80.0) -> Errors:
    """The 80 m square with the bow on each waypoint, as the prototype's ``seed`` column; windows as in ``legs``."""
    points = [*square(side_m), NorthEast((side_m, 0.0))]
    run = case.loop()
    run.place(0.0, 0.0, 0.0, speed_mps)
    offset = _origin_offset(run)
    near, index, values = max(2.0, 1.8 * speed_mps), 1, []
    end_s = 5.0 * side_m / speed_mps * 2.5
    while index < len(points) and run.t_s < end_s:
        line = Line(points[index - 1], points[index])
        north, east = _known(run, offset)
        if line.project(north, east).along_m > side_m - near or math.dist((north, east), points[index]) < near:
            index += 1
            continue
        run.steer(Desired(math.atan2(points[index][1] - east, points[index][0] - north), speed_mps))
        here = line.project(run.vessel.north_m, run.vessel.east_m)
        if index > 1 and 20.0 < here.along_m < side_m - near:
            values.append(here.cross_m)
    return errors(values, run, finished=index == len(points))


def _origin_offset(run: ControlLoop) -> NorthEast:
    """Where the estimator's origin lies on the truth's plane."""
    assert run.state.origin_lat_rad is not None and run.state.origin_lon_rad is not None  # noqa: PT018
    return run.frame.to_local(run.state.origin_lat_rad, run.state.origin_lon_rad)


def _known(run: ControlLoop, offset: NorthEast) -> NorthEast:
    """The vessel's own idea of where it is, on the truth's plane."""
    return NorthEast(((run.state.x_m or 0.0) + offset[0], (run.state.y_m or 0.0) + offset[1]))
