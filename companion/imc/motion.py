"""The vehicle's motion as IMC tells it, from the MAVLink messages that are fresh.

Each function gives the message, or None when there is nothing true to say: a field that IMC has no unknown for is never filled
with a value that nobody measured.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Any, Final

from mavlink_bridge.imc import (
    Distance,
    DistanceValidity,
    EstimatedState,
    EulerAngles,
    FixKind,
    FixValidity,
    GpsFix,
    StateReport,
)
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.units import wrap_2pi, wrap_pi
from mavlink_bridge.mavlink.wire.mapping import degE7_to_rad

from .picture import ImcPicture

_UNKNOWN_16: Final = 0xFFFF
_STILL_MPS: Final = 0.5
"""Below this the course over ground is noise and says nothing of the bow."""
_DOWNWARD: Final = 25
"""MAV_SENSOR_ROTATION_PITCH_270."""
_LEAST_UTC_S: Final = 1_577_836_800
"""2020-01-01: a GPS_RAW_INT.time_usec below counts from the vehicle's start."""
_FIX_3D: Final = 3
_PLAN_ACTIVE: Final = 3
"""MISSION_STATE_ACTIVE."""
_DIFFERENTIAL: Final = frozenset((4, 5, 6))


def heading_rad(picture: ImcPicture, now_us: int) -> float | None:
    """The bow's direction from true north, [-pi, pi); a moving vessel without a compass shows its course."""
    attitude = picture.fresh("ATTITUDE", now_us)
    if attitude is not None:
        return wrap_pi(attitude.yaw)
    position = picture.fresh("GLOBAL_POSITION_INT", now_us)
    if position is None:
        return None
    if position.hdg != _UNKNOWN_16:
        return wrap_pi(math.radians(position.hdg * 0.01))
    if math.hypot(position.vx, position.vy) * 0.01 >= _STILL_MPS:
        return math.atan2(position.vy, position.vx)
    return None


def water_m(picture: ImcPicture, now_us: int) -> float | None:
    """Water under the sounder or the keel; None unknown."""
    altitude = picture.fresh("ALTITUDE", now_us)
    if altitude is not None and altitude.bottom_clearance >= 0.0:
        return float(altitude.bottom_clearance)
    sounding = _sounding(picture, now_us)
    return None if sounding is None else sounding.current_distance * 0.01


def _sounding(picture: ImcPicture, now_us: int) -> Any | None:
    sounding = picture.fresh("DISTANCE_SENSOR", now_us)
    return sounding if sounding is not None and sounding.orientation == _DOWNWARD else None


def here(picture: ImcPicture, now_us: int) -> LatLon | None:
    """Where the vessel is, when that is known."""
    position = picture.fresh("GLOBAL_POSITION_INT", now_us)
    return None if position is None else _place(position.lat, position.lon)


def home(picture: ImcPicture) -> LatLon | None:
    """Its home, as it was last told: a place that stays."""
    told = picture.newest("HOME_POSITION")
    return None if told is None else _place(told.message.latitude, told.message.longitude)


def _place(lat: int, lon: int) -> LatLon | None:
    lat_rad, lon_rad = degE7_to_rad(lat), degE7_to_rad(lon)
    return None if lat_rad is None or lon_rad is None else LatLon((lat_rad, lon_rad))


def estimated_state(picture: ImcPicture, now_us: int) -> EstimatedState | None:
    """Where the vessel is and how it moves; None without a fresh position or any idea of its heading."""
    position, psi_rad = picture.fresh("GLOBAL_POSITION_INT", now_us), heading_rad(picture, now_us)
    place = here(picture, now_us)
    if position is None or psi_rad is None or place is None:
        return None
    attitude = picture.fresh("ATTITUDE", now_us)
    north, east, alt_m = position.vx * 0.01, position.vy * 0.01, water_m(picture, now_us)
    cosine, sine = math.cos(psi_rad), math.sin(psi_rad)
    return EstimatedState(
        lat_rad=place[0],
        lon_rad=place[1],
        height_m=ellipsoid_m(picture, now_us),
        phi_rad=attitude.roll if attitude else 0.0,
        theta_rad=attitude.pitch if attitude else 0.0,
        psi_rad=psi_rad,
        u_mps=north * cosine + east * sine,
        v_mps=east * cosine - north * sine,
        vx_mps=north,
        vy_mps=east,
        r_radps=attitude.yawspeed if attitude else 0.0,
        alt_m=-1.0 if alt_m is None else alt_m,
    )


def ellipsoid_m(picture: ImcPicture, now_us: int) -> float:
    """The receiver's height above the ellipsoid; 0, the sea's own height roughly, when it is not told."""
    fix = picture.fresh("GPS_RAW_INT", now_us)
    return fix.alt_ellipsoid * 0.001 if fix is not None else 0.0


def euler_angles(picture: ImcPicture, now_us: int, utc_s: float) -> EulerAngles | None:
    """The attitude, with the time when it came."""
    attitude = picture.fresh("ATTITUDE", now_us)
    if attitude is None:
        return None
    return EulerAngles(time_s=utc_s, phi_rad=attitude.roll, theta_rad=attitude.pitch, psi_rad=wrap_pi(attitude.yaw))


