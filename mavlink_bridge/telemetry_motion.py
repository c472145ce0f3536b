"""Telemetry of motion: where the vessel is, how it moves, what it steers for.

Snapshot in, message out, or None when there is nothing true to say.
"""

from __future__ import annotations

import math
from typing import Any, Final

from mavlink_bridge.codec import dialect
from mavlink_bridge.imc import FixType, GpsFix
from mavlink_bridge.mapping import (
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
    quality_to_percent,
    rad_to_cdeg,
    rad_to_deg,
    rad_to_degE7,
    rad_to_yaw_cdeg,
    thrust_to_percent,
    value_or_nan,
)
from mavlink_bridge.snapshot import Snapshot

Message = Any

_FRAME_GLOBAL: Final = 0
_TARGET_POSITION_ONLY: Final = 0b110111111000
"""POSITION_TARGET_TYPEMASK: velocity, acceleration, yaw and yaw rate are not given."""
_TARGET_YAW_GIVEN: Final = 0b100111111000


def gps_raw_int(snapshot: Snapshot) -> Message | None:
    """GPS_RAW_INT of the newest fix; without a position fix the coordinates are 0 and fix_type says so."""
    fix = snapshot.fix
    if fix is None:
        fix = GpsFix(snapshot.t_us, FixType.NONE)
    positioned = fix.has_position and not fix.dead_reckoning
    lat, lon = (fix.lat_rad, fix.lon_rad) if positioned else (None, None)
    height_m = fix.height_msl_m if positioned else None
    return dialect.MAVLink_gps_raw_int_message(
        time_usec=fix.utc_us if fix.utc_us is not None else fix.t_us,
        fix_type=int(fix.fix_type) if positioned else 1,
        lat=rad_to_degE7(lat, 0),
        lon=rad_to_degE7(lon, 0),
        alt=m_to_mm(height_m),
        eph=dop_to_u16(fix.hdop),
        epv=dop_to_u16(fix.vdop),
        vel=mps_to_cms(fix.sog_mps),
        cog=rad_to_cdeg(fix.cog_rad),
        satellites_visible=count_to_u8(fix.satellites),
        alt_ellipsoid=m_to_mm(fix.height_ellipsoid_m if positioned else None),
        h_acc=m_to_mm_u32(fix.hacc_m),
        v_acc=m_to_mm_u32(fix.vacc_m),
        vel_acc=0,
        hdg_acc=0,
        yaw=rad_to_yaw_cdeg(snapshot.state.psi_rad if not snapshot.state.heading_from_course else None),
    )


def attitude(snapshot: Snapshot) -> Message | None:
    """ATTITUDE; an axis that nobody measures is 0 with the AHRS health bit clear, since the message cannot say unknown."""
    state = snapshot.state
    return dialect.MAVLink_attitude_message(
        time_boot_ms=boot_ms(snapshot.t_us),
        roll=state.phi_rad or 0.0,
        pitch=state.theta_rad or 0.0,
        yaw=state.psi_rad or 0.0,
        rollspeed=0.0,
        pitchspeed=0.0,
        yawspeed=state.r_radps or 0.0,
    )


def attitude_quaternion(snapshot: Snapshot) -> Message | None:
    """ATTITUDE_QUATERNION (w, x, y, z), NED to body, of the same angles as ATTITUDE; for stations that ask for it."""
    state = snapshot.state
    half = [(angle or 0.0) / 2.0 for angle in (state.phi_rad, state.theta_rad, state.psi_rad)]
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, half), map(math.sin, half)
    return dialect.MAVLink_attitude_quaternion_message(
        time_boot_ms=boot_ms(snapshot.t_us),
        q1=cr * cp * cy + sr * sp * sy,
        q2=sr * cp * cy - cr * sp * sy,
        q3=cr * sp * cy + sr * cp * sy,
        q4=cr * cp * sy - sr * sp * cy,
        rollspeed=0.0,
        pitchspeed=0.0,
        yawspeed=state.r_radps or 0.0,
    )


