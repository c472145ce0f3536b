"""A simulated vessel: where she goes, and what she does on the way. Metres and seconds of the simulated world."""

from __future__ import annotations

import math
from typing import Final, Literal

from pydantic import Field, model_validator

from companion.core.config import Config
from mavlink_bridge.language.units import wrap_pi

DRIVE: Final = math.radians(3.0)
"""How fast ships turn in ordinary manoeuvres, rad/s."""


class ManoeuvreText(Config):
    """One change on the way."""

    at_s: float = Field(ge=0)
    """When, s after the start."""
    turn_deg: float = Field(0.0, ge=-360, le=360)
    """To starboard positive."""
    rate_dps: float = Field(3.0, gt=0, le=30)
    """How fast she turns."""
    speed_mps: float | None = Field(None, ge=0, le=30)
    """Her speed from then on, or from the start."""


class SilenceText(Config):
    """A time in which nothing of her is received."""

    from_s: float = Field(ge=0)
    """Its beginning, s."""
    to_s: float = Field(gt=0)
    """Its end, s."""


class VesselText(Config):
    """A vessel of a scenario: [[vessel]]."""

    mmsi: int = Field(0, ge=0, le=999_999_999)
    """0: one is given by her place in the file."""
    name: str = Field("", max_length=20)
    """As her transponder sends it."""
    ais: Literal["A", "B", "none"] = "A"
    """Class of her transponder. "none": nobody hears her."""
    north_m: float = 0.0
    """Where she begins, north of our start."""
    east_m: float = 0.0
    """Where she begins."""
    course_deg: float = 0.0
    """Her course over ground."""
    speed_mps: float = Field(0.0, ge=0, le=30)
    """Her speed from then on, or from the start."""
    route: tuple[tuple[float, float], ...] = ()
    """Points (north, east) in metres that she goes to, one after the other; then on as before. Empty: straight on."""
    manoeuvres: tuple[ManoeuvreText, ...] = ()
    """Changes on the way."""
    obeys: bool = False
    """She gives way by rules 13 to 15, to starboard, when she comes within 90 s of less than her domain."""
    length_m: float = Field(12.0, gt=0, le=500)
    """Over all; her antenna stands in the middle."""
    beam_m: float = Field(0.0, ge=0, le=80)
    """0: a third of the length of a boat, a sixth of that of a ship."""
    ship_type: int = Field(0, ge=0, le=255)
    """Type of ship as AIS numbers them; 0: not said."""
    status: int = Field(0, ge=0, le=15)
    """Navigational status as AIS numbers them; 1: at anchor."""
    has_heading: bool = False
    """Most small vessels send none."""
    interval_s: float | None = Field(None, gt=0, le=600)
    """Reports so often instead of as the standard says."""
    silent: tuple[SilenceText, ...] = ()
    """Times in which nothing of her is received."""

    @model_validator(mode="after")
    def _goes_somewhere(self) -> VesselText:
        if self.route and not self.speed_mps:
            raise ValueError("route: give her a speed_mps")
        return self

    @property
    def width_m(self) -> float:
        """Her beam."""
        return self.beam_m or self.length_m / (3.0 if self.length_m < 20.0 else 6.0)


class Target:
    """A vessel under way. ``step`` moves her; the truth is in ``north_m``, ``east_m``, ``course_rad``, ``speed_mps``."""

    def __init__(self, text: VesselText, number: int) -> None:
        self.text = text
        self.mmsi = text.mmsi or (244_000_001 if text.ais != "B" else 265_000_001) + number
        self.north_m, self.east_m = text.north_m, text.east_m
        self.course_rad = math.radians(text.course_deg)
        self.speed_mps = text.speed_mps
        self.turning_radps = 0.0
        self._route = list(text.route)
        self._coming = sorted(text.manoeuvres, key=lambda each: each.at_s)
        self._left_rad = 0.0
        self._rate_radps = DRIVE
        self._yielded = False
        self._time_s = 0.0

    def step(self, dt_s: float, own: tuple[float, float, float, float] | None = None) -> None:
        """Go on for ``dt_s``. ``own``: north, east and their rates of the boat, for a target that obeys."""
        self._time_s += dt_s
        while self._coming and self._coming[0].at_s <= self._time_s:
            act = self._coming.pop(0)
            self._left_rad += math.radians(act.turn_deg)
            self._rate_radps = math.radians(act.rate_dps)
            if act.speed_mps is not None:
                self.speed_mps = act.speed_mps
        if self._route:
            self._steer_route()
        if self.text.obeys and own is not None and not self._yielded:
            self._look_out(own)
        self._turn(dt_s)
        self.north_m += self.speed_mps * math.cos(self.course_rad) * dt_s
        self.east_m += self.speed_mps * math.sin(self.course_rad) * dt_s

    def _turn(self, dt_s: float) -> None:
        most = self._rate_radps * dt_s
        part = max(-most, min(most, self._left_rad))
        self.turning_radps = part / dt_s
        self._left_rad -= part
        if part:
            self.course_rad = wrap_pi(self.course_rad + part)

    def _steer_route(self) -> None:
        north, east = self._route[0][0] - self.north_m, self._route[0][1] - self.east_m
        # a point inside her turning circle is never reached: she goes on to the next
        if math.hypot(north, east) < max(self.speed_mps / DRIVE, 5.0):
            self._route.pop(0)
            self._left_rad = 0.0
            return
        self._left_rad = wrap_pi(math.atan2(east, north) - self.course_rad)

    def _look_out(self, own: tuple[float, float, float, float]) -> None:
        """Turn once, 40 degrees to starboard, when the boat is on her starboard side or ahead and would come too close."""
        north, east = own[0] - self.north_m, own[1] - self.east_m
        vn = own[2] - self.speed_mps * math.cos(self.course_rad)
        ve = own[3] - self.speed_mps * math.sin(self.course_rad)
        bearing = wrap_pi(math.atan2(east, north) - self.course_rad)
        speed2 = vn * vn + ve * ve
        time_s = -(north * vn + east * ve) / speed2 if speed2 > 1e-6 else 0.0
        apart = math.hypot(north + vn * time_s, east + ve * time_s)
        if (
            0.0 < time_s < 90.0
            and apart < 50.0 + self.text.length_m / 2
            and -math.radians(15) < bearing < math.radians(112.5)
        ):
            self._left_rad += math.radians(40.0)
            self._yielded = True
