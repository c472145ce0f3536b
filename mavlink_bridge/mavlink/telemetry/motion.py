"""Telemetry of motion: where the vessel is, how it moves, what it steers for.

Snapshot in, the message's values out in the order of the wire, or None when there is nothing true to say.
"""

from __future__ import annotations

import math
from typing import Final

from ...language.messages import FixType, GpsFix
from ...language.snapshot import Snapshot
from ..wire.mapping import (
    NAN,
    boot_ms,
    bottom_clearance_m,
    count_to_u8,
    dop_to_u16,
    m_to_cm,
    m_to_m16,
    m_to_mm,
    m_to_mm_u32,
    mps_to_cms,
    mps_to_cms_signed,
    offset_m,
    quality_to_percent,
    rad_to_cdeg,
    rad_to_deg,
    rad_to_degE7,
    rad_to_yaw_cdeg,
    thrust_to_percent,
    value_or_nan,
)
from ..wire.payload import Values, told_as

_FRAME_GLOBAL: Final = 0
_TARGET_POSITION_ONLY: Final = 0b110111111000
"""POSITION_TARGET_TYPEMASK: velocity, acceleration, yaw and yaw rate are not given."""
_TARGET_YAW_GIVEN: Final = 0b100111111000
_NO_MOTION: Final = (0.0,) * 7
"""Altitude, velocity and acceleration of a set-point that is a place."""
_AT_HOME: Final = (*(1.0, 0.0, 0.0, 0.0), *(0.0, 0.0, 0.0))
"""Quaternion and approach vector: a boat's home is a place and nothing more."""
_DOWNWARD_SONAR: Final = (*(1, 0, 25, 255), *(0.0, 0.0), *(0.0, 0.0, 0.0, 0.0))
"""MAV_DISTANCE_SENSOR_ULTRASOUND, sensor 0, pitch 270, covariance unknown; no field of view, no quaternion."""


@told_as(
    "GPS_RAW_INT",
    "time_usec lat lon alt eph epv vel cog fix_type satellites_visible alt_ellipsoid h_acc v_acc vel_acc hdg_acc yaw",
)
def gps_raw_int(snapshot: Snapshot) -> Values | None:
    """GPS_RAW_INT of the newest fix; without a position fix the coordinates are 0 and fix_type says so: 1 no fix, 0 no receiver heard."""
    fix = snapshot.fix
    heard = fix is not None
    if fix is None:
        fix = GpsFix(snapshot.t_us, FixType.NONE)
    positioned = fix.has_position and not fix.dead_reckoning
    lat, lon = (fix.lat_rad, fix.lon_rad) if positioned else (None, None)
    height_m = fix.height_msl_m if positioned else None
    return (
        fix.utc_us if fix.utc_us is not None else fix.t_us,
        rad_to_degE7(lat, 0),
        rad_to_degE7(lon, 0),
        m_to_mm(height_m),
        dop_to_u16(fix.hdop),
        dop_to_u16(fix.vdop),
        mps_to_cms(fix.sog_mps),
        rad_to_cdeg(fix.cog_rad),
        fix.fix_type if positioned else int(heard),
        count_to_u8(fix.satellites),
        m_to_mm(fix.height_ellipsoid_m if positioned else None),
        m_to_mm_u32(fix.hacc_m),
        m_to_mm_u32(fix.vacc_m),
        0,  # accuracy of speed and
        0,  # of course: not known
        rad_to_yaw_cdeg(snapshot.state.psi_rad if not snapshot.state.heading_from_course else None),
    )


@told_as("ATTITUDE", "time_boot_ms roll pitch yaw rollspeed pitchspeed yawspeed")
def attitude(snapshot: Snapshot) -> Values | None:
    """ATTITUDE; None without a heading, for which the message has no unknown: 0 would be north.

    Roll and pitch that nobody measures are 0, and AHRS of SYS_STATUS is then absent, or not healthy when they were measured before.
    """
    state = snapshot.state
    if state.psi_rad is None:
        return None
    return (
        boot_ms(snapshot.t_us),
        state.phi_rad or 0.0,
        state.theta_rad or 0.0,
        state.psi_rad,
        0.0,  # rates of roll and
        0.0,  # of pitch: not measured
        state.r_radps or 0.0,
    )


@told_as("ATTITUDE_QUATERNION", "time_boot_ms q1 q2 q3 q4 rollspeed pitchspeed yawspeed")
def attitude_quaternion(snapshot: Snapshot) -> Values | None:
    """ATTITUDE_QUATERNION (w, x, y, z), NED to body, of the same angles as ATTITUDE, and None when that is."""
    state = snapshot.state
    if state.psi_rad is None:
        return None
    half = [(angle or 0.0) / 2.0 for angle in (state.phi_rad, state.theta_rad, state.psi_rad)]
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, half), map(math.sin, half)
    return (
        boot_ms(snapshot.t_us),
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        0.0,  # rates of roll and
        0.0,  # of pitch: not measured
        state.r_radps or 0.0,
    )


