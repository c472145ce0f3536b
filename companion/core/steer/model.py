"""The model-based law (profile ``model``): reference model, feed-forward from the vessel file, PD on heading and measured
yaw rate, integrals that stop when the actuators do, and allocation by authority.

Two degrees of freedom: the reference turns no faster than the vessel can, the feed-forward sails it, the feedback sees
only what the model got wrong. Everything is in newtons and newton metres, so one set of settings fits every vessel.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import ActuatorDemand, ActuatorOutput, Desired, EstimatedState
from mavlink_bridge.language.snapshot import ControlTrace
from mavlink_bridge.language.units import clamp, wrap_pi

from ..hull import Handling, VesselConfig
from ..hull.handling import BRAKED_SHARE
from ..hull.left import WHOLE, Shares, straight_mps
from ..hull.thrust import ThrustLaw
from .allocation import Allocation, Allocator
from .bandwidth import Schedule, Wishes, heading_schedule, plain_margins
from .heading_reference import HeadingReference, TurnLimits
from .kicks import Kicks, eased
from .law import ModelConfig, SteeringConfig
from .observer import WaterSpeedObserver, believed
from .slow_compass import DIFFERENCED_S
from .yaw_loop import LoopMargins

_SATURATED_RAD = 0.3
"""Heading error at which a good bandwidth just uses up the yaw authority."""
_SHORTEST_STEP_S, _LONGEST_STEP_S = 0.005, 0.2
"""The first call after a start has no time behind it, a late one too much."""
_SATURATED_MPS = 0.25
"""Speed error that may take all of the thrust: ten times a receiver's noise, which would else work the propellers of a heavy boat."""
_KICKED_RATE = 0.15
"""Bandwidth that is kept at rest by a boat that must kick its propeller over the rudder to turn, rad/s."""
_REFERENCE_RATE = 2.4
"""The reference's bandwidth, rad/s: fast enough not to be felt, slow enough not to saturate."""
_REFERENCE_TIMES = 1.6
"""And no more than so many times the loop's own, and what the yaw authority supports at the speed: a heavy boat's propellers
worked from nothing to all, five times in three seconds, for hundredths of a degree in what was asked for."""
_GENTLE = 0.6
"""Share of the bandwidth for station keeping, where thrusters alone steer and every wave would work them."""
_BY_COURSE = 0.5
"""Share of the bandwidth while the course stands in for a lost heading: it is late by the hull's way round, and swings with the slip."""
_TURNS_WITH = 0.6
"""Share of the astern thrust that a gentle turn may use: both propellers can still give as much astern as ahead. All of it
where wind turns the bow away so hard that the boat would not come to face it."""
_PLANNED = 0.7
"""Share of that for which a gentle turn is planned; the rest is the feedback's."""
_LEAST_TURN = 0.1
"""Yaw rate that a gentle turn has, as far as all of that gives it, rad/s: a heavy boat never came to look where the push came from."""
_SPEED_REFERENCE = 2.0
"""Bandwidth of the speed reference, 1/s; on station in strong wind twice that."""
_HANDS_OVER_S = 10.0
"""How long the speed integral takes to hand over to the observer on station: slower than the loop, so that nothing is felt."""
_CALM_SURGE = 0.15
"""Acceleration of the reference, m/s², below which the speed integral works."""
_SAME = 0.03
"""Outputs that differ by less are the same."""
_CALM_TURN = 0.1
"""Yaw acceleration of the reference, rad/s², below which the heading integral works."""
_STANDING_RAD = 0.1
"""A greater heading error is a turn's, not a standing one: all of it in the integral would swing a slow loop past for half a minute."""


