"""One vessel as her reports tell: where she is now, how sure that is, whether she rests or turns.

Between reports a position is carried on by course and speed, on an arc for the first seconds of a turn; its uncertainty grows
with age. A vessel at rest stays where her reports put her on average: noise of her speed over three minutes would carry her
away. One whose places make a line is not at rest, whatever she says. All in metres on a plane through her newest report; times
in microseconds of the vessel's clock.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.language.units import clamp, wrap_pi

from ..ais.reports import FixState, PositionReport, StationClass
from .drift import DriftLine, Places
from .way import Way

AT_REST_MPS: Final = 0.257
"""Half a knot: below it course and speed are the receiver's noise."""
MOORED_MPS: Final = 1.55
"""Three knots: a vessel that is faster is under way, whatever status her crew has left standing (ITU-R M.1371 table 1)."""
MOORED_STATUS: Final = frozenset((1, 5, 6))
"""At anchor, moored, aground."""
_ACCURATE_M: Final = 8.0
"""Per axis. The standard's high accuracy is better than 10 m; receivers on boats show 6 m."""
_PLAIN_M: Final = 10.0
"""The standard's other accuracy is worse than 10 m, and boats' receivers are not."""
_NO_FIX_M: Final = 100.0
"""Manual input, dead reckoning or an inoperative receiver."""
_SPEED_SIGMA_MPS: Final = 0.25
"""Of the speed that is reported, with its steps of 0.1 kn."""
_COURSE_SIGMA_RAD: Final = math.radians(2.5)
_COURSE_SLOW_MPS: Final = 3.0
"""Below it the course gets worse with 1/speed, at most six times."""
_CHANGE_MPS: Final = 0.2
"""What nobody's course and speed keep to, per second of age."""
_CHANGE_LIFE_S: Final = 180.0
"""After three minutes her course and speed are not known any worse: they are not known."""
_BLIND_MPS: Final = 5.0
"""How fast the circle grows around a vessel whose course or speed is unknown."""
_REST_GROWTH_MPS: Final = 0.05
"""A vessel at anchor swings, and may drag."""
_COVER: Final = 1.25
"""Two of these sigmas, taken as a radius, hold 95 % of a plane's normal errors; twice the plain sigma holds 86 %."""
_REST_MEAN: Final = 8
"""Reports over which a resting vessel's place is averaged."""
_REST_GATE_M: Final = 40.0
"""A resting vessel that is reported farther away than this has moved."""
_DRIFT_MPS: Final = 0.1
"""Slower along a line she stays at rest, but where the line puts her: within the look-ahead she goes less than her place's sigma."""
_DRIFT_SIGMA_MPS: Final = 0.05
"""No drift is steadier: wind and stream change."""
_TURN_GAP_S: Final = 35.0
"""Two courses farther apart than class B's interval say nothing of a turn."""
_TURN_LEAST_RAD: Final = math.radians(12.0)
_TURN_MOST_RADPS: Final = math.radians(6.0)
_TURN_SPEED_MPS: Final = 1.0
"""Slower, a course is noise and its change too."""
_ARC_S: Final = 10.0
"""How long a turn is believed to go on after its report."""
_TIMED_S: Final = 0.4
"""Of the moment of a fix that is known by its UTC second."""
_UNTIMED_S: Final = 1.5
"""And of one that is not."""
_PAIR_LEAST_S: Final = 2.0
"""Two reports closer together give a speed that is their noise;"""
_PAIR_MOST_S: Final = 180.0
"""farther apart, the mean of whatever she did between."""


def offset_m(lat1_rad: float, lon1_rad: float, lat2_rad: float, lon2_rad: float) -> tuple[float, float]:
    """North and east from the first point to the second; good to 0.1 % within 10 km outside the polar seas."""
    north, east = metres_per_radian(lat1_rad)
    return (lat2_rad - lat1_rad) * north, wrap_pi(lon2_rad - lon1_rad) * east