@told_as("GLOBAL_POSITION_INT", "time_boot_ms lat lon alt relative_alt vx vy vz hdg")
def global_position_int(snapshot: Snapshot) -> Values | None:
    """GLOBAL_POSITION_INT; None without a position. relative_alt is 0: a boat is at the height of its home."""
    state = snapshot.state
    if state.lat_rad is None or state.lon_rad is None:
        return None
    return (
        boot_ms(snapshot.t_us),
        rad_to_degE7(state.lat_rad),
        rad_to_degE7(state.lon_rad),
        m_to_mm(state.height_msl_m),
        0,  # above home
        mps_to_cms_signed(state.vx_mps),
        mps_to_cms_signed(state.vy_mps),
        0,  # down
        rad_to_cdeg(state.psi_rad),
    )


@told_as("LOCAL_POSITION_NED", "time_boot_ms x y z vx vy vz")
def local_position_ned(snapshot: Snapshot) -> Values | None:
    """LOCAL_POSITION_NED about the run's fixed origin; None without a position."""
    state = snapshot.state
    if state.x_m is None or state.y_m is None:
        return None
    return (
        boot_ms(snapshot.t_us),
        state.x_m,
        state.y_m,
        0.0,
        state.vx_mps or 0.0,
        state.vy_mps or 0.0,
        0.0,
    )


@told_as("VFR_HUD", "airspeed groundspeed alt climb heading throttle")
def vfr_hud(snapshot: Snapshot) -> Values | None:
    """VFR_HUD; airspeed repeats the ground speed, as no log measures the water's. Unknown is NaN; the heading has none and is 0."""
    state = snapshot.state
    speed_mps = value_or_nan(state.sog_mps)
    return (
        speed_mps,
        speed_mps,
        value_or_nan(state.height_msl_m),
        0.0,
        rad_to_deg(state.psi_rad),
        thrust_to_percent(abs(snapshot.throttle)),
    )


def _bearing_deg(angle_rad: float | None) -> int:
    """NAV_CONTROLLER_OUTPUT bearings: -180...179 degrees, unknown 0."""
    return (rad_to_deg(angle_rad) + 180) % 360 - 180


@told_as(
    "NAV_CONTROLLER_OUTPUT",
    "nav_roll nav_pitch alt_error aspd_error xtrack_error nav_bearing target_bearing wp_dist",
)
def nav_controller_output(snapshot: Snapshot) -> Values | None:
    """NAV_CONTROLLER_OUTPUT: bearings in degrees -180...180, distance m, cross-track m."""
    desired_rad = snapshot.desired.psi_rad if snapshot.desired else None
    path = snapshot.path
    return (
        *(0.0, 0.0, 0.0),  # desired roll and pitch, altitude error
        snapshot.trace.speed_error_mps or 0.0,
        path.cross_track_m or 0.0,
        _bearing_deg(desired_rad),
        _bearing_deg(path.target_bearing_rad),
        m_to_m16(path.distance_m),
    )


@told_as(
    "POSITION_TARGET_GLOBAL_INT",
    "time_boot_ms lat_int lon_int alt vx vy vz afx afy afz yaw yaw_rate type_mask coordinate_frame",
)
def position_target_global_int(snapshot: Snapshot) -> Values | None:
    """POSITION_TARGET_GLOBAL_INT of the point that guidance makes for; None when it makes for none."""
    path = snapshot.path
    if path.target_lat_rad is None or path.target_lon_rad is None:
        return None
    psi_rad = snapshot.desired.psi_rad if snapshot.desired else None
    return (
        boot_ms(snapshot.t_us),
        rad_to_degE7(path.target_lat_rad),
        rad_to_degE7(path.target_lon_rad),
        *_NO_MOTION,
        psi_rad or 0.0,
        0.0,
        _TARGET_POSITION_ONLY if psi_rad is None else _TARGET_YAW_GIVEN,
        _FRAME_GLOBAL,
    )


@told_as("ORBIT_EXECUTION_STATUS", "time_usec radius x y z frame")
def orbit_execution_status(snapshot: Snapshot) -> Values | None:
    """ORBIT_EXECUTION_STATUS, radius clockwise positive; None when not circling."""
    path = snapshot.path
    if path.orbit_radius_m is None or path.orbit_lat_rad is None or path.orbit_lon_rad is None:
        return None
    return (
        snapshot.t_us,
        path.orbit_radius_m,
        rad_to_degE7(path.orbit_lat_rad),
        rad_to_degE7(path.orbit_lon_rad),
        0.0,
        _FRAME_GLOBAL,
    )


