"""Swinging the bow early for a corner in a current.

In still water the bow turns by as much as the path does. In a current it may have to turn far more (from drifting down one
leg to stemming across the next), and takes longer than the corner lasts. Where a bow that swings as fast as it can would
come round beside the next leg, it swings now, whatever the corner's arc says: the water carries the vessel meanwhile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavlink_bridge.language.units import wrap_pi

from ..estimate import SmoothMotion
from .field import SteeredHeading, triangle
from .paths import Arc, Chain


@dataclass(frozen=True, slots=True)
class Wish:
    """What the next leg asks: its speed over ground in this drift, with this vessel."""

    onward_mps: float
    drift: tuple[float, float]
    top_mps: float
    rate_radps: float
    """Yaw rate that the vessel can hold."""


FELT = 0.2
"""Share of the speed wanted from which on the water is so fast that a corner may need an early swing."""
_ROUND_RAD = math.radians(10.0)
"""The bow is round: what is left is the heading loop's."""
_BACK_RAD = 1.6 * math.pi
"""A turn of more than this is one of a little the other way: the bow is beyond."""
_TURN_S = 2.0
"""What turns a hull for less is a wave."""
_SPARE_M = 0.5
"""A swing is broken off where it would end by more than this on this side of the leg."""
_PARTS = 6
"""In which the way of a swing is summed up: within 2 % of the integral."""


class EarlySwing:
    """Decides when the bow starts to swing; once begun for a corner, it goes on until the bow is round or has time again."""

    def __init__(self) -> None:
        self._begun: Arc | None = None
        self._done: Arc | None = None
        self._whole_rad = self._from_mps = 0.0
        self._turning_radps = 0.0
        self.seen_radps = 0.0
        """Greatest yaw rate that the hull was seen to turn with."""

    def see(self, dt_s: float, r_radps: float) -> None:
        """Take the yaw rate of one tick."""
        self._turning_radps += min(dt_s / _TURN_S, 1.0) * (r_radps - self._turning_radps)
        self.seen_radps = max(self.seen_radps, abs(self._turning_radps))

    def step(self, track: Chain, motion: SmoothMotion, psi_rad: float, wish: Wish) -> tuple[float, float] | None:
        """Return the heading to turn to, rad, and the speed through the water, m/s, when a corner needs more time than is left.

        To be asked only in a current of at least ``FELT`` times the speed wanted.
        """
        arc = _corner(track)
        if arc is None or arc is self._done:
            self._begun = None
            return None
        onward = triangle(_exit_course(arc), wish.onward_mps, wish.drift, wish.top_mps, wish.top_mps)
        turn = (onward.psi_rad - psi_rad) * arc.sense % (2.0 * math.pi)
        if self._begun is arc and not _ROUND_RAD < turn < _BACK_RAD:
            self._begun, self._done = None, arc
            return None
        spare_m = _SPARE_M if self._begun is arc else 0.0
        if turn > _BACK_RAD or _beside_m(arc, motion, psi_rad, turn=turn, onward=onward, wish=wish) < -spare_m:
            self._begun = None
            return None
        if self._begun is not arc:
            self._begun, self._whole_rad, self._from_mps = arc, turn, max(motion.water_mps, 0.0)
        left = min(turn / self._whole_rad, 1.0)
        return onward.psi_rad, self._from_mps * left + onward.water_mps * (1.0 - left)


def _beside_m(
    arc: Arc, motion: SmoothMotion, psi_rad: float, *, turn: float, onward: SteeredHeading, wish: Wish
) -> float:
    """How far beyond the next leg a bow that swings now comes round, m; negative: on this side of it."""
    across = _exit_course(arc) - 0.5 * math.pi * arc.sense
    cos, sin = math.cos(across), math.sin(across)
    north_m, east_m = arc.point(arc.length_m)
    off_m = (north_m - motion.north_m) * cos + (east_m - motion.east_m) * sin
    swung_mps = wish.drift[0] * cos + wish.drift[1] * sin
    for k in range(_PARTS):
        part = (k + 0.5) / _PARTS
        water_mps = max(motion.water_mps, 0.0) * (1.0 - part) + onward.water_mps * part
        swung_mps += water_mps * math.cos(psi_rad + arc.sense * part * turn - across) / _PARTS
    return swung_mps * turn / wish.rate_radps - off_m


def _corner(track: Chain) -> Arc | None:
    """The corner under the keel or next ahead on an open track."""
    if track.closed:
        return None
    return next((part for part in track.segments[track.index : track.index + 2] if isinstance(part, Arc)), None)


def _exit_course(arc: Arc) -> float:
    return wrap_pi(arc.start_rad + arc.sense * (arc.sweep_rad + 0.5 * math.pi))
