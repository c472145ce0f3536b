"""A console's sticks and buttons: the axes that this vessel has, and what they add up to.

Consoles show whatever is announced and send ``Name=value;…``; axes go from -127 to 127, buttons are 0 or 1. A stick that is not moved
may not be repeated, so the last ones hold for a while; then all is neutral.
"""

from __future__ import annotations

import math
from typing import Final

ACTIONS: Final = (
    "Exit=Button;Thrust=Axis;Heading=Axis;Port Motor=Axis;Starboard Motor=Axis;"
    "Accelerate=Button;Decelerate=Button;Stop=Button;Ranges=Range127"
)
"""What RemoteActionsRequest is answered with."""
_RANGE: Final = 127.0
_STEP: Final = 0.1
"""What one press of Accelerate or Decelerate changes of full thrust."""
_LONGEST: Final = 2048
_REPEAT_US: Final = 200_000
"""Twice within the vessel's 0.5 s."""


class RemoteSticks:
    """The newest sticks of one teleoperation. ``hold_us``: how long they hold without being repeated."""

    def __init__(self, hold_us: int, now_us: int) -> None:
        self._hold_us = hold_us
        self._heard_us = now_us
        self._next_us = now_us
        self._thrust = 0.0
        self._heading = 0.0
        self._motors: dict[str, float] = {}
        self._down: set[str] = set()
        self.has_ended = False
        """The console's Exit was pressed."""

    def take(self, actions: str, now_us: int) -> None:
        """Read ``Name=value;…``; what is not understood is passed over."""
        self._heard_us = self._next_us = now_us
        for part in actions[:_LONGEST].split(";"):
            name, found, text = part.partition("=")
            value = _number(text) if found else None
            if value is not None:
                self._set(name.strip(), value)

    def due(self, now_us: int) -> tuple[float, float] | None:
        """(surge, yaw), -1...1 each, when they are to be said again; None before."""
        if now_us < self._next_us:
            return None
        self._next_us = now_us + _REPEAT_US
        if now_us - self._heard_us > self._hold_us:
            self._neutral()
        surge, yaw = self._thrust, self._heading
        if self._motors:
            port, starboard = self._motors.get("Port Motor", 0.0), self._motors.get("Starboard Motor", 0.0)
            surge += 0.5 * (port + starboard)
            yaw += 0.5 * (port - starboard)
        return _limited(surge), _limited(yaw)

    def _set(self, name: str, value: float) -> None:
        share = _limited(value / _RANGE)
        match name:
            case "Thrust":
                self._thrust = share
            case "Heading":
                self._heading = share
            case "Port Motor" | "Starboard Motor":
                self._motors[name] = share
            case "Accelerate" | "Decelerate" | "Stop" | "Exit":
                self._press(name, value > 0.0)
            case _:
                pass

    def _press(self, name: str, down: bool) -> None:
        """A button counts once, when it goes down."""
        if down and name not in self._down:
            match name:
                case "Accelerate":
                    self._thrust = _limited(self._thrust + _STEP)
                case "Decelerate":
                    self._thrust = _limited(self._thrust - _STEP)
                case "Stop":
                    self._neutral()
                case _:
                    self.has_ended = True
        if down:
            self._down.add(name)
        else:
            self._down.discard(name)

    def _neutral(self) -> None:
        self._thrust = self._heading = 0.0
        self._motors.clear()


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _limited(share: float) -> float:
    return max(-1.0, min(1.0, share))
