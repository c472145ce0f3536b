"""Scaling between the vocabulary and MAVLink fields: centidegrees, percents, sentinels. 1e7 itself is ``language.units``'s.

One function per kind of field. Into MAVLink: ``None``, NaN and infinity become the field's "unknown", values outside the field's range are
limited to it, so that no state of the vessel can raise while it is being told. Out of MAVLink: sentinels become ``None``.
Sources: MAVLink common.xml (units, invalid values) and the field table of ``docs/IMC.md``.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.language.units import E7, e7_to_rad

INT8_UNKNOWN: Final = 127
UINT8_UNKNOWN: Final = 255
INT16_MAX: Final = 32_767
UINT16_UNKNOWN: Final = 65_535
INT32_UNKNOWN: Final = 0x7FFF_FFFF
UINT32_MAX: Final = 0xFFFF_FFFF
NAN: Final = float("nan")


def _scaled(value: float | None, factor: float, low: int, high: int, unknown: int) -> int:
    """Scale, round to nearest and limit to [low, high]; what is not finite gives ``unknown``."""
    if value is None:
        return unknown
    scaled = value * factor
    if low <= scaled <= high:
        return round(scaled)
    if not math.isfinite(value):
        return unknown
    return low if scaled < low else high


# Positions


def rad_to_degE7(angle_rad: float | None, unknown: int = INT32_UNKNOWN) -> int:  # noqa: N802 - MAVLink's name of the unit
    """Latitude or longitude in rad to degrees * 1e7 (int32, 1.1 cm).

    ``unknown``: INT32_MAX where the definition says so (commands, set-points), 0 for GPS_RAW_INT and GLOBAL_POSITION_INT.
    """
    if angle_rad is None:
        return unknown
    return _scaled(math.degrees(angle_rad), E7, -1_800_000_000, 1_800_000_000, unknown)


def degE7_to_rad(value: int) -> float | None:  # noqa: N802
    """Degrees * 1e7 to rad; None for INT32_MAX and INT32_MIN (not given)."""
    if value >= INT32_UNKNOWN or value <= -INT32_UNKNOWN:
        return None
    return e7_to_rad(value)


def deg_to_degE7(angle_deg: float) -> int:  # noqa: N802
    """Degrees, as in files and float messages, to degrees * 1e7; INT32_MAX when not finite or out of range."""
    scaled = angle_deg * E7
    if not math.isfinite(scaled) or abs(scaled) >= INT32_UNKNOWN:
        return INT32_UNKNOWN
    return round(scaled)


# Angles


def rad_to_cdeg(angle_rad: float | None) -> int:
    """Heading or course in rad to centidegrees 0...35999; unknown 65535."""
    if angle_rad is None or not math.isfinite(angle_rad):
        return UINT16_UNKNOWN
    return round(math.degrees(angle_rad) % 360.0 * 100.0) % 36_000


def rad_to_yaw_cdeg(angle_rad: float | None, *, fitted: bool = True) -> int:
    """GPS_RAW_INT.yaw: 1...36000 centidegrees with north = 36000; 0 = no compass, 65535 = none just now."""
    if not fitted:
        return 0
    value = rad_to_cdeg(angle_rad)
    return 36_000 if value == 0 else value


def rad_to_deg(angle_rad: float | None, unknown: int = 0) -> int:
    """Bearing in rad to whole degrees 0...359 (VFR_HUD.heading, NAV_CONTROLLER_OUTPUT)."""
    if angle_rad is None or not math.isfinite(angle_rad):
        return unknown
    return round(math.degrees(angle_rad) % 360.0) % 360


def rad_to_deg_half(angle_rad: float | None) -> int:
    """HIGH_LATENCY2 headings: degrees / 2, 0...179; unknown 0."""
    return rad_to_deg(angle_rad) // 2


def rad_to_deg_i8(angle_rad: float | None) -> int:
    """Roll or pitch in whole degrees in an int8 (HIGH_LATENCY2.custom0, custom1); unknown 127."""
    return _scaled(None if angle_rad is None else math.degrees(angle_rad), 1.0, -127, 126, INT8_UNKNOWN)


def deg_to_rad(angle_deg: float) -> float | None:
    """Degrees in a float field to rad in [-pi, pi); None when NaN or infinite."""
    if not math.isfinite(angle_deg):
        return None
    return math.radians((angle_deg + 180.0) % 360.0 - 180.0)


# Speeds and lengths


def mps_to_cms(speed_mps: float | None) -> int:
    """Speed to cm/s in a uint16 (GPS_RAW_INT.vel); unknown 65535."""
    return _scaled(speed_mps, 100.0, 0, UINT16_UNKNOWN - 1, UINT16_UNKNOWN)


def mps_to_cms_signed(speed_mps: float | None, unknown: int = 0) -> int:
    """Velocity to cm/s in an int16 (GLOBAL_POSITION_INT.vx)."""
    return _scaled(speed_mps, 100.0, -INT16_MAX, INT16_MAX, unknown)


def mps_to_fifths(speed_mps: float | None) -> int:
    """HIGH_LATENCY2 speeds: m/s * 5 in a uint8; unknown 255."""
    return _scaled(speed_mps, 5.0, 0, UINT8_UNKNOWN - 1, UINT8_UNKNOWN)


def offset_m(from_lat_rad: float, from_lon_rad: float, lat_rad: float, lon_rad: float) -> tuple[float, float]:
    """Metres north and east of one place to another in the first one's plane on WGS-84, to 0.1 m within 5 km."""
    middle_rad = 0.5 * (from_lat_rad + lat_rad)
    per_lat, per_lon = metres_per_radian(middle_rad)
    east_rad = math.remainder(lon_rad - from_lon_rad, math.tau)
    north_m, east_m = per_lat * (lat_rad - from_lat_rad), per_lon * east_rad
    turn_rad = (
        0.5 * east_rad * math.sin(middle_rad)
    )  # meridians converge: half way north is not where it was at the start
    return north_m + turn_rad * east_m, east_m - turn_rad * north_m