def global_position_int(snapshot: Snapshot) -> Message | None:
    """GLOBAL_POSITION_INT; None without a position. relative_alt is 0: a boat is at the height of its home."""
    state = snapshot.state
    if state.lat_rad is None or state.lon_rad is None:
        return None
    return dialect.MAVLink_global_position_int_message(
        time_boot_ms=boot_ms(snapshot.t_us),
        lat=rad_to_degE7(state.lat_rad),
        lon=rad_to_degE7(state.lon_rad),
        alt=m_to_mm(state.height_msl_m),
        relative_alt=0,
        vx=mps_to_cms_signed(state.vx_mps),
        vy=mps_to_cms_signed(state.vy_mps),
        vz=0,
        hdg=rad_to_cdeg(state.psi_rad),
    )


def local_position_ned(snapshot: Snapshot) -> Message | None:
    """LOCAL_POSITION_NED about the run's fixed origin; None without a position."""
    state = snapshot.state
    if state.x_m is None or state.y_m is None:
        return None
    return dialect.MAVLink_local_position_ned_message(
        time_boot_ms=boot_ms(snapshot.t_us),
        x=state.x_m,
        y=state.y_m,
        z=0.0,
        vx=state.vx_mps or 0.0,
        vy=state.vy_mps or 0.0,
        vz=0.0,
    )


def vfr_hud(snapshot: Snapshot) -> Message | None:
    """VFR_HUD; airspeed repeats the ground speed, as no log measures the water's."""
    state = snapshot.state
    speed_mps = state.sog_mps or 0.0
    return dialect.MAVLink_vfr_hud_message(
        airspeed=speed_mps,
        groundspeed=speed_mps,
        heading=rad_to_deg(state.psi_rad),
        throttle=thrust_to_percent(abs(snapshot.throttle)),
        alt=state.height_msl_m or 0.0,
        climb=0.0,
    )


def _bearing_deg(angle_rad: float | None) -> int:
    """NAV_CONTROLLER_OUTPUT bearings: -180...179 degrees, unknown 0."""
    return (rad_to_deg(angle_rad) + 180) % 360 - 180


def nav_controller_output(snapshot: Snapshot) -> Message | None:
    """NAV_CONTROLLER_OUTPUT: bearings in degrees -180...180, distance m, cross-track m."""
    desired_rad = snapshot.desired.psi_rad if snapshot.desired else None
    path = snapshot.path
    return dialect.MAVLink_nav_controller_output_message(
        nav_roll=0.0,
        nav_pitch=0.0,
        nav_bearing=_bearing_deg(desired_rad),
        target_bearing=_bearing_deg(path.target_bearing_rad),
        wp_dist=m_to_m16(path.distance_m),
        alt_error=0.0,
        aspd_error=snapshot.trace.speed_error_mps or 0.0,
        xtrack_error=path.cross_track_m or 0.0,
    )


