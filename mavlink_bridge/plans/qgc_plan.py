"""QGroundControl's JSON: .plan (version 1) and the older .mission, read and written.

Survey and corridor items are replaced by the items that QGroundControl expanded them to and stored with them; complex
items without such a list are refused, because guessing another program's geometry would sail another plan. DO_JUMP in a
file names the ``doJumpId`` of its target; inside it is the target's place. Source: QGroundControl developer guide, plan file format.
"""

from __future__ import annotations

import json
import math
from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mavlink_bridge.language.units import e7_to_deg

from ..language.requests import PlanItem
from ..mavlink.missions.plan_rules import GLOBAL_FRAMES
from ..mavlink.wire.cmd import Cmd
from ..mavlink.wire.mapping import deg_to_degE7
from .form import PlanFile, PlanFileError, coordinates, make_item

Coordinate = tuple[float, float] | tuple[float, float, float | None]


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)


class _Simple(_Part):
    type: Literal["SimpleItem", "missionItem"]
    command: int = Field(ge=0, le=65_535)
    frame: int = Field(ge=0, le=255)
    autoContinue: bool = True  # noqa: N815 - names of the file format
    doJumpId: int | None = None  # noqa: N815
    id: int | None = None
    params: list[float | None] = Field(default_factory=list, max_length=7)
    coordinate: list[float | None] | None = Field(None, min_length=3, max_length=3)
    param1: float | None = 0.0
    param2: float | None = 0.0
    param3: float | None = 0.0
    param4: float | None = 0.0

    def numbers(self) -> list[float]:
        """The seven numbers; null is NaN."""
        given = self.params or [self.param1, self.param2, self.param3, self.param4]
        seven = [*given[:4], *self.coordinate] if self.coordinate is not None else given
        if len(seven) != 7:
            raise PlanFileError(f"an item of command {self.command} has {len(seven)} numbers, 7 are needed")
        return [math.nan if value is None else value for value in seven]


class _Transect(_Part):
    Items: list[_Simple]


class _Complex(_Part):
    type: Literal["ComplexItem", "complexItem"]
    complexItemType: str = ""  # noqa: N815
    TransectStyleComplexItem: _Transect | None = None


class _Mission(_Part):
    version: int = 2
    items: list[_Simple | _Complex]
    plannedHomePosition: Coordinate | None = None  # noqa: N815


class _Polygon(_Part):
    inclusion: bool = True
    polygon: list[tuple[float, float]]


class _CircleShape(_Part):
    center: tuple[float, float]
    radius: float


class _Circle(_Part):
    inclusion: bool = True
    circle: _CircleShape


class _Fence(_Part):
    polygons: list[_Polygon] = Field(default_factory=list)
    circles: list[_Circle] = Field(default_factory=list)
    polygon: list[tuple[float, float]] = Field(default_factory=list)
    breachReturn: Coordinate | None = None  # noqa: N815


class _Rally(_Part):
    points: list[Coordinate] = Field(default_factory=list)


class _Plan(_Part):
    mission: _Mission
    geoFence: _Fence = Field(default_factory=_Fence)  # noqa: N815
    rallyPoints: _Rally = Field(default_factory=_Rally)  # noqa: N815


class _OldHome(_Part):
    coordinate: Coordinate


class _OldMission(_Part):
    items: list[_Simple]
    plannedHomePosition: _OldHome | None = None  # noqa: N815


def from_json(found: dict[str, Any]) -> PlanFile:
    """A parsed .plan or .mission. Raises PlanFileError."""
    try:
        if "MAV_AUTOPILOT" in found:
            return _old_mission(_OldMission.model_validate(found))
        if found.get("fileType") != "Plan":
            raise PlanFileError(f"fileType is {str(found.get('fileType'))[:40]!r}, not 'Plan'")
        if found.get("version") != 1:
            raise PlanFileError(f"plan version {str(found.get('version'))[:40]} is unknown: 1 is read")
        return _plan(_Plan.model_validate(found))
    except ValidationError as error:
        raise PlanFileError(*(_problem(detail) for detail in error.errors()[:20])) from None


def _problem(detail: Any) -> str:
    return f"{'.'.join(str(part) for part in detail['loc'])}: {detail['msg']}"


def _plan(plan: _Plan) -> PlanFile:
    simple: list[_Simple] = []
    notes: list[str] = []
    for place, item in enumerate(plan.mission.items):
        if isinstance(item, _Simple):
            simple.append(item)
            continue
        if item.TransectStyleComplexItem is None:
            raise PlanFileError(f"mission item {place}: a {item.complexItemType or 'complex'} item cannot be expanded")
        expanded = item.TransectStyleComplexItem.Items
        simple += expanded
        notes.append(f"{item.complexItemType} expanded to {len(expanded)} items")
    return PlanFile(
        mission=_mission_items(simple),
        fence=_fence_items(plan.geoFence),
        rally=tuple(_place(Cmd.RALLY_POINT, 3, 0.0, point) for point in plan.rallyPoints.points),
        home_rad=_radians(plan.mission.plannedHomePosition),
        format="QGroundControl plan",
        notes=tuple(notes),
    )


def _old_mission(mission: _OldMission) -> PlanFile:
    home = mission.plannedHomePosition
    return PlanFile(
        _mission_items(mission.items),
        home_rad=_radians(home.coordinate) if home else None,
        format="QGroundControl mission",
    )