def gps_fix(picture: ImcPicture, now_us: int) -> GpsFix | None:
    """The receiver's fix; ``validity`` is empty while it has none."""
    raw = picture.fresh("GPS_RAW_INT", now_us)
    if raw is None:
        return None
    lat_rad, lon_rad = degE7_to_rad(raw.lat), degE7_to_rad(raw.lon)
    valid, when = FixValidity(0), _date(raw.time_usec)
    if when is not None:
        valid |= FixValidity.DATE | FixValidity.TIME
    if raw.fix_type >= _FIX_3D - 1 and lat_rad is not None and lon_rad is not None:
        valid |= FixValidity.POSITION
    known = {
        FixValidity.COURSE: raw.cog != _UNKNOWN_16,
        FixValidity.SPEED: raw.vel != _UNKNOWN_16,
        FixValidity.HDOP: raw.eph != _UNKNOWN_16,
        FixValidity.VDOP: raw.epv != _UNKNOWN_16,
        FixValidity.HACC: raw.h_acc != 0,
        FixValidity.VACC: raw.v_acc != 0,
    }
    for flag, is_known in known.items():
        valid |= flag if is_known else FixValidity(0)
    return GpsFix(
        validity=valid,
        type=FixKind.DIFFERENTIAL if raw.fix_type in _DIFFERENTIAL else FixKind.STANDALONE,
        utc_year=when.year if when else 0,
        utc_month=when.month if when else 0,
        utc_day=when.day if when else 0,
        utc_time_s=_since_midnight_s(when) if when else 0.0,
        lat_rad=(lat_rad or 0.0) if FixValidity.POSITION in valid else 0.0,
        lon_rad=(lon_rad or 0.0) if FixValidity.POSITION in valid else 0.0,
        height_m=raw.alt_ellipsoid * 0.001,
        satellites=0 if raw.satellites_visible == 255 else raw.satellites_visible,
        cog_rad=math.radians(raw.cog * 0.01) if raw.cog != _UNKNOWN_16 else 0.0,
        sog_mps=raw.vel * 0.01 if raw.vel != _UNKNOWN_16 else 0.0,
        hdop=raw.eph * 0.01 if raw.eph != _UNKNOWN_16 else 0.0,
        vdop=raw.epv * 0.01 if raw.epv != _UNKNOWN_16 else 0.0,
        hacc_m=raw.h_acc * 0.001,
        vacc_m=raw.v_acc * 0.001,
    )


def _date(time_usec: int) -> datetime | None:
    seconds = time_usec * 1e-6
    return datetime.fromtimestamp(seconds, UTC) if _LEAST_UTC_S <= seconds < 1e11 else None


def _since_midnight_s(when: datetime) -> float:
    return when.hour * 3600 + when.minute * 60 + when.second + when.microsecond * 1e-6


def distance(picture: ImcPicture, now_us: int) -> Distance | None:
    """The sounder's range; a sounder that says by WATER_DEPTH that it measures nothing is told as such."""
    sounding = _sounding(picture, now_us)
    if sounding is not None:
        return Distance(validity=DistanceValidity.VALID, value_m=sounding.current_distance * 0.01)
    depth = picture.fresh("WATER_DEPTH", now_us)
    if depth is None:
        return None
    if depth.healthy and math.isfinite(depth.distance):
        return Distance(validity=DistanceValidity.VALID, value_m=depth.distance)
    return Distance(validity=DistanceValidity.INVALID)


def state_report(picture: ImcPicture, now_us: int, utc_s: float) -> StateReport | None:
    """The state that crossed a radio, with the time when it was true. ``utc_s``: now."""
    state, age_s = estimated_state(picture, now_us), picture.age_s(now_us)
    if state is None or age_s is None:
        return None
    battery = picture.fresh("SYS_STATUS", now_us)
    mission = picture.fresh("MISSION_CURRENT", now_us)
    share_pct = -1
    if mission is not None and mission.total not in (0, _UNKNOWN_16) and _under_way(picture, now_us):
        share_pct = min(100, 100 * mission.seq // mission.total)
    return StateReport(
        stime_s=max(0, min(round(utc_s - age_s), 0xFFFF_FFFF)),
        latitude_deg=math.degrees(state.lat_rad),
        longitude_deg=math.degrees(state.lon_rad),
        altitude_dm=_UNKNOWN_16 if state.alt_m < 0.0 else min(round(state.alt_m * 10.0), _UNKNOWN_16 - 1),
        depth_dm=0,
        heading=round(wrap_2pi(state.psi_rad) / math.tau * _UNKNOWN_16),
        speed_cmps=max(-32768, min(round(math.hypot(state.vx_mps, state.vy_mps) * 100.0), 32767)),
        fuel_pct=battery.battery_remaining if battery is not None else -1,
        exec_state_pct=share_pct,
    )


def _under_way(picture: ImcPicture, now_us: int) -> bool:
    """Whether a plan is being sailed (MISSION_STATE_ACTIVE)."""
    mission = picture.fresh("MISSION_CURRENT", now_us)
    return mission is not None and getattr(mission, "mission_state", 0) == _PLAN_ACTIVE
