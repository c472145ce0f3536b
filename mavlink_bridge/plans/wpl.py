"""Plan files as text lines: "QGC WPL 110" and 120, and the old list of fence corners.

Row 0 of a WPL 110 file is the home position, which is taken off, and DO_JUMP targets count with it. Sources: gcs §4.3;
MAVLink file formats guide.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.units import e7_to_rad

from ..language.requests import PlanItem
from ..mavlink.missions.wire import home_problem, with_home, without_home
from ..mavlink.wire.cmd import Cmd
from .form import PlanFile, PlanFileError, coordinates, make_item


def read_wpl(text: str) -> PlanFile:
    """A QGC WPL file, of mission, fence or rally items. Raises PlanFileError with every bad line."""
    lines = text.splitlines()
    version = lines[0].split()[-1]
    if version not in ("110", "120"):
        raise PlanFileError(f"QGC WPL {version} is unknown: 110 and 120 are read")
    items: list[PlanItem] = []
    problems: list[str] = []
    for number, line in enumerate(lines[1:], 2):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            items.append(_wpl_item(line, len(items)))
        except (ValueError, OverflowError) as error:
            problems.append(f"line {number}: {error}")
    if problems:
        raise PlanFileError(*problems)
    return _sort_wpl(tuple(items), version)


def _wpl_item(line: str, place: int) -> PlanItem:
    columns = line.split()
    if len(columns) != 12:
        raise ValueError(f"{len(columns)} columns, 12 are needed")
    seq, _, frame, command = (int(float(column)) for column in columns[:4])
    if seq != place:
        raise ValueError(f"item number {seq} where {place} is due")
    param1, param2, param3, param4, x, y, z = (float(column) for column in columns[4:11])
    autocontinue = int(float(columns[11]))
    if not 0 <= command <= 65_535 or not 0 <= frame <= 255 or autocontinue not in (0, 1):
        raise ValueError("command, frame or autocontinue is out of range")
    return make_item(command, frame, (param1, param2, param3, param4, x, y, z), autocontinue)


def _sort_wpl(items: tuple[PlanItem, ...], version: str) -> PlanFile:
    form = f"QGC WPL {version}"
    commands = {item.command for item in items}
    if items and all(Cmd.FENCE_RETURN_POINT <= command <= Cmd.FENCE_CIRCLE_EXCLUSION for command in commands):
        return PlanFile(fence=items, format=form)
    if commands == {Cmd.RALLY_POINT}:
        return PlanFile(rally=items, format=form)
    if version == "120" or not items:
        return PlanFile(items, format=form)
    problem = home_problem(items[0])
    if problem:
        note = "row 0 is no home position (a waypoint in frame 0), so it is taken as the first item"
        return PlanFile(items, format=form, notes=(note,))
    home = items[0]
    place = (e7_to_rad(home.x), e7_to_rad(home.y)) if home.x or home.y else None
    return PlanFile(without_home(items), home_rad=place, format=form)


def write_wpl(plan: PlanFile) -> str:
    """QGC WPL 110 of the mission, with the home row that the format demands. NaN becomes 0: the format has no NaN."""
    rows = [_wpl_row(seq, int(seq == 0), item) for seq, item in enumerate(with_home(plan.mission, plan.home_rad))]
    return "QGC WPL 110\n" + "".join(rows)


def _wpl_row(seq: int, current: int, item: PlanItem) -> str:
    numbers = (item.param1, item.param2, item.param3, item.param4, *coordinates(item), item.z)
    texts = [f"{0.0 if math.isnan(number) else number:.8f}" for number in numbers]
    return (
        "\t".join([str(seq), str(current), str(item.frame), str(item.command), *texts, str(item.autocontinue)]) + "\n"
    )


def read_fence_list(text: str) -> PlanFile:
    """Latitude and longitude per line: the return point, then a closed polygon. Raises PlanFileError."""
    points: list[tuple[float, float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        columns = line.split()
        if not columns or columns[0].startswith("#"):
            continue
        try:
            latitude, longitude = map(float, columns)
        except ValueError:
            raise PlanFileError(f"line {number}: neither a plan file nor a list of latitude and longitude") from None
        points.append((latitude, longitude))
    if len(points) < 4:
        raise PlanFileError("no plan: expected .plan, .mission, QGC WPL, seed JSON or a fence list")
    corners = points[1:-1] if points[-1] == points[1] else points[1:]
    count = float(len(corners))
    items = [make_item(Cmd.FENCE_POLYGON_INCLUSION, 0, (count, 0.0, 0.0, 0.0, *corner, 0.0)) for corner in corners]
    items.append(make_item(Cmd.FENCE_RETURN_POINT, 3, (0.0, 0.0, 0.0, 0.0, *points[0], 0.0)))
    return PlanFile(fence=tuple(items), format="fence list")
