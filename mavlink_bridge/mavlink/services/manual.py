"""Steering by hand: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE to sticks between -1 and 1.

As ArduPilot's Rover reads them: z is the throttle (ahead positive) and y the rudder, so that a station set up for a rover works; r, the
other stick's turn, counts as well, the larger of both wins. The vessel owns the 0.5 s time-out and who may steer.
"""

from __future__ import annotations

from typing import Any, Final

from ...language.requests import ManualInput

_INVALID: Final = 0x7FFF
_FULL: Final = 1000.0
_RELEASED: Final = 0
_LEFT_ALONE: Final = 0xFFFF
_KEPT_US: Final = 500_000
"""An axis that is left alone is neutral after this, as sticks are (FS_MAN_TIMEOUT)."""


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


class RcOverride:
    """RC_CHANNELS_OVERRIDE: channel 1 rudder, 3 throttle. One alone moves its axis; the other stays as this sender last set it."""

    def __init__(self) -> None:
        self._last: dict[tuple[int, int, int], tuple[float, int]] = {}
        """By sender's system and component, and channel: the newest value given and when."""

    def take(self, message: Any, now_us: int) -> ManualInput | None:
        """Sticks; None when both channels are released or left alone, or one is outside 800...2200 us."""
        system = message.get_srcSystem()
        given_us = {1: message.chan1_raw, 3: message.chan3_raw}
        if all(value in (_RELEASED, _LEFT_ALONE) for value in given_us.values()):
            return None
        if any(value not in (_RELEASED, _LEFT_ALONE) and not 800 <= value <= 2200 for value in given_us.values()):
            return None
        sender = system, message.get_srcComponent()
        steer, throttle = (self._axis((*sender, channel), value, now_us) for channel, value in given_us.items())
        return ManualInput(throttle, steer, system)

    def _axis(self, axis: tuple[int, int, int], value: int, now_us: int) -> float:
        if value == _LEFT_ALONE:
            last, last_us = self._last.get(axis, (0.0, now_us))
            return last if now_us - last_us <= _KEPT_US else 0.0
        stick = 0.0 if value == _RELEASED else max(-1.0, min(1.0, (value - 1500) / 500.0))
        self._last[axis] = stick, now_us
        return stick
