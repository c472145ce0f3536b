"""Whether thrust moves the vessel where the compass says that her bow points: what no drift can feign.

Current and wind carry a vessel anywhere, but what they add does not change as her own thrust does. What does is her way through the
water, along the bow. So the changes of the velocity over ground are compared with those that the modelled way along the bow should
bring: with a right compass they go together, with a wrong one they go together too, but turned by as much as the compass is wrong.

What counts is what the fixes tell, not what is predicted from them: a prediction turns with the heading that is in question. Where they
tell no velocity, their places over some seconds do, beside those where the modelled way alone would have led to.
"""

from __future__ import annotations

import cmath
import math
from collections import deque
from typing import Final

from mavlink_bridge.language.value import value

_MEAN_S: Final = 8.0
"""What changes slower than this is left to wind and current; a hull gains and loses its way within it."""
_COUNTS_S: Final = 12.0
"""So long a change counts: one acceleration and one stop."""
_LEAST: Final = 1.0
"""Changes of the way that must count, m2/s: half a metre a second for four seconds,"""
_LEAST_SEEN: Final = 0.5
"""and half of that must be seen over ground. A velocity without corrections has a noise of 0.3."""
_LEAST_BY_ROUGH: Final = 1.5
"""Rough places show more change that is none."""
_TOGETHER: Final = 0.92
"""Share of the changes over ground that the thrust must explain. Wrong compasses on five hulls had 0.97 and more in 12 m/s of wind;
sound ones, turned by more than the limit, 0.6 at most, when a current of 2 m/s set in within a tick."""
_OFF_RAD: Final = math.radians(50.0)
"""Sound compasses were off by up to 11 degrees, and by 27 when 18 m/s of wind set in."""
_FEWEST, _MOST = 0.4, 2.5
"""Times what the file says of the way: thrust and drag wrong by half. What moves a hull otherwise is a tow, the ground, an eddy."""
_HELD_S: Final = 1.5
"""It must look so for longer than a gust's onset lasts,"""
_HELD_BY_ROUGH_S: Final = 2.5
"""seen by rough places for longer: they blur a tug's pull, and all else that begins with the thrust, into one with it,"""
_STEADY_RAD: Final = math.radians(10.0)
"""and the angle must stay within this: a hull that a dead or reversed propeller spins goes off the model more and more."""
_BORNE_OUT_RAD: Final = math.radians(30.0)
"""A heading within this of the way is borne out. From then on only a leap makes it wrong, and what looks like it is a propeller."""
_LEAPS_COS: Final = 0.94
"""A heading that leaps by 20 degrees in one tick is another compass, or one that was set right: the past says nothing of it."""
_GAP_S: Final = 0.5
"""After a longer pause of the heading the changes are not known,"""
_NO_FIX_S: Final = 3.2
"""nor after a longer one of the fixes: three of the slowest receiver's."""
_SMOOTH_S: Final = 1.0
"""A velocity that is told is smoothed by so much, and the modelled one alike: five times a second its noise would hide half a way."""
_SMOOTH_FIXES: Final = 1.5
"""Once a second by so many fixes: it would hide a whole way of a metre and a half a second."""
_ROUGH_M: Final = 0.12
"""Places that vary by more than RTK's, which is known to a decimetre also while it floats."""
_FINE_S: Final = 2.0
_ROUGH_S: Final = 5.0
"""Places make a velocity over so long: once a second, with half a metre from place to place, one of 0.13 m/s of noise."""
_JITTER_S: Final = 0.05
"""A fix that comes by its clock a little later is still within it."""
_FILLED: Final = 0.8
"""Over less than this share of it there are too few."""

_Pair = tuple[float, float]


@value
class Told:
    """What a fix that was believed told of the reference point, north and east."""

    t_us: int
    """When it was valid."""
    at_m: _Pair
    """Where, less all leaps: where a vessel can have been, one after the other."""
    sigma_m: float
    """How much such places vary from one to the next."""
    mps: _Pair | None
    """Over ground; None where the receiver told nothing of it."""


