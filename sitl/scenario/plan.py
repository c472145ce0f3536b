"""Plans written inside a scenario: manoeuvres, fence and rally points in metres, compiled to what a ground station uploads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator, model_validator

from companion.core.config import Config
from mavlink_bridge.language import messages as imc
from mavlink_bridge.language.figures import FIGURES, Figure, figure_of
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind
from mavlink_bridge.language.units import rad_to_e7
from mavlink_bridge.mavlink.missions.plan_export import InexpressibleError, items_from_maneuvers
from mavlink_bridge.mavlink.missions.plan_mapping import Cmd, PlanError as ItemError, load_plan

from .autostart import AutostartError

_GLOBAL = 3
"""MAV_FRAME_GLOBAL_RELATIVE_ALT."""


class Place(Config):
    """A point: metres from the start, or degrees."""

    north_m: float | None = None
    east_m: float | None = None
    lat_deg: float | None = Field(None, ge=-90, le=90)
    lon_deg: float | None = Field(None, ge=-180, le=180)

    @model_validator(mode="after")
    def _either(self) -> Place:
        metres = (self.north_m, self.east_m)
        degrees = (self.lat_deg, self.lon_deg)
        whole = [pair for pair in (metres, degrees) if None not in pair]
        if len(whole) != 1 or {*metres, *degrees} - {None, *whole[0]}:
            raise ValueError("give north_m and east_m, or lat_deg and lon_deg")
        return self

    def position_rad(self, frame: LocalFrame) -> tuple[float, float]:
        """Latitude and longitude."""
        if self.lat_deg is not None and self.lon_deg is not None:
            return math.radians(self.lat_deg), math.radians(self.lon_deg)
        assert self.north_m is not None
        assert self.east_m is not None
        return frame.to_geodetic(self.north_m, self.east_m)


class GotoText(Place):
    """A way-point."""

    hold_s: float = Field(0.0, ge=0)
    acceptance_m: float | None = Field(None, gt=0)


class LoiterPlace(Place):
    """A loiter's figure at its place."""

    kind: str = "circular"
    """The name of a figure."""
    radius_m: float | None = Field(None, gt=0)
    length_m: float | None = Field(None, gt=0)
    bearing_deg: float | None = None
    direction: Literal["cw", "ccw", "into_drift", "vessel"] = "cw"
    turns: float | None = Field(None, gt=0)

    @field_validator("kind")
    @classmethod
    def _known(cls, value: str) -> str:
        name = value.replace("_", "-")
        if name not in FIGURES:
            raise ValueError(f"must be one of {', '.join(each.replace('-', '_') for each in FIGURES)}")
        return name

    @property
    def figure(self) -> Figure:
        """The figure that is meant."""
        return figure_of(
            self.kind,
            radius_m=self.radius_m,
            length_m=self.length_m,
            bearing_rad=None if self.bearing_deg is None else math.radians(self.bearing_deg),
            direction=imc.LoiterDirection[self.direction.upper()],
        )


class LoiterText(LoiterPlace):
    """A loiter; with neither duration nor turns it is unlimited."""

    duration_s: float | None = Field(None, gt=0)


class ItemText(Config):
    """One item of the plan: exactly one field."""

    speed_mps: float | None = Field(None, gt=0, le=20)
    goto: GotoText | None = None
    loiter: LoiterText | None = None
    wait_s: float | None = Field(None, gt=0)
    return_home: Literal[True] | None = None

    @model_validator(mode="after")
    def _one(self) -> ItemText:
        if sum(value is not None for value in self.__dict__.values()) != 1:
            raise ValueError(f"name exactly one of {', '.join(type(self).model_fields)}")
        return self

    def maneuver(self, seq: int, frame: LocalFrame) -> imc.Maneuver:
        """What it asks of the vessel."""
        if self.goto is not None:
            place = self.goto.position_rad(frame)
            return imc.Goto(seq, *place, hold_s=self.goto.hold_s, acceptance_m=self.goto.acceptance_m)
        if self.loiter is not None:
            return _loiter(seq, self.loiter, frame)
        if self.wait_s is not None:
            return imc.Delay(seq, duration_s=self.wait_s)
        return imc.ReturnHome(seq) if self.return_home else imc.ChangeSpeed(seq, self.speed_mps)


