"""What a Python program gets from ``import companion``: plans made, read and written, runs read and reported, a vessel reached.

Degrees, metres and m/s at this border, units in every name. Everything else is inner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from mavlink_bridge.language.figures import Circle, Hover, LoiterDirection
from mavlink_bridge.language.messages import Goto, Loiter
from mavlink_bridge.mavlink.missions.plan_export import items_from_maneuvers
from mavlink_bridge.plans import PlanFile, read_plan as parse_plan

from .commands.plan.link import Vessel
from .commands.plan.save import write_file
from .commands.report import default_output, read as read_run
from .io.whole_file import write_whole
from .report.page import make_page
from .settings.device import no_device

__all__ = [
    "PlanFile",
    "Vessel",
    "loiter",
    "plan_of",
    "read_plan",
    "read_run",
    "waypoint",
    "write_plan",
    "write_report",
]


def waypoint(lat_deg: float, lon_deg: float, *, speed_mps: float | None = None, hold_s: float = 0.0) -> Goto:
    """A point to sail to (WGS-84, degrees); ``hold_s``: how long to stay there."""
    return Goto(0, math.radians(lat_deg), math.radians(lon_deg), hold_s=hold_s, speed_mps=speed_mps)


def loiter(
    lat_deg: float,
    lon_deg: float,
    *,
    radius_m: float = 20.0,
    duration_s: float | None = None,
    speed_mps: float | None = None,
    clockwise: bool = True,
) -> Loiter:
    """A circle about a point; radius 0 keeps station there. ``duration_s`` counts from reaching it, None = for ever."""
    way = LoiterDirection.CW if clockwise else LoiterDirection.CCW
    figure = Circle(radius_m=radius_m, direction=way) if radius_m else Hover()
    place = math.radians(lat_deg), math.radians(lon_deg)
    return Loiter(0, *place, figure=figure, duration_s=duration_s, speed_mps=speed_mps)


def plan_of(maneuvers: Sequence[Goto | Loiter]) -> PlanFile:
    """Make a plan of manoeuvres, in their order. Raises InexpressibleError for what MAVLink cannot say."""
    return PlanFile(items_from_maneuvers(maneuvers))


def read_plan(path: str | Path) -> PlanFile:
    """Read a plan file: QGroundControl's .plan and .mission, WPL 110, the seed's JSON. Raises OSError, PlanFileError."""
    file = Path(path)
    return parse_plan(no_device(file).read_bytes(), file.name)


def write_plan(plan: PlanFile, path: str | Path) -> None:
    """Write a plan file in the format of the name's end: .plan, .json, .txt or .waypoints. Raises ConfigError for another."""
    write_file(plan, Path(path))


def write_report(source: str | Path, out: str | Path | None = None) -> Path:
    """Write the HTML report of a run's folder or a telemetry log; return where it is. Raises ConfigError."""
    target = Path(out) if out is not None else default_output(Path(source))
    write_whole(target, make_page(read_run(Path(source))).encode("utf-8"))
    return target