@told_as("FIGURE_EIGHT_EXECUTION_STATUS", "time_usec major_radius minor_radius orientation x y z frame")
def figure_eight_execution_status(snapshot: Snapshot) -> Values | None:
    """FIGURE_EIGHT_EXECUTION_STATUS, major radius positive with the north loop clockwise; None when not sailing an eight."""
    path = snapshot.path
    if path.eight is None or path.target_lat_rad is None or path.target_lon_rad is None:
        return None
    radius_m, length_m, bearing_rad = path.eight
    return (
        snapshot.t_us,
        math.copysign(0.5 * length_m + abs(radius_m), radius_m),
        abs(radius_m),
        math.remainder(bearing_rad, math.tau),
        rad_to_degE7(path.target_lat_rad),
        rad_to_degE7(path.target_lon_rad),
        0.0,
        _FRAME_GLOBAL,
    )


@told_as("HOME_POSITION", "latitude longitude altitude x y z q approach_x approach_y approach_z time_usec")
def home_position(snapshot: Snapshot) -> Values | None:
    """HOME_POSITION, at the boat's height as relative_alt says, and in LOCAL_POSITION_NED's axes; None before a home is known."""
    state, lat_rad, lon_rad = snapshot.state, snapshot.home_lat_rad, snapshot.home_lon_rad
    if lat_rad is None or lon_rad is None:
        return None
    origin_lat_rad, origin_lon_rad = state.origin_lat_rad, state.origin_lon_rad
    if origin_lat_rad is None or origin_lon_rad is None:
        north_m, east_m = NAN, NAN
    else:
        north_m, east_m = offset_m(origin_lat_rad, origin_lon_rad, lat_rad, lon_rad)
    return (
        rad_to_degE7(lat_rad),
        rad_to_degE7(lon_rad),
        m_to_mm(state.height_msl_m),
        *(north_m, east_m, 0.0),
        *_AT_HOME,
        snapshot.t_us,
    )


@told_as("GPS_GLOBAL_ORIGIN", "latitude longitude altitude time_usec")
def gps_global_origin(snapshot: Snapshot) -> Values | None:
    """GPS_GLOBAL_ORIGIN: where LOCAL_POSITION_NED counts from; None before the first position."""
    state = snapshot.state
    if state.origin_lat_rad is None or state.origin_lon_rad is None:
        return None
    return (
        rad_to_degE7(state.origin_lat_rad),
        rad_to_degE7(state.origin_lon_rad),
        m_to_mm(state.height_msl_m),
        snapshot.t_us,
    )


@told_as(
    "DISTANCE_SENSOR",
    "time_boot_ms min_distance max_distance current_distance type id orientation covariance"
    " horizontal_fov vertical_fov quaternion signal_quality",
)
def distance_sensor(snapshot: Snapshot) -> Values | None:
    """DISTANCE_SENSOR, downward; None while the sounder reports nothing, for the message has no word for it."""
    distance = snapshot.distance
    if distance is None or distance.value_m is None or snapshot.health.depth is not True:
        return None
    return (
        boot_ms(distance.t_us),
        0,
        m_to_cm(distance.range_max_m) or 0xFFFF,
        m_to_cm(distance.value_m),
        *_DOWNWARD_SONAR,
        quality_to_percent(distance.signal_quality),
    )


@told_as(
    "ALTITUDE",
    "time_usec altitude_monotonic altitude_amsl altitude_local altitude_relative altitude_terrain bottom_clearance",
)
def altitude(snapshot: Snapshot) -> Values | None:
    """ALTITUDE: bottom_clearance is the water under the keel, -1 when unknown; a height that nobody measures is NaN."""
    state = snapshot.state
    height_m = value_or_nan(state.height_msl_m)
    return (
        snapshot.t_us,
        height_m,
        height_m,
        *(0.0, 0.0),  # above the start and above home
        -1001.0 if state.alt_m is None else max(state.alt_m, 0.0),
        bottom_clearance_m(state.alt_m),
    )


@told_as("WATER_DEPTH", "time_boot_ms lat lng alt roll pitch yaw distance temperature id healthy")
def water_depth(snapshot: Snapshot) -> Values | None:
    """WATER_DEPTH: the sounding with the position where it was taken; None without a sounder."""
    distance = snapshot.distance
    if distance is None:
        return None
    state = snapshot.state
    return (
        boot_ms(distance.t_us),
        rad_to_degE7(state.lat_rad, 0),
        rad_to_degE7(state.lon_rad, 0),
        value_or_nan(state.height_msl_m),
        value_or_nan(state.phi_rad),
        value_or_nan(state.theta_rad),
        value_or_nan(state.psi_rad),
        value_or_nan(distance.value_m),
        NAN,
        0,
        1 if snapshot.health.depth and distance.value_m is not None else 0,
    )
