"""Steering by hand: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE to sticks between -1 and 1.

As ArduPilot's Rover reads them: z is the throttle (ahead positive) and y the rudder, so that a station set up for a rover works; r, the
other stick's turn, counts as well, the larger of both wins. The vessel owns the 0.5 s time-out and who may steer.
"""

from __future__ import annotations

from typing import Any, Final

from mavlink_bridge.requests import ManualInput

_INVALID: Final = 0x7FFF
_FULL: Final = 1000.0
_RELEASED: Final = (0, 0xFFFF)


def _axis(value: int) -> float | None:
    """Axis to -1...1; None when the sender has no such axis. Beyond full deflection counts as full."""
    return None if value == _INVALID else max(-1.0, min(1.0, value / _FULL))


def manual_control(message: Any) -> ManualInput | None:
    """MANUAL_CONTROL to sticks; None when the message carries neither throttle nor rudder."""
    surge, steer, turn = _axis(message.z), _axis(message.y), _axis(message.r)
    if surge is None:
        surge = _axis(message.x)
    sides = [side for side in (steer, turn) if side is not None]
    if surge is None or not sides:
        return None
    return ManualInput(surge, max(sides, key=abs), message.get_srcSystem())


def rc_override(message: Any) -> ManualInput | None:
    """RC_CHANNELS_OVERRIDE, channel 1 rudder and 3 throttle; None unless both are given: released or outside 800...2200 us."""
    values_us = (message.chan1_raw, message.chan3_raw)
    if any(value in _RELEASED or not 800 <= value <= 2200 for value in values_us):
        return None
    steer, throttle = (max(-1.0, min(1.0, (value - 1500) / 500.0)) for value in values_us)
    return ManualInput(throttle, steer, message.get_srcSystem())