class Track:
    """A vessel, or one of two that send under one number."""

    __slots__ = (
        "_places",
        "_rest_count",
        "_time_sigma_s",
        "_way",
        "agreed",
        "at_rest",
        "cog_rad",
        "heading_rad",
        "lat_rad",
        "lon_rad",
        "mmsi",
        "report",
        "reports",
        "sigma0_m",
        "sog_mps",
        "t_us",
        "turn_radps",
        "velocity_known",
        "vx_mps",
        "vy_mps",
    )

    def __init__(self, report: PositionReport, t_us: int, *, timed: bool) -> None:
        """``t_us``: when she was there. ``timed``: known by the UTC second of the report."""
        assert report.lat_rad is not None
        assert report.lon_rad is not None
        self.mmsi = report.mmsi
        self.reports = 0
        self.agreed = 0
        """Reports in a row that were hers and not her double's."""
        self.lat_rad, self.lon_rad = report.lat_rad, report.lon_rad
        self.t_us = t_us
        self.turn_radps = 0.0
        self.sog_mps: float | None = None
        self.cog_rad: float | None = None
        self.at_rest = False
        self._rest_count = 0
        self._places = Places(_told(report))
        self._way: Way | None = None
        """Her straight way; None while she rests or nobody knows her velocity."""
        self.vx_mps = self.vy_mps = 0.0
        self.velocity_known = False
        self._take(report, t_us, timed)

    def update(self, report: PositionReport, t_us: int, *, timed: bool) -> None:
        """Take a further report of hers, newer than the last."""
        before_s = (t_us - self.t_us) * 1e-6
        turn_radps = self._turn(report, before_s)
        resting = is_at_rest(report)
        assert report.lat_rad is not None
        assert report.lon_rad is not None
        self._add_place(report, before_s)
        moved = offset_m(self.lat_rad, self.lon_rad, report.lat_rad, report.lon_rad)
        if resting and self.at_rest and math.hypot(*moved) < _REST_GATE_M:
            self._rest_count = min(self._rest_count + 1, _REST_MEAN)
            share = 1.0 / self._rest_count
            self.lat_rad += share * (report.lat_rad - self.lat_rad)
            self.lon_rad += share * wrap_pi(report.lon_rad - self.lon_rad)
        else:
            self.lat_rad, self.lon_rad = report.lat_rad, report.lon_rad
            self._rest_count = 1
        way = self._way
        self._take(report, t_us, timed)
        self.turn_radps = turn_radps
        if not turn_radps and way is not None:
            self._go_on(way, moved, before_s)
        line = self._places.line(self.sigma0_m) if resting else None
        if line is not None:
            self._drift(line)
        if not self.velocity_known and not self.at_rest and _PAIR_LEAST_S <= before_s <= _PAIR_MOST_S:
            self.vx_mps, self.vy_mps = moved[0] / before_s, moved[1] / before_s
            self.sog_mps, self.cog_rad = math.hypot(self.vx_mps, self.vy_mps), math.atan2(self.vy_mps, self.vx_mps)
            self.velocity_known = True

    def _add_place(self, report: PositionReport, before_s: float) -> None:
        last = self.report
        assert last.lat_rad is not None
        assert last.lon_rad is not None
        assert report.lat_rad is not None
        assert report.lon_rad is not None
        moved = offset_m(last.lat_rad, last.lon_rad, report.lat_rad, report.lon_rad)
        self._places.add(moved, before_s, _told(report))

    def _drift(self, line: DriftLine) -> None:
        """Follow the line that her places make."""
        report = self.report
        assert report.lat_rad is not None
        assert report.lon_rad is not None
        per_lat, per_lon = metres_per_radian(report.lat_rad)
        self.lat_rad = report.lat_rad + line.north_m / per_lat
        self.lon_rad = wrap_pi(report.lon_rad + line.east_m / per_lon)
        self._rest_count = 1
        if line.speed_mps < _DRIFT_MPS:
            return
        self.at_rest, self.velocity_known = False, True
        self.turn_radps = 0.0
        self.vx_mps, self.vy_mps = line.vn_mps, line.ve_mps
        self.sog_mps, self.cog_rad = line.speed_mps, math.atan2(line.ve_mps, line.vn_mps)
        self._way = Way(self.vx_mps, self.vy_mps, line.place_m, max(line.rate_mps, _DRIFT_SIGMA_MPS))

    def _take(self, report: PositionReport, t_us: int, timed: bool) -> None:
        self.report, self.t_us = report, t_us
        self.reports += 1
        self.at_rest = is_at_rest(report)
        if self.at_rest and not self._rest_count:
            self._rest_count = 1
        self.heading_rad = report.heading_rad
        self.sog_mps, self.cog_rad = report.sog_mps, report.cog_rad
        self.turn_radps = report.turn_radps or 0.0
        self.velocity_known = self.at_rest or (self.sog_mps is not None and self.cog_rad is not None)
        self.vx_mps = self.vy_mps = 0.0
        if not self.at_rest and self.sog_mps is not None and self.cog_rad is not None:
            self.vx_mps = self.sog_mps * math.cos(self.cog_rad)
            self.vy_mps = self.sog_mps * math.sin(self.cog_rad)
        exact = report.fix in (FixState.GOOD, FixState.NO_TIME)
        self.sigma0_m = (_ACCURATE_M if report.accurate else _PLAIN_M) if exact else _NO_FIX_M
        self._time_sigma_s = _TIMED_S if timed else _UNTIMED_S
        self._way = None
        if self.velocity_known and not self.at_rest:
            self._way = Way(self.vx_mps, self.vy_mps, self._place_sigma_m(), self._rate_mps())

    def _go_on(self, way: Way, moved_m: tuple[float, float], dt_s: float) -> None:
        """Join the report to her straight way: one course is two degrees off, in three minutes far too much."""
        if self._way is None:
            return
        rate = self._rate_mps()
        if way.join(moved_m, (self.vx_mps, self.vy_mps), dt_s, (self._place_sigma_m(), rate)):
            self._way = way
            self.vx_mps, self.vy_mps = way.vx_mps, way.vy_mps

    def _place_sigma_m(self) -> float:
        return math.hypot(self.sigma0_m, self._time_sigma_s * math.hypot(self.vx_mps, self.vy_mps))

    def _rate_mps(self) -> float:
        """How far off one report's speed and course are, m/s each axis."""
        speed = math.hypot(self.vx_mps, self.vy_mps)
        course = _COURSE_SIGMA_RAD * clamp(_COURSE_SLOW_MPS / max(speed, 0.3), 1.0, 6.0)
        return max(_SPEED_SIGMA_MPS, speed * course)

    def _turn(self, report: PositionReport, before_s: float) -> float:
        """Rate of turn: her own instrument's, else from two courses. Class B sends none."""
        if report.turn_radps is not None:
            return clamp(report.turn_radps, -_TURN_MOST_RADPS, _TURN_MOST_RADPS)
        before, now = self.cog_rad, report.cog_rad
        slow = min(self.sog_mps or 0.0, report.sog_mps or 0.0) < _TURN_SPEED_MPS
        if before is None or now is None or slow or not 0.0 < before_s <= _TURN_GAP_S:
            return 0.0
        change = wrap_pi(now - before)
        return clamp(change / before_s, -_TURN_MOST_RADPS, _TURN_MOST_RADPS) if abs(change) >= _TURN_LEAST_RAD else 0.0

    def age_s(self, now_us: int) -> float:
        """Seconds since she was there."""
        return (now_us - self.t_us) * 1e-6

    def moved_m(self, age_s: float) -> tuple[float, float]:
        """North and east that she has gone since her report."""
        turn = self.turn_radps
        if not turn or self.at_rest:
            off_north, off_east = (0.0, 0.0) if self._way is None else self._way.off_m
            return off_north + self.vx_mps * age_s, off_east + self.vy_mps * age_s
        arc_s = min(age_s, _ARC_S)
        vx, vy = self.velocity(age_s)
        # the chord of an arc: half the turn off the first course, shorter by its sinc
        half = 0.5 * turn * arc_s
        sine, cosine = math.sin(half), math.cos(half)
        along = arc_s * (sine / half)
        north = along * (self.vx_mps * cosine - self.vy_mps * sine)
        east = along * (self.vx_mps * sine + self.vy_mps * cosine)
        return north + vx * (age_s - arc_s), east + vy * (age_s - arc_s)

    def velocity(self, age_s: float) -> tuple[float, float]:
        """Over ground, north and east, as it is now."""
        if not self.turn_radps or self.at_rest:
            return self.vx_mps, self.vy_mps
        turned = self.turn_radps * min(age_s, _ARC_S)
        sine, cosine = math.sin(turned), math.cos(turned)
        return self.vx_mps * cosine - self.vy_mps * sine, self.vx_mps * sine + self.vy_mps * cosine

    def place(self, now_us: int) -> tuple[float, float]:
        """Latitude and longitude now, rad."""
        north, east = self.moved_m(self.age_s(now_us))
        per_lat, per_lon = metres_per_radian(self.lat_rad)
        return self.lat_rad + north / per_lat, wrap_pi(self.lon_rad + east / per_lon)

    def sigma_m(self, age_s: float) -> float:
        """Uncertainty of the place now: she is within two of these in 95 of 100 cases, as long as she keeps course and speed."""
        if self.at_rest:
            return _COVER * math.hypot(self.sigma0_m, _REST_GROWTH_MPS * age_s)
        if not self.velocity_known:
            return _COVER * self.sigma0_m + _BLIND_MPS * age_s
        speed = math.hypot(self.vx_mps, self.vy_mps)
        steady = self.rate_sigma_mps()
        rate = math.hypot(steady, _CHANGE_MPS * min(age_s, _CHANGE_LIFE_S) / _CHANGE_LIFE_S)
        spread = math.hypot(math.hypot(self.sigma0_m, rate * age_s), self._time_sigma_s * speed)
        return _COVER * spread + abs(self.turn_radps) * speed * min(age_s, 30.0) * min(age_s, 30.0) * 0.25

    def rate_sigma_mps(self) -> float:
        """Uncertainty of her velocity, each axis."""
        return self._rate_mps() if self._way is None else self._way.rate_mps

    def interval_s(self) -> float:
        """How often a station like hers must report at least (ITU-R M.1371 tables 1 and 2), seconds."""
        speed = self.sog_mps or 0.0
        if self.report.sent is StationClass.CLASS_A:
            return 180.0 if is_at_rest(self.report) else 10.0
        return 180.0 if speed <= 1.03 else 30.0


def _told(report: PositionReport) -> tuple[float, float] | None:
    """Her speed and course as she reports them, north and east."""
    if report.sog_mps is None or report.cog_rad is None:
        return None
    return report.sog_mps * math.cos(report.cog_rad), report.sog_mps * math.sin(report.cog_rad)


def is_at_rest(report: PositionReport) -> bool:
    """Whether she says that she lies still: hardly any speed, or at anchor, moored or aground and no faster than a ship swings."""
    if report.sog_mps is None:
        return report.status in MOORED_STATUS
    return report.sog_mps < AT_REST_MPS or (report.status in MOORED_STATUS and report.sog_mps <= MOORED_MPS)
