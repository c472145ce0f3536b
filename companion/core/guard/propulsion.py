"""Whether a thruster gives what it is told to: weed on a propeller, a lost one, a broken lead.

What is missing on one side leaves two traces at once: a turning moment towards that side that neither rudder nor hull
explains, and way that is not made. The moment alone may be wind or a bent rudder, the way alone a current; only both,
of the size of the thrust that is missing, are taken for a thruster. Judged only where that thrust stands clear of what a
gale does to the hull. It stays weak until it was asked for thrust and has given it: one that rests shows nothing. What it
still gives is estimated, so that the vessel can be steered with what is left; no sign and no channel is changed by it.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from mavlink_bridge.language.value import value

from ..hull import ForceModel, VesselConfig
from ..hull.actuator_model import ActuatorModel
from ..hull.left import WHOLE, Shares, straight_mps
from ..hull.statics import Statics
from .diagnosis import GALE_MPS, Cause
from .diagnosis.late_heading import LateHeading
from .diagnosis.slow_loss import SlowLoss
from .diagnosis.wrong_way import WrongWay

_TAU_S: Final = 2.5
"""Everything is compared after the same low-pass: waves turn a hull to and fro within 3 s."""
_GUSTS: Final = 1.4
"""A gale's gusts over its mean, as long as the judgement takes: a boat that lies still leans on one thruster against them."""
_ASKED: Final = 0.6
"""Share of one side's moment beyond which no floor goes: what is hardly ever asked for could never be judged."""
_STILL_MPS: Final = 0.5
"""Slower than this over ground the boat keeps a station: what holds it against the wind is thrust, whatever the model takes for way."""
_CLEAR: Final = 1.6
"""The moment that is missing must be this much more than what such a wind turns the hull by."""
_SHARE, _WHOLE = 0.6, 1.4
"""So much of one side's thrust must be missing; more than all of it, and of the rudder that stands in its race, cannot be."""
_TURNED: Final = 3.2
"""Unless it runs the wrong way: that one is short of up to twice as much and a half, because propellers give less astern. Only
thrust that stands clear of a gale is taken for that."""
_AGAINST: Final = -0.35
"""A thruster that is found to give less than this runs the wrong way: astern it gives half of what it gives ahead, or more."""
_WAY_SHARE, _WAY_WHOLE = 0.5, 2.5
"""And so much of it must be missing in the way made, at one time or another of the last ``_WAY_S``."""
_WAY_S: Final = 12.0
"""A boat of some 55 kg has lost its way long before, so both traces fall into it."""
_HELD_S: Final = 7.5
"""Three of the low-pass's times: what a wave or a gust leaves is gone by then."""
_RECENT_S: Final = 60.0
"""What the diagnosis told of longer ago and still did not come true was weather or a hull file that is wrong."""
_DOUBT_S: Final = 60.0
"""A thruster that is lost makes the file look wrong, too: not so soon that it could not be found."""
_DOUBTFUL, _DOUBTED_S = 0.2, 15.0
"""With a file that has been off by so much for a while, what is missing under way must be missing for longer than a corner lasts."""
_ON_TRIAL: Final = 3.0
"""On a sea trial the file is what is to be found: what is missing by it must be missing so many times as long, longer than a manoeuvre
lasts. Of 40 trials with a file wrong by half 12 had been broken off for a thruster that was sound; none is."""
_GONE_S: Final = 20.0
"""So long a thruster must give what it is asked for until it is trusted again: a blade that clears for some seconds and
fouls again is one fault, told once."""
_GIVEN: Final = 0.35
"""Less than this share missing: it gives what it is told."""
_SHARE_TAU_S: Final = 15.0
"""Pole of the estimate of what a weak one gives, once it is found: some gusts, a bend."""
_NOTHING: Final = 0.2
"""An estimate below this is nothing: the moment of a gust is as much, and who leans on thrust that is not there stands still."""
_SOMETHING: Final = 0.4
"""And above this it is something again: the vessel is steered quite otherwise with nothing."""
_STEP: Final = 0.15
"""The share that others reckon with follows the estimate in steps: each means a new allocation."""
_SIDES: Final = (
    (Cause.PORT_WEAK, Cause.PORT_REVERSED),
    (Cause.STARBOARD_WEAK, Cause.STARBOARD_REVERSED),
)
"""What the diagnosis calls it: gives little, and pushes the wrong way."""
_HELM: Final = frozenset({Cause.RUDDERS_STILL, Cause.RUDDERS_REVERSED})
"""Rudders that were told of leave a moment that lasts, too."""
_SMALL_NM: Final = 1.0
"""Below this a hull's moment is lost in the noise of any gyro or compass."""
_USUAL_S: Final = 30.0
"""Ten waves and more: long enough for a mean."""
_TIMES_USUAL: Final = 8.0
"""In quieter weather than a gale: this many times what is usually unexplained, once that is known for ``_USUAL_S``."""
_TIMES_LEAST: Final = 5.0
"""And never fewer times than this, four sigma, as long as the diagnosis has no opinion: a hull that turns across a gale on a circle
lacks more than what a steady gale makes."""
_SWINGS: Final = 0.5
"""Of what stands clear of a gale: so much a late heading must leave missing until it is told, to and fro, as no wind turns a hull."""


