"""Following a track: the speed that its bends and its end allow, the course of the field, the heading and rate to steer."""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import Desired, EstimatedState
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import clamp, wrap_pi

from ..config import Config, param
from ..estimate import SmoothMotion
from ..hull import Handling
from ..hull.handling import SLOW_SHARE
from .field import MOST_SLOPE, Integrator, SteeredHeading, approach, bow, standing_share, triangle
from .paths import Arc, Chain, Projection, fillet
from .stemmed import SPARED
from .swing import FELT, EarlySwing, Wish


class FollowConfig(Config):
    """Path following. Everything about the vessel comes from its file."""

    look_ahead_s: float = param(
        1.2,
        "PATH_LOOK_S",
        "Look-ahead, seconds of sailing; a hull that answers slowly takes more",
        unit="s",
        ge=0.5,
        le=20.0,
    )
    look_ahead_min_m: float = param(2.0, "PATH_LOOK_MIN", "Shortest look-ahead", unit="m", ge=0.5, le=50.0)
    integral: float = param(0.3, "PATH_INT", "Gain of the path integral", ge=0.0, le=2.0)
    integral_corridor_m: float = param(
        2.0, "PATH_INT_BAND", "The path integral works only this close to the path", unit="m", ge=0.1, le=100.0
    )
    turn_share: float = param(
        0.9, "PATH_TURN", "Share of the vessel's turning ability that a bend may use", ge=0.2, le=1.0
    )
    deceleration: float = param(
        0.3, "PATH_DECEL", "Deceleration before bends and ends, at most", unit="m/s^2", ge=0.02, le=5.0
    )
    preview_s: float = param(0.9, "PATH_PREVIEW", "Bends are steered into this much early", unit="s", ge=0.0, le=3.0)
    speed_min_mps: float = param(
        0.5, "PATH_SPEED_MIN", "Bends never slow the vessel below this", unit="m/s", ge=0.1, le=5
    )
    use_drift: bool = True
    """Steer by the triangle of velocities; off leaves drift to the integral."""


_AFTER_CORNER_S = 3.0
"""A corner's transient is no drift: the integral waits so long."""
_TURN_TAU_S = 0.3
"""As long as the path's turning takes to become the hull's."""
_BOW_TAU_S = 1.5
"""A path is joined more widely for water that runs with the boat, not for each wave that slows her."""
_ANY_MPS = (0.0, math.inf)
"""Bends may be sailed at any speed: both thrusters work."""
_ALONE_SHARE = 0.7
"""Share of the turning ability for bends with one thruster: the same thrust must also hold against wind and current."""
_ANSWERS = 1.1
"""Look-ahead over the time in which the course answers the helm: the turn, then the slip. Less, and a slow hull swings about its path."""
_SLOW_S = 3.0
_SLOWER = 0.6
"""A hull that takes longer to answer looks so much further ahead on a leg for each second more: she is still turning when she meets it,
and swung past it and back three times. More than that, and gusts carry her off instead."""
_ARC_HOLDS_S = 1.0
"""A path is joined by an arc of twice the tightest radius, which leaves so much time to begin it. A heavy boat that turns towards the
path takes longer, and twice: to end that turn, and to take up the other. She would swing past by metres."""
_EARLY = 0.5
"""A turn that is taken up evenly, and the slip that turns her course with it, is the path's on the whole when it begins half as early.
More was better by a little on our own heavy hulls, and twice as bad on a tanker's published model."""
_SLIP_HOLDS_S = 1.0
"""Slip that comes as quickly is in the lead that the heading has already (``_leeway``)."""
_SLOPE_BESIDE_DRIFT = 0.15
"""Slope of the path's integral where the drift is reckoned with: 9 degrees, more than a compass is off that the drift does not show. A
greater one fills up while the drift is still learnt, and stands beside the leg for a minute after."""
_NO_DRIFT = (0.0, 0.0)
"""m/s north and east."""


Followed = tuple[Desired, Projection, float]
"""What to steer, where on the track the vessel is, and the speed planned in m/s."""


