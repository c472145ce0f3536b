"""A console's sticks and buttons: the axes that this vessel has, and what they add up to.

Consoles show whatever is announced and send ``Name=value;…``; axes go from -127 to 127, buttons are 0 or 1. A stick that is not moved
may not be repeated, so each axis holds for a while after a message that named it; then it is neutral.
"""

from __future__ import annotations

import math
from typing import Final

ACTIONS: Final = (
    "Exit=Button;Thrust=Axis;Heading=Axis;Port Motor=Axis;Starboard Motor=Axis;"
    "Accelerate=Button;Decelerate=Button;Stop=Button;Ranges=Range127"
)
"""What RemoteActionsRequest is answered with."""
_THRUST: Final = "Thrust"
_HEADING: Final = "Heading"
_PORT: Final = "Port Motor"
_STARBOARD: Final = "Starboard Motor"
_RANGE: Final = 127.0
_STEP: Final = 0.1
"""What one press of Accelerate or Decelerate changes of full thrust."""
_LONGEST: Final = 2048
_REPEAT_US: Final = 200_000
"""Twice within the vessel's 0.5 s."""


class RemoteSticks:
    """The newest sticks of one teleoperation. ``hold_us``: how long each holds without being repeated."""

    def __init__(self, hold_us: int, now_us: int) -> None:
        self._hold_us = hold_us
        self._next_us = now_us
        self._axes: dict[str, tuple[float, int]] = {}
        """Each axis' share, and when it was last named."""
        self._is_stepped = False
        """The thrust is what the buttons have made it: whoever names them names it."""
        self._down: set[str] = set()
        self.has_ended = False
        """The console's Exit was pressed."""

    def take(self, actions: str, now_us: int) -> None:
        """Read ``Name=value;…``; what is not understood is passed over, and makes nothing last longer."""
        self._next_us = now_us
        for part in actions[:_LONGEST].split(";"):
            name, found, text = part.partition("=")
            value = _number(text) if found else None
            if value is not None:
                self._set(name.strip(), value, now_us)

    def due(self, now_us: int) -> tuple[float, float] | None:
        """(surge, yaw), -1...1 each, when they are to be said again; None before."""
        if now_us < self._next_us:
            return None
        self._next_us = now_us + _REPEAT_US
        port, starboard = self._share(_PORT, now_us), self._share(_STARBOARD, now_us)
        surge = self._share(_THRUST, now_us) + 0.5 * (port + starboard)
        yaw = self._share(_HEADING, now_us) + 0.5 * (port - starboard)
        return _limited(surge), _limited(yaw)

    def _share(self, axis: str, now_us: int) -> float:
        """Where an axis stands: in the middle, once nobody has named it for too long."""
        share, named_us = self._axes.get(axis, (0.0, now_us))
        return share if now_us - named_us <= self._hold_us else 0.0

    def _set(self, name: str, value: float, now_us: int) -> None:
        match name:
            case "Thrust" | "Heading" | "Port Motor" | "Starboard Motor":
                self._axes[name] = _limited(value / _RANGE), now_us
                self._is_stepped = self._is_stepped and name != _THRUST
            case "Accelerate" | "Decelerate":
                step = _STEP if name == "Accelerate" else -_STEP
                self._step(step if self._goes_down(name, value > 0.0) else 0.0, now_us)
            case "Stop":
                if self._goes_down(name, value > 0.0):
                    self._axes.clear()
            case "Exit":
                self.has_ended = self.has_ended or self._goes_down(name, value > 0.0)
            case _:
                pass

    def _step(self, step: float, now_us: int) -> None:
        self._is_stepped = self._is_stepped or step != 0.0
        if self._is_stepped:
            self._axes[_THRUST] = _limited(self._share(_THRUST, now_us) + step), now_us

    def _goes_down(self, button: str, down: bool) -> bool:
        """A button counts once, when it goes down."""
        counts = down and button not in self._down
        if down:
            self._down.add(button)
        else:
            self._down.discard(button)
        return counts


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _limited(share: float) -> float:
    return max(-1.0, min(1.0, share))
