"""Whether thrust moves the vessel where the compass says that her bow points: what no drift can feign.

Current and wind carry a vessel anywhere, but what they add does not change as her own thrust does. What does is her way through the
water, along the bow. So the changes of the velocity over ground are compared with those that the modelled way along the bow should
bring: with a right compass they go together, with a wrong one they go together too, but turned by as much as the compass is wrong.
"""

from __future__ import annotations

import cmath
import math
from typing import Final

_MEAN_S: Final = 8.0
"""What changes slower than this is left to wind and current; a hull gains and loses its way within it."""
_COUNTS_S: Final = 12.0
"""So long a change counts: one acceleration and one stop."""
_LEAST: Final = 1.0
"""Changes of the way that must count, m2/s: half a metre a second for four seconds."""
_TOGETHER: Final = 0.92
"""Share of the changes over ground that the thrust must explain. Wrong compasses on five hulls had 0.97 and more in 12 m/s of wind;
sound ones, turned by more than the limit, 0.6 at most, when a current of 2 m/s set in within a tick."""
_OFF_RAD: Final = math.radians(50.0)
"""Sound compasses were off by up to 11 degrees, and by 27 when 18 m/s of wind set in."""
_FEWEST, _MOST = 0.4, 2.5
"""Times what the file says of the way: thrust and drag wrong by half. What moves a hull otherwise is a tow, the ground, an eddy."""
_HELD_S: Final = 1.5
"""It must look so for longer than a gust's onset lasts,"""
_STEADY_RAD: Final = math.radians(10.0)
"""and the angle must stay within this: a hull that a dead or reversed propeller spins goes off the model more and more."""
_BORNE_OUT_RAD: Final = math.radians(30.0)
"""A heading within this of the way is borne out. From then on only a leap makes it wrong, and what looks like it is a propeller."""
_LEAPS_COS: Final = 0.94
"""A heading that leaps by 20 degrees in one tick is another compass, or one that was set right: the past says nothing of it."""
_GAP_S: Final = 0.5
"""After a longer pause the changes are not known."""

_Pair = tuple[float, float]


class ThrustWitness:
    """Watches the heading that is steered by; one call per tick with a compass that is believed."""

    def __init__(self) -> None:
        self._bow = 0j
        self._since_rad = 0.0
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._ground: complex | None = None
        self._through = self._both = 0j
        self._own = self._made = self._held_s = 0.0
        self._is_borne_out = False

    def step(self, dt_s: float, *, ground_mps: _Pair, bow: _Pair, through_mps: _Pair) -> float | None:
        """Return by how much the way is off the heading, clockwise, once it is certain that it is.

        ``ground_mps``: velocity over ground, NED. ``bow``: unit vector of the heading, NED. ``through_mps``: modelled surge and sway.
        """
        before, self._bow = self._bow, complex(*bow)
        ground, through = complex(*ground_mps), complex(*through_mps) * self._bow
        leapt = (before.conjugate() * self._bow).real < _LEAPS_COS
        if self._ground is None or leapt or not 0.0 < dt_s < _GAP_S:
            self.clear()
            self._ground, self._through = ground, through
            return None
        changed, by_thrust = ground - self._ground, through - self._through
        keep = 1.0 - dt_s / _COUNTS_S
        self._both = keep * self._both + dt_s * by_thrust.conjugate() * changed
        self._own = keep * self._own + dt_s * abs(by_thrust) * abs(by_thrust)
        self._made = keep * self._made + dt_s * abs(changed) * abs(changed)
        self._ground += dt_s / _MEAN_S * changed
        self._through += dt_s / _MEAN_S * by_thrust
        return self._judged(dt_s)

    def _judged(self, dt_s: float) -> float | None:
        off_rad, both = cmath.phase(self._both), abs(self._both)
        fits = self._own >= _LEAST and _FEWEST * self._own < both < _MOST * self._own
        if not fits or both * both <= _TOGETHER * self._own * self._made:
            self._held_s = 0.0
            return None
        self._is_borne_out = self._is_borne_out or abs(off_rad) < _BORNE_OUT_RAD
        turned_rad = abs(math.remainder(off_rad - self._since_rad, math.tau))
        if self._is_borne_out or abs(off_rad) < _OFF_RAD:
            self._held_s = 0.0
            return None
        if self._held_s <= 0.0 or turned_rad > _STEADY_RAD:
            self._held_s, self._since_rad = 0.0, off_rad
        self._held_s += dt_s
        return off_rad if self._held_s >= _HELD_S else None
