"""The water and the air of a simulation: current, wind with gusts, and the motion that waves give the hull.

First-order Gauss-Markov processes for current and gusts, a lightly damped second-order shaping filter for waves
(vessel-control §1.2). Every random number comes from the generator handed in.
"""

from __future__ import annotations

import math
import random
from typing import Protocol

from companion.core.config import Config

_WAVE_DAMPING = 0.15


class WaterConfig(Config):
    """Conditions. Current flows *to*, wind blows *from*, as sailors say it."""

    current_mps: float = 0.0
    """Speed of the current."""
    current_to_deg: float = 60.0
    """Where it sets, true."""
    current_sigma_mps: float = 0.0
    """Slow wander of the current."""
    current_tau_s: float = 120.0
    """Time constant of that wander."""
    wind_mps: float = 0.0
    """Mean wind."""
    wind_from_deg: float = 280.0
    """Where it blows from, true."""
    gust_share: float = 0.18
    """RMS of the gusts over the mean wind."""
    gust_tau_s: float = 5.0
    """Time constant of the gusts."""
    direction_wander_deg: float = 0.0
    """Wander of the wind's direction, RMS."""
    direction_tau_s: float = 60.0
    """Time constant of that wander."""
    wave_height_m: float = 0.0
    """Significant height."""
    wave_period_s: float = 3.0
    """Mean period of the waves."""
    start_s: float = 0.0
    """Before this time the water is still."""


class Conditions(Protocol):
    """Where the water and the air move to, NED, and the waves' narrow-band signals of unit variance."""

    current_n_mps: float
    current_e_mps: float
    wind_n_mps: float
    wind_e_mps: float
    wave_height_m: float
    wave: float
    wave_quadrature: float


class Still:
    """No current, no wind, no waves."""

    def __init__(self) -> None:
        self.current_n_mps = self.current_e_mps = 0.0
        self.wind_n_mps = self.wind_e_mps = 0.0
        self.wave_height_m = self.wave = self.wave_quadrature = 0.0


class Water(Still):
    """Steps the random processes; its attributes are what holds at the moment."""

    def __init__(self, config: WaterConfig, rng: random.Random) -> None:
        super().__init__()
        self._rng = rng
        self._t_s = 0.0
        self._current = [0.0, 0.0]
        self._gust = [0.0, 0.0]
        self._wander = [0.0]
        self._wave_speed = 0.0
        self.configure(config)

    def configure(self, config: WaterConfig) -> None:
        """Change the conditions from now on; gusts and waves go on from where they are, those that are no more are gone at once."""
        self.config = config
        self._steady = not (config.current_sigma_mps > 0.0 or config.wind_mps > 0.0)
        self._published = False
        self._calm = self._steady and config.direction_wander_deg <= 0.0 and config.wave_height_m <= 0.0
        """Nothing is random: once published, nothing changes."""
        if config.current_sigma_mps <= 0.0:
            self._current = [0.0, 0.0]
        if config.wind_mps * config.gust_share <= 0.0:
            self._gust = [0.0, 0.0]
        if config.direction_wander_deg <= 0.0:
            self._wander = [0.0]
        if config.wave_height_m <= 0.0:
            self.wave_height_m = self.wave = self.wave_quadrature = self._wave_speed = 0.0

    def step(self, dt_s: float) -> None:
        """Advance by ``dt_s`` (at most about 0.1 s, for the wave filter)."""
        self._t_s += dt_s
        if self._calm and self._published:
            return
        config = self.config
        if self._t_s < config.start_s:
            return
        if config.current_sigma_mps > 0.0:
            self._drift(self._current, config.current_sigma_mps, config.current_tau_s, dt_s)
        if config.wind_mps > 0.0 and config.gust_share > 0.0:
            self._drift(self._gust, config.gust_share * config.wind_mps, config.gust_tau_s, dt_s)
        if config.direction_wander_deg > 0.0:
            self._drift(self._wander, math.radians(config.direction_wander_deg), config.direction_tau_s, dt_s)
        if config.wave_height_m > 0.0:
            self._waves(dt_s)
        if not (self._steady and self._published):
            self._publish()
            self._published = True

    def _drift(self, values: list[float], sigma: float, tau_s: float, dt_s: float) -> None:
        """Gauss-Markov: exact in mean and variance for any step."""
        keep = math.exp(-dt_s / tau_s)
        spread = sigma * math.sqrt(1.0 - keep * keep)
        for index, value in enumerate(values):
            values[index] = keep * value + spread * self._rng.gauss(0.0, 1.0)

    def _waves(self, dt_s: float) -> None:
        """Narrow-band noise of unit variance about the wave frequency."""
        omega = 2.0 * math.pi / self.config.wave_period_s
        speed = self._wave_speed
        speed += dt_s * (-2.0 * _WAVE_DAMPING * omega * speed - omega * omega * self.wave)
        speed += 2.0 * math.sqrt(_WAVE_DAMPING) * omega**1.5 * math.sqrt(dt_s) * self._rng.gauss(0.0, 1.0)
        self._wave_speed = speed
        self.wave += dt_s * speed
        self.wave_height_m = self.config.wave_height_m
        self.wave_quadrature = speed / omega

    def _publish(self) -> None:
        config = self.config
        current_rad = math.radians(config.current_to_deg)
        self.current_n_mps = config.current_mps * math.cos(current_rad) + self._current[0]
        self.current_e_mps = config.current_mps * math.sin(current_rad) + self._current[1]
        wind_rad = math.radians(config.wind_from_deg) + math.pi + self._wander[0]
        self.wind_n_mps = config.wind_mps * math.cos(wind_rad) + self._gust[0]
        self.wind_e_mps = config.wind_mps * math.sin(wind_rad) + self._gust[1]


STILL: Conditions = Still()
"""Water that never moves."""
