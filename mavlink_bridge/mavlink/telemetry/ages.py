"""What every telemetry message says when the source of its values is silent: a table, read by the docs and tested row by row.

A value whose source is silent is said as unknown where its message has a word for that (MAVLink common.xml). Where it has none
and the value would be a lie, the message is not sent; where it is only poorer, a bit of SYS_STATUS says so.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import Final, NamedTuple

GYRO, ACCEL, MAG, GPS, RANGEFINDER, MOTORS, AHRS, BATTERY = 0x01, 0x02, 0x04, 0x20, 0x100, 0x8000, 0x200000, 0x2000000
"""MAV_SYS_STATUS_SENSOR."""


class Told(Enum):
    """Where a value comes from, as the operator knows it."""

    RECEIVER = "GNSS receiver"
    COMPASS = "compass"
    TILT = "roll and pitch sensor"
    SOUNDER = "sounder"
    BOARD = "actuator board"
    OWN = "the vessel itself"


class Age(NamedTuple):
    """What one message does when one source is silent."""

    message: str
    source: Told
    says: dict[str, float | tuple[float, ...]]
    """Field and what it then holds; NaN stands for not a number."""
    unhealthy: int = 0
    """Bits of SYS_STATUS.onboard_control_sensors_health that are then clear."""
    ceases: bool = False
    """The message is then not sent."""
    note: str = ""


_U16: Final = 65_535
_NO_CELLS: Final = (_U16,) * 10

AGES: Final = (
    Age("HEARTBEAT", Told.OWN, {}),
    Age("SYS_STATUS", Told.RECEIVER, {}, GPS | AHRS),
    Age("SYS_STATUS", Told.COMPASS, {}, MAG | AHRS),
    Age(
        "SYS_STATUS", Told.TILT, {}, AHRS, note="a vessel that has never measured roll or pitch has no AHRS bit at all"
    ),
    Age("SYS_STATUS", Told.SOUNDER, {}, RANGEFINDER),
    Age(
        "SYS_STATUS",
        Told.BOARD,
        {"voltage_battery": _U16, "current_battery": -1, "battery_remaining": -1},
        MOTORS,
        note="the battery's bits are absent, as nothing measures it",
    ),
    Age(
        "GPS_RAW_INT",
        Told.RECEIVER,
        {
            **{"fix_type": 0, "lat": 0, "lon": 0, "alt": 0, "eph": _U16, "epv": _U16, "vel": _U16, "cog": _U16},
            **{"satellites_visible": 255, "h_acc": 0, "v_acc": 0},
        },
    ),
    Age("GPS_RAW_INT", Told.COMPASS, {"yaw": _U16}),
    Age("ATTITUDE", Told.COMPASS, {}, ceases=True, note="yaw has no unknown, 0 would be north"),
    Age("ATTITUDE", Told.TILT, {"roll": 0.0, "pitch": 0.0}, AHRS),
    Age("ATTITUDE_QUATERNION", Told.COMPASS, {}, ceases=True),
    Age("ATTITUDE_QUATERNION", Told.TILT, {"q2": 0.0, "q3": 0.0}, AHRS),
    Age("GLOBAL_POSITION_INT", Told.RECEIVER, {}, ceases=True),
    Age("GLOBAL_POSITION_INT", Told.COMPASS, {"hdg": _U16}),
    Age("LOCAL_POSITION_NED", Told.RECEIVER, {}, ceases=True),
    Age("VFR_HUD", Told.RECEIVER, {"airspeed": math.nan, "groundspeed": math.nan, "alt": math.nan}),
    Age("VFR_HUD", Told.COMPASS, {"heading": 0}, MAG, note="the field has no unknown; GLOBAL_POSITION_INT.hdg has"),
    Age("NAV_CONTROLLER_OUTPUT", Told.RECEIVER, {"wp_dist": 0, "xtrack_error": 0.0}, note="as without a path"),
    Age(
        "POSITION_TARGET_GLOBAL_INT",
        Told.RECEIVER,
        {},
        ceases=True,
        note="a vessel without a position makes for nothing",
    ),
    Age("ORBIT_EXECUTION_STATUS", Told.RECEIVER, {}, ceases=True, note="a vessel without a position sails no circle"),
    Age("FIGURE_EIGHT_EXECUTION_STATUS", Told.RECEIVER, {}, ceases=True, note="nor a figure of eight"),
    Age("DISTANCE_SENSOR", Told.SOUNDER, {}, ceases=True),
    Age("ALTITUDE", Told.SOUNDER, {"bottom_clearance": -1.0, "altitude_terrain": -1001.0}),
    Age("ALTITUDE", Told.RECEIVER, {"altitude_amsl": math.nan, "altitude_monotonic": math.nan}),
    Age("WATER_DEPTH", Told.SOUNDER, {"distance": math.nan, "healthy": 0}),
    Age("WATER_DEPTH", Told.RECEIVER, {"lat": 0, "lng": 0, "alt": math.nan}),
    Age("WATER_DEPTH", Told.COMPASS, {"yaw": math.nan}),
    Age("WATER_DEPTH", Told.TILT, {"roll": math.nan, "pitch": math.nan}),
    Age("BATTERY_STATUS", Told.BOARD, {"voltages": _NO_CELLS, "current_battery": -1, "battery_remaining": -1}),
    Age(
        "SERVO_OUTPUT_RAW",
        Told.BOARD,
        {f"servo{number}_raw": 0 for number in range(1, 5)},
        note="a board on level 0 never tells: there they are the pulses that were commanded, and time_usec is 0",
    ),
    Age("SYSTEM_TIME", Told.RECEIVER, {}, note="goes on by the vessel's own clock; 0 before the first date"),
    Age("HOME_POSITION", Told.RECEIVER, {}, note="a place, not a measurement: it stays"),
    Age("GPS_GLOBAL_ORIGIN", Told.RECEIVER, {}, note="a place, not a measurement: it stays"),
    Age(
        "FENCE_STATUS",
        Told.RECEIVER,
        {},
        note="stays; the fence's bit of SYS_STATUS is unhealthy while the fence is on",
    ),
    Age("MISSION_CURRENT", Told.OWN, {}),
    Age("CURRENT_MODE", Told.OWN, {}),
    Age("EXTENDED_SYS_STATE", Told.OWN, {}),
    Age(
        "HIGH_LATENCY2",
        Told.RECEIVER,
        {"latitude": 0, "longitude": 0, "groundspeed": 255, "airspeed": 255, "eph": 255, "failure_flags": 1},
        note="flag 1, GPS",
    ),
    Age("HIGH_LATENCY2", Told.COMPASS, {"heading": 0, "failure_flags": 32}, note="flag 32, magnetometer"),
    Age("HIGH_LATENCY2", Told.TILT, {"custom1": 127}, note="custom0 too under persona generic"),
    Age("HIGH_LATENCY2", Told.SOUNDER, {"failure_flags": 64}, note="flag 64, terrain"),
    Age("HIGH_LATENCY2", Told.BOARD, {"battery": -1, "failure_flags": 1024}, note="flag 1024, engine"),
)
"""Every message of ``streams.STREAMED`` and every source of its values. ``failure_flags`` holds at least the bit given."""


def ages_markdown() -> str:
    """The table for the docs."""
    lines = ["| message | source | when the source is silent |", "| --- | --- | --- |"]
    for age in AGES:
        said = [f"{field} {_figure(value)}" for field, value in age.says.items() if field != "failure_flags"]
        said += ["not sent"] if age.ceases else []
        said += [f"SYS_STATUS: {_bits(age.unhealthy)} not healthy"] if age.unhealthy else []
        said += [age.note] if age.note else []
        lines.append(f"| {age.message} | {age.source.value} | {'; '.join(said) or 'its own state, always true'} |")
    return "\n".join(lines) + "\n"


def _figure(value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return f"all {value[0]:g}"
    return "NaN" if math.isnan(value) else f"{value:g}"


def _bits(bits: int) -> str:
    names = {
        GYRO: "gyro",
        ACCEL: "accelerometer",
        MAG: "magnetometer",
        GPS: "GPS",
        RANGEFINDER: "laser and sonar position",
        MOTORS: "motor outputs",
        AHRS: "AHRS",
        BATTERY: "battery",
    }
    return ", ".join(name for bit, name in names.items() if bits & bit)
