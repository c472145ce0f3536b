"""Mode numbers: the only place that knows ArduPilot's Rover numbers, the PX4 layout and MAVLink's standard modes.

Inside there is only ``Mode``. Requests are understood in both encodings whatever the persona, because MAVSDK and
MAVProxy choose by their own rules (gcs.md §2.2, §2.3); what an endpoint *shows* follows its persona.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from ...language.messages import Mode
from ..wire.codec import dialect
from .config import EndpointConfig

_CUSTOM: Final = 1
_AUTO: Final = 4
_GUIDED: Final = 8
_STABILIZE: Final = 16
_MANUAL: Final = 64

STANDARD_NONE: Final = 0
STANDARD_SAFE_RECOVERY: Final = 5
STANDARD_MISSION: Final = 6


@dataclass(frozen=True, slots=True)
class ModeFace:
    """How one mode looks on the wire."""

    mode: Mode
    rover: int
    px4: int
    standard: int
    flags: int
    """MAV_MODE_FLAG bits of HEARTBEAT.base_mode, without SAFETY_ARMED."""


FACES: Final = (
    ModeFace(Mode.MANUAL, 0, 0x00010000, STANDARD_NONE, _CUSTOM | _MANUAL),
    ModeFace(Mode.HOLD, 4, 0x03040000, STANDARD_NONE, _CUSTOM | _STABILIZE | _GUIDED),
    ModeFace(Mode.AUTO, 10, 0x04040000, STANDARD_MISSION, _CUSTOM | _STABILIZE | _AUTO | _GUIDED),
    ModeFace(Mode.RTL, 11, 0x05040000, STANDARD_SAFE_RECOVERY, _CUSTOM | _STABILIZE | _AUTO | _GUIDED),
    ModeFace(Mode.GUIDED, 15, 0x00060000, STANDARD_NONE, _CUSTOM | _STABILIZE | _GUIDED),
    ModeFace(Mode.CIRCLE, 9, 0x01030000, STANDARD_NONE, _CUSTOM | _STABILIZE | _GUIDED),
    ModeFace(Mode.LOITER, 5, 0x02030000, STANDARD_NONE, _CUSTOM | _STABILIZE | _GUIDED),
)
"""In the order of AVAILABLE_MODES. In the PX4 layout Guided is shown as Offboard, Circle and Loiter as kinds of position control."""

_BY_MODE: Final = {face.mode: face for face in FACES}
_ROVER: Final = {face.rover: face.mode for face in FACES} | {12: Mode.RTL}
"""12 is SMART_RTL, which some station buttons send."""
_PX4: Final = {face.px4 >> 16: face.mode for face in FACES} | {
    0x0002: Mode.MANUAL,  # altitude and position control, Acro, Stabilized: what moves a boat by sticks
    0x0003: Mode.MANUAL,
    0x0005: Mode.MANUAL,
    0x0007: Mode.MANUAL,
    0x0304: Mode.HOLD,
    0x0004: Mode.AUTO,
}
_STANDARD: Final = {STANDARD_SAFE_RECOVERY: Mode.RTL, STANDARD_MISSION: Mode.AUTO}


_FOREIGN: Final = {
    1: "Acro",
    3: "Steering",
    6: "Follow",
    7: "Simple",
    8: "Dock",
    16: "Initialising",
    0x0104: "Ready",
    0x0204: "Takeoff",
    0x0604: "Land",
    0x0804: "Follow me",
    0x0904: "Precision land",
}
"""Modes of other vehicles that stations offer: Rover numbers, and PX4 main and sub modes as sub << 8 | main for the rest."""


def foreign_name(number: int, sub: float) -> str:
    """What a station calls a mode that this boat has not."""
    if math.isfinite(sub) and sub > 0.0 and number < 256:
        number |= int(sub) << 8
    elif number >= 0x10000:
        number >>= 16
    return _FOREIGN.get(number, f"mode {number}")


def face(mode: Mode) -> ModeFace:
    return _BY_MODE[mode]


def shows_rover_numbers(config: EndpointConfig) -> bool:
    return config.persona == "ardurover" or config.generic_mode_encoding == "rover"


def custom_mode(mode: Mode, config: EndpointConfig) -> int:
    """Return HEARTBEAT.custom_mode for a mode under this endpoint's persona."""
    shown = _BY_MODE[mode]
    return shown.rover if shows_rover_numbers(config) else shown.px4


def base_mode(mode: Mode, armed: bool) -> int:
    return _BY_MODE[mode].flags | (128 if armed else 0)


def from_set_mode(number: int, sub: float, spare: float) -> Mode | None:
    """Decode MAV_CMD_DO_SET_MODE: param2, param3, param4 (gcs.md §2.4), None for a number that is no mode.

    param3 given means PX4 main and sub mode; a number of 65536 or more is a whole PX4 custom mode; NaN in param4 tells
    MAVSDK, which means PX4 numbers; everything else is ArduPilot's Rover table.
    """
    if number >= 0x10000:
        return from_custom_mode(number)
    if math.isfinite(sub) and sub != 0.0:
        return _PX4.get(int(sub) << 8 | number) if 0 < sub < 256 and number < 256 else None
    if math.isnan(spare):
        return _PX4.get(number)
    return _ROVER.get(number)


def from_custom_mode(number: int) -> Mode | None:
    """Decode a whole custom_mode as in SET_MODE (message 11), in either encoding."""
    if number >= 0x10000:
        return None if number & 0xFFFF else _PX4.get(number >> 16)
    return _ROVER.get(number)


def from_standard(number: int) -> Mode | None:
    """Decode MAV_STANDARD_MODE; None for one that this boat does not have."""
    return _STANDARD.get(number)


def available_modes(index: int, config: EndpointConfig) -> Any:
    """Return AVAILABLE_MODES number ``index``, 1...len(FACES)."""
    shown = FACES[index - 1]
    return dialect.MAVLink_available_modes_message(
        number_modes=len(FACES),
        mode_index=index,
        standard_mode=shown.standard,
        custom_mode=custom_mode(shown.mode, config),
        properties=0,
        mode_name=shown.mode.value.encode(),
    )
