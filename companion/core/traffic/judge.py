"""Risk, role and danger towards one vessel, kept from the first moment of risk until past and clear.

Risk: on both courses over ground we would pass within the wanted clearance of her hull, inside the look-ahead; the wanted clearance
grows with what is not known of her. The role is taken then (rules 13 to 15) and kept. Pure: what was, what is, what becomes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.traffic import TCPA_MOST_S, Danger, Role
from mavlink_bridge.language.units import clamp, wrap_pi
from mavlink_bridge.language.value import value

from ..ais.reports import StationClass
from .clearance import Axis, Clearance, Hull, circle_of, clearance, hull_of, passed_s, reached_s
from .config import TrafficConfig
from .sectors import role_of
from .table import Static
from .track import Track

SHIP_LENGTH_M: Final = 20.0
"""From here on she is a ship: the wanted clearance is the larger one."""
Course = tuple[float, float, tuple[float, float], Axis]
"""North and east from us to her antenna, her velocity less ours, her hull and its heading."""
FAR_M: Final = 4000.0
"""Farther away nothing is judged: within the look-ahead not even a fast ship comes so far."""
_CLOSE_SHARE: Final = 0.5
"""Of the wanted clearance: nearer than this is close."""
_CLOSE_S: Final = 20.0
"""So long before she is that near nothing is left to do by agreement."""
_LEFT: Final = 1.3
"""So much farther off or later she is close no more: her place is known to some metres, her course to two degrees."""
_SILENT: Final = 3.0
"""Of her intervals. One report in five is lost as it is, two in a row in every other meeting."""
_SLACK_S: Final = 5.0
"""For reports that come late."""
_UNDER_WAY_MPS: Final = 0.3
"""Slower we have no course of our own, and so no role."""
_AXIS_MPS: Final = 0.514
"""One knot: below it a course says nothing of where a bow points."""
_AWAY_MPS: Final = 0.25
"""A range that opens slower is the noise of her speed and ours."""
_PARALLEL_RAD: Final = math.radians(5.0)
"""Courses that differ by less are the same as far as AIS tells a boat's;"""
_PARALLEL_MPS: Final = 0.2
"""and who draws nearer no faster than her speed's noise does not cross."""
_SOON_S: Final = 90.0
"""From here on doubt counts as risk: 60 s of warning and two class B reports before them."""
_AHEAD: Final = 0.5
"""Her courses are uncertain ahead as they are behind, but reports still come."""
_SURE: Final = 1.0
"""Share of her uncertainty by which the wanted clearance grows when it is soon: in doubt there is risk (rule 7 d)."""
_UNSURE: Final = -1.0
"""The same while there is time for further reports: a course that is two degrees off is no risk yet."""
_DOUBT_MOST: Final = 0.4
"""Of the wanted clearance: of who is hardly known everything would be a risk."""
_LATER_S: Final = 150.0
"""Up to here doubt counts for her; between the two it changes over."""


@value
class Own:
    """Where we are and go, for judging others."""

    lat_rad: float
    lon_rad: float
    metres: tuple[float, float]
    """Of a radian of latitude and of longitude here."""
    vn_mps: float
    ve_mps: float
    psi_rad: float
    """Heading, or the course where none is known."""
    sog_mps: float


def own_of(state: EstimatedState) -> Own | None:
    """Our own place and way; None without a position."""
    if state.lat_rad is None or state.lon_rad is None:
        return None
    vn, ve = state.vx_mps or 0.0, state.vy_mps or 0.0
    course = math.atan2(ve, vn)
    psi = course if state.psi_rad is None else state.psi_rad
    return Own(
        lat_rad=state.lat_rad,
        lon_rad=state.lon_rad,
        metres=metres_per_radian(state.lat_rad),
        vn_mps=vn,
        ve_mps=ve,
        psi_rad=psi,
        sog_mps=math.hypot(vn, ve),
    )


@value
class Dealing:
    """How it stands with one vessel, from look to look."""

    role: Role = Role.NONE
    danger: Danger = Danger.NONE
    lost: bool = False
    """She has risk and has not been heard for three of her intervals."""
    going_away: bool = False
    """She has risk and the distance to her hull only grows."""


NO_DEALING: Final = Dealing()


@value
class TrafficLook:
    """What one look at a vessel gives."""

    dealing: Dealing
    range_m: float
    bearing_rad: float
    opening: bool
    closest: Clearance | None
    """None: too far away to be judged. Its time is that of her hull's nearer end, or of when it is reached."""


def hull_and_axis(track: Track, static: Static) -> tuple[Hull, float]:
    """Her hull and where it points; a circle where nobody knows."""
    hull = hull_of(static.sides, ship=track.report.sent is StationClass.CLASS_A)
    if track.heading_rad is not None:
        return hull, track.heading_rad
    if track.cog_rad is not None and not track.at_rest and (track.sog_mps or 0.0) > _AXIS_MPS:
        return hull, track.cog_rad
    return circle_of(hull), 0.0


def wanted_m(hull: Hull, config: TrafficConfig) -> float:
    """The clearance that we want to her hull."""
    return config.ship_distance_m if hull.length_m >= SHIP_LENGTH_M else config.small_distance_m