def position_target_global_int(snapshot: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT of the point that guidance makes for; None when it makes for none."""
    path = snapshot.path
    if path.target_lat_rad is None or path.target_lon_rad is None:
        return None
    psi_rad = snapshot.desired.psi_rad if snapshot.desired else None
    return dialect.MAVLink_position_target_global_int_message(
        time_boot_ms=boot_ms(snapshot.t_us),
        coordinate_frame=_FRAME_GLOBAL,
        type_mask=_TARGET_POSITION_ONLY if psi_rad is None else _TARGET_YAW_GIVEN,
        lat_int=rad_to_degE7(path.target_lat_rad),
        lon_int=rad_to_degE7(path.target_lon_rad),
        alt=0.0,
        vx=0.0,
        vy=0.0,
        vz=0.0,
        afx=0.0,
        afy=0.0,
        afz=0.0,
        yaw=psi_rad or 0.0,
        yaw_rate=0.0,
    )


def orbit_execution_status(snapshot: Snapshot) -> Message | None:
    """ORBIT_EXECUTION_STATUS, radius clockwise positive; None when not circling."""
    path = snapshot.path
    if path.orbit_radius_m is None or path.orbit_lat_rad is None or path.orbit_lon_rad is None:
        return None
    return dialect.MAVLink_orbit_execution_status_message(
        time_usec=snapshot.t_us,
        radius=path.orbit_radius_m,
        frame=_FRAME_GLOBAL,
        x=rad_to_degE7(path.orbit_lat_rad),
        y=rad_to_degE7(path.orbit_lon_rad),
        z=0.0,
    )


def figure_eight_execution_status(snapshot: Snapshot) -> Message | None:
    """FIGURE_EIGHT_EXECUTION_STATUS, major radius positive with the north loop clockwise; None when not sailing an eight."""
    path = snapshot.path
    if path.eight is None or path.target_lat_rad is None or path.target_lon_rad is None:
        return None
    radius_m, length_m, bearing_rad = path.eight
    return dialect.MAVLink_figure_eight_execution_status_message(
        time_usec=snapshot.t_us,
        major_radius=math.copysign(0.5 * length_m + abs(radius_m), radius_m),
        minor_radius=abs(radius_m),
        orientation=math.remainder(bearing_rad, math.tau),
        frame=_FRAME_GLOBAL,
        x=rad_to_degE7(path.target_lat_rad),
        y=rad_to_degE7(path.target_lon_rad),
        z=0.0,
    )


def home_position(snapshot: Snapshot) -> Message | None:
    """HOME_POSITION; None before a home is known."""
    if snapshot.home_lat_rad is None or snapshot.home_lon_rad is None:
        return None
    return dialect.MAVLink_home_position_message(
        latitude=rad_to_degE7(snapshot.home_lat_rad),
        longitude=rad_to_degE7(snapshot.home_lon_rad),
        altitude=0,
        x=0.0,
        y=0.0,
        z=0.0,
        q=[1.0, 0.0, 0.0, 0.0],
        approach_x=0.0,
        approach_y=0.0,
        approach_z=0.0,
        time_usec=snapshot.t_us,
    )


def distance_sensor(snapshot: Snapshot) -> Message | None:
    """DISTANCE_SENSOR, downward; None while the sounder reports nothing, for the message has no word for it."""
    distance = snapshot.distance
    if distance is None or distance.value_m is None or snapshot.health.depth is not True:
        return None
    return dialect.MAVLink_distance_sensor_message(
        time_boot_ms=boot_ms(distance.t_us),
        min_distance=0,
        max_distance=m_to_cm(distance.range_max_m) or 0xFFFF,
        current_distance=m_to_cm(distance.value_m),
        type=1,
        id=0,
        orientation=25,
        covariance=255,
        signal_quality=quality_to_percent(distance.signal_quality),
    )


def altitude(snapshot: Snapshot) -> Message | None:
    """ALTITUDE: bottom_clearance is the water under the keel, -1 when unknown."""
    state = snapshot.state
    height_m = state.height_msl_m or 0.0
    return dialect.MAVLink_altitude_message(
        time_usec=snapshot.t_us,
        altitude_monotonic=height_m,
        altitude_amsl=height_m,
        altitude_local=0.0,
        altitude_relative=0.0,
        altitude_terrain=-1001.0 if state.alt_m is None else max(state.alt_m, 0.0),
        bottom_clearance=bottom_clearance_m(state.alt_m),
    )


def water_depth(snapshot: Snapshot) -> Message | None:
    """WATER_DEPTH: the sounding with the position where it was taken; None without a sounder."""
    distance = snapshot.distance
    if distance is None:
        return None
    state = snapshot.state
    return dialect.MAVLink_water_depth_message(
        time_boot_ms=boot_ms(distance.t_us),
        id=0,
        healthy=1 if snapshot.health.depth and distance.value_m is not None else 0,
        lat=rad_to_degE7(state.lat_rad, 0),
        lng=rad_to_degE7(state.lon_rad, 0),
        alt=state.height_msl_m or 0.0,
        roll=state.phi_rad or 0.0,
        pitch=state.theta_rad or 0.0,
        yaw=state.psi_rad or 0.0,
        distance=value_or_nan(distance.value_m),
        temperature=NAN,
    )
