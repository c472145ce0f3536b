"""Whether a receiver smooths the speed that it tells, and what is made of such a speed.

Behind a low-pass of a time constant tau, places have gone on by tau times the speed that is told further than that speed leads: over any
time what both differ by is tau times the change of the speed. So tau is a slope, found without differentiating anything, in turns
and where a boat starts or stops. A speed that is only late makes nearly the same of it.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from ..antenna import Pair
from .receiver_way import ReceiverWay

_LOOK_US: Final = 500_000
_OVER_US: Final = 10_000_000
"""A corner and what the smoothing leaves of it; plain places wander by less than a metre in it."""
_MEMORY_S: Final = 300.0
"""Some corners of a plan; a setting of the receiver does not change by itself."""
_LEAST_S: Final = 0.8
"""Receivers that do not smooth are late by up to half a second, once a second: the mean since the fix before."""
_SIGMAS: Final = 5.0
_EXPLAINED: Final = 0.5
"""Share of what places and speed differ by that the slope must explain. A speed in the wrong unit differs on straight legs, too."""
_ENDS: Final = 0.5
"""With half of what began it, it ends: what a receiver that settles made in its first minute wears off."""
_LEAST_TIME_S: Final = 20.0
"""A receiver that has just found itself steps and wanders for some ten seconds."""
_LEAST_CHANGE: Final = 3.0
"""Change of the speed, m/s, squared and by seconds: less is the noise of a receiver at rest."""


class LateSpeed:
    """One receiver; call once for each fix that is believed."""

    def __init__(self) -> None:
        self.lag_s = 0.0
        """Time constant of the smoothing; 0 where there is none, or it is not known."""
        self._told = False
        self.begin()

    def begin(self) -> None:
        """Another receiver: nothing is known of it."""
        self.lag_s = self._time_s = self._own = self._both = self._apart = 0.0
        self._way = ReceiverWay()
        self._past: deque[tuple[int, complex, complex]] = deque()
        self._led = 0j
        self._seen: complex | None = None
        self._seen_us = 0

    def step(self, t_us: int, at_m: Pair, mps: Pair | None) -> str:
        """Take where a fix is, all leaps of the estimate left in, and its speed; return what to say, empty for nothing."""
        way = self._way.since(t_us, mps)
        if way is None or mps is None:
            self._past.clear()
            return ""
        self._led += way
        past = self._past
        if past and t_us - past[-1][0] < _LOOK_US:
            return ""
        look_s = (t_us - past[-1][0]) * 1e-6 if past else 0.0
        past.append((t_us, complex(*at_m) - self._led, complex(*mps)))
        while t_us - past[0][0] > _OVER_US:
            past.popleft()
        self._compare(look_s)
        return self._judged()

    def _compare(self, dt_s: float) -> None:
        (_, was_m, was_mps), (_, is_m, is_mps) = self._past[0], self._past[-1]
        apart, changed, keep = is_m - was_m, is_mps - was_mps, 1.0 - dt_s / _MEMORY_S
        self._time_s = keep * self._time_s + dt_s
        self._own = keep * self._own + dt_s * (changed.conjugate() * changed).real
        self._both = keep * self._both + dt_s * (changed.conjugate() * apart).real
        self._apart = keep * self._apart + dt_s * (apart.conjugate() * apart).real

    def _judged(self) -> str:
        if self._own < _LEAST_CHANGE or self._time_s < _LEAST_TIME_S:
            return ""
        lag_s = self._both / self._own
        explained = lag_s * self._both
        spread_s2 = (self._apart - explained) * _OVER_US * 1e-6 / (2.0 * self._time_s * self._own)
        if self.lag_s:
            is_still = lag_s > _ENDS * _LEAST_S and explained > _ENDS * _EXPLAINED * self._apart
            self.lag_s = max(lag_s, _LEAST_S) if is_still else 0.0
        elif lag_s > _LEAST_S + _SIGMAS * math.sqrt(max(spread_s2, 0.0)) and explained > _EXPLAINED * self._apart:
            self.lag_s = lag_s
        if not self.lag_s or self._told:
            return ""
        self._told = True
        return f"Receiver's speed lags by {self.lag_s:.0f} s: switch its smoothing off"

    def seen(self, t_us: int, mps: Pair, told_mps: Pair) -> Pair:
        """Return what the receiver should tell of a speed at a moment, m/s."""
        since_us, self._seen_us = t_us - self._seen_us, t_us
        if not self.lag_s:
            return mps
        if self._seen is None or not 0 < since_us < _OVER_US:
            self._seen = complex(*told_mps)
        self._seen -= math.expm1(-since_us * 1e-6 / self.lag_s) * (complex(*mps) - self._seen)
        return self._seen.real, self._seen.imag

    def variance(self, least: float, acceleration_psd: float, dt_s: float) -> float:
        """Return the variance of a told speed, (m/s)^2, with which the estimate follows it half as fast as it comes: it would swing."""
        return least + 4.0 * acceleration_psd * self.lag_s * self.lag_s / dt_s
