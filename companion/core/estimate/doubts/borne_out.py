"""Whether her way still vouches for a compass: it did once, but a gyro that drifts carries a heading away without any leap.

While it vouches, what looks like a wrong heading is a propeller. What a propeller does shows within seconds and is found within some
tens of them. A compass that creeps takes a minute or more, and shows meanwhile as a bow that goes off the course she makes good.
"""

from __future__ import annotations

import cmath
import math
from typing import Final

_VOUCHES_S: Final = 45.0
"""So long a way that fitted counts: the watch over the propellers takes up to 40 s, a gyro that is worth the name creeps 20 degrees."""
_SWINGS_RAD: Final = math.radians(20.0)
"""Sooner, where bow and course have parted by so much since,"""
_SWUNG_S: Final = 10.0
"""for so long: the slip of a turn, and the spin of a propeller that has just failed, are shorter."""
_WAY_MPS: Final = 0.5
"""A slower way over ground has no course that tells of the bow."""
_GOES_SHARE: Final = 0.2
"""A way over ground that is apart from what thrust makes along the bow by no more than this share of it bears the heading out, too,"""
_GOES_S: Final = 10.0
"""for so long, water that makes up for a wrong compass to a fifth, in speed and direction, is rarer than a propeller that fails."""
_NEAR_COS: Final = math.cos(math.radians(40.0))
"""Such a way vouches for headings near it only: a compass that iron has magnetised is right on one heading and wrong on others."""


class BorneOut:
    """The last way that bore the heading out, and what has become of it; one call per fix."""

    def __init__(self) -> None:
        self._age_s: float | None = None
        self._swing: complex | None = None
        self._swung_s = self._goes_s = 0.0
        self._about: complex | None = None
        """The heading that a steady way bore out; None: any, by a way that changed with the thrust."""
        self._is_near = True

    def __bool__(self) -> bool:
        """Whether the heading is vouched for."""
        return self.once and self._age_s is not None and self._age_s < _VOUCHES_S

    @property
    def once(self) -> bool:
        """Whether it was at some time, and bow and course have not parted since."""
        return self._age_s is not None and self._swung_s < _SWUNG_S and self._is_near

    def renew(self) -> None:
        """The way changes with the thrust as the heading says."""
        self._begin(None)

    def _begin(self, about: complex | None) -> None:
        self._age_s, self._swing, self._swung_s = 0.0, None, 0.0
        self._about, self._is_near = about, True

    def step(self, dt_s: float, bow: complex, ground: complex, through: complex) -> None:
        """Take the bow's unit vector, the velocity over ground and the modelled one through the water, NED."""
        goes = abs(through) > _WAY_MPS and abs(ground - through) < _GOES_SHARE * abs(through)
        self._goes_s = self._goes_s + dt_s if goes else 0.0
        if self._goes_s > _GOES_S and not (self and self._about is None):
            self._begin(bow)
        if self._age_s is None:
            return
        self._is_near = self._about is None or (bow * self._about.conjugate()).real > _NEAR_COS
        self._age_s += dt_s
        if abs(ground) < _WAY_MPS:
            return
        swing = ground * bow.conjugate() / abs(ground)
        if self._swing is None:
            self._swing = swing
        is_off = abs(cmath.phase(swing * self._swing.conjugate())) > _SWINGS_RAD
        self._swung_s = self._swung_s + dt_s if is_off else max(0.0, self._swung_s - dt_s)