def look(before: Dealing, track: Track, static: Static, *, own: Own, now_us: int, config: TrafficConfig) -> TrafficLook:
    """Judge one vessel."""
    age_s = track.age_s(now_us)
    moved = track.moved_m(age_s)
    per_lat, per_lon = own.metres
    east_rad = math.remainder(track.lon_rad - own.lon_rad, math.tau)
    north, east = (track.lat_rad - own.lat_rad) * per_lat + moved[0], east_rad * per_lon + moved[1]
    vn, ve = track.velocity(age_s)
    closing = vn - own.vn_mps, ve - own.ve_mps
    range_m = math.hypot(north, east)
    opening = north * closing[0] + east * closing[1] >= 0.0
    bearing = math.atan2(east, north)
    if range_m > FAR_M and before.danger is Danger.NONE:
        return TrafficLook(before, range_m, bearing, opening, None)
    axis = hull_and_axis(track, static)
    course = north, east, closing, axis
    closest = clearance(*course, config.look_ahead_s)
    wanted = wanted_m(axis[0], config)
    shown = closest if closest.time_s < config.look_ahead_s else clearance(*course, TCPA_MOST_S)
    if shown.distance_m < _CLOSE_SHARE * wanted:
        shown = replace(shown, time_s=_met_s(shown, course, _CLOSE_SHARE * wanted))
    doubt_m = _doubt(closest.time_s) * track.sigma_m(age_s + _AHEAD * closest.time_s)
    # far ahead doubt takes all of it away, but who is foretold to hit is a risk however far
    grown = wanted + clamp(doubt_m, -wanted, _DOUBT_MOST * wanted)
    # towards one at rest we go by our own speed, which is known
    leaving = track.at_rest or north * closing[0] + east * closing[1] > track.rate_sigma_mps() * range_m
    danger = _danger(closest, wanted, grown, leaving=leaving)
    if _is_close(closest, course, _CLOSE_SHARE * wanted, _LEFT if before.danger is Danger.CLOSE else 1.0):
        danger = Danger.CLOSE
    if before.danger is not Danger.NONE and danger is Danger.NONE:
        clear = closest.time_s <= 0.0 and closest.distance_m > wanted
        danger = Danger.NONE if clear else Danger.RISK
    if danger is Danger.NONE:
        return TrafficLook(NO_DEALING, range_m, bearing, opening, shown)
    role = before.role
    if before.danger is Danger.NONE or role is Role.NONE:
        role = _role(track, (north, east), own, (vn, ve))
    lost = age_s > _SILENT * track.interval_s() + _SLACK_S
    away = closest.time_s <= 0.0 <= closest.distance_m and north * closing[0] + east * closing[1] > _AWAY_MPS * range_m
    return TrafficLook(Dealing(role, danger, lost, away), range_m, bearing, opening, shown)


def _doubt(time_s: float) -> float:
    """Share of what is not known of her that counts against us, so long before the closest point."""
    later = clamp((time_s - _SOON_S) / (_LATER_S - _SOON_S), 0.0, 1.0)
    return _SURE + (_UNSURE - _SURE) * later


def _is_close(closest: Clearance, course: Course, half_m: float, left: float) -> bool:
    """Whether she is within half of the wanted clearance, or soon is. ``left``: how much farther, once she was."""
    reach_m = left * half_m
    if closest.now_m < reach_m or closest.distance_m >= reach_m:
        return closest.now_m < reach_m
    return reached_s(*course, reach_m) <= left * _CLOSE_S


def _met_s(least: Clearance, course: Course, half_m: float) -> float:
    """When she is met who comes within half of the wanted clearance: not when we have passed along or through all of her."""
    return reached_s(*course, 0.0) if least.distance_m < 0.0 else min(least.time_s, passed_s(*course, half_m))


def _danger(closest: Clearance, wanted_m: float, grown_m: float, *, leaving: bool) -> Danger:
    """None or risk. ``leaving``: the range surely opens. A vessel that is too near and may as well come nearer is a risk (rule 7 d)."""
    if closest.distance_m >= (grown_m if closest.time_s > 0.0 else wanted_m) or (closest.time_s <= 0.0 and leaving):
        return Danger.NONE
    return Danger.RISK


def _role(track: Track, place_m: tuple[float, float], own: Own, hers: tuple[float, float]) -> Role:
    if track.at_rest or not track.velocity_known:
        return Role.OBSTACLE
    if own.sog_mps < _UNDER_WAY_MPS:
        return Role.NONE
    speed = math.hypot(*hers)
    course = track.heading_rad if track.heading_rad is not None else math.atan2(hers[1], hers[0])
    role = role_of(place_m, own.psi_rad, own.sog_mps, course, speed)
    if role in (Role.OVERTAKING, Role.OVERTAKEN):
        return role  # however slowly: who comes from abaft the beam is overtaking, and stays so when she turns in (rule 13 b, d)
    nearing_mps = math.hypot(hers[0] - own.vn_mps, hers[1] - own.ve_mps)
    is_beside = nearing_mps < _PARALLEL_MPS and abs(wrap_pi(course - own.psi_rad)) < _PARALLEL_RAD
    return Role.NONE if is_beside else role
