"""Telemetry of the vessel itself: health, battery, plan progress, actuators, fence, clock. Snapshot in, message out, or None."""

from __future__ import annotations

from typing import Any, Final

from mavlink_bridge import modes
from mavlink_bridge.codec import dialect
from mavlink_bridge.endpoint_config import EndpointConfig
from mavlink_bridge.imc import Action, GuardState, Mode
from mavlink_bridge.mapping import (
    a_to_ca,
    boot_ms,
    m_to_dam,
    mps_to_fifths,
    rad_to_deg_half,
    rad_to_deg_i8,
    rad_to_degE7,
    share_to_percent,
    share_to_permille,
    thrust_to_percent,
    v_to_mv,
)
from mavlink_bridge.snapshot import Health, Snapshot

Message = Any

_GYRO: Final = 0x01
_ACCEL: Final = 0x02
_MAG: Final = 0x04
_GPS: Final = 0x20
_RANGEFINDER: Final = 0x100
_YAW_CONTROL: Final = 0x1000
_XY_CONTROL: Final = 0x4000
_MOTORS: Final = 0x8000
_GEOFENCE: Final = 0x100000
_AHRS: Final = 0x200000
_LOGGING: Final = 0x1000000
_BATTERY: Final = 0x2000000
_PREARM: Final = 0x10000000

_STANDBY: Final = 3
_ACTIVE: Final = 4
_CRITICAL: Final = 5
_EMERGENCY: Final = 6


def system_status(snapshot: Snapshot) -> int:
    """MAV_STATE: emergency when blocked or terminated, critical while a failsafe acts, active while armed."""
    if snapshot.terminated or snapshot.guard is GuardState.LOCKED:
        return _EMERGENCY
    if snapshot.action > Action.WARN and snapshot.armed:
        return _CRITICAL
    return _ACTIVE if snapshot.armed else _STANDBY


def heartbeat(snapshot: Snapshot, config: EndpointConfig) -> Message:
    """HEARTBEAT of a surface boat under the endpoint's persona."""
    return dialect.MAVLink_heartbeat_message(
        type=11,
        autopilot=3 if config.persona == "ardurover" else 0,
        base_mode=modes.base_mode(snapshot.mode, snapshot.armed),
        custom_mode=modes.custom_mode(snapshot.mode, config),
        system_status=system_status(snapshot),
        mavlink_version=3,
    )


def _bits(health: Health, snapshot: Snapshot) -> tuple[int, int, int]:
    """Return (present, enabled, healthy) of SYS_STATUS.

    A GNSS compass stands for gyro, accelerometer and magnetometer: its attitude and heading are what the stations mean
    that ask for those bits.
    """
    loops = snapshot.armed and snapshot.desired is not None
    path = loops and snapshot.mode is not Mode.MANUAL
    parts: tuple[tuple[int, bool | None, bool], ...] = (
        (_GYRO | _ACCEL, health.attitude or health.heading, True),
        (_MAG, health.heading, True),
        (_GPS, health.gps, True),
        (_AHRS, health.heading and snapshot.state.position_valid, True),
        (_RANGEFINDER, health.depth, True),
        (_BATTERY, health.battery, True),
        (_LOGGING, health.logging, True),
        (_MOTORS, health.actuators, snapshot.armed),
        (_YAW_CONTROL, True, loops),
        (_XY_CONTROL, True, path),
        (_GEOFENCE, health.fence_ok, health.fence_enabled),
        (_PREARM, health.prearm_ok, True),
    )
    present = enabled = healthy = 0
    for bit, state, is_on in parts:
        if state is None:
            continue
        present |= bit
        enabled |= bit if is_on else 0
        healthy |= bit if state else 0
    return present, enabled, healthy


def sys_status(snapshot: Snapshot) -> Message | None:
    """SYS_STATUS with bits that are true: present means fitted, enabled means on, health means good."""
    present, enabled, healthy = _bits(snapshot.health, snapshot)
    supply = snapshot.supply
    return dialect.MAVLink_sys_status_message(
        onboard_control_sensors_present=present,
        onboard_control_sensors_enabled=enabled,
        onboard_control_sensors_health=healthy,
        load=share_to_permille(snapshot.load),
        voltage_battery=v_to_mv(supply.voltage_v if supply else None),
        current_battery=a_to_ca(supply.current_a if supply else None),
        battery_remaining=share_to_percent(supply.remaining if supply else None),
        drop_rate_comm=0,
        errors_comm=min(sum(link.bad_frames for link in snapshot.links), 0xFFFF),
        errors_count1=0,
        errors_count2=0,
        errors_count3=0,
        errors_count4=0,
    )


def battery_status(snapshot: Snapshot) -> Message | None:
    """BATTERY_STATUS; voltage, current and charge each carry their own 'unknown'."""
    supply = snapshot.supply
    voltage_mv = v_to_mv(supply.voltage_v if supply else None)
    return dialect.MAVLink_battery_status_message(
        id=0,
        battery_function=1,
        type=0,
        temperature=0x7FFF,
        voltages=[voltage_mv] + [0xFFFF] * 9,
        current_battery=a_to_ca(supply.current_a if supply else None),
        current_consumed=-1,
        energy_consumed=-1,
        battery_remaining=share_to_percent(supply.remaining if supply else None),
    )


def extended_sys_state(snapshot: Snapshot) -> Message | None:
    """EXTENDED_SYS_STATE: 'in air' while armed and under way, so that stations offer what they offer a vehicle under way."""
    output = snapshot.output
    moving = snapshot.armed and (
        snapshot.mode is not Mode.MANUAL or bool(output.thruster_port or output.thruster_starboard)
    )
    return dialect.MAVLink_extended_sys_state_message(vtol_state=0, landed_state=2 if moving else 1)