def m_to_mm(length_m: float | None, unknown: int = 0) -> int:
    """Metres to mm in an int32 (altitudes)."""
    return _scaled(length_m, 1000.0, -INT32_UNKNOWN, INT32_UNKNOWN, unknown)


def m_to_mm_u32(length_m: float | None) -> int:
    """Accuracy in mm in a uint32 (GPS_RAW_INT.h_acc); unknown 0."""
    return _scaled(length_m, 1000.0, 0, UINT32_MAX, 0)


def m_to_cm(length_m: float | None) -> int:
    """DISTANCE_SENSOR distances: cm in a uint16, 655.35 m and more saturate; unknown 0."""
    return _scaled(length_m, 100.0, 0, UINT16_UNKNOWN, 0)


def m_to_m16(length_m: float | None) -> int:
    """Whole metres in a uint16 (NAV_CONTROLLER_OUTPUT.wp_dist); unknown 0."""
    return _scaled(length_m, 1.0, 0, UINT16_UNKNOWN, 0)


def m_to_dam(length_m: float | None) -> int:
    """HIGH_LATENCY2.target_distance: decametres in a uint16; unknown 0."""
    return _scaled(length_m, 0.1, 0, UINT16_UNKNOWN, 0)


def m_to_m_i16(length_m: float | None) -> int:
    """HIGH_LATENCY2.altitude: whole metres in an int16; unknown 0."""
    return _scaled(length_m, 1.0, -INT16_MAX, INT16_MAX, 0)


def m_to_dm(length_m: float | None) -> int:
    """HIGH_LATENCY2.eph: decimetres in a uint8; unknown 255."""
    return _scaled(length_m, 10.0, 0, UINT8_UNKNOWN - 1, UINT8_UNKNOWN)


def bottom_clearance_m(altitude_m: float | None) -> float:
    """ALTITUDE.bottom_clearance: metres above the bottom, -1 when not measured (IMC: negative = invalid)."""
    if altitude_m is None or not math.isfinite(altitude_m):
        return -1.0
    return max(altitude_m, 0.0)


# Shares, quality, electricity, time


def dop_to_u16(dop: float | None) -> int:
    """Dilution of precision * 100 (GPS_RAW_INT.eph, epv); unknown 65535."""
    return _scaled(dop, 100.0, 0, UINT16_UNKNOWN - 1, UINT16_UNKNOWN)


def count_to_u8(count: int | None) -> int:
    """Satellites visible; unknown 255."""
    return UINT8_UNKNOWN if count is None else min(max(count, 0), UINT8_UNKNOWN - 1)


def share_to_percent(share: float | None, unknown: int = -1) -> int:
    """0...1 to 0...100 % (battery remaining; unknown -1)."""
    return _scaled(share, 100.0, 0, 100, unknown)


def quality_to_percent(quality: float | None) -> int:
    """DISTANCE_SENSOR.signal_quality of a valid reading: 2...100; 0 = unknown (1 would call the reading invalid)."""
    if quality is None or not math.isfinite(quality):
        return 0
    return round(min(max(1.0 + 99.0 * quality, 2.0), 100.0))


def thrust_to_percent(thrust: float | None) -> int:
    """Forward share of full thrust to VFR_HUD.throttle, 0...100 %: the field has no astern."""
    return _scaled(thrust, 100.0, 0, 100, 0)


def share_to_permille(share: float | None) -> int:
    """SYS_STATUS.load: 0...1 to 0...1000."""
    return _scaled(share, 1000.0, 0, 1000, 0)


def v_to_mv(voltage_v: float | None) -> int:
    """Volts to mV in a uint16 (SYS_STATUS, BATTERY_STATUS); unknown 65535."""
    return _scaled(voltage_v, 1000.0, 0, UINT16_UNKNOWN - 1, UINT16_UNKNOWN)


def a_to_ca(current_a: float | None) -> int:
    """Amperes to cA in an int16; unknown -1."""
    return _scaled(current_a, 100.0, -INT16_MAX, INT16_MAX, -1)


def boot_ms(now_us: int) -> int:
    """Monotonic microseconds to time_boot_ms, a uint32 that wraps after 49.7 days."""
    return now_us // 1000 & UINT32_MAX


def value_or_nan(value: float | None) -> float:
    """A float field whose unknown is NaN."""
    return NAN if value is None else value
