"""Swinging the bow early for a corner in a strong current.

In still water the bow turns by as much as the path does. Where the water is about as fast as the vessel it may have to
turn far more (from drifting down one leg to stemming across the next), and takes longer than the corner lasts. Then the
turn begins before the corner, timed to be over at its end, while the water carries the vessel along.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavlink_bridge.language.units import wrap_pi

from ..estimate import SmoothMotion
from .field import triangle
from .paths import Arc, Chain, Projection


@dataclass(frozen=True, slots=True)
class Wish:
    """What the next leg asks: its speed over ground in this drift, with this vessel."""

    onward_mps: float
    drift: tuple[float, float]
    top_mps: float
    rate_radps: float
    """Yaw rate that the vessel can hold."""


STRONG = 0.4
"""Share of the speed wanted from which on the water is so fast that a corner may need an early swing."""
_EXTRA_RAD = math.radians(25.0)
"""The bow must turn by this much more than the path before the swing begins early."""
_MARGIN_S = 1.0
"""The swing begins so much before it must: late is beside the path, early is only inside the corner."""


@dataclass(frozen=True, slots=True)
class Swing:
    """A heading that is on its way round."""

    psi_rad: float
    rate_radps: float


class EarlySwing:
    """Decides when the bow starts to swing; once begun for a corner, it goes on until that corner is behind."""

    def __init__(self) -> None:
        self._begun: Arc | None = None

    def step(self, track: Chain, here: Projection, motion: SmoothMotion, psi_rad: float, wish: Wish) -> Swing | None:
        """Return the heading to steer when the coming corner needs more time than is left, else None.

        To be asked only in a current of at least ``STRONG`` times the speed wanted.
        """
        found = _corner(track, here)
        if found is None:
            self._begun = None
            return None
        arc, rest_m = found
        onward = triangle(_exit_course(arc), wish.onward_mps, wish.drift, wish.top_mps, wish.top_mps)
        turn = (onward.psi_rad - psi_rad) * arc.sense % (2.0 * math.pi)
        over_ground = math.hypot(motion.vn_mps, motion.ve_mps)
        left_s = max(0.0, rest_m / max(over_ground, 0.3) - _MARGIN_S)
        if self._begun is not arc:
            stems = motion.water_mps < 0.6 * onward.water_mps
            far = turn > 1.6 * math.pi or turn - arc.sweep_rad < _EXTRA_RAD
            if not stems or far or turn < wish.rate_radps * left_s:
                return None
            self._begun = arc
        psi = wrap_pi(onward.psi_rad - arc.sense * wish.rate_radps * left_s)
        return Swing(psi, arc.sense * wish.rate_radps if turn < 1.6 * math.pi else 0.0)


def _corner(track: Chain, here: Projection) -> tuple[Arc, float] | None:
    """The corner under the keel or next ahead on an open track, and the way to its end."""
    if track.closed:
        return None
    rest_m = track.segment.length_m - here.along_m
    for segment in track.segments[track.index : track.index + 2]:
        if isinstance(segment, Arc):
            return segment, rest_m if segment is track.segment else rest_m + segment.length_m
    return None


def _exit_course(arc: Arc) -> float:
    return wrap_pi(arc.start_rad + arc.sense * (arc.sweep_rad + 0.5 * math.pi))