@value
class ThrustFlags:
    """Of the thrusters; names as in the failsafe table."""

    thruster_weak: bool = False
    """A thruster gives much less than it is told to, as far as the hull's motion shows."""
    thruster_alone: bool = False
    """And what the other one gives cannot be steered with."""
    thruster_reversed: bool = False
    """One pushes against what it is told, or thrusters or rudders turn the hull the wrong way."""


class PropulsionWatch:
    """One vessel's thrusters; one call per tick. A vessel with one thruster, or with both on the centre line, is not judged."""

    def __init__(self, vessel: VesselConfig, *, heading_late_s: float = 0.0) -> None:
        """``heading_late_s``: what the settings say of it."""
        self._heading_late_s = heading_late_s
        self._model = ForceModel(vessel)
        self._actuators = ActuatorModel(vessel)
        self._vessel, self._statics = vessel, Statics(vessel)
        hull, wind = vessel.hull, vessel.windage
        self._lateral_m = self._model.lateral_m
        self._m11, self._inertia = hull.m11_kg, hull.turning_kgm2
        gale_nm = 0.6125 * wind.cn * wind.lateral_m2 * hull.length_m * GALE_MPS * GALE_MPS
        self._least_nm = max(_SMALL_NM, 0.1 * self._lateral_m * vessel.thruster.ahead_n)
        self._clear_nm = self._most_nm = max(self._least_nm, _CLEAR * gale_nm)
        self._slow_loss = SlowLoss(gale_nm, self._least_nm)
        side_nm = self._lateral_m * vessel.thruster.ahead_n
        self._gusts_nm = max(self._clear_nm, min(_GUSTS * _GUSTS * self._clear_nm, _ASKED * side_nm))
        self.on_trial = False
        """A sea trial is under way."""
        self.has_turn_rate = False
        """A sensor of its own tells it."""
        self._forget()

    def clear(self) -> bool:
        """Forget: disarmed. Return whether a thruster had been weak."""
        found = any(self.weak)
        self._forget()
        return found

    def _forget(self) -> None:
        self._smooth: list[float] | None = None
        self._held_s, self._given_s = [0.0, 0.0], [0.0, 0.0]
        self._fit = [(0.0, 0.0), (0.0, 0.0)]
        self._slow_loss.forget()
        self._lost_s = [0.0, 0.0]
        """For so long nothing but a loss of this side has explained what was missing for minutes."""
        self._slow_s = [math.inf, math.inf]
        self._usual_nm = self._known_s = 0.0
        self._opinion: frozenset[Cause] | None = None
        self._told: frozenset[Cause] = frozenset()
        self._lies = False
        """It keeps a station."""
        self._doubt = 0.0
        """By how much the file has been wrong about the way that is made, of late: none or all."""
        self._sure_s = [0.0, 0.0]
        """For so long the diagnosis, which has told of this side, has held nothing else for possible."""
        self._since_s = [0.0, 0.0]
        """For so long it has told of this side."""
        self.weak = (False, False)
        """Port, starboard: this thruster gives much less than it is told to."""
        self.shares: Shares = WHOLE
        """What each is taken to give of what it is told."""
        self._swapped, self._mirrored = WrongWay(self._clear_nm), WrongWay(self._clear_nm)
        self.late = LateHeading(_SWINGS * self._clear_nm, self._heading_late_s)
        """Whether the heading comes late."""
        self.reversed = False
        """It pushes against what it is told: nothing can be sailed with until somebody has looked at it."""
        self.alone = False
        """One gives nothing, and at no speed do the rudders hold the hull straight against the other."""

    @property
    def flags(self) -> ThrustFlags:
        """What the failsafe should know of the thrusters."""
        reversed_ = self.reversed or self.helm_mirrored
        return ThrustFlags(thruster_weak=any(self.weak), thruster_alone=self.alone, thruster_reversed=reversed_)

    @property
    def helm_mirrored(self) -> bool:
        """The thrusters' difference or the rudders turn the hull the other way than they are told to."""
        return self._swapped.found or self._mirrored.found

    def step(
        self,
        dt_s: float,
        state: EstimatedState,
        sent: ActuatorOutput | None,
        opinion: frozenset[Cause] | None = None,
        told: frozenset[Cause] = frozenset(),
        *,
        before_mps: tuple[float, float] | None = None,
    ) -> tuple[bool, bool]:
        """Take one tick; return which thrusters, port and starboard, are weak.

        ``opinion``: what the diagnosis holds for possible. What it does not is not found here; None = it has none yet.
        ``told``: what it has decided for at some time. ``before_mps``: the drift, north and east, as it was before it suspected anything;
        while it is sure of a side that counts: the drift becomes what a lost propeller does not give, and way through such water turns
        the hull as that propeller would have.
        """
        self._opinion, self._told = opinion, told
        self._doubt += dt_s / _DOUBT_S * (abs(state.made_share) - self._doubt)
        psi, u, v, r = state.compass_rad, state.u_mps, state.v_mps, state.r_radps
        if not self._lateral_m or psi is None or u is None or v is None or r is None or not 0.0 < dt_s < 0.5:
            self._actuators.step(dt_s, sent)
            self._smooth = None
            return self.weak
        is_sure = self._sure_s != [0.0, 0.0]
        known_mps = state.drift_n_mps or 0.0, state.drift_e_mps or 0.0
        drift_n, drift_e = before_mps if before_mps is not None and is_sure else known_mps
        cos, sin = math.cos(psi), math.sin(psi)
        water_u, water_v = u - drift_n * cos - drift_e * sin, v + drift_n * sin - drift_e * cos
        self._actuators.step(dt_s, sent, water_u)
        port_n, starboard_n, angle = self._actuators.port_n, self._actuators.starboard_n, self._actuators.rudder_rad
        _, dv, dr = self._model.rates(
            water_u,
            water_v,
            r,
            thrust_port_n=port_n,
            thrust_starboard_n=starboard_n,
            rudder_port_rad=angle,
            rudder_starboard_rad=angle,
        )
        hull = self._vessel.hull
        moment_nm = hull.m23_kgm * dv + hull.m33_kgm2 * dr
        drag_n = self._statics.drag_n(water_u)
        held_n = port_n + starboard_n - drag_n
        helm_nm = self._model.rudder_slope_nm(water_u, port_n, starboard_n) * angle
        port_nm = self._lateral_m * port_n + self._race_nm(port_n, angle)
        starboard_nm = -self._lateral_m * starboard_n + self._race_nm(starboard_n, angle)
        values = [r, moment_nm, port_n, starboard_n, held_n, u, abs(helm_nm), port_nm, starboard_nm, helm_nm, drag_n]
        if self._smooth is None:
            self._smooth = values
            return self.weak
        smooth, share = self._smooth, dt_s / _TAU_S
        for k, newest in enumerate(values):
            smooth[k] += share * (newest - smooth[k])
        missing_nm = hull.m33_kgm2 * (r - smooth[0]) / _TAU_S - smooth[1]
        lost_n = smooth[4] - self._m11 * (u - smooth[5]) / _TAU_S
        self._lies = -_STILL_MPS < u < _STILL_MPS
        self._judge_all(dt_s, psi, missing_nm, lost_n)
        return self.weak

    def _judge_all(self, dt_s: float, psi: float, missing_nm: float, lost_n: float) -> None:
        """Judge the thrusters by the moment and the thrust that are missing, and the helm where they push."""
        self._most_nm = self._gusts_nm if self._lies else self._clear_nm
        self._note_slow_loss(dt_s, psi, missing_nm)
        self._judge(dt_s, missing_nm, lost_n)
        if not any(self.weak):
            self._judge_helm(dt_s, missing_nm)

    def _race_nm(self, thrust_n: float, angle_rad: float) -> float:
        """What the rudder behind a propeller turns the hull by through that propeller's race alone."""
        return self._model.rudder_slope_nm(0.0, thrust_n, 0.0) * angle_rad

    def _floor(self, dt_s: float, missing_nm: float) -> float:
        """Thrust's moment from which on a thruster can be judged."""
        if self._held_s == [0.0, 0.0] and abs(missing_nm) < self._most_nm:
            self._known_s += dt_s
            size_nm = abs(missing_nm)
            self._usual_nm += (
                dt_s / (self._known_s if self._known_s < _USUAL_S else _USUAL_S) * (size_nm - self._usual_nm)
            )
        if self._known_s < _USUAL_S:
            return self._most_nm
        most_nm = self._most_nm
        if self._opinion is None and not any(self.weak):  # nobody else tells weather from weed
            most_nm = max(most_nm, min(_TIMES_LEAST * self._usual_nm, self._gusts_nm))
        return min(most_nm, max(self._least_nm, _TIMES_USUAL * self._usual_nm))

    def _judge(self, dt_s: float, missing_nm: float, lost_n: float) -> None:
        smooth = self._smooth
        assert smooth is not None
        floor_nm = self._floor(dt_s, missing_nm)
        for side, sense in ((0, -1.0), (1, 1.0)):
            thrust_n = smooth[2 + side]
            told_nm = self._lateral_m * abs(thrust_n)
            lacks_nm = sense * math.copysign(missing_nm, missing_nm * thrust_n) if thrust_n else 0.0
            way_share = lost_n * math.copysign(1.0, thrust_n) / max(abs(thrust_n), 1e-3)
            slow = _WAY_SHARE < way_share < _WAY_WHOLE and told_nm > 0.5 * floor_nm
            self._slow_s[side] = 0.0 if slow else self._slow_s[side] + dt_s
            most = _TURNED if told_nm > self._most_nm else _WHOLE
            weak = told_nm > floor_nm and _SHARE * told_nm < lacks_nm < most * (told_nm + smooth[6])
            weak = weak and self._slow_s[side] < _WAY_S
            self._held_s[side] = self._held_s[side] + dt_s if weak else max(0.0, self._held_s[side] - dt_s)
            self._ask_diagnosis(side, dt_s)
            if told_nm > floor_nm or self._sure_s[side]:
                self._asked(side, dt_s, missing_nm, smooth[7 + side])
        weak_now = (self._is_weak(0), self._is_weak(1))
        if weak_now != self.weak or any(weak_now):
            self.weak = weak_now
            self._set_shares()

    def _note_slow_loss(self, dt_s: float, psi_rad: float, missing_nm: float) -> None:
        """Weed that gathers slowly; once a thruster is weak its own fit goes on."""
        smooth, slow = self._smooth, self._slow_loss
        assert smooth is not None
        if any(self.weak):
            slow.forget()
            self._lost_s = [0.0, 0.0]
            return
        slow.step(dt_s, psi_rad, (smooth[7], smooth[8]), missing_nm, drag_nm=self._lateral_m * smooth[10])
        for side, lost in enumerate(slow.lost):
            self._lost_s[side] = self._lost_s[side] + dt_s if lost else 0.0
            if self._lost_s[side] > self._for_s:
                told = _SHARE_TAU_S * smooth[7 + side] * smooth[7 + side]
                self._fit[side] = (told, lost * told)
                self._given_s[side] = 0.0

    def _judge_helm(self, dt_s: float, missing_nm: float) -> None:
        smooth, patience = self._smooth, _ON_TRIAL if self.on_trial else 1.0
        assert smooth is not None
        sides_nm, apart_nm = (smooth[7], smooth[8]), self._lateral_m * (smooth[2] - smooth[3])
        if self.has_turn_rate:
            self.late.rest()
        else:
            self.late.step(dt_s, apart_nm + smooth[9], missing_nm)
        for helm, helm_nm, cause in (
            (self._swapped, apart_nm, Cause.SWAPPED),
            (self._mirrored, smooth[9], Cause.RUDDERS_REVERSED),
        ):
            may_be, is_late = self._may_be(cause), self.late.explains
            helm.step(dt_s, helm_nm, sides_nm, missing_nm, may_be=may_be, is_late=is_late, patience=patience)

    def _asked(self, side: int, dt_s: float, missing_nm: float, brings_nm: float) -> None:
        """Thrust was asked of this side: fit the share of its moment that is missing, and how long it has been there again."""
        if not (self.weak[side] or self._held_s[side] > dt_s or self._sure_s[side] or self._lost_s[side]):
            self._fit[side] = (0.0, 0.0)
        told, both = self._fit[side]
        keep = 1.0 - dt_s / _SHARE_TAU_S
        told, both = keep * told + dt_s * brings_nm * brings_nm, keep * both - dt_s * brings_nm * missing_nm
        self._fit[side] = (told, both)
        self._given_s[side] = self._given_s[side] + dt_s if both < _GIVEN * told else 0.0

    def _ask_diagnosis(self, side: int, dt_s: float) -> None:
        """It weighs force and moment in any weather: once it has decided for this side and stays with it, there is no doubt left."""
        told = self._told & frozenset(_SIDES[side])
        self._since_s[side] += dt_s if told else 0.0
        if self._opinion and self._opinion <= told and self._since_s[side] < _RECENT_S:
            self._sure_s[side] += dt_s
            self._given_s[side] = 0.0
        else:
            self._sure_s[side] = 0.0

    def _may_be(self, *causes: Cause) -> bool:
        return self._opinion is None or not self._opinion.isdisjoint(causes)

    def _is_weak(self, side: int) -> bool:
        if self.weak[side]:
            return self._held_s[side] > _HELD_S or self._given_s[side] < _GONE_S
        # what was found first explains all the rest
        is_explained = self.weak[1 - side] or self.helm_mirrored
        for_s = self._for_s
        is_sure = self._sure_s[side] > for_s and self._left(side) < 1.0 - _SHARE
        if self._lost_s[side] > for_s:  # the weighing got used to it: what holds nothing for possible is no witness
            is_helm = not self._told.isdisjoint(_HELM)
            return not (is_explained or is_helm) and (not self._opinion or self._may_be(*_SIDES[side]))
        is_found = self._held_s[side] > for_s or is_sure
        return is_found and not is_explained and self._may_be(*_SIDES[side])

    @property
    def _for_s(self) -> float:
        """So long thrust must be missing."""
        if self.on_trial:
            return _ON_TRIAL * _HELD_S
        return _DOUBTED_S if self._doubt >= _DOUBTFUL and not self._lies else _HELD_S

    def _left(self, side: int) -> float:
        """What this side still gives of what it is told, by the moment that is missing."""
        told, both = self._fit[side]
        return 1.0 - both / told if told > 0.0 else 1.0

    def _is_against(self, side: int, fitted: float) -> bool:
        """The diagnosis decides, the fitted share where it holds both or neither for possible."""
        little, against = (self._opinion is not None and cause in self._opinion for cause in _SIDES[side])
        return fitted < _AGAINST if little == against else against

    def _set_shares(self) -> None:
        """What the one that was found first still gives: two that give nothing leave no moment to tell by."""
        if not any(self.weak):
            self.shares, self.alone, self.reversed = WHOLE, False, False
            return
        side = 0 if self.weak[0] and (self.shares[0] < 1.0 or not self.weak[1]) else 1
        fitted = self._left(side)
        old, left = self.shares[side], max(0.0, min(fitted, _SHARE))
        # later the boat is steered by what is left, and gusts and rudders weigh more than a thruster that pushes nothing
        self.reversed = self.reversed or (old == 1.0 and self._is_against(side, fitted))
        new = 0.0 if left < (_SOMETHING if old == 0.0 else _NOTHING) else left
        if abs(new - old) > _STEP or new == 0.0 < old:
            self.shares = shares = (new, 1.0) if side == 0 else (1.0, new)
            self.alone = new == 0.0 and straight_mps(self._vessel, shares) is None
