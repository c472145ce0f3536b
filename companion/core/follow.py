"""Following a track: the speed that its bends and its end allow, the course of the field, the heading and rate to steer."""

from __future__ import annotations

import math

from companion.core.config import Config, param
from companion.core.field import Integrator, approach, triangle
from companion.core.handling import Handling
from companion.core.motion import SmoothMotion
from companion.core.paths import Projection, Track
from companion.core.swing import EarlySwing, Wish
from companion.core.units import clamp, wrap_pi
from mavlink_bridge.imc import Desired, EstimatedState
from mavlink_bridge.value import value


class FollowConfig(Config):
    """Path following. Everything about the vessel comes from its file."""

    look_ahead_s: float = param(1.2, "PATH_LOOK_S", "Look-ahead, seconds of sailing", unit="s", ge=0.5, le=20.0)
    look_ahead_min_m: float = param(2.5, "PATH_LOOK_MIN", "Shortest look-ahead", unit="m", ge=0.5, le=50.0)
    integral: float = param(0.3, "PATH_INT", "Gain of the path integral", ge=0.0, le=2.0)
    integral_corridor_m: float = param(
        2.0, "PATH_INT_BAND", "The path integral works only this close to the path", unit="m", ge=0.1, le=100.0
    )
    turn_share: float = param(
        0.7, "PATH_TURN", "Share of the vessel's turning ability that a bend may use", ge=0.2, le=1.0
    )
    deceleration: float = param(0.3, "PATH_DECEL", "Deceleration before bends and ends", unit="m/s^2", ge=0.02, le=5.0)
    preview_s: float = param(0.9, "PATH_PREVIEW", "Bends are steered into this much early", unit="s", ge=0.0, le=3.0)
    speed_min_mps: float = param(
        0.5, "PATH_SPEED_MIN", "Bends never slow the vessel below this", unit="m/s", ge=0.1, le=5
    )
    use_drift: bool = True
    """Steer by the triangle of velocities; off leaves drift to the integral."""


_AFTER_CORNER_S = 3.0
_TURN_TAU_S = 0.3


@value
class Followed:
    """One step's result."""

    desired: Desired
    projection: Projection
    planned_mps: float
    possible: bool


