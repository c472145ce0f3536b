"""Telemetry of the vessel itself: health, battery, plan progress, actuators, fence, clock.

Snapshot in, the message's values out in the order of the wire, or None when there is nothing true to say.
"""

from __future__ import annotations

import math
from typing import Final

from ...language.messages import Action, GuardState, Mode
from ...language.snapshot import Health, Snapshot
from ..persona import EndpointConfig, modes
from ..wire.mapping import (
    a_to_ca,
    boot_ms,
    m_to_dam,
    m_to_dm,
    m_to_m_i16,
    mps_to_fifths,
    rad_to_deg_half,
    rad_to_deg_i8,
    rad_to_degE7,
    share_to_percent,
    share_to_permille,
    thrust_to_percent,
    v_to_mv,
)
from ..wire.payload import Values, told_as

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

_SURFACE_BOAT: Final = 11
"""MAV_TYPE_SURFACE_BOAT."""
_CELLS: Final = 10
_CELL_MV: Final = 0xFFFE
_NO_CELL: Final = 0xFFFF
_NO_PULSES: Final = (0, 0, 0, 0)

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


@told_as("HEARTBEAT", "custom_mode type autopilot base_mode system_status mavlink_version")
def heartbeat(snapshot: Snapshot, config: EndpointConfig) -> Values:
    """HEARTBEAT of a surface boat under the endpoint's persona."""
    return (
        modes.custom_mode(snapshot.mode, config),
        _SURFACE_BOAT,
        3 if config.persona == "ardurover" else 0,
        modes.base_mode(snapshot.mode, snapshot.armed),
        system_status(snapshot),
        3,
    )