class _Places:
    """The last places, and where the modelled way alone would have led to by then: what both make of a velocity."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, complex, complex]] = deque()

    def take(self, told: Told, led_m: complex) -> tuple[complex, complex] | None:
        """Return the slopes of both over the last seconds, m/s: alike in lag. None while there are few."""
        t_s, seen, over_s = told.t_us * 1e-6, self._seen, _ROUGH_S if told.sigma_m > _ROUGH_M else _FINE_S
        seen.append((t_s, complex(*told.at_m), led_m))
        while t_s - seen[0][0] > over_s + _JITTER_S:
            seen.popleft()
        if t_s - seen[0][0] < _FILLED * over_s:
            return None
        mean_s = math.fsum(each[0] for each in seen) / len(seen)
        weight = math.fsum((each[0] - mean_s) ** 2 for each in seen)
        made = through = 0j
        for then_s, at_m, led_m in seen:
            share = (then_s - mean_s) / weight
            made, through = made + share * at_m, through + share * led_m
        return made, through


class ThrustWitness:
    """Watches the heading that is steered by; one call per tick with a compass that is believed."""

    def __init__(self) -> None:
        self._bow = 0j
        self._since_rad = 0.0
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._told: Told | None = None
        self._fix_us: int | None = None
        self._is_borne_out = False
        self._begin()

    def _begin(self) -> None:
        self._led = self._last = 0j
        self._places = _Places()
        self._smoothed: tuple[complex, complex] | None = None
        self._ground: complex | None = None
        self._through = self._both = 0j
        self._own = self._made = self._held_s = 0.0

    def step(self, dt_s: float, *, bow: _Pair, through_mps: _Pair, told: Told | None) -> float | None:
        """Return by how much the way is off the heading, clockwise, once it is certain that it is.

        ``bow``: unit vector of the heading, NED. ``through_mps``: modelled surge and sway, at the moment that the fix of the tick before
        was valid. ``told``: the fix that is new at this tick.
        """
        before, self._bow = self._bow, complex(*bow)
        leapt = (before.conjugate() * self._bow).real < _LEAPS_COS
        if leapt or not 0.0 < dt_s < _GAP_S:
            self.clear()
        last, self._told = self._told, told
        return None if last is None else self._take(last, complex(*through_mps) * self._bow)

    def _take(self, told: Told, through: complex) -> float | None:
        since_s = 0.0 if self._fix_us is None else (told.t_us - self._fix_us) * 1e-6
        if not 0.0 < since_s < _NO_FIX_S:
            self._begin()
            since_s = 0.0
        self._fix_us = told.t_us
        self._led += 0.5 * since_s * (self._last + through)
        self._last = through
        made = self._places.take(told, self._led) if told.mps is None else self._smooth(since_s, complex(*told.mps))
        if made is None:
            return None
        self._compare(since_s, *made)
        return self._judged(since_s, is_rough=told.mps is None and told.sigma_m > _ROUGH_M)

    def _smooth(self, dt_s: float, ground: complex) -> tuple[complex, complex]:
        part = min(dt_s / _SMOOTH_S, 1.0 / _SMOOTH_FIXES)
        was_ground, was_through = self._smoothed or (ground, self._last)
        self._smoothed = was_ground + part * (ground - was_ground), was_through + part * (self._last - was_through)
        return self._smoothed

    def _compare(self, dt_s: float, ground: complex, through: complex) -> None:
        """Take both velocities at a fix."""
        if self._ground is None:
            self._ground, self._through = ground, through
        changed, by_thrust = ground - self._ground, through - self._through
        keep = 1.0 - dt_s / _COUNTS_S
        self._both = keep * self._both + dt_s * by_thrust.conjugate() * changed
        self._own = keep * self._own + dt_s * abs(by_thrust) * abs(by_thrust)
        self._made = keep * self._made + dt_s * abs(changed) * abs(changed)
        self._ground += dt_s / _MEAN_S * changed
        self._through += dt_s / _MEAN_S * by_thrust

    def _judged(self, dt_s: float, *, is_rough: bool) -> float | None:
        off_rad, both = cmath.phase(self._both), abs(self._both)
        fits = self._own >= _LEAST and _FEWEST * self._own < both < _MOST * self._own
        fits = fits and both * both >= (_LEAST_BY_ROUGH if is_rough else _LEAST_SEEN) * self._own
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
        return off_rad if self._held_s >= (_HELD_BY_ROUGH_S if is_rough else _HELD_S) else None