class FenceText(Config):
    """An area to stay in, or out of: a circle or a polygon."""

    keep: Literal["in", "out"] = "in"
    radius_m: float | None = Field(None, gt=0)
    north_m: float = 0.0
    east_m: float = 0.0
    corners: tuple[tuple[float, float], ...] = ()
    """North and east, m."""

    @model_validator(mode="after")
    def _shape(self) -> FenceText:
        if (self.radius_m is None) == (not self.corners):
            raise ValueError("give radius_m with north_m and east_m, or corners")
        return self

    def items(self, frame: LocalFrame) -> list[PlanItem]:
        """Fence items."""
        inside = self.keep == "in"
        if self.radius_m is not None:
            command = Cmd.FENCE_CIRCLE_INCLUSION if inside else Cmd.FENCE_CIRCLE_EXCLUSION
            return [_at(command, (self.north_m, self.east_m), frame, self.radius_m)]
        command = Cmd.FENCE_POLYGON_INCLUSION if inside else Cmd.FENCE_POLYGON_EXCLUSION
        return [_at(command, corner, frame, len(self.corners)) for corner in self.corners]


class PlanText(Config):
    """What is loaded before the vessel starts: a plan file, or items, fence and rally points in metres."""

    file: Path | None = None
    """Beside the scenario file."""
    start: bool = True
    """Arm and start it as soon as the vessel's checks pass."""
    item: tuple[ItemText, ...] = ()
    fence: tuple[FenceText, ...] = ()
    rally: tuple[tuple[float, float], ...] = ()
    """North and east, m."""

    @model_validator(mode="after")
    def _one(self) -> PlanText:
        if self.file is not None and self.item:
            raise ValueError("give a file or items, not both")
        return self


def compile_plan(text: PlanText, frame: LocalFrame) -> tuple[LoadPlan, ...]:
    """The uploads of the inline parts. Raises AutostartError with every mistake."""
    mistakes: list[str] = []
    mission: Sequence[PlanItem] = ()
    try:
        mission = items_from_maneuvers([item.maneuver(seq, frame) for seq, item in enumerate(text.item)])
    except InexpressibleError as error:
        mistakes.append(str(error))
    fence = [item for area in text.fence for item in area.items(frame)]
    rally = [_at(Cmd.RALLY_POINT, point, frame, 0.0) for point in text.rally]
    loads: list[LoadPlan] = []
    for kind, items in ((PlanKind.FENCE, fence), (PlanKind.RALLY, rally), (PlanKind.MISSION, mission)):
        load = load_plan(kind, items) if items else None
        if isinstance(load, ItemError):
            mistakes.append(f"{kind.name.lower()} item {load.seq}: {load.reason}")
        elif load is not None:
            loads.append(load)
    if mistakes:
        raise AutostartError(mistakes)
    return tuple(loads)


def _loiter(seq: int, text: LoiterText, frame: LocalFrame) -> imc.Loiter:
    return imc.Loiter(
        seq,
        *text.position_rad(frame),
        figure=text.figure,
        duration_s=text.duration_s,
        turns=text.turns,
    )


def _at(command: int, point: tuple[float, float], frame: LocalFrame, param1: float) -> PlanItem:
    lat_rad, lon_rad = frame.to_geodetic(*point)
    x, y = rad_to_e7(lat_rad), rad_to_e7(lon_rad)
    return PlanItem(
        command=int(command), frame=_GLOBAL, param1=float(param1), param2=0.0, param3=0.0, param4=0.0, x=x, y=y, z=0.0
    )
