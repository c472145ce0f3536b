"""Writes NMEA 0183 sentences from SI values: the simulated talkers' pen. None becomes a blank field."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Final

from companion.core.nmea.line import frame
from mavlink_bridge.language.units import E7, mps_to_knots, wrap_2pi
from mavlink_bridge.language.value import value

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_DAY_MS: Final = 86_400_000
# One format and one pass is several times faster than a piece for each field.
_TIME: Final = "%02d%02d%02d.%03d"
_GGA: Final = "%sGGA,%s,%s,%d,%02d,%.1f,%.2f,M,%.2f,M,,"
_POSITION: Final = "%02d%02d.%07d,%s,%03d%02d.%07d,%s"


@value
class FixSentences:
    """What the sentences of one fix share, written once; empty = blank."""

    place: str
    knots: str
    kmh: str
    course: str


NO_FIX: Final = FixSentences("", "", "", "")


def fix_text(lat_rad: float, lon_rad: float, sog_mps: float, cog_rad: float | None) -> FixSentences:
    """A fix as its sentences show it; None: no course, as at rest."""
    knots, kmh = f"{mps_to_knots(sog_mps):.3f}", f"{sog_mps * 3.6:.3f}"
    return FixSentences(position(lat_rad, lon_rad), knots, kmh, degrees(cog_rad))


def time_fields(utc_us: int) -> tuple[str, str, str, str, str]:
    """(hhmmss.ss, dd, mm, yyyy, ddmmyy), with a third decimal when it is needed, to the nearest millisecond."""
    days, milliseconds = divmod((utc_us + 500) // 1000, _DAY_MS)
    minutes, milliseconds = divmod(milliseconds, 60_000)
    seconds, milliseconds = divmod(milliseconds, 1000)
    moment = _TIME % (minutes // 60, minutes % 60, seconds, milliseconds)
    return (moment if milliseconds % 10 else moment[:-1], *_date_fields(days))


@lru_cache(maxsize=4)
def _date_fields(days: int) -> tuple[str, str, str, str]:
    """(dd, mm, yyyy, ddmmyy) of a day since 1970; formatting it anew for each fix costs more than all the rest of it."""
    moment = _EPOCH + timedelta(days=days)
    return f"{moment:%d}", f"{moment:%m}", f"{moment:%Y}", f"{moment:%d%m%y}"


def zda(talker: str, time: tuple[str, str, str, str, str]) -> bytes:
    return frame(f"{talker}ZDA,{time[0]},{time[1]},{time[2]},{time[3]},00,00")


def gga(
    talker: str,
    hhmmss: str,
    fix: FixSentences,
    quality: int,
    satellites: int,
    hdop: float,
    height_msl_m: float,
    geoid_m: float,
) -> bytes:
    """A fix; without a position the fields stay blank, as receivers send before their first fix."""
    if not fix.place:
        return frame(f"{talker}GGA,{hhmmss},,,,,0,00,99.9,,M,,M,,")
    return frame(_GGA % (talker, hhmmss, fix.place, quality, satellites, hdop, height_msl_m, geoid_m))


def rmc(
    talker: str, time: tuple[str, str, str, str, str], fix: FixSentences, variation_rad: float | None, mode: str
) -> bytes:
    if not fix.place:
        return frame(f"{talker}RMC,{time[0]},V,,,,,,,{time[4]},,,N")
    return frame(
        f"{talker}RMC,{time[0]},A,{fix.place},{fix.knots},{fix.course},{time[4]},{east_west(variation_rad)},{mode}"
    )


def vtg(talker: str, fix: FixSentences, mode: str) -> bytes:
    if not fix.knots:
        return frame(f"{talker}VTG,,T,,M,,N,,K,N")
    return frame(f"{talker}VTG,{fix.course},T,,M,{fix.knots},N,{fix.kmh},K,{mode}")


def gst(talker: str, hhmmss: str, sigma_m: float, sigma_up_m: float) -> bytes:
    side = sigma_m / math.sqrt(2.0)
    return frame(f"{talker}GST,{hhmmss},,,,,{side:.3f},{side:.3f},{sigma_up_m:.3f}")


def heading(talker: str, kind: str, psi_rad: float | None, variation_rad: float | None) -> bytes:
    """HDT and THS carry the true heading; HDG and HDM the magnetic one (``psi_rad`` less the variation)."""
    if kind == "HDT":
        return frame(f"{talker}HDT,{degrees(psi_rad)},T")
    if kind == "THS":
        return frame(f"{talker}THS,{degrees(psi_rad)},{'V' if psi_rad is None else 'A'}")
    magnetic = None if psi_rad is None else psi_rad - (variation_rad or 0.0)
    if kind == "HDM":
        return frame(f"{talker}HDM,{degrees(magnetic)},M")
    if kind == "HDG":
        return frame(f"{talker}HDG,{degrees(magnetic)},,,{east_west(variation_rad)}")
    raise ValueError(f"no heading sentence {kind!r}")


def rot(talker: str, r_radps: float) -> bytes:
    """Degrees per minute, two decimals: 3e-6 rad/s."""
    return frame(f"{talker}ROT,{math.degrees(r_radps) * 60.0:.2f},A")


def attitude(kind: str, hhmmss: str, psi_rad: float | None, phi_rad: float, theta_rad: float) -> bytes:
    """PASHR, PSAT (HPR) or PSXN (23): heading, roll, pitch."""
    true, roll, pitch = degrees(psi_rad), math.degrees(phi_rad), math.degrees(theta_rad)
    if kind == "PASHR":
        return frame(f"PASHR,{hhmmss},{true},T,{roll:+.3f},{pitch:+.3f},,0.050,0.050,0.200,1,0")
    if kind == "PSAT":
        return frame(f"PSAT,HPR,{hhmmss},{true},{pitch:.3f},{roll:.3f},N")
    if kind == "PSXN":
        return frame(f"PSXN,23,{roll:.3f},{pitch:.3f},{true},0.00")
    raise ValueError(f"no attitude sentence {kind!r}")


def depth(talker: str, kind: str, value_m: float | None, offset_m: float, range_m: float) -> bytes:
    """DPT or DBT; None = no bottom found."""
    if kind == "DPT":
        shown = "" if value_m is None else f"{value_m:.2f}"
        return frame(f"{talker}DPT,{shown},{offset_m:.2f},{range_m:.1f}")
    if kind == "DBT":
        if value_m is None:
            return frame(f"{talker}DBT,,f,,M,,F")
        return frame(f"{talker}DBT,{value_m / 0.3048:.2f},f,{value_m:.2f},M,{value_m / 1.8288:.2f},F")
    raise ValueError(f"no depth sentence {kind!r}")


def degrees(angle_rad: float | None) -> str:
    """Compass degrees [0, 360), three decimals: finer than any compass, so that noise is the only noise."""
    if angle_rad is None:
        return ""
    text = f"{math.degrees(wrap_2pi(angle_rad)):.3f}"
    return "0.000" if text == "360.000" else text


def east_west(angle_rad: float | None) -> str:
    if angle_rad is None:
        return ","
    return f"{abs(math.degrees(angle_rad)):.1f},{'E' if angle_rad >= 0.0 else 'W'}"


def position(lat_rad: float, lon_rad: float) -> str:
    """``ddmm.mmmmmmm,N,dddmm.mmmmmmm,E``: seven decimals of a minute, 0.2 mm."""
    north, east = "N" if lat_rad >= 0.0 else "S", "E" if lon_rad >= 0.0 else "W"
    return _POSITION % (*_minutes(lat_rad), north, *_minutes(lon_rad), east)


def _minutes(angle_rad: float) -> tuple[int, int, int]:
    """Degrees, minutes and 1e-7 minutes. Rounding the whole angle first keeps 59.99999999 from becoming 60."""
    minutes, fraction = divmod(round(abs(math.degrees(angle_rad)) * 60.0 * E7), 10**7)
    return minutes // 60, minutes % 60, fraction
