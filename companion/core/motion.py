"""Position and velocity for guidance, between the estimator's steps."""

from __future__ import annotations

import math

from mavlink_bridge.imc import EstimatedState

_VELOCITY_TAU_S = 0.7
_POSITION_TAU_S = 0.5
_JUMP_M = 2.0


class SmoothMotion:
    """Position and velocity without the steps of single fixes, and without lag.

    Velocity through the water changes slowly in the hull's axes, so it is smoothed there and turns with the hull at once;
    position is carried by that velocity and drawn to the estimate.
    """

    def __init__(self) -> None:
        self.water_mps = 0.0
        """Surge through the water."""
        self.north_m = self.east_m = 0.0
        self.vn_mps = self.ve_mps = 0.0
        self._sway_mps = 0.0
        self._running = False

    def reset(self) -> None:
        self._running = False

    def step(self, dt_s: float, state: EstimatedState) -> None:
        """Take the estimate of one tick, which holds a position and a heading."""
        assert state.x_m is not None and state.y_m is not None and state.psi_rad is not None  # noqa: PT018
        cos, sin = math.cos(state.psi_rad), math.sin(state.psi_rad)
        drift_n, drift_e = state.drift_n_mps or 0.0, state.drift_e_mps or 0.0
        north, east = (state.vx_mps or 0.0) - drift_n, (state.vy_mps or 0.0) - drift_e
        u, v = north * cos + east * sin, east * cos - north * sin
        x, y = state.x_m, state.y_m
        if self._running and math.dist((x, y), (self.north_m, self.east_m)) < _JUMP_M:
            gain = min(1.0, dt_s / _VELOCITY_TAU_S)
            u = self.water_mps + gain * (u - self.water_mps)
            v = self._sway_mps + gain * (v - self._sway_mps)
            gain = min(1.0, dt_s / _POSITION_TAU_S)
            north_m, east_m = self.north_m + self.vn_mps * dt_s, self.east_m + self.ve_mps * dt_s
            x, y = north_m + gain * (x - north_m), east_m + gain * (y - east_m)
        self._running = True
        self.water_mps, self._sway_mps, self.north_m, self.east_m = u, v, x, y
        self.vn_mps, self.ve_mps = u * cos - v * sin + drift_n, u * sin + v * cos + drift_e
