"""How sure a filtered value is: the small Kalman filter behind heading and position, and an expected heading after a silence."""

from __future__ import annotations

import math
from typing import Final

_RATE_OFF_DPS: Final = 1.0
"""A turn rate sensor that carried the heading through a silence may be off by so much: those that are sold are off by half of it,"""
_RATE_OFF_SHARE: Final = 0.02
"""and by so much of what it tells: a hull that spins goes round ten times in a minute."""
_UNSEEN_DPS: Final = 10.0
"""Without one a vessel may have turned so fast unseen, whatever she did before: a light hull that wind or its own way turns."""
_COURSE_OFF_DEG: Final = 15.0
"""A course that stood in through a silence is so much more off than a compass: slip, leeway, a current that is not known well,"""
_COURSE_LATE_S: Final = 1.5
"""and so late in a turn that is faster than those that are unseen: the slip of a light hull, and a fix at 1 Hz."""
_CARRIED_MAX_S: Final = 1.0
"""The expected heading goes on turning for so long without news; the vessel may have begun to turn the other way meanwhile."""
_LIVELY_S: Final = 20.0
"""How fast she turned counts for so long: helm to one side, then to the other, and a corner of a plan."""
_ANYWHERE_DEG: Final = 180.0
"""A heading may point anywhere."""


class PairCovariance:
    """Covariance of (value, rate); the caller keeps the state, since an angle wraps and a velocity turns.

    Discrete white-noise acceleration model (Bar-Shalom, Li & Kirubarajan 2001, §6.2.2): over dt the covariance grows by
    q (dt^3/3, dt^2/2, dt), q in unit^2/s^3.
    """

    __slots__ = ("q", "rate_rate", "value_rate", "value_value")

    def __init__(self, q: float, value_variance: float, rate_variance: float) -> None:
        self.q = q
        self.value_value = value_variance
        self.value_rate = 0.0
        self.rate_rate = rate_variance

    def begin_value(self, variance: float) -> None:
        """The value has been set anew, and tells nothing of the rate."""
        self.value_value, self.value_rate = variance, 0.0

    def predict(self, dt_s: float) -> None:
        """Let ``dt_s`` pass."""
        grown = self.q * dt_s
        value_rate, rate_rate = self.value_rate, self.rate_rate
        self.value_value += dt_s * (2.0 * value_rate + dt_s * (rate_rate + grown / 3.0))
        self.value_rate = value_rate + dt_s * (rate_rate + 0.5 * grown)
        self.rate_rate = rate_rate + grown

    def measure_value(self, variance: float) -> tuple[float, float]:
        """Take in a measurement of the value; return the gains for (value, rate)."""
        value_value, value_rate = self.value_value, self.value_rate
        total = value_value + variance
        value_gain, rate_gain = value_value / total, value_rate / total
        self.rate_rate -= rate_gain * value_rate
        self.value_rate = value_rate - value_gain * value_rate
        self.value_value = value_value - value_gain * value_value
        return value_gain, rate_gain

    def measure_rate(self, variance: float) -> tuple[float, float]:
        """Take in a measurement of the rate; return the gains for (value, rate)."""
        value_rate, rate_rate = self.value_rate, self.rate_rate
        total = rate_rate + variance
        value_gain, rate_gain = value_rate / total, rate_rate / total
        self.value_value -= value_gain * value_rate
        self.value_rate = value_rate - rate_gain * value_rate
        self.rate_rate = rate_rate - rate_gain * rate_rate
        return value_gain, rate_gain


class Unseen:
    """How far an expected heading may be off by a silence: by the turns that were seen before it and asked for in it."""

    __slots__ = ("_clipped_deg", "_lively_dps", "_seen_us", "off_deg", "strays")

    def __init__(self) -> None:
        self.off_deg = 0.0
        """By the silences since the last heading that was believed."""
        self._clipped_deg = 0.0
        self._lively_dps = 0.0
        """The fastest turn of late; it fades."""
        self._seen_us = 0
        self.strays = False
        """Whether the expectation went with a way that thrust does not make: water that has begun to move."""

    def see(self, t_us: int, r_radps: float) -> None:
        """Take a turn rate, measured or asked for."""
        past_s, self._seen_us = (t_us - self._seen_us) * 1e-6, t_us
        if past_s > 0.0:
            self._lively_dps *= 1.0 - min(past_s, _CARRIED_MAX_S) / _LIVELY_S
        rate_dps = abs(math.degrees(r_radps))
        if rate_dps > self._lively_dps:
            self._lively_dps = rate_dps

    def clip(self, off_rad: float) -> None:
        """She turns by so much further than the expected heading was allowed to."""
        self._clipped_deg += math.degrees(off_rad)

    def believed(self) -> None:
        """A heading was believed."""
        self.off_deg = self._clipped_deg = 0.0
        self.strays = False

    def end_silence(self, silent_s: float, *, is_told: bool) -> None:
        """A silence ends that the last heading was carried through; ``is_told``: by a turn rate sensor."""
        if is_told:
            turned_deg = (_RATE_OFF_DPS + _RATE_OFF_SHARE * self._lively_dps) * silent_s
        else:
            lively_deg = self._lively_dps * (silent_s + min(silent_s, _CARRIED_MAX_S))
            turned_deg = max(_UNSEEN_DPS * silent_s, lively_deg)
        self.off_deg += _ANYWHERE_DEG if self.strays else turned_deg + self._clipped_deg
        self._clipped_deg = 0.0

    def end_course(self) -> None:
        """A silence ends while a course stands in."""
        late_deg = _COURSE_LATE_S * max(self._lively_dps - _UNSEEN_DPS, 0.0)
        self.off_deg = _ANYWHERE_DEG if self.strays else _COURSE_OFF_DEG + late_deg