class Follower:
    """Steers along one track at a time. Keeps the integral from leg to leg: it holds what the heading sensor is off."""

    def __init__(self, config: FollowConfig, handling: Handling) -> None:
        self._config = config
        self._handling = handling
        self.integrator = Integrator()
        self.motion = SmoothMotion()
        self._early = EarlySwing()
        self._sway_mps = self._turning = 0.0
        self._straight_s = math.inf
        self._measure_bends()

    def configure(self, config: FollowConfig) -> None:
        self._config = config
        self._measure_bends()

    def bend_speed_mps(self, curvature: float) -> float:
        """Return the greatest speed at which the vessel can hold a curvature, with the configured share of its ability.

        Where no speed will do, the one that turns tightest.
        """
        bend = round(abs(curvature), 6)
        if bend < 1e-6:
            return self._handling.top_mps
        speed = self._bend_speeds.get(bend)
        if speed is None:
            fits = [mps for mps, radius in self._radii if radius * bend <= 1.0]
            speed = fits[-1] if fits else min(self._radii, key=lambda pair: pair[1])[0]
            self._bend_speeds[bend] = speed
        return speed

    def tightest_m(self) -> float:
        """Return the smallest radius that the vessel can sail at any speed."""
        return min(radius for _, radius in self._radii)

    def _measure_bends(self) -> None:
        """Tabulate the radius that each speed allows, from the least speed that bends may slow to."""
        handling, least = self._handling, self._config.speed_min_mps
        top = max(handling.top_mps, least)
        speeds = [least + (top - least) * k / 60.0 for k in range(61)]
        self._radii = [(mps, mps / (self._config.turn_share * handling.max_yaw_rate(mps))) for mps in speeds]
        self._bend_speeds: dict[float, float] = {}

    def step(
        self, dt_s: float, state: EstimatedState, track: Track, speed_mps: float, end_speed_mps: float | None
    ) -> Followed:
        """Return what to steer. ``end_speed_mps`` is the speed at the end of an open track, None = keep on."""
        motion = self.motion
        motion.step(dt_s, state)
        here = track.locate(motion.north_m, motion.east_m)
        vn, ve = motion.vn_mps, motion.ve_mps
        planned = self._plan(track, here, speed_mps, end_speed_mps, math.hypot(vn, ve))
        course, rate = self._course(dt_s, track, here, vn, ve, planned)
        desired, possible = self._steer(dt_s, state, course, rate, planned)
        swing = self._swing(state, track, here, speed_mps, planned)
        if swing is not None:
            desired = swing
        return Followed(desired, here, planned, possible)

    def _plan(
        self, track: Track, here: Projection, speed_mps: float, end_speed_mps: float | None, now_mps: float
    ) -> float:
        """Speed that lets the vessel slow down in time for every bend within sight and for the end."""
        double = 2.0 * self._config.deceleration
        planned = speed_mps
        horizon = speed_mps * speed_mps / double + 2.0 * speed_mps
        lag_m = 0.6 * now_mps
        for distance, curvature in track.bends(here.along_m, horizon):
            if curvature:
                limit = self.bend_speed_mps(curvature)
                planned = min(planned, math.sqrt(limit * limit + double * max(0.0, distance - lag_m)))
        if end_speed_mps is not None and not track.closed:
            rest = max(0.0, track.rest_m(here.along_m) - lag_m)
            planned = min(planned, math.sqrt(end_speed_mps * end_speed_mps + double * rest))
        return planned

    def _course(
        self, dt_s: float, track: Track, here: Projection, vn: float, ve: float, planned: float
    ) -> tuple[float, float]:
        config = self._config
        speed = max(math.hypot(vn, ve), 0.5 * planned)
        look_ahead = max(config.look_ahead_min_m, config.look_ahead_s * speed)
        settled = self._settled(dt_s, track, here)
        corridor = config.integral_corridor_m if settled else 0.0
        offset = self.integrator.step(dt_s, here.cross_m, look_ahead, config.integral, corridor)
        turn_m = self._turn_m(here, planned)
        angle, slope = approach(offset, look_ahead, turn_m)
        cos, sin = math.cos(here.course_rad), math.sin(here.course_rad)
        along, across = vn * cos + ve * sin, ve * cos - vn * sin
        preview = track.ahead(here.along_m, config.preview_s * speed)
        bend = preview / max(0.2, 1.0 - here.curvature * here.cross_m)
        return wrap_pi(here.course_rad - angle), bend * along - slope * across

    def _settled(self, dt_s: float, track: Track, here: Projection) -> bool:
        """False in a corner and for a while after it: its transient is no standing error, and must not be integrated."""
        corner = here.curvature != 0.0 and not track.closed
        self._straight_s = 0.0 if corner else self._straight_s + dt_s
        return self._straight_s > _AFTER_CORNER_S

    def _turn_m(self, here: Projection, planned: float) -> float:
        """Radius of the arc by which the vessel joins the path."""
        tightest = planned / (self._config.turn_share * self._handling.max_yaw_rate(planned))
        inside = here.cross_m * here.curvature > 0.0
        return max(2.0 * tightest, 1.0 / abs(here.curvature) if inside and here.curvature else 0.0)

    def _steer(
        self, dt_s: float, state: EstimatedState, course: float, rate: float, planned: float
    ) -> tuple[Desired, bool]:
        drift = (0.0, 0.0)
        if self._config.use_drift:
            drift = (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        water = max(self.motion.water_mps, 0.0)
        heading = triangle(course, planned, drift, 0.96 * self._handling.top_mps, water)
        limit = self._handling.max_yaw_rate(water)
        turning = clamp(rate * heading.rate_factor, -limit, limit)
        slip, slipping = self._leeway(dt_s, turning, max(water, 0.5 * planned))
        psi = wrap_pi(heading.psi_rad - slip)
        # the drift along the bow as it is, not as it will be: the speed through the water stays while it turns
        bow = psi if state.psi_rad is None else state.psi_rad
        surge = heading.water_mps + drift[0] * math.cos(bow) + drift[1] * math.sin(bow)
        return Desired(psi, surge, clamp(turning - slipping, -limit, limit)), heading.possible

    def _swing(
        self, state: EstimatedState, track: Track, here: Projection, speed_mps: float, planned: float
    ) -> Desired | None:
        """Turn early for a corner in a strong current, with no more thrust than helps along the path."""
        drift = (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        if not self._config.use_drift or state.psi_rad is None:
            return None
        motion, handling = self.motion, self._handling
        rate = self._config.turn_share * handling.max_yaw_rate(max(motion.water_mps, 0.0))
        wish = Wish(speed_mps, drift, 0.96 * handling.top_mps, rate)
        swing = self._early.step(track, here, motion, state.psi_rad, wish)
        if swing is None:
            return None
        cos, sin = math.cos(state.psi_rad), math.sin(state.psi_rad)
        wanted_n = planned * math.cos(here.course_rad) - drift[0]
        wanted_e = planned * math.sin(here.course_rad) - drift[1]
        water = max(0.0, wanted_n * cos + wanted_e * sin)
        return Desired(swing.psi_rad, water + drift[0] * cos + drift[1] * sin, swing.rate_radps, brake=True)

    def _leeway(self, dt_s: float, rate: float, speed_mps: float) -> tuple[float, float]:
        """Return the slip angle of the turn that is being steered, and its derivative: the hull looks into the bend."""
        if speed_mps < 0.3:
            return 0.0, 0.0
        self._turning += min(1.0, dt_s / _TURN_TAU_S) * (rate - self._turning)
        goal = self._handling.sway_per_rate(speed_mps) * self._turning
        change = (goal - self._sway_mps) / max(self._handling.sway_lag_s, dt_s)
        self._sway_mps += change * dt_s
        return math.atan(self._sway_mps / speed_mps), change / speed_mps