def _mission_items(simple: list[_Simple]) -> tuple[PlanItem, ...]:
    """Items in order, DO_JUMP targets turned from ids to places. A target that is not in the file becomes one past the end."""
    ids = [item.doJumpId if item.doJumpId is not None else item.id for item in simple]
    places = {(place + 1 if number is None else number): place for place, number in enumerate(ids)}
    items: list[PlanItem] = []
    for item in simple:
        numbers = item.numbers()
        if item.command == Cmd.DO_JUMP and math.isfinite(numbers[0]):
            numbers[0] = float(places.get(int(numbers[0]), len(simple)))
        items.append(make_item(item.command, item.frame, numbers, int(item.autoContinue)))
    return tuple(items)


def _fence_items(fence: _Fence) -> tuple[PlanItem, ...]:
    """Fence items in the order in which QGroundControl sends them: polygons, circles, return point."""
    polygons = fence.polygons or ([_Polygon(polygon=fence.polygon)] if fence.polygon else [])
    items: list[PlanItem] = []
    for area in polygons:
        command = Cmd.FENCE_POLYGON_INCLUSION if area.inclusion else Cmd.FENCE_POLYGON_EXCLUSION
        items += [_place(command, 0, float(len(area.polygon)), corner) for corner in area.polygon]
    for ring in fence.circles:
        command = Cmd.FENCE_CIRCLE_INCLUSION if ring.inclusion else Cmd.FENCE_CIRCLE_EXCLUSION
        items.append(_place(command, 0, ring.circle.radius, ring.circle.center))
    if fence.breachReturn is not None:
        items.append(_place(Cmd.FENCE_RETURN_POINT, 3, 0.0, fence.breachReturn))
    return tuple(items)


def _place(command: int, frame: int, param1: float, where: Coordinate) -> PlanItem:
    altitude = where[2] if len(where) == 3 and where[2] is not None else 0.0
    x, y = deg_to_degE7(where[0]), deg_to_degE7(where[1])
    return PlanItem(
        command=command, frame=frame, param1=param1, param2=0.0, param3=0.0, param4=0.0, x=x, y=y, z=altitude
    )


def _radians(where: Coordinate | None) -> tuple[float, float] | None:
    if where is None or (where[0] == 0.0 and where[1] == 0.0):
        return None
    return math.radians(where[0]), math.radians(where[1])


# Writing

_ARDUPILOT: Final = 3
_SURFACE_BOAT: Final = 11


def write_plan(plan: PlanFile, *, firmware_type: int = _ARDUPILOT, speed_mps: float = 1.5) -> str:
    """A .plan that QGroundControl opens. ``firmware_type`` is MAV_AUTOPILOT: 3 shows the boat's whole menu there, 0 is generic."""
    home = plan.home_rad or (0.0, 0.0)
    mission = {
        "version": 2,
        "firmwareType": firmware_type,
        "vehicleType": _SURFACE_BOAT,
        "cruiseSpeed": speed_mps,
        "hoverSpeed": speed_mps,
        "globalPlanAltitudeMode": 1,
        "plannedHomePosition": [math.degrees(home[0]), math.degrees(home[1]), 0],
        "items": [_simple_item(place, item) for place, item in enumerate(plan.mission)],
    }
    whole = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": mission,
        "geoFence": _fence_json(plan.fence),
        "rallyPoints": {
            "version": 2,
            "points": [[e7_to_deg(item.x), e7_to_deg(item.y), _null(item.z) or 0] for item in plan.rally],
        },
    }
    return json.dumps(whole, indent=4, allow_nan=False) + "\n"


def _null(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _simple_item(place: int, item: PlanItem) -> dict[str, Any]:
    x, y = coordinates(item)
    param1 = item.param1 + 1 if item.command == Cmd.DO_JUMP else item.param1
    numbers = (param1, item.param2, item.param3, item.param4, x, y, item.z)
    entry: dict[str, Any] = {
        "type": "SimpleItem",
        "autoContinue": bool(item.autocontinue),
        "command": item.command,
        "doJumpId": place + 1,
        "frame": item.frame,
        "params": [_null(number) for number in numbers],
    }
    if item.frame in GLOBAL_FRAMES:
        entry |= {"AMSLAltAboveTerrain": None, "Altitude": _null(item.z) or 0, "AltitudeMode": 1}
    return entry


def _fence_json(items: tuple[PlanItem, ...]) -> dict[str, Any]:
    polygons: list[dict[str, Any]] = []
    circles: list[dict[str, Any]] = []
    fence: dict[str, Any] = {"version": 2, "polygons": polygons, "circles": circles}
    at = 0
    while at < len(items):
        item = items[at]
        inclusion = item.command in (Cmd.FENCE_POLYGON_INCLUSION, Cmd.FENCE_CIRCLE_INCLUSION)
        count = 1
        if item.command in (Cmd.FENCE_POLYGON_INCLUSION, Cmd.FENCE_POLYGON_EXCLUSION):
            count = max(1, int(item.param1))
            corners = [[e7_to_deg(corner.x), e7_to_deg(corner.y)] for corner in items[at : at + count]]
            polygons.append({"version": 1, "inclusion": inclusion, "polygon": corners})
        elif item.command == Cmd.FENCE_RETURN_POINT:
            fence["breachReturn"] = [e7_to_deg(item.x), e7_to_deg(item.y), _null(item.z) or 0]
        else:
            ring = {"center": [e7_to_deg(item.x), e7_to_deg(item.y)], "radius": item.param1}
            circles.append({"version": 1, "inclusion": inclusion, "circle": ring})
        at += count
    return fence
