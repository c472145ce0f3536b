"""The PID of the seed's controller: DUNE's DiscretePID, step for step (dune-imc §1.4), with its parcels.

The integral term is used before it is updated and goes on growing while the output is clamped; those are the
original's manners, kept for parity. The model-based controller does not use this class.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..config import Config, param


class PidGains(Config):
    """Gains of one loop. An output or integral limit of 0 means none."""

    kp: float = param(..., "P", "output per unit of error", ge=0.0, le=1000.0)
    ki: float = param(0.0, "I", "output per unit of error and second", ge=0.0, le=1000.0)
    kd: float = param(0.0, "D", "output per unit of error a second", ge=0.0, le=1000.0)
    integral_limit: float = param(0.0, "IMAX", "greatest integral part, either way; 0 = none", ge=0.0, le=1000.0)


@dataclass(frozen=True, slots=True)
class Parcels:
    """One step's parts."""

    p: float
    i: float
    d: float
    output: float


class DiscretePid:
    """u = Kp e + Kd d + I, clamped; then I += Ki e dt, clamped."""

    def __init__(self, gains: PidGains, output_limit: float = 0.0) -> None:
        self._gains = gains
        self._limit = output_limit
        self.reset()

    def configure(self, gains: PidGains, output_limit: float) -> None:
        """Change gains or limit; changed values reset the memory, as the seed says."""
        if (gains, output_limit) != (self._gains, self._limit):
            self._gains, self._limit = gains, output_limit
            self.reset()

    def reset(self) -> None:
        self._integral = 0.0
        self._error = 0.0

    def step(self, dt_s: float, error: float, derivative: float | None = None) -> Parcels:
        """Return the parcels for an error; ``derivative`` of the error in 1/s replaces the difference quotient."""
        gains = self._gains
        slope = (error - self._error) / dt_s if derivative is None else derivative
        p, i, d = gains.kp * error, self._integral, gains.kd * slope
        output = _clamp(p + i + d, self._limit)
        self._integral = _clamp(i + gains.ki * error * dt_s, gains.integral_limit)
        self._error = error
        return Parcels(p, i, d, output)


def _clamp(value: float, limit: float) -> float:
    return value if limit <= 0.0 else max(-limit, min(limit, value))
