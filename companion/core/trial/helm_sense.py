"""Whether a vessel turns against the trial's helm: leads changed over, a rudder servo mounted mirrored, a sign that is wrong.

A trial is often a boat's first voyage, and its sticks show which way she turns. One that turns against a helm that has been held for
a while, and turns no slower for it, is no boat to be sailed home: each stick would send her away. Turns that a helm only begins to
take off, as in a zig-zag, count for neither side; nor does what is done astern, where rudders work the other way. A hull that turns
away by herself does so for a while with the right helm, too: of her more is asked.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

_HELM: Final = 0.4
"""Less helm does not rule a hull that turns by itself."""
_HELD_S: Final = 2.0
"""A helm works by then, of slow servos and propellers, too, and a turn against it is seen to grow or to die away."""
_DIES: Final = 0.9
"""A rate that is less than this share of the one before the helm was held so long dies away."""
_TURNS_RADPS: Final = math.radians(2.0)
"""Slower is waves."""
_AGAINST_RAD: Final = math.radians(60.0)
"""A gust that turns the bow at half throttle is over by then, and wind turns a bow no further than to itself."""
_TURNS_AWAY_RAD: Final = 4.0
"""The same of a hull that her file says turns away by herself: light twins without rudders spun by half a turn against half helm."""
_WITH: Final = 3.0
"""Turned so many times as far against the helm as with it."""
_ASTERN_MPS: Final = -0.1
"""More than the water's noise."""


class HelmSense:
    """One trial's helm; one call per tick."""

    def __init__(self, *, turns_away: bool) -> None:
        """``turns_away``: the hull does so by herself."""
        self._least_rad = _TURNS_AWAY_RAD if turns_away else _AGAINST_RAD
        self._rates: deque[tuple[float, float]] = deque()
        """Time and yaw rate, since the helm is held."""
        self._side = 0.0
        self._t_s = self._against_rad = self._with_rad = 0.0
        self.is_wrong = False
        """She turns against her helm."""

    def step(self, dt_s: float, *, surge: float, helm: float, r_radps: float, through_mps: float) -> None:
        """Take the sticks that were out for this time, the yaw rate and the surge through the water."""
        self._t_s += dt_s
        side = math.copysign(1.0, helm)
        if abs(helm) < _HELM or surge < 0.0 or through_mps < _ASTERN_MPS:
            self._rates.clear()
            return
        if side != self._side:
            self._side = side
            self._rates.clear()
        self._rates.append((self._t_s, r_radps))
        if self._t_s - self._rates[0][0] < _HELD_S:
            return
        _, before_radps = self._rates.popleft()
        if abs(r_radps) < _TURNS_RADPS or r_radps * before_radps < 0.0 or abs(r_radps) < _DIES * abs(before_radps):
            return
        if r_radps * side > 0.0:
            self._with_rad += abs(r_radps) * dt_s
        else:
            self._against_rad += abs(r_radps) * dt_s
        self.is_wrong = self.is_wrong or (
            self._against_rad > self._least_rad and self._against_rad > _WITH * self._with_rad
        )