def _bits(health: Health, snapshot: Snapshot) -> tuple[int, int, int]:
    """Return (present, enabled, healthy) of SYS_STATUS.

    A GNSS compass stands for gyro, accelerometer and magnetometer: its attitude and heading are what the stations mean
    that ask for those bits. AHRS is absent on a vessel that has never measured roll or pitch.
    """
    loops = snapshot.armed and snapshot.desired is not None
    path = loops and snapshot.mode is not Mode.MANUAL
    parts: tuple[tuple[int, bool | None, bool], ...] = (
        (_GYRO | _ACCEL, health.attitude or health.heading, True),
        (_MAG, health.heading, True),
        (_GPS, health.gps, True),
        (_AHRS, health.attitude and health.heading and snapshot.state.position_valid, True),
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


@told_as(
    "SYS_STATUS",
    "onboard_control_sensors_present onboard_control_sensors_enabled onboard_control_sensors_health load"
    " voltage_battery current_battery drop_rate_comm errors_comm errors_count1 errors_count2 errors_count3"
    " errors_count4 battery_remaining",
)
def sys_status(snapshot: Snapshot) -> Values | None:
    """SYS_STATUS with bits that are true: present means fitted, enabled means on, health means good."""
    present, enabled, healthy = _bits(snapshot.health, snapshot)
    supply = snapshot.supply
    return (
        present,
        enabled,
        healthy,
        share_to_permille(snapshot.load),
        v_to_mv(supply.voltage_v if supply else None),
        a_to_ca(supply.current_a if supply else None),
        0,  # share of frames lost: not known
        min(sum([link.bad_frames for link in snapshot.links]), 0xFFFF),
        *(0, 0, 0, 0),  # ArduPilot's own counters
        share_to_percent(supply.remaining if supply else None),
    )


def _cells_mv(voltage_v: float | None) -> list[int]:
    """BATTERY_STATUS.voltages of a battery measured as a whole: the first 'cell' holds it, the next what does not fit."""
    left_mv = -1 if voltage_v is None or not math.isfinite(voltage_v) else max(round(voltage_v * 1000.0), 0)
    cells = []
    for number in range(_CELLS):
        cells.append(min(left_mv, _CELL_MV) if left_mv > 0 or (left_mv == 0 and number == 0) else _NO_CELL)
        left_mv -= _CELL_MV
    return cells


@told_as(
    "BATTERY_STATUS",
    "current_consumed energy_consumed temperature voltages current_battery id battery_function type battery_remaining",
)
def battery_status(snapshot: Snapshot) -> Values | None:
    """BATTERY_STATUS; voltage, current and charge each carry their own 'unknown'."""
    supply = snapshot.supply
    return (
        *(-1, -1, 0x7FFF),  # charge and energy used, temperature: unknown
        *_cells_mv(supply.voltage_v if supply else None),
        a_to_ca(supply.current_a if supply else None),
        *(0, 1, 0),  # battery 0, for all functions, of unknown type
        share_to_percent(supply.remaining if supply else None),
    )


@told_as("EXTENDED_SYS_STATE", "vtol_state landed_state")
def extended_sys_state(snapshot: Snapshot) -> Values | None:
    """EXTENDED_SYS_STATE: 'in air' while armed and under way, so that stations offer what they offer a vehicle under way."""
    output = snapshot.output
    moving = snapshot.armed and (
        snapshot.mode is not Mode.MANUAL or bool(output.thruster_port or output.thruster_starboard)
    )
    return 0, 2 if moving else 1


@told_as("MISSION_CURRENT", "seq total mission_state mission_mode mission_id fence_id rally_points_id")
def mission_current(snapshot: Snapshot, config: EndpointConfig) -> Values | None:
    """MISSION_CURRENT; under persona ardurover item 0 is home, so numbers are one higher, but home is not one of the total."""
    progress = snapshot.progress
    shift = 1 if config.has_home_item and progress.total else 0
    return (
        progress.seq + shift,
        progress.total or 0xFFFF,
        progress.state,
        1 if snapshot.mode is Mode.AUTO else 2,
        progress.mission_id,
        progress.fence_id,
        progress.rally_id,
    )


@told_as("MISSION_ITEM_REACHED", "seq")
def mission_item_reached(seq: int, config: EndpointConfig) -> Values:
    return (seq + (1 if config.has_home_item else 0),)


@told_as("FENCE_STATUS", "breach_time breach_count breach_status breach_type breach_mitigation")
def fence_status(snapshot: Snapshot) -> Values | None:
    fence = snapshot.fence
    return (
        boot_ms(fence.breach_t_us),
        min(fence.breach_count, 0xFFFF),
        1 if fence.breached else 0,
        fence.breach_type,
        1 if fence.breached else 0,
    )


@told_as(
    "SERVO_OUTPUT_RAW",
    "time_usec servo1_raw servo2_raw servo3_raw servo4_raw servo5_raw servo6_raw servo7_raw servo8_raw port",
)
def servo_output_raw(snapshot: Snapshot) -> Values | None:
    """SERVO_OUTPUT_RAW: the pulse widths that the actuator board says it applied; 0 = unknown.

    Only a board that can never say it, the seed's on level 0, has those that were commanded, and time_usec 0.
    """
    board = snapshot.actuator
    shown = (board.applied_us or board.commanded_us) if board.connected else None
    return (board.t_us & 0xFFFFFFFF, *(shown or _NO_PULSES), *_NO_PULSES, 0)


@told_as("SYSTEM_TIME", "time_unix_usec time_boot_ms")
def system_time(snapshot: Snapshot) -> Values | None:
    return snapshot.utc_us or 0, boot_ms(snapshot.t_us)


@told_as("CURRENT_MODE", "custom_mode intended_custom_mode standard_mode")
def current_mode(snapshot: Snapshot, config: EndpointConfig) -> Values:
    number = modes.custom_mode(snapshot.mode, config)
    return number, number, modes.face(snapshot.mode).standard


@told_as(
    "HIGH_LATENCY2",
    "timestamp latitude longitude custom_mode altitude target_altitude target_distance wp_num failure_flags type"
    " autopilot heading target_heading throttle airspeed airspeed_sp groundspeed windspeed wind_heading eph epv"
    " temperature_air climb_rate battery custom0 custom1 custom2",
)
def high_latency2(snapshot: Snapshot, config: EndpointConfig) -> Values | None:
    """HIGH_LATENCY2. custom_mode has 16 bits: Rover numbers as they are, the PX4 layout by its upper half.

    custom0 holds base_mode under persona ardurover, where stations look for the armed flag, and roll in degrees otherwise;
    custom1 is pitch.
    """
    state, path = snapshot.state, snapshot.path
    number = modes.custom_mode(snapshot.mode, config)
    base = modes.base_mode(snapshot.mode, snapshot.armed)
    return (
        boot_ms(snapshot.t_us),
        rad_to_degE7(state.lat_rad, 0),
        rad_to_degE7(state.lon_rad, 0),
        number if number < 0x10000 else number >> 16,
        m_to_m_i16(state.height_msl_m),
        0,  # target's altitude
        m_to_dam(path.distance_m),
        min(snapshot.progress.seq + (1 if config.has_home_item else 0), 0xFFFF),
        _failure_flags(snapshot),
        _SURFACE_BOAT,
        3 if config.persona == "ardurover" else 0,
        rad_to_deg_half(state.psi_rad),
        rad_to_deg_half(path.target_bearing_rad),
        thrust_to_percent(abs(snapshot.throttle)),
        mps_to_fifths(state.sog_mps),
        mps_to_fifths(snapshot.desired.speed_mps or 0.0) if snapshot.desired else 0,
        mps_to_fifths(state.sog_mps),
        *(0, 0),  # wind's speed and direction
        m_to_dm(snapshot.fix.hacc_m if snapshot.fix else None),
        *(255, -128, 0),  # vertical accuracy and temperature unknown, climb rate
        share_to_percent(snapshot.supply.remaining if snapshot.supply else None),
        (base - 256 if base > 127 else base) if config.persona == "ardurover" else rad_to_deg_i8(state.phi_rad),
        rad_to_deg_i8(state.theta_rad),
        0,
    )


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
