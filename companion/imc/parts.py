"""How each part of the vessel is, in words: one IMC entity each, from the bits of SYS_STATUS and the ages of what is heard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.imc import EntityCondition, EntityState

from .picture import ImcPicture
from .power import BATTERY, PORT, RUDDERS, STARBOARD

VEHICLE: Final = "Vehicle Link"
CLOCK: Final = "Clock"
SOUNDER: Final = "Sounder"
FENCE: Final = "Fence"
LOST_US: Final = 5_000_000
"""A vehicle that was not heard for so long is not there."""
_UNKNOWN_MV: Final = 0xFFFF
_FIXES: Final = {2: "2-D fix", 3: "3-D fix", 4: "differential fix", 5: "RTK float", 6: "RTK fixed"}


@dataclass(frozen=True)
class Part:
    """A part that SYS_STATUS has a bit for (MAV_SYS_STATUS_SENSOR)."""

    label: str
    bit: int
    good: str
    bad: str


PARTS: Final = (
    Part("GPS", 0x20, "active", "no usable fix"),
    Part("Compass", 0x04, "active", "no heading"),
    Part("Attitude", 0x200000, "active", "roll, pitch or position missing"),
    Part(SOUNDER, 0x100, "active", "no soundings"),
    Part("Actuators", 0x8000, "active", "the board does not answer or refuses"),
    Part(BATTERY, 0x2000000, "active", "low or not measured"),
    Part(FENCE, 0x100000, "inside", "outside, or its state is not known"),
    Part("Logger", 0x1000000, "writing", "not writing"),
    Part("Arming", 0x10000000, "may be armed", "checks before arming fail; the texts say which"),
)
LABELS: Final = (VEHICLE, CLOCK, *(part.label for part in PARTS), PORT, STARBOARD, RUDDERS)
Told = tuple[str, EntityState]


def parts(picture: ImcPicture, now_us: int, skews: Sequence[str]) -> list[Told]:
    """Every entity's state: (label, state)."""
    found = [(VEHICLE, link_state(picture, now_us)), (CLOCK, clock_state(skews))]
    status = picture.fresh("SYS_STATUS", now_us, LOST_US)
    if status is None or not is_heard(picture, now_us):
        return found
    return found + [(part.label, _part_state(part, status, picture, now_us)) for part in PARTS]


def is_heard(picture: ImcPicture, now_us: int) -> bool:
    """Whether the vehicle is there."""
    heard_us = picture.heard_us()
    return heard_us is not None and now_us - heard_us <= LOST_US


def link_state(picture: ImcPicture, now_us: int) -> EntityState:
    """The MAVLink vehicle: heard, over which way, how long ago."""
    heard_us = picture.heard_us()
    if heard_us is None:
        return EntityState(EntityCondition.BOOT, description="the MAVLink vehicle has not been heard yet")
    if now_us - heard_us > LOST_US:
        silent_s = (now_us - heard_us) * 1e-6
        return EntityState(
            EntityCondition.FAILURE, description=f"the MAVLink vehicle has been silent for {silent_s:.0f} s"
        )
    if not picture.by_radio(now_us):
        return EntityState(EntityCondition.NORMAL, description="heard")
    age_s = picture.age_s(now_us)
    if age_s is None:
        return EntityState(
            EntityCondition.FAULT, description="the gateway has heard nothing of the vessel by radio yet"
        )
    return EntityState(EntityCondition.NORMAL, description=f"heard by radio {age_s:.0f} s ago")


def clock_state(skews: Sequence[str]) -> EntityState:
    """Whether a console's clock differs from ours so far that it shows our values as old."""
    if not skews:
        return EntityState(EntityCondition.NORMAL, description="goes with the consoles'")
    return EntityState(EntityCondition.FAULT, description="; ".join(skews)[:400])


def _part_state(part: Part, status: Any, picture: ImcPicture, now_us: int) -> EntityState:
    if not status.onboard_control_sensors_present & part.bit:
        return _absent(part, picture, now_us)
    if part.label == FENCE and not status.onboard_control_sensors_enabled & part.bit:
        return _unfenced(picture, now_us)
    healthy = bool(status.onboard_control_sensors_health & part.bit)
    words = _more(part, status, picture, now_us) if healthy else ""
    return EntityState(
        EntityCondition.NORMAL if healthy else EntityCondition.ERROR,
        description=words or (part.good if healthy else part.bad),
    )


def _absent(part: Part, picture: ImcPicture, now_us: int) -> EntityState:
    """A part without its bit. Soundings are told of a sounder only: if they come, its guard is what is switched off."""
    if part.label != SOUNDER:
        return EntityState(EntityCondition.NORMAL, description="not fitted")
    if picture.fresh("WATER_DEPTH", now_us) is not None:
        return EntityState(EntityCondition.FAULT, description="fitted, but the depth guard is switched off")
    if picture.by_radio(now_us):
        return EntityState(EntityCondition.NORMAL, description="no depth is told by radio")
    return EntityState(EntityCondition.NORMAL, description="not fitted; no depth guard")


def _unfenced(picture: ImcPicture, now_us: int) -> EntityState:
    """The vehicle keeps inside nothing: it has no fence, or does not heed the one it has."""
    mission = picture.fresh("MISSION_CURRENT", now_us)
    if mission is not None and mission.fence_id:
        return EntityState(EntityCondition.FAULT, description="a fence is aboard, but switched off")
    return EntityState(EntityCondition.NORMAL, description="not told by radio" if picture.by_radio(now_us) else "none")


def _more(part: Part, status: Any, picture: ImcPicture, now_us: int) -> str:
    """What a healthy part has to say beyond that."""
    if part.label == BATTERY and status.voltage_battery != _UNKNOWN_MV:
        left = f", {status.battery_remaining} %" if status.battery_remaining >= 0 else ""
        return f"{status.voltage_battery * 0.001:.1f} V{left}"
    fix = picture.fresh("GPS_RAW_INT", now_us)
    if part.label == "GPS" and fix is not None:
        number = fix.satellites_visible
        return f"{_FIXES.get(fix.fix_type, 'fix')}" + (f", {number} satellites" if number != 255 else "")
    return ""
