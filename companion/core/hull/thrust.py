"""The propellers' law: from a command to revolutions, and from revolutions and speed to thrust, and back.

The only place where it stands: simulator, observer, allocation, statics, stopping distance and design tools ask here.
Thrust follows the linear part of the propeller's open-water curve (Fossen, Handbook of Marine Craft, propulsion):
``T = F (n² - loss n u)`` with n the share of full revolutions and u the speed towards which the propeller pushes; at rest
the command sets ``n² = c^exponent``, or what a table says.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from typing import Final

from .vessel_file import VesselConfig

_SOFT: Final = 0.01
"""Share of full thrust below which the inverse is a straight line: its slope would be infinite at zero."""
_SOFT_ROOT: Final = math.sqrt(_SOFT)


@dataclass(frozen=True, slots=True)
class Side:
    """Bollard thrust of one side at full command, N, both positive."""

    ahead_n: float
    astern_n: float


class ThrustLaw:
    """The thrusters of one vessel. Holds no state; a single thruster counts as two halves on the centre line."""

    __slots__ = ("_ahead", "_astern", "_curve", "_dead_band", "_loss", "plain", "sides")

    def __init__(self, vessel: VesselConfig) -> None:
        thruster = vessel.thruster
        half = 0.5 if thruster.count == 1 else 1.0
        port = Side(thruster.ahead_n * half, thruster.astern_n * half)
        share = thruster.starboard_share if thruster.count == 2 else 1.0
        self.sides = (port, Side(port.ahead_n * share, port.astern_n * share))
        """Port, starboard."""
        self._dead_band = thruster.dead_band
        self._ahead = 0.5 * thruster.exponent
        self._astern = 0.5 * (thruster.exponent if thruster.exponent_astern is None else thruster.exponent_astern)
        self._loss = thruster.speed_loss
        self._curve = _Curve(thruster.curve) if thruster.curve else None
        self.plain = self._curve is None and self._ahead == self._astern == 1.0 and not self._loss
        """Thrust is the square of the command and nothing else: for those who ask at 100 Hz."""

    @property
    def ahead_n(self) -> float:
        """What each side can give ahead, N: the weaker one's."""
        return min(self.sides[0].ahead_n, self.sides[1].ahead_n)

    @property
    def astern_n(self) -> float:
        """What each side can give astern, N, positive: the weaker one's."""
        return min(self.sides[0].astern_n, self.sides[1].astern_n)

    @property
    def all_ahead_n(self) -> float:
        """Bollard thrust of all at full ahead, N."""
        return self.sides[0].ahead_n + self.sides[1].ahead_n

    @property
    def all_astern_n(self) -> float:
        """Bollard thrust of all at full astern, N, positive."""
        return self.sides[0].astern_n + self.sides[1].astern_n

    @property
    def loss(self) -> float:
        """Share of the bollard thrust lost for each m/s ahead at full revolutions."""
        return self._loss

    def revs(self, command: float) -> float:
        """Return the share of full revolutions, -1...1, that a command -1...1 settles at."""
        band = self._dead_band
        if -band < command < band:
            return 0.0
        if self._curve is not None:
            share = self._curve.share(command)
            return math.copysign(math.sqrt(abs(share)), share)
        power = self._ahead if command > 0.0 else self._astern
        return command if power == 1.0 else math.copysign(abs(command) ** power, command)

    def thrust_n(self, side: int, revs: float, surge_mps: float) -> float:
        """Return the thrust of a side (0 port, 1 starboard), N, at revolutions -1...1 and a speed through the water."""
        give = self.sides[side]
        if revs > 0.0:
            slip = self._loss * surge_mps if surge_mps > 0.0 else 0.0
            return give.ahead_n * revs * (revs - slip) if revs > slip else 0.0
        size, slip = -revs, -self._loss * surge_mps if surge_mps < 0.0 else 0.0
        return -give.astern_n * size * (size - slip) if size > slip else 0.0

    def command(self, side: int, force_n: float, surge_mps: float) -> float:
        """Return the command -1...1 for a thrust of a side, N: the inverse of both laws, saturated; straight through zero."""
        full = self.sides[side].ahead_n if force_n > 0.0 else self.sides[side].astern_n
        share = abs(force_n) / full
        if share > 1.0:
            share = 1.0
        if self.plain:
            return math.copysign(math.sqrt(share) if share > _SOFT else share / _SOFT_ROOT, force_n)
        towards = surge_mps if force_n > 0.0 else -surge_mps
        slip = self._loss * towards if towards > 0.0 else 0.0
        if share > _SOFT:
            return self._command(share, slip, force_n)
        return self._command(_SOFT, slip, force_n) * (share / _SOFT)

    def _command(self, share: float, slip: float, sense: float) -> float:
        revs = math.sqrt(share) if slip == 0.0 else 0.5 * (slip + math.sqrt(slip * slip + 4.0 * share))
        if revs > 1.0:
            revs = 1.0
        if self._curve is not None:
            return self._curve.command(math.copysign(revs * revs, sense))
        power = self._ahead if sense > 0.0 else self._astern
        return math.copysign(revs if power == 1.0 else revs ** (1.0 / power), sense)

    def most_command(self, share: float) -> float:
        """Return the greatest command 0...1 at which no side gives more than this share 0...1 of its full thrust, ahead or astern."""
        if not share > 0.0:
            return 0.0
        return 1.0 if share >= 1.0 else min(self._command(share, 0.0, 1.0), -self._command(share, 0.0, -1.0))

    def steady_loss(self, revs: float) -> float:
        """Return what the loss adds to the linear drag at revolutions ahead, N/(m/s)."""
        return self.all_ahead_n * self._loss * revs


class _Curve:
    """Share of full thrust over command, straight between points, through zero."""

    def __init__(self, points: tuple[tuple[float, float], ...]) -> None:
        self._commands = [command for command, _ in points]
        self._shares = [share for _, share in points]

    def share(self, command: float) -> float:
        return _between(self._commands, self._shares, command)

    def command(self, share: float) -> float:
        return _between(self._shares, self._commands, share)


def _between(xs: list[float], ys: list[float], x: float) -> float:
    k = min(max(bisect.bisect_right(xs, x) - 1, 0), len(xs) - 2)
    part = (x - xs[k]) / (xs[k + 1] - xs[k])
    return ys[k] + min(1.0, max(0.0, part)) * (ys[k + 1] - ys[k])
