"""Read-only parameters that an ArduPilot Rover would have and that stations look for; without them QGC nags at each connect.

They say what is true of this boat in ArduPilot's words (no receiver, no compass of its own to calibrate) and change nothing.
"""

from __future__ import annotations

from typing import Final

from ..persona import ParamInfo

_TEXT: Final = "For ground stations that expect ArduPilot; read-only and without effect."


def _values() -> dict[str, float]:
    values: dict[str, float] = {"RCMAP_ROLL": 1, "RCMAP_PITCH": 2, "RCMAP_THROTTLE": 3, "RCMAP_YAW": 4}
    for channel in range(1, 9):
        values |= {f"RC{channel}_MIN": 1000, f"RC{channel}_MAX": 2000, f"RC{channel}_TRIM": 1500}
    for suffix in ("", "2", "3"):
        values |= {f"COMPASS_DEV_ID{suffix}": 1 if not suffix else 0, f"COMPASS_USE{suffix}": 0}
        values |= {f"COMPASS_OFS{suffix}_{axis}": 1 if not suffix else 0 for axis in "XYZ"}
    values |= {f"INS_ACCOFFS_{axis}": 0.001 for axis in "XYZ"}
    values |= {"FRAME_CLASS": 2}
    return values


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

ROVER_STUBS: Final = COMMON_STUBS + tuple(
    ParamInfo(name, value, text=_TEXT, read_only=True, group="Compatibility") for name, value in _values().items()
)