def mission_current(snapshot: Snapshot, config: EndpointConfig) -> Message | None:
    """MISSION_CURRENT; under persona ardurover item 0 is home, so numbers are one higher."""
    progress = snapshot.progress
    shift = 1 if config.has_home_item else 0
    total = progress.total + (shift if progress.total else 0)
    return dialect.MAVLink_mission_current_message(
        seq=progress.seq + (shift if progress.total else 0),
        total=total if total else 0xFFFF,
        mission_state=int(progress.state),
        mission_mode=1 if snapshot.mode is Mode.AUTO else 2,
        mission_id=progress.mission_id,
        fence_id=progress.fence_id,
        rally_points_id=progress.rally_id,
    )


def mission_item_reached(seq: int, config: EndpointConfig) -> Message:
    return dialect.MAVLink_mission_item_reached_message(seq + (1 if config.has_home_item else 0))


def fence_status(snapshot: Snapshot) -> Message | None:
    fence = snapshot.fence
    return dialect.MAVLink_fence_status_message(
        breach_status=1 if fence.breached else 0,
        breach_count=min(fence.breach_count, 0xFFFF),
        breach_type=fence.breach_type,
        breach_time=boot_ms(fence.breach_t_us),
        breach_mitigation=1 if fence.breached else 0,
    )


def servo_output_raw(snapshot: Snapshot) -> Message | None:
    """SERVO_OUTPUT_RAW: the pulse widths that the actuator board says it applied, never those merely asked for; 0 = unknown."""
    applied = snapshot.actuator.applied_us if snapshot.actuator.connected else None
    one, two, three, four = applied or (0, 0, 0, 0)
    return dialect.MAVLink_servo_output_raw_message(
        time_usec=snapshot.actuator.t_us & 0xFFFFFFFF,
        port=0,
        servo1_raw=one,
        servo2_raw=two,
        servo3_raw=three,
        servo4_raw=four,
        servo5_raw=0,
        servo6_raw=0,
        servo7_raw=0,
        servo8_raw=0,
    )


def system_time(snapshot: Snapshot) -> Message | None:
    return dialect.MAVLink_system_time_message(time_unix_usec=snapshot.utc_us or 0, time_boot_ms=boot_ms(snapshot.t_us))


def current_mode(snapshot: Snapshot, config: EndpointConfig) -> Message:
    return modes.current_mode(snapshot.mode, snapshot.mode, config)


def high_latency2(snapshot: Snapshot, config: EndpointConfig) -> Message | None:
    """HIGH_LATENCY2. custom_mode has 16 bits: Rover numbers as they are, the PX4 layout by its upper half.

    custom0 holds base_mode under persona ardurover, where stations look for the armed flag, and roll in degrees otherwise;
    custom1 is pitch.
    """
    state, path = snapshot.state, snapshot.path
    number = modes.custom_mode(snapshot.mode, config)
    base = modes.base_mode(snapshot.mode, snapshot.armed)
    return dialect.MAVLink_high_latency2_message(
        timestamp=boot_ms(snapshot.t_us),
        type=11,
        autopilot=3 if config.persona == "ardurover" else 0,
        custom_mode=number if number < 0x10000 else number >> 16,
        latitude=rad_to_degE7(state.lat_rad, 0),
        longitude=rad_to_degE7(state.lon_rad, 0),
        altitude=round(min(max(state.height_msl_m or 0.0, -0x7FFF), 0x7FFF)),
        target_altitude=0,
        heading=rad_to_deg_half(state.psi_rad),
        target_heading=rad_to_deg_half(path.target_bearing_rad),
        target_distance=m_to_dam(path.distance_m),
        throttle=thrust_to_percent(abs(snapshot.throttle)),
        airspeed=mps_to_fifths(state.sog_mps),
        airspeed_sp=mps_to_fifths(snapshot.desired.speed_mps or 0.0) if snapshot.desired else 0,
        groundspeed=mps_to_fifths(state.sog_mps),
        windspeed=0,
        wind_heading=0,
        eph=_eph(snapshot),
        epv=255,
        temperature_air=-128,
        climb_rate=0,
        battery=share_to_percent(snapshot.supply.remaining if snapshot.supply else None),
        wp_num=min(snapshot.progress.seq + (1 if config.has_home_item else 0), 0xFFFF),
        failure_flags=_failure_flags(snapshot),
        custom0=(base - 256 if base > 127 else base) if config.persona == "ardurover" else rad_to_deg_i8(state.phi_rad),
        custom1=rad_to_deg_i8(state.theta_rad),
        custom2=0,
    )


def _eph(snapshot: Snapshot) -> int:
    hacc_m = snapshot.fix.hacc_m if snapshot.fix else None
    return 255 if hacc_m is None else min(round(hacc_m * 10.0), 254)


def _failure_flags(snapshot: Snapshot) -> int:
    """HL_FAILURE_FLAG: GPS 1, compass 32, sounder 64 (terrain), battery 128, actuators 1024 (engine), fence 2048."""
    health = snapshot.health
    flags = 0 if health.gps else 1
    flags |= 32 if not health.heading else 0
    flags |= 64 if health.depth is False else 0
    flags |= 128 if health.battery is False else 0
    flags |= 1024 if not health.actuators else 0
    flags |= 2048 if not health.fence_ok else 0
    return flags