class ModelController:
    """Profile ``model``."""

    def __init__(self, config: SteeringConfig, vessel: VesselConfig) -> None:
        self._vessel = vessel
        self._handling = Handling(vessel)
        self._allocator = Allocator(vessel, self._handling.model)
        self._observer = WaterSpeedObserver(vessel, self._handling.model)
        hull = vessel.hull
        self._m11 = hull.m11_kg
        self._ahead_n, self._astern_n = vessel.thruster.ahead_n, vessel.thruster.astern_n
        self._inertia = hull.turning_kgm2
        # rudders alone turn a resting hull only by the thrust that the allocation adds for them
        self._by_rudder = not self._handling.model.lateral_m
        self._kicks = Kicks(vessel, self._handling.model)
        self._least_rate = _KICKED_RATE if self._by_rudder else 0.0
        self._left_mps = math.inf
        """Greatest steady speed through the water with what weak thrusters still give."""
        self._seldom_s = 0.0
        """Age of headings that comes of a compass that speaks seldom."""
        self._config: ModelConfig = config.model
        self._tune(config.model)
        self._clear()

    def _clear(self) -> None:
        self._kicks.clear()
        self._reference = HeadingReference()
        self._u_ref: float | None = None
        self._du_ref = 0.0
        self._yaw_integral_nm = 0.0
        self._surge_integral_n = 0.0
        self._heading_error = 0.0
        self._firmness = 0.0
        self._held = False
        """The turn takes all of the moment that a gentle one may."""
        self._last: ActuatorDemand | None = None

    def _tune(self, config: ModelConfig) -> None:
        """Bandwidth over speed: no more than the yaw authority supports, nor than leaves margins at the stated delay."""
        handling, vessel = self._handling, self._vessel
        reach = handling.reach_radps(0.5 * handling.top_mps, _SATURATED_RAD)
        most = min(config.heading_bandwidth, reach)
        self._wishes = Wishes(
            most, config.heading_damping, config.heading_integral, config.heading_late_s + self._seldom_s
        )
        self._schedule = schedule = heading_schedule(vessel, self._wishes)
        self._step_mps = schedule.step_mps
        attainable_mps = schedule.steady_mps if schedule.lowered else 1.05 * handling.top_mps
        self._attainable_mps = min(attainable_mps, self._left_mps)
        self._omegas = [gain.omega_radps for gain in schedule.gains]
        self._firm_radps = max(self._omegas) if self._seldom_s <= DIFFERENCED_S else min(self._omegas)
        """For strong wind on station: the thrust that holds against it gives the rudders their flow, whatever way she makes. By a compass
        that is heard seldom a boat swung by 50 degrees so."""
        most_radps = min(_REFERENCE_RATE, _REFERENCE_TIMES * self._firm_radps)
        steps = range(len(schedule.gains))
        # kicks turn a boat that they turn with all that she has at any speed
        reaches = (
            most_radps if self._by_rudder else handling.reach_radps(step * schedule.step_mps, _SATURATED_RAD)
            for step in steps
        )
        self._quicks = [min(most_radps, _REFERENCE_TIMES * each) for each in reaches]
        self._zetas = [config.heading_damping * gain.stiffer for gain in schedule.gains]
        self._integrals = [gain.integral for gain in schedule.gains]
        self._saturated_nm = self._inertia * most * most * _SATURATED_RAD
        law = ThrustLaw(vessel)
        self._firm_nm = 2.0 * handling.model.lateral_m * law.astern_n
        self._gentle_nm = max(
            _TURNS_WITH * self._firm_nm, min(handling.moment_for(_LEAST_TURN) / _PLANNED, self._firm_nm)
        )
        if self._by_rudder:
            self._gentle_nm, self._firm_nm = self._kicks.gentle_nm, self._kicks.firm_nm
        self._gentle_rate = handling.rate_for(_PLANNED * self._gentle_nm) if handling.model.lateral_m else math.inf
        self._turn_most = min(config.yaw_acceleration, 0.2 * reach * reach)
        self._rate_limit = config.yaw_rate_limit
        self._speed_integral = config.speed_integral
        within = law.all_ahead_n / (self._m11 * _SATURATED_MPS)
        self._surge_most, self._speed_gain = config.acceleration, min(config.speed_gain, handling.surge_radps, within)

    def _omega(self, speed_mps: float) -> float:
        """Bandwidth at a speed through the water, rad/s."""
        return self._at(self._omegas, speed_mps)

    def _at(self, table: list[float], speed_mps: float) -> float:
        place = clamp(speed_mps / self._step_mps, 0.0, len(table) - 1 - 1e-9)
        k = int(place)
        return table[k] + (place - k) * (table[k + 1] - table[k])

    def reset(self, state: EstimatedState, dt_s: float = 0.0, sent: ActuatorOutput | None = None) -> None:
        self._clear()
        self._observer.idle(dt_s, state, sent)

    def configure(self, config: SteeringConfig) -> None:
        """Change settings without a bump: the integral takes over what the old gain gave."""
        old, self._config = self._config, config.model
        if old != config.model:
            self._tune_under_way()

    def seldom_heard(self, late_s: float) -> None:
        """Reckon with headings that are so much older because the compass speaks seldom."""
        self._seldom_s = late_s
        self._tune_under_way()

    def _tune_under_way(self) -> None:
        speed = max(self._observer.u_mps, 0.0)
        before = self._omega(speed)
        self._tune(self._config)
        now, most_nm = self._omega(speed), 0.5 * self._saturated_nm
        takes_over_nm = self._inertia * (before * before - now * now) * self._heading_error
        self._yaw_integral_nm = clamp(self._yaw_integral_nm + takes_over_nm, -most_nm, most_nm)

    def thrusters(self, shares: Shares, through_mps: tuple[float, float] | None = None) -> None:
        """Steer with what each thruster still gives, port and starboard, as a share of what it is told.

        ``through_mps``: surge and sway through the water as the vessel makes them in truth; None = go on with what was modelled.
        """
        self._handling.thrusters(shares)
        self._allocator.thrusters(shares)
        self._observer.thrusters(shares, through_mps)
        self._least_rate = 0.0 if shares == WHOLE and self._handling.model.lateral_m else _KICKED_RATE
        speeds = None if shares == WHOLE else straight_mps(self._vessel, shares)
        self._left_mps = math.inf if speeds is None else speeds[1]
        self._tune(self._config)
        # what the integrals have made up for is now reckoned with
        self._yaw_integral_nm = self._surge_integral_n = 0.0

    def heading_gains(self, speed_mps: float) -> tuple[float, float, float]:
        """Return (P in Nm/rad, I in Nm/(rad s), D in Nm/(rad/s)) of the heading loop at a speed, for design work."""
        linear, _ = self._handling.yaw_damping(speed_mps)
        omega = self._omega(speed_mps)
        kp = self._inertia * omega * omega
        damping = 2.0 * self._at(self._zetas, speed_mps) * omega * self._inertia
        return kp, self._at(self._integrals, speed_mps) * kp, max(damping - max(linear, 0.0), 0.0)

    @property
    def top_mps(self) -> float:
        """Top speed through the water."""
        return self._handling.top_mps

    @property
    def backs_and_fills(self) -> bool:
        """Whether it turns a boat without a difference of thrust where she lies, by kicks over the rudder."""
        return self._by_rudder and self._kicks.can

    @property
    def schedule(self) -> Schedule:
        """The heading loop's gains over speed, what they leave, and how fast the vessel may be sailed with them."""
        return self._schedule

    def plain_margins(self, speed_mps: float) -> LoopMargins:
        """Return what the bandwidth at a speed leaves with the settings' own damping and integral."""
        return plain_margins(self._handling, self._wishes, self._omega(speed_mps), speed_mps)

    @property
    def steady_mps(self) -> float:
        """Greatest speed through the water at which the heading loop keeps its margins, with the thrusters that there are."""
        return min(self._schedule.steady_mps, self._left_mps)

    @property
    def turn_radps(self) -> float:
        """Greatest yaw rate that is steered."""
        return self._rate_limit

    def water_speed_mps(self) -> float | None:
        return self._observer.aligned_mps()

    @property
    def water_sway_mps(self) -> float:
        """The modelled sway through the water, to starboard positive."""
        return self._observer.v_mps

    def step(
        self, now_us: int, dt_s: float, state: EstimatedState, desired: Desired, sent: ActuatorOutput | None
    ) -> tuple[ActuatorDemand, ControlTrace]:
        dt_s = clamp(dt_s, _SHORTEST_STEP_S, _LONGEST_STEP_S)
        self._observer.step(dt_s, state, sent)
        water = self._observer.u_mps
        made_mps = water * (1.0 + believed(state.made_share))
        ahead = made_mps if made_mps > 0.0 else 0.0
        omega = self._omega(ahead)
        omega += desired.firmness * desired.firmness * (self._firm_radps - omega)
        omega *= _BY_COURSE if state.heading_from_course else 1.0
        self._firmness = desired.firmness
        flow_mps = None
        if desired.gentle and self._handling.model.lateral_m:
            # what holds against wind looks like way, and may be none: the rudders are sure of the propellers' race alone
            ahead = flow_mps = 0.0
        self._kicks.far(dt_s, desired, state.psi_rad)
        surge_n, speed_error, speed_p = self._surge(dt_s, desired, water)
        yaw_nm, heading_p, heading_d = self._yaw(dt_s, state.psi_rad, desired, ahead, omega)
        if desired.psi_rad is None and desired.speed_mps is None:
            self._last = ActuatorDemand(now_us)
            return self._last, ControlTrace()
        may_kick = self._kicks.may(dt_s, desired, speed_error) and (self._by_rudder or self._kicks.brings_round)
        given = self._allocator.allocate(
            surge_n, yaw_nm, made_mps, flow_mps=flow_mps, may_kick=may_kick, standing_rad=self._observer.rudder_rad
        )
        if self._free(sent):
            self._integrate(dt_s, given, surge_n, yaw_nm=yaw_nm, speed_error=speed_error, omega=omega)
        rudder_rad = given.rudder_rad
        if desired.gentle and self._by_rudder and self._last is not None:
            rudder_rad = eased(dt_s, rudder_rad, self._last.rudder_port_rad)
        self._last = ActuatorDemand(now_us, given.thruster_port, given.thruster_starboard, rudder_rad, rudder_rad)
        return self._last, ControlTrace(
            heading_error_rad=self._heading_error,
            heading_p=heading_p,
            heading_i=self._yaw_integral_nm,
            heading_d=heading_d,
            speed_error_mps=speed_error,
            speed_p=speed_p,
            speed_i=self._surge_integral_n,
            speed_d=0.0,
            psi_ref_rad=self._reference.psi_rad,
            speed_ref_mps=self._u_ref,
        )

    def _free(self, sent: ActuatorOutput | None) -> bool:
        """True when what went out is what was asked for, so that integrals may act."""
        last = self._last
        if last is None or sent is None:
            return True
        return (
            abs(sent.thruster_port - last.thruster_port) < _SAME
            and abs(sent.thruster_starboard - last.thruster_starboard) < _SAME
            and abs(sent.rudder_port_rad - last.rudder_port_rad) < _SAME
        )

    def _yaw(
        self, dt_s: float, psi: float | None, desired: Desired, speed: float, omega: float
    ) -> tuple[float, float, float]:
        """Return the moment, and P and D of it."""
        if desired.psi_rad is None or psi is None:
            self._reference.forget()
            self._heading_error = 0.0
            return 0.0, 0.0, 0.0
        rate, inertia = self._observer.rate_radps or 0.0, self._inertia
        linear, quadratic = self._handling.yaw_damping(speed)
        reference = self._reference
        aim_rad = reference.step(dt_s, desired, self._turn_limits(gentle=desired.gentle), psi_rad=psi, r_radps=rate)
        self._heading_error = error = wrap_pi(aim_rad - psi)
        if desired.brake:
            omega *= _GENTLE + (1.0 - _GENTLE) * desired.firmness
        r_ref, damping = reference.r_radps, 2.0 * self._at(self._zetas, speed) * omega * inertia
        if linear > 0.0:  # the hull's own share; a hull that has none takes all of it from the law
            damping -= linear
        p = inertia * omega * omega * error
        d = (damping if damping > 0.0 else 0.0) * (r_ref - rate)
        forward = inertia * reference.a_radps2 + (linear + quadratic * abs(r_ref)) * r_ref
        moment = forward + p + d + self._yaw_integral_nm + desired.yaw_nm
        self._held = False
        if desired.gentle:
            most = self._gentle_nm + desired.firmness * (self._firm_nm - self._gentle_nm)
            if self._kicks.brings_round:
                most = max(most, self._kicks.race_nm)
            self._held = abs(moment) > most
            moment = clamp(moment, -most, most)
        return moment, p, d

    def _turn_limits(self, *, gentle: bool) -> TurnLimits:
        # by the file's own speed: no more is asked of the hull for what it is thought to do
        ahead_mps = max(self._observer.u_mps, 0.0)
        return TurnLimits(
            quick_radps=self._at(self._quicks, ahead_mps),
            turn_radps=self._handling.yaw_rate_for_way(ahead_mps),
            least_radps=self._least_rate,
            most_radps=min(self._rate_limit, self._gentle_rate) if gentle else self._rate_limit,
            acceleration_radps2=self._turn_most,
        )

    def _surge(self, dt_s: float, desired: Desired, water: float) -> tuple[float, float, float]:
        """Return the thrust, error and P."""
        surge, wanted = self._observer.surge_mps, desired.speed_mps
        if wanted is None or surge is None:
            self._u_ref = None
            return 0.0, 0.0, 0.0
        measured = water if desired.through_water else surge
        reference = measured if self._u_ref is None else self._u_ref
        most, m11 = self._surge_most, self._m11
        pole = _SPEED_REFERENCE * (1.0 + desired.firmness)
        self._du_ref = change = clamp((wanted - reference) * pole, -most, most)
        reference += change * dt_s
        most = self._attainable_mps + measured - water
        if reference > most:
            reference = most  # beyond what the hull can do it would only take longer to come down again
        self._u_ref = reference
        error = reference - measured
        if desired.gentle:
            # the speed that the thrust on its way will bring: slow propellers need no slow loop then
            coming_mps = self._vessel.thruster.lag_s * (self._observer.gains_mps2 - change)
            p = self._config.speed_gain * m11 * (error - coming_mps)
        else:
            p = self._speed_gain * m11 * error
        through = clamp(reference + (water - measured), -0.5, self._attainable_mps)
        forward = self._handling.drag_n(through) + m11 * change
        total = forward + p + self._surge_integral_n
        if not desired.brake and wanted >= 0.0:
            total = max(total, -BRAKED_SHARE * self._astern_n)
        return total, error, p

    def _integrate(
        self, dt_s: float, given: Allocation, surge_n: float, yaw_nm: float, speed_error: float, omega: float
    ) -> None:
        """Conditional integration: only what the actuators can answer, and not while the reference is turning."""
        bound_nm, tolerance = 0.5 * self._saturated_nm, 0.02 * self._saturated_nm
        if abs(given.yaw_nm - yaw_nm) < tolerance and abs(self._reference.a_radps2) < _CALM_TURN and not self._held:
            gain = self._at(self._integrals, self._observer.u_mps) * self._inertia * omega * omega
            error = clamp(self._heading_error, -_STANDING_RAD, _STANDING_RAD)
            self._yaw_integral_nm = clamp(self._yaw_integral_nm + gain * error * dt_s, -bound_nm, bound_nm)
        # in strong wind the observer's way through the water is an integral, too: with two the boat would swing
        firmness = self._firmness
        self._surge_integral_n -= firmness * self._surge_integral_n * dt_s / _HANDS_OVER_S
        if abs(given.surge_n - surge_n) < 1.0 and abs(self._du_ref) < _CALM_SURGE:
            gain = (1.0 - firmness) * self._speed_integral * self._speed_gain * self._m11
            bound_n = self._ahead_n
            self._surge_integral_n = clamp(self._surge_integral_n + gain * speed_error * dt_s, -bound_n, bound_n)
