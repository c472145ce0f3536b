"""Read-only parameters that an ArduPilot Rover would have and that stations look for; without them QGC nags at each connect.

They say what is true of this boat in ArduPilot's words (no receiver, no compass of its own to calibrate, no battery sensor to set up) and
change nothing. A page of Vehicle Setup that misses one of them opens with an error box (tests/qgc_buttons.py has the lists).
"""

from __future__ import annotations

from typing import Final

from ..persona import ParamInfo

_TEXT: Final = "For ground stations that expect ArduPilot; read-only and without effect."
_CHANNELS: Final = 16
_HOLD: Final = 4.0
"""Rover's mode number. Without a receiver no switch chooses a mode; the page that shows six of them shows the mildest."""


def _values() -> dict[str, float]:
    values: dict[str, float] = {"RCMAP_ROLL": 1, "RCMAP_PITCH": 2, "RCMAP_THROTTLE": 3, "RCMAP_YAW": 4}
    for channel in range(1, 9):
        values |= {f"RC{channel}_MIN": 1000, f"RC{channel}_MAX": 2000, f"RC{channel}_TRIM": 1500}
    for channel in range(1, _CHANNELS + 1):
        values |= {f"RC{channel}_REVERSED": 0, f"RC{channel}_OPTION": 0}
    values |= {f"MODE{number}": _HOLD for number in range(1, 7)}
    for suffix in ("", "2", "3"):
        values |= {f"COMPASS_DEV_ID{suffix}": 1 if not suffix else 0, f"COMPASS_USE{suffix}": 0}
        values |= {f"COMPASS_OFS{suffix}_{axis}": 1 if not suffix else 0 for axis in "XYZ"}
    values |= {f"INS_ACCOFFS_{axis}": 0.001 for axis in "XYZ"}
    return values | {"FRAME_CLASS": 2, "COMPASS_DEC": 0, "AHRS_ORIENTATION": 0, "BATT_MONITOR": 0}


_CHOICES: Final[dict[str, tuple[tuple[float, str], ...]]] = {
    "FRAME_CLASS": ((2, "Boat"),),
    "BATT_MONITOR": ((0, "No sensor that a station could set up"),),
    "AHRS_ORIENTATION": ((0, "None"),),
    **{f"MODE{number}": ((_HOLD, "Hold"),) for number in range(1, 7)},
}
"""Only what is true can be chosen: the page then shows a word, and offers no other."""


def _stub(name: str, value: float) -> ParamInfo:
    return ParamInfo(name, value, text=_TEXT, read_only=True, group="Compatibility", choices=_CHOICES.get(name, ()))


COMMON_STUBS: Final = (
    ParamInfo(
        "ARMING_CHECK",
        1.0,
        text="All checks before arming are on, always; read-only.",
        read_only=True,
        group="Compatibility",
    ),
)
"""MAVProxy says 'Arming checks disabled' at each arming of a vehicle without it."""

ROVER_STUBS: Final = COMMON_STUBS + tuple(_stub(name, value) for name, value in _values().items())
