"""Keeping station without a sway thruster: face the drift and hold against it, or drift and return.

``weathervane`` steers the velocity through the water that undoes the drift and brings the vessel back to its point;
in still water it rests on its heading and uses the thrusters ahead and astern. ``drift`` lets go inside a radius.
"""

from __future__ import annotations

import math
from typing import Literal

from mavlink_bridge.language.messages import Desired, EstimatedState
from mavlink_bridge.language.units import clamp, wrap_pi

from ..config import Config, param
from ..estimate import SmoothMotion
from ..hull import Handling

_TURN_ROUND_S = 6.0
_AT_REST = Desired(None, None)


class StationConfig(Config):
    """Station keeping."""

    mode: Literal["weathervane", "drift"] = "weathervane"
    """'weathervane' holds the point with steady thrust, 'drift' saves energy inside the radius."""
    radius_m: float = param(2.0, "HOLD_RADIUS", "Drift mode: let go inside this radius", unit="m", ge=0.3, le=100.0)
    gain: float = param(0.35, "HOLD_GAIN", "Speed towards the point per metre of distance", unit="1/s", ge=0.05, le=2.0)
    speed_mps: float = param(1.0, "HOLD_SPEED", "Greatest speed towards the point", unit="m/s", ge=0.1, le=5.0)
    calm_mps: float = param(
        0.1, "HOLD_CALM", "Drift below which the heading is left alone", unit="m/s", ge=0.02, le=1.0
    )


class StationKeeper:
    """Holds one anchor point at a time."""

    def __init__(self, config: StationConfig, handling: Handling) -> None:
        self._top_mps = handling.top_mps
        self._able_mps = 0.96 * self._top_mps
        """Drift that the vessel can still stem."""
        self._motion = SmoothMotion()
        self.anchor = (0.0, 0.0)
        self._heading_rad: float | None = None
        self._returning = False
        self._facing = False
        self.configure(config)

    def limit(self, fast_mps: float) -> None:
        """Sail no faster than this through the water, m/s."""
        self._able_mps = min(fast_mps, 0.96 * self._top_mps)

    def configure(self, config: StationConfig) -> None:
        self._drifts = config.mode == "drift"
        self._radius_m, self._gain = config.radius_m, config.gain
        self._speed_mps, self._calm_mps = config.speed_mps, config.calm_mps

    def begin(self, anchor: tuple[float, float]) -> None:
        self.anchor = anchor
        self._motion.reset()
        self._heading_rad = None
        self._returning = self._facing = False

    def distance_m(self, state: EstimatedState) -> float:
        assert state.x_m is not None
        assert state.y_m is not None
        return math.hypot(self.anchor[0] - state.x_m, self.anchor[1] - state.y_m)

    def step(self, dt_s: float, state: EstimatedState) -> tuple[Desired, bool]:
        """Return what to steer, and whether the vessel is able to stay at all."""
        motion = self._motion
        motion.step(dt_s, state)
        north, east = self.anchor[0] - motion.north_m, self.anchor[1] - motion.east_m
        drift = (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        strength = math.hypot(drift[0], drift[1])
        if self._drifts:
            return self._drift_and_return(state, north, east, drift), strength < self._able_mps
        return self._weathervane(state, north, east, drift, strength), strength < self._able_mps

    def _weathervane(
        self, state: EstimatedState, north: float, east: float, drift: tuple[float, float], strength: float
    ) -> Desired:
        distance = math.hypot(north, east)
        if distance > 4.0 * self._radius_m:
            return self._go(state, north, east, drift)
        self._facing = strength > (0.8 if self._facing else 1.2) * self._calm_mps
        if not self._facing:
            return self._rest(state, north, east, distance)
        facing = math.atan2(-drift[1], -drift[0])
        cos, sin = math.cos(facing), math.sin(facing)
        ahead, starboard = north * cos + east * sin, east * cos - north * sin
        aside = math.atan2(self._gain * starboard, (strength if strength >= 0.3 else 0.3) + 0.2)
        self._heading_rad = wrap_pi(facing + aside)
        return Desired(self._heading_rad, clamp(self._gain * ahead, -0.4, 0.8), 0.0, False, True)

    def _rest(self, state: EstimatedState, north: float, east: float, distance: float) -> Desired:
        """Still water: rest near the point; beyond, close the distance ahead or astern, and turn only when it lies abeam."""
        self._returning = distance > (0.2 if self._returning else 0.4) * self._radius_m
        if not self._returning:
            self._heading_rad = None
            return _AT_REST
        psi = state.psi_rad or 0.0
        if self._heading_rad is None:
            self._heading_rad = psi
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        if distance > 0.5 * self._radius_m and abs(east * cos - north * sin) > 0.5:
            bearing = math.atan2(east, north)
            behind = abs(wrap_pi(bearing - psi)) > 0.5 * math.pi
            self._heading_rad = wrap_pi(bearing + (math.pi if behind else 0.0))
            cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        speed = clamp(self._gain * (north * cos + east * sin), -0.4, self._speed_mps)
        return Desired(self._heading_rad, speed, 0.0, False, True)

    def _go(self, state: EstimatedState, north: float, east: float, drift: tuple[float, float]) -> Desired:
        """Head for the point by the triangle of velocities, slower while the bow is elsewhere."""
        distance = math.hypot(north, east)
        wanted = min(self._speed_mps, self._gain * distance) / max(distance, 1e-6)
        water_n, water_e = north * wanted - drift[0], east * wanted - drift[1]
        psi = math.atan2(water_e, water_n)
        self._heading_rad = psi
        error = wrap_pi(psi - (state.psi_rad or 0.0))
        surge = math.hypot(water_n, water_e) * max(0.0, math.cos(error))
        return Desired(psi, surge + drift[0] * math.cos(psi) + drift[1] * math.sin(psi), brake=True)

    def _drift_and_return(
        self, state: EstimatedState, north: float, east: float, drift: tuple[float, float]
    ) -> Desired:
        distance, radius = math.hypot(north, east), self._radius_m
        # turning round takes time, in which the water carries it on
        early = min(0.5 * radius, _TURN_ROUND_S * math.hypot(*drift))
        if distance > radius - early:
            self._returning = True
        elif distance < 0.3 * radius:
            self._returning = False
        if not self._returning:
            return Desired(None, None)
        return self._go(state, north, east, drift)