class Follower:
    """Steers along one track at a time. Keeps the integral, what the heading sensor is off, from leg to leg where an arc joins them."""

    def __init__(self, config: FollowConfig, handling: Handling) -> None:
        self._handling = handling
        self._fast_mps = SPARED * handling.top_mps
        self.integrator = Integrator()
        self.motion = SmoothMotion()
        self._early = EarlySwing()
        self._sway_mps = self._turning = 0.0
        self._straight_s = math.inf
        self._bends_mps = _ANY_MPS
        self.configure(config)

    def configure(self, config: FollowConfig) -> None:
        self._config = config
        self._double = 2.0 * min(config.deceleration, self._handling.slows_mps2)
        answers_s = self._handling.takes_up_s + self._handling.sway_lag_s
        self._reverses_s = max(0.0, 2.0 * (self._handling.takes_up_s - _ARC_HOLDS_S))
        """How much longer she sails on before the turn towards a path has become one along it than the arc has to spare."""
        self._look_ahead_s = max(config.look_ahead_s, _ANSWERS * answers_s)
        self._leg_look_ahead_s = self._look_ahead_s + _SLOWER * max(0.0, answers_s - _SLOW_S)
        self._look_ahead_min_m = config.look_ahead_min_m
        self._integral, self._corridor_m = config.integral, config.integral_corridor_m
        self.integrator.most_slope = _SLOPE_BESIDE_DRIFT if config.use_drift else MOST_SLOPE
        self._turn_share = config.turn_share
        slips_s = max(0.0, self._handling.sway_lag_s - _SLIP_HOLDS_S)
        self._preview_s = max(config.preview_s, _EARLY * (self._handling.takes_up_s + slips_s))
        self._use_drift = config.use_drift
        self._bow_turns = 1.0
        """By how much more than the course: in water that runs with her the arc over ground is so much wider."""
        self._turn_mps: float | None = None
        self._turn_least_m = 0.0
        """Radius by which a path is joined at the speed ``_turn_mps``."""
        self._measure_bends()

    def limit(self, fast_mps: float) -> None:
        """Sail no faster than this through the water, m/s; the bends are measured anew."""
        self._fast_mps = min(fast_mps, SPARED * self._handling.top_mps)
        self.configure(self._config)

    def bends_within(self, least_mps: float, most_mps: float) -> None:
        """The handling has changed: measure the bends anew, sailed at these speeds through the water only."""
        self._bends_mps = (least_mps, most_mps)
        self._early = EarlySwing()  # what was seen to turn her is not all there any more
        self.configure(self._config)

    def bend_speed_mps(self, curvature: float) -> float:
        """Return the greatest speed at which the vessel can hold a curvature, with the configured share of its ability.

        Where no speed will do, the one that turns tightest.
        """
        speed = self._bend_speeds.get(curvature)
        if speed is None:
            speed = self._bend_speeds[curvature] = self._bend_speed(round(abs(curvature), 6))
        return speed

    def _bend_speed(self, bend: float) -> float:
        if bend < 1e-6:
            return self._handling.top_mps
        fits = [mps for mps, radius in self._radii if radius * bend <= 1.0]
        return fits[-1] if fits else min(self._radii, key=lambda pair: pair[1])[0]

    def tightest_m(self) -> float:
        """Return the smallest radius that the vessel can sail at any speed."""
        return min(radius for _, radius in self._radii)

    def corner(
        self, start: NorthEast, corner: NorthEast, end: NorthEast, *, cut_m: float, reach_m: float
    ) -> Arc | None:
        """Return the arc that rounds a corner, as ``fillet`` does: one that the vessel can sail.

        It is as long as she sails on, at the speed for which that is known, beyond what an arc has to spare to take a turn up and end it.
        """
        way_m = self._reverses_s * SLOW_SHARE * self._handling.top_mps
        least_m = self.tightest_m()
        return fillet(start, corner, end, cut_m=cut_m, least_m=least_m, reach_m=reach_m, way_m=way_m)

    def _measure_bends(self) -> None:
        """Tabulate the radius that each speed allows, from the least speed that bends may slow to."""
        handling, least = self._handling, max(self._config.speed_min_mps, self._bends_mps[0])
        top = max(min(handling.top_mps, self._bends_mps[1]), least)
        speeds = [least + (top - least) * k / 60.0 for k in range(61)]
        share = self._config.turn_share if self._bends_mps == _ANY_MPS else min(self._config.turn_share, _ALONE_SHARE)
        self._radii = [(mps, mps / (share * handling.max_yaw_rate(mps))) for mps in speeds]
        self._bend_speeds: dict[float, float] = {}

    def heading_for(self, state: EstimatedState, course_rad: float, speed_mps: float) -> float | None:
        """Return the heading that makes a course over ground good in the drift as estimated; None where no drift is known.

        The slip of the turn that leads there is no part of it: a bow that followed it would swing past.
        """
        if state.current_n_mps is None or state.current_e_mps is None or state.psi_rad is None:
            return None
        north, east = (state.vx_mps or 0.0) - state.current_n_mps, (state.vy_mps or 0.0) - state.current_e_mps
        now_mps = north * math.cos(state.psi_rad) + east * math.sin(state.psi_rad)
        drift = (state.current_n_mps, state.current_e_mps)
        return triangle(course_rad, speed_mps, drift, self._fast_mps, now_mps).psi_rad

    def step(
        self, dt_s: float, state: EstimatedState, track: Chain, speed_mps: float, end_speed_mps: float | None
    ) -> Followed:
        """Return what to steer. ``end_speed_mps`` is the speed at the end of an open track, None = keep on."""
        motion = self.motion
        motion.step(dt_s, state)
        here = track.locate(motion.north_m, motion.east_m)
        now_mps = math.hypot(motion.vn_mps, motion.ve_mps)
        planned = self._plan(track, here.along_m, speed_mps, end_speed_mps, now_mps)
        course, rate = self._course(dt_s, track, here, now_mps, planned)
        drift = (state.current_n_mps or 0.0, state.current_e_mps or 0.0) if self._use_drift else _NO_DRIFT
        heading = bow(
            here.course_rad,
            course,
            planned,
            drift,
            top_mps=self._fast_mps,
            now_mps=self._water_mps(),
            made_share=state.made_share,
            is_bend=here.curvature != 0.0,
        )
        share = min(1.0, dt_s / _BOW_TAU_S)
        self._bow_turns += share * (max(1.0, heading.rate_factor) - self._bow_turns)
        desired = self._steer(dt_s, state, heading, rate=rate, planned=planned, drift=drift)
        if self._use_drift and math.hypot(drift[0], drift[1]) >= FELT * speed_mps:
            desired = self._swing(dt_s, state, track, speed_mps=speed_mps, planned=planned, drift=drift) or desired
        return desired, here, planned

    def _plan(
        self, track: Chain, along_m: float, speed_mps: float, end_speed_mps: float | None, now_mps: float
    ) -> float:
        """Speed that lets the vessel slow down in time for every bend within sight and for the end."""
        double = self._double
        planned = speed_mps
        horizon = speed_mps * speed_mps / double + 2.0 * speed_mps
        lag_m = 0.6 * now_mps
        for distance, curvature in track.bends(along_m, horizon):
            if curvature:
                limit = self.bend_speed_mps(curvature)
                rest = distance - lag_m
                mps = math.sqrt(limit * limit + double * (rest if rest > 0.0 else 0.0))
                if mps < planned:
                    planned = mps
        if end_speed_mps is not None and not track.closed:
            rest = max(0.0, track.rest_m(along_m) - lag_m)
            planned = min(planned, math.sqrt(end_speed_mps * end_speed_mps + double * rest))
        return planned

    def _course(
        self, dt_s: float, track: Chain, here: Projection, now_mps: float, planned: float
    ) -> tuple[float, float]:
        speed = now_mps if now_mps >= 0.5 * planned else 0.5 * planned
        look_ahead = (self._look_ahead_s if track.closed else self._leg_look_ahead_s) * speed
        if look_ahead < self._look_ahead_min_m:
            look_ahead = self._look_ahead_min_m
        cross, curvature, path = here.cross_m, here.curvature, here.course_rad
        # as far off as the integral's own slope would have her stand, or it would never begin
        corridor = max(self._corridor_m, MOST_SLOPE * look_ahead) if self._settled(dt_s, track, curvature) else 0.0
        cos, sin, vn, ve = math.cos(path), math.sin(path), self.motion.vn_mps, self.motion.ve_mps
        along, across = vn * cos + ve * sin, ve * cos - vn * sin
        standing = standing_share(cross, look_ahead, speed, across)
        offset = self.integrator.step(
            dt_s, cross, look_ahead, gain=self._integral, corridor_m=corridor, standing=standing
        )
        turn_m = self._turn_m(cross, curvature, planned)
        angle, slope = approach(offset, look_ahead, turn_m, self._reverses_s * speed)
        inside = 1.0 - curvature * cross
        bend = track.ahead(here.along_m, self._preview_s * speed) / (inside if inside > 0.2 else 0.2)
        return wrap_pi(path - angle), bend * along - slope * across

    def _settled(self, dt_s: float, track: Chain, curvature: float) -> bool:
        """False in a corner and for a while after it: its transient is no standing error, and must not be integrated."""
        corner = curvature != 0.0 and not track.closed
        self._straight_s = 0.0 if corner else self._straight_s + dt_s
        return self._straight_s > _AFTER_CORNER_S

    def _turn_m(self, cross_m: float, curvature: float, planned: float) -> float:
        """Radius of the arc by which the vessel joins the path."""
        if planned != self._turn_mps:
            self._turn_mps = planned
            self._turn_least_m = 2.0 * (planned / (self._turn_share * self._handling.yaw_rate_for_way(planned)))
        least = self._turn_least_m * self._bow_turns
        if cross_m * curvature > 0.0 and 1.0 / abs(curvature) > least:  # inside a bend: by its own radius
            return 1.0 / abs(curvature)
        return least

    def _steer(
        self,
        dt_s: float,
        state: EstimatedState,
        heading: SteeredHeading,
        rate: float,
        planned: float,
        drift: tuple[float, float],
    ) -> Desired:
        water = self._water_mps()
        limit = self._handling.yaw_rate_for_way(water)
        turning = clamp(rate * heading.rate_factor, -limit, limit)
        slip, slipping = self._leeway(dt_s, turning, water if water >= 0.5 * planned else 0.5 * planned)
        psi = wrap_pi(heading.psi_rad - slip)
        # the drift along the bow as it is, not as it will be: the speed through the water stays while it turns
        now_rad = psi if state.psi_rad is None else state.psi_rad
        surge = heading.water_mps + drift[0] * math.cos(now_rad) + drift[1] * math.sin(now_rad)
        rate_radps = clamp(turning - slipping, -limit, limit)
        return Desired(psi, surge, rate_radps, asked_mps=planned)

    def _water_mps(self) -> float:
        """The way ahead through the water."""
        return self.motion.water_mps if self.motion.water_mps > 0.0 else 0.0

    def _swing(
        self,
        dt_s: float,
        state: EstimatedState,
        track: Chain,
        speed_mps: float,
        planned: float,
        drift: tuple[float, float],
    ) -> Desired | None:
        """Turn early for a corner in a current."""
        if state.psi_rad is None:
            return None
        self._early.see(dt_s, state.r_radps or 0.0)
        # one that turns faster than its file says would come round far inside the corner
        rate = self._turn_share * max(self._handling.yaw_rate_for_way(self._water_mps()), self._early.seen_radps)
        wish = Wish(speed_mps, drift, self._fast_mps, rate)
        found = self._early.step(track, self.motion, state.psi_rad, wish)
        if found is None:
            return None
        psi_rad, water_mps = found
        along_mps = drift[0] * math.cos(state.psi_rad) + drift[1] * math.sin(state.psi_rad)
        return Desired(psi_rad, water_mps + along_mps, asked_mps=planned)

    def _leeway(self, dt_s: float, rate: float, speed_mps: float) -> tuple[float, float]:
        """Return the slip angle of the turn that is being steered, and its derivative: the hull looks into the bend."""
        if speed_mps < 0.3:
            return 0.0, 0.0
        self._turning += (dt_s / _TURN_TAU_S if dt_s < _TURN_TAU_S else 1.0) * (rate - self._turning)
        goal = self._handling.sway_per_rate(speed_mps) * self._turning
        lag_s = self._handling.sway_lag_s
        change = (goal - self._sway_mps) / (lag_s if lag_s >= dt_s else dt_s)
        self._sway_mps += change * dt_s
        return math.atan(self._sway_mps / speed_mps), change / speed_mps
