"""The small Kalman filter behind heading and position: one value and its rate, driven by white acceleration."""

from __future__ import annotations


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
