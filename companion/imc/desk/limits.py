"""A console's operational limits: the area is the vessel's fence, the least altitude its depth guard's, the greatest speed bounds plans.

What a surface vessel has not, depth and climbing for two, is refused by name. Limits that nobody has set are not claimed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from mavlink_bridge import imc
from mavlink_bridge.language.geodesy import direct
from mavlink_bridge.language.requests import PlanItem
from mavlink_bridge.language.units import rad_to_e7
from mavlink_bridge.mavlink.wire.cmd import Cmd

MIN_ALTITUDE: Final = "DEPTH_MIN"
"""The parameter behind the least altitude."""
_GLOBAL_FRAME: Final = 0
_Mask = imc.LimitsMask
_KNOWN: Final = _Mask.MIN_ALT | _Mask.MAX_SPEED | _Mask.AREA
_LONGEST_M: Final = 100_000.0


@dataclass(frozen=True, slots=True)
class LimitArea:
    """A rectangle about its centre; ``length_m`` lies along ``orientation_rad`` from north."""

    lat_rad: float
    lon_rad: float
    orientation_rad: float
    width_m: float
    length_m: float

    def fence(self) -> tuple[PlanItem, ...]:
        """The rectangle as a fence that the vessel stays inside."""
        half_length, half_width = 0.5 * self.length_m, 0.5 * self.width_m
        corners = (
            (half_length, half_width),
            (half_length, -half_width),
            (-half_length, -half_width),
            (-half_length, half_width),
        )
        items = []
        for along, across in corners:
            bearing_rad = self.orientation_rad + math.atan2(across, along)
            lat_rad, lon_rad = direct(self.lat_rad, self.lon_rad, bearing_rad, math.hypot(along, across))
            items.append(_vertex(lat_rad, lon_rad))
        return tuple(items)


def _vertex(lat_rad: float, lon_rad: float) -> PlanItem:
    return PlanItem(
        command=Cmd.FENCE_POLYGON_INCLUSION,
        frame=_GLOBAL_FRAME,
        param1=4.0,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        x=rad_to_e7(lat_rad),
        y=rad_to_e7(lon_rad),
        z=0.0,
    )


@dataclass(frozen=True, slots=True)
class ConsoleLimits:
    """What a console has set and the vessel has taken. None = not set."""

    max_speed_mps: float | None = None
    area: LimitArea | None = None

    def message(self, min_altitude_m: float | None) -> imc.OperationalLimits:
        """As consoles read it."""
        area = self.area
        mask = _Mask(0)
        mask |= _Mask.MAX_SPEED if self.max_speed_mps is not None else _Mask(0)
        mask |= _Mask.AREA if area is not None else _Mask(0)
        mask |= _Mask.MIN_ALT if min_altitude_m is not None else _Mask(0)
        message = imc.OperationalLimits(
            mask=int(mask), min_altitude_m=min_altitude_m or 0.0, max_speed_mps=self.max_speed_mps or 0.0
        )
        if area is None:
            return message
        return replace(
            message,
            lat_rad=area.lat_rad,
            lon_rad=area.lon_rad,
            orientation_rad=area.orientation_rad,
            width_m=area.width_m,
            length_m=area.length_m,
        )

    def export(self) -> dict[str, Any]:
        area = self.area
        kept = [area.lat_rad, area.lon_rad, area.orientation_rad, area.width_m, area.length_m] if area else None
        return {"max_speed_mps": self.max_speed_mps, "area": kept}


@dataclass(frozen=True, slots=True)
class LimitChange:
    """What an operator should read of one limit. ``weakens``: the vessel may do what it might not before."""

    words: str
    weakens: bool = False


def changes(before: ConsoleLimits, after: ConsoleLimits) -> list[LimitChange]:
    """What of area and speed is otherwise now."""
    found = []
    area, speed_mps = after.area, after.max_speed_mps
    if area is None and before.area is not None:
        found.append(LimitChange("area REMOVED, there is no fence", weakens=True))
    elif area is not None and area != before.area:
        found.append(LimitChange(f"area {area.length_m:g} x {area.width_m:g} m", weakens=before.area is not None))
    if speed_mps is None and before.max_speed_mps is not None:
        found.append(LimitChange("max speed REMOVED", weakens=True))
    elif speed_mps is not None and speed_mps != before.max_speed_mps:
        weakens = before.max_speed_mps is not None and speed_mps > before.max_speed_mps
        found.append(LimitChange(f"max speed {speed_mps:g} m/s", weakens))
    return found


def lowered(before_m: float | None, after_m: float | None) -> list[LimitChange]:
    """What of the least altitude is otherwise now; None: not looked at."""
    if before_m is None or after_m is None or before_m == after_m:
        return []
    return [LimitChange(f"{MIN_ALTITUDE} {before_m:g} -> {after_m:g} m", weakens=after_m < before_m)]


def in_words(changed: Sequence[LimitChange]) -> str:
    """One sentence of them."""
    return ", ".join(each.words for each in changed) or "as they were"


def restored(saved: object) -> ConsoleLimits:
    """Limits out of the store; none from what is none."""
    try:
        speed, area = saved["max_speed_mps"], saved["area"]  # type: ignore[index]
        numbers = [float(value) for value in area] if area is not None else []
        found = LimitArea(*numbers) if area is not None else None
        return ConsoleLimits(None if speed is None else float(speed), found)
    except (KeyError, TypeError, ValueError):
        return ConsoleLimits()


def limits_of(message: imc.OperationalLimits) -> ConsoleLimits:
    """Area and speed of a console's limits. Raises ValueError when any limit in them, the altitude too, is no number or no area."""
    if message.mask & _Mask.MIN_ALT and not math.isfinite(message.min_altitude_m):
        raise ValueError("min altitude is no number")
    speed_mps = message.max_speed_mps if message.mask & _Mask.MAX_SPEED else 0.0
    if not 0.0 <= speed_mps < math.inf:
        raise ValueError(f"max speed {speed_mps:g} m/s is not above 0; leave it out for none")
    return ConsoleLimits(speed_mps or None, area_of(message))


def area_of(message: imc.OperationalLimits) -> LimitArea | None:
    """The area of a console's limits; None when it sets none. Raises ValueError for what is no area."""
    if not message.mask & _Mask.AREA:
        return None
    numbers = (message.lat_rad, message.lon_rad, message.orientation_rad, message.width_m, message.length_m)
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError("the area is not given in finite numbers")
    if (
        abs(message.lat_rad) > 0.5 * math.pi
        or abs(message.lon_rad) > math.pi
        or (message.lat_rad, message.lon_rad) == (0.0, 0.0)
    ):
        raise ValueError("the area's centre is not on the globe")
    if not (0.0 < message.width_m <= _LONGEST_M and 0.0 < message.length_m <= _LONGEST_M):
        raise ValueError(f"the area is {message.length_m:g} by {message.width_m:g} m")
    return LimitArea(*numbers)


def unknown_limits(mask: int) -> str:
    """Names of the limits in a mask that a surface vessel has not; "" for none."""
    left = [each for each in _Mask if mask & each and not each & _KNOWN]
    return ", ".join((each.name or "").lower().replace("_", " ") for each in left)
