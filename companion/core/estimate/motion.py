"""Position and velocity for guidance, between the estimator's steps."""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import EstimatedState

_VELOCITY_TAU_S = 0.7
"""Longer than a fix of 2 Hz, shorter than a hull takes to change its way."""
_POSITION_TAU_S = 0.3
"""As short as keeps RTK's steps out of the commands."""
_JUMP_M = 2.0
"""What the position moves at once by is no motion: begin anew there."""


class SmoothMotion:
    """Position and velocity without the steps of single fixes, and without lag.

    Velocity through the water changes slowly in the hull's axes, so it is smoothed there and turns with the hull at once;
    position is carried by that velocity and drawn to the estimate.
    """

    __slots__ = ("_running", "_sway_mps", "east_m", "north_m", "ve_mps", "vn_mps", "water_mps")

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
        x, y, psi = state.x_m, state.y_m, state.psi_rad
        assert x is not None and y is not None and psi is not None  # noqa: PT018
        cos, sin = math.cos(psi), math.sin(psi)
        drift_n, drift_e = state.current_n_mps or 0.0, state.current_e_mps or 0.0
        north, east = (state.vx_mps or 0.0) - drift_n, (state.vy_mps or 0.0) - drift_e
        u, v = north * cos + east * sin, east * cos - north * sin
        if self._running and math.hypot(x - self.north_m, y - self.east_m) < _JUMP_M:
            gain = dt_s / _VELOCITY_TAU_S if dt_s < _VELOCITY_TAU_S else 1.0
            u = self.water_mps + gain * (u - self.water_mps)
            v = self._sway_mps + gain * (v - self._sway_mps)
            gain = dt_s / _POSITION_TAU_S if dt_s < _POSITION_TAU_S else 1.0
            north_m, east_m = self.north_m + self.vn_mps * dt_s, self.east_m + self.ve_mps * dt_s
            x, y = north_m + gain * (x - north_m), east_m + gain * (y - east_m)
        self._running = True
        self.water_mps, self._sway_mps, self.north_m, self.east_m = u, v, x, y
        self.vn_mps, self.ve_mps = u * cos - v * sin + drift_n, u * sin + v * cos + drift_e
