"""What an operator may do with the vessel: arm, stop, set, switch; and what of it stands until the next order.

``vehicle.py`` runs the parts once per tick; ``orders.py`` carries out requests through here. Nothing here takes time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from mavlink_bridge.language.messages import (
    Distance,
    EstimatedState,
    FenceArea,
    GuardState,
    Mode,
    PlanSpecification,
    PlanState,
    Severity,
    Source,
)
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.requests import DistanceInput
from mavlink_bridge.language.stations import Station

from ..guard.depth.plan_legs import plan_legs
from ..guard.failsafe_orders import Order
from ..hull import Handling
from ..hull.left import WHOLE, Shares
from ..hull.statics import top_speed_mps
from ..hull.stopping import Braking
from ..steer.law import backs_and_fills, lowered_text, steady_speed_mps, turn_rate_radps
from ..steer.slow_compass import DIFFERENCED_S
from .config import TickInputs, VehicleConfig
from .haven import degrees
from .operators import StickOwner
from .parts import Parts
from .ticked import before_the_first
from .voice import Voice
from .voyage import ADRIFT, Left, Voyage

_STATION: Final = Source("station", "DISTANCE_SENSOR")
_TOLD_UNKNOWN: Final = 0.01
"""Share of a plan in uncharted water that an operator is told of: less is a border of the chart."""
GUARD_OFF: Final = "depth guard OFF: nothing watches the depth"
"""Whole in the 50 bytes that a text has on the radio."""


@dataclass(frozen=True, slots=True)
class Decided:
    """What operators have decided since the last tick; the failsafe looks at it once."""

    order: Order | None = None
    armed: bool = False
    aborted: bool = False


class Controls:
    """One vessel's: the operators' side of its parts, and the last whole tick."""

    def __init__(self, config: VehicleConfig, parts: Parts) -> None:
        self.config, self.parts, self.voice = config, parts, Voice()
        parts.navigator.stopping_m = self.stopping_distance_m
        parts.mission.havens.coming_in = self._coming_in
        handling = Handling(parts.vessel)
        parts.navigator.turns_at_rest = handling.model.turns_at_rest
        parts.navigator.turns_away = handling.turns_away
        self.last = before_the_first(parts.gate.neutral(0, "start"))
        """The newest whole tick."""
        self.sensed = self.last.sensed
        """What is known now."""
        self.inputs = TickInputs()
        """What the coming tick will see: an order before it may look at that already."""
        self.armed = self.terminating = False
        self.decided = Decided()
        self._home_by_operator = False
        self.voyage = Voyage()
        self.started_at: LatLon | None = None
        """Where the vessel first knew its place in this process, rad."""
        self.returns_by_order = False
        """The return under way, if there is one, was an operator's order."""
        self.interrupted: Mode | None = None
        """What the vessel was doing when a failsafe or the guard broke it off, until an operator's next order; Hold: a sea trial."""
        self._sticks = StickOwner()
        self._soundings: list[Distance] = []
        self._shares = WHOLE
        self._braking: tuple[tuple[Shares, float, float], Braking] | None = None
        self.standing = self._say_guard()
        """What a station that comes late should hear too."""
        self._steady_mps = math.inf
        self._limit_speed()

    @property
    def state(self) -> EstimatedState:
        """The newest."""
        return self.sensed.state

    @property
    def here(self) -> LatLon | None:
        """Where the vessel is, rad; None = not known."""
        state = self.state
        return None if state.lat_rad is None or state.lon_rad is None else LatLon((state.lat_rad, state.lon_rad))

    def _say_guard(self) -> tuple[tuple[Severity, str], ...]:
        """Say what the depth guard's margins allow, or that nothing guards the depth; return it."""
        told = (Severity.INFO, self.parts.guard.startup_warning(self.stopping_distance_m, self.braking))
        if not self.config.depth.enabled:
            told = (Severity.WARNING, GUARD_OFF)
        self.voice.say(*told)
        return (told,)

    @property
    def goes_on_with(self) -> str:
        """The mode that an order would go on with: the one broken off, or in force; "" = none. Hold also without a plan, or on a trial."""
        mode, on_trial = self.interrupted or self.parts.navigator.mode, self.parts.navigator.trial is not None
        rests = mode in (Mode.MANUAL, Mode.AUTO) and not self.parts.mission.total
        if on_trial or mode is Mode.HOLD or rests:
            return Mode.HOLD.value
        return "" if mode is Mode.MANUAL else mode.value

    def configure(self, config: VehicleConfig) -> None:
        """Take new live settings."""
        old, self.config = self.config, config
        self.parts.configure(config, old)
        if config.steering != old.steering:
            self._limit_speed()
        if config.depth != old.depth:
            self.standing = self._say_guard()

    @property
    def _sails_plan(self) -> bool:
        is_active = self.parts.mission.state is PlanState.ACTIVE
        return self.armed and self.parts.navigator.mode is Mode.AUTO and is_active

    def load_plan(self, plan: PlanSpecification) -> None:
        sails = self._sails_plan
        if self.parts.mission.load(plan, is_armed=self.armed):
            self.parts.plan_reach.goes_on(plan)
        if sails and not plan.maneuvers:
            self.voice.say(Severity.INFO, "the plan was cleared: keeping station here")
        legs = plan_legs(plan.maneuvers, self.here, self.config.guidance.loiter_radius_m)
        unknown = self.parts.guard.unknown_share(legs)
        if unknown is not None and unknown >= _TOLD_UNKNOWN:
            self.voice.say(Severity.NOTICE, f"{100.0 * unknown:.0f} % of this plan lies in unknown water")

    def load_fence(self, areas: Sequence[FenceArea]) -> None:
        self.parts.fence.load(areas)

    def load_rally(self, points: tuple[LatLon, ...]) -> None:
        self.parts.mission.havens.rally = points

    def arm(self, now_us: int) -> None:
        """Permit thrust. The caller has asked ``prearm_reasons``."""
        if not self.armed:
            self.voice.say(Severity.INFO, "armed")
            if not self.config.depth.enabled:
                self.voice.say(Severity.WARNING, GUARD_OFF)
            self.parts.controller.reset(self.state)
            self.parts.navigator.await_sticks(now_us)
            self.parts.navigator.forget_hold()  # where it was disarmed, or switched on, may be far away by now
            home_stays = self.voyage.keeps_home(now_us, self.here, self.parts.mission.home)
            if not home_stays:
                self.set_home_here()
            if self.parts.navigator.mode is Mode.AUTO:
                self.look_at_reach()
            else:
                self.parts.mission.leave()
            self.voice.say_all(self.parts.mission.havens.at_arming(self.state, home_stays=home_stays))
        self.voyage.armed(now_us, self.here)
        self.armed, self.decided = True, replace(self.decided, armed=True)

    def resume_voyage(
        self, place: LatLon | None, home: LatLon | None, seen: LatLon | None, left: Left | None, *, by_operator: bool
    ) -> None:
        """The process before this one ended on a voyage: home stays where it was, and arming is no departure."""
        self.voyage.resume(place, seen, left)
        if home is None:
            return
        self.parts.mission.home, self._home_by_operator = home, by_operator
        lasts = "the voyage goes on" if left is None else "the voyage goes on till half an hour after the disarm"
        self.voice.say(Severity.NOTICE, f"{lasts}: home is at {degrees(home)}; arm, then Return leads there")

    def look_for_home(self, now_us: int, utc_us: int | None) -> None:
        """A voyage that an operator left in an earlier process may be over by now: the next day, or on a trailer."""
        if self.started_at is None:
            self._look_where_started()
        self.voyage.passes(self.here)
        dated = None if self.here is None else utc_us  # without a fix a receiver's date may be any
        self.voyage.hears_time(now_us, dated)
        if self.voyage.is_from_before and not self.voyage.has_begun(now_us):
            self._begin_anew()
            self.voice.say(Severity.NOTICE, "the voyage before is over: home is where the boat is armed")
        if self.voyage.tells_adrift(now_us):
            self.voice.say(*ADRIFT)
        if self.parts.mission.home is None:
            self.set_home_here()

    def _begin_anew(self) -> None:
        """The voyage of an earlier process is over: nothing of it stays."""
        self.voyage, self.parts.mission.home, self._home_by_operator = Voyage(), self.here, False

    def _look_where_started(self) -> None:
        """The place is known for the first time: a voyage that went on far from here was ended on a trailer."""
        here, home = self.here, self.parts.mission.home
        self.started_at = here
        if here is None or home is None:
            return
        if away_m := self.voyage.carried_m(here, home):
            self._begin_anew()
            text = f"the voyage before was left {away_m / 1000.0:.0f} km away: it is over, and home is here"
            self.voice.say(Severity.WARNING, text)

    @property
    def lasting_voyage(self) -> dict[str, object] | None:
        """What of a voyage must outlive the process, for ``resume_voyage``; None when there is none."""
        lasting = self.voyage.lasting
        if lasting is None or not self.voyage.has_begun(self.voice.now_us):
            return None
        place, seen = lasting
        kept = {"place": place, "seen": seen, "home": self.parts.mission.home, "by_operator": self._home_by_operator}
        return {**kept, "left": self.voyage.left}

    def reach_refusal(self, first: int, *, under_way: bool = False) -> str:
        """Return why the plan lies too far away to be sailed from item ``first`` on, or an empty string."""
        mission = self.parts.mission
        is_there = first == mission.seq and mission.state in (PlanState.PAUSED, PlanState.ACTIVE)
        goes_on = is_there and not mission.is_changed
        under_way = under_way or (is_there and mission.is_changed and self._sails_plan)
        return self.parts.plan_reach.refusal(
            mission.plan, first, self.state, mission.home, goes_on=goes_on, under_way=under_way
        )

    def look_at_reach(self) -> None:
        """Loading a plan or arming in Auto starts it: one that lies too far away is told, and the vessel holds instead."""
        mission, in_auto = self.parts.mission, self.parts.navigator.mode is Mode.AUTO
        refusal = self.reach_refusal(mission.seq, under_way=self._sails_plan)
        if refusal and in_auto:
            self.parts.navigator.enter(Mode.HOLD, self.state)
        if refusal:
            self.voice.say(Severity.WARNING, f"{refusal}{': holding here' if in_auto else ''}")

    def disarm(self, why: str, *, abort: bool = False, by_operator: bool = False) -> None:
        """Neutral from this tick on. ``abort`` (IMC Abort) also pauses the plan; only an operator goes on."""
        self.voyage.disarmed(self.voice.now_us, self.here, by_operator=by_operator)
        if self.armed:
            self.voice.say(Severity.INFO, f"disarmed: {why}")
        self.armed = False
        if abort:
            self.decided = replace(self.decided, aborted=True)
        if self.parts.navigator.mode is not Mode.MANUAL:
            self.break_off(f"disarmed ({why})")

    def break_off(self, why: str, into: Mode = Mode.HOLD) -> None:
        """Change mode without an order, ``why`` in words: to hold, or to another mode, and to hold where that is refused."""
        navigator = self.parts.navigator
        if navigator.mode is not Mode.HOLD:
            self.interrupted = navigator.mode if navigator.trial is None else Mode.HOLD
        self.returns_by_order = False
        navigator.end_trial(why)
        if navigator.enter(into, self.state) and into is not Mode.HOLD:
            navigator.enter(Mode.HOLD, self.state)

    def terminate(self, why: str) -> None:
        self.voice.say(Severity.EMERGENCY, why)
        self.terminating = True
        self.armed = False

    def operator_acted(self, order: Order) -> None:
        """An operator has given an order; latched failsafes look at it in the next tick."""
        self.decided = replace(self.decided, order=order)
        self.interrupted = None
        self.returns_by_order = self.parts.navigator.mode is Mode.RTL

    def manual_owner(self, station: Station | None, now_us: int) -> Station | None:
        """Return who has the sticks; the sender when they were free. A change of hands is told to everybody."""
        timeout_s, neutral_s = self.config.operator.owner_timeout_s, self.config.failsafe.manual_timeout_s
        owner, text = self._sticks.owner(station, now_us, timeout_s, neutral_s)
        self._tell_hands(text)
        return owner

    def take_sticks(self, station: Station | None, now_us: int) -> None:
        """Another station orders manual control: it need not wait when the sticks of the one before have stopped."""
        self._tell_hands(self._sticks.take(station, now_us, self.config.failsafe.manual_timeout_s))

    def set_home(self, lat_rad: float | None, lon_rad: float | None) -> str:
        """Set home to a position or to here; return a refusal or an empty string."""
        if lat_rad is None or lon_rad is None:
            lat_rad, lon_rad = self.state.lat_rad, self.state.lon_rad
        if lat_rad is None or lon_rad is None:
            return "no position"
        self.parts.mission.home = LatLon((lat_rad, lon_rad))
        self._home_by_operator = True
        if far := self.parts.mission.havens.far(self.state):
            self.voice.say(Severity.WARNING, far)
        return ""

    def enable_fence(self, enable: bool) -> str:
        self.parts.fence.enable(enable)
        return ""

    def depth_input(self, body: DistanceInput, now_us: int) -> None:
        """A depth that a station sends counts as a sounding from the next tick on."""
        self._soundings.append(Distance(now_us, body.value_m, signal_quality=body.signal_quality, source=_STATION))

    def take_soundings(self) -> list[Distance]:
        """Return what stations have sent since the last call."""
        taken, self._soundings = self._soundings, []
        return taken

    @property
    def guard_state(self) -> GuardState:
        return self.parts.guard.state

    def unlock_guard(self) -> None:
        self.parts.guard.unlock_once()
        self.voice.say(Severity.WARNING, "depth guard unlocked once by the operator")

    def set_home_here(self) -> None:
        """Home is where the vessel was last armed, and before that where it first knew its place, unless an operator set it."""
        state = self.state
        if not self._home_by_operator and state.lat_rad is not None and state.lon_rad is not None:
            self.parts.mission.home = LatLon((state.lat_rad, state.lon_rad))

    def _tell_hands(self, text: str) -> None:
        if text:
            self.voice.say(Severity.INFO, text)

    def use_thrusters(self, shares: Shares) -> None:
        """Sail with what each thruster still gives of what it is told, port and starboard, where the law can."""
        is_other_boat = (self._shares == WHOLE) != (shares == WHOLE)
        self._shares = shares
        self.parts.turned.thrusters(shares)
        law_takes = getattr(self.parts.controller, "thrusters", None)
        if law_takes is None:
            return
        through_mps = None
        if is_other_boat:  # what was no thrust had passed for water, in this tick's state, too
            state, through_mps = self.parts.estimator.recall_water(self.state)
            self.sensed = replace(self.sensed, state=state)
        law_takes(shares, through_mps)
        self.parts.guidance.thrusters(shares)
        self._limit_speed()

    def watch_compass(self, now_us: int) -> None:
        """Steer more gently by a compass that speaks seldom, where the law can."""
        seldom, waited_s = self.parts.slow_compass, self.parts.estimator.heading_waited_s(now_us)
        if not seldom.step(now_us, waited_s, is_steered=self.armed):
            return
        law_takes = getattr(self.parts.controller, "seldom_heard", None)
        if law_takes is None:
            return
        law_takes(seldom.late_s)
        if seldom.late_s > DIFFERENCED_S:
            self.voice.say(
                Severity.NOTICE,
                f"Compass is heard each {seldom.wait_s:.1f} s and tells no turn rate: steered more gently",
            )
        self._limit_speed()

    def _limit_speed(self) -> None:
        """Keep to what the steering law gives: turns, and the speed up to which it has its margins; tell when that is lowered."""
        controller = self.parts.controller
        steady_mps = steady_speed_mps(controller)
        if steady_mps is None:
            return
        self.parts.guidance.limit(
            fast_mps=steady_mps, turn_radps=turn_rate_radps(controller), backs_and_fills=backs_and_fills(controller)
        )
        if steady_mps == self._steady_mps:
            return
        self._steady_mps = steady_mps
        told = lowered_text(steady_mps, top_speed_mps(self.parts.vessel))
        if told and self._shares != WHOLE:
            told = f"Sailing on with what the thrusters still give: at most {steady_mps:.1f} m/s"
        if told:
            self.voice.say(Severity.WARNING, told)

    def stopping_distance_m(self, speed_mps: float) -> float:
        """The way that stopping takes from this speed, by coasting: the depth guard alone brakes."""
        return self.parts.statics.stopping_distance_m(speed_mps)

    def _coming_in(self, speed_mps: float | None) -> tuple[float, float]:
        """Speed of a return, and the way to rest beyond its place: she is there, and slows down, within the acceptance radius."""
        speed_mps = speed_mps or self.parts.navigator.return_speed_mps
        return speed_mps, self.stopping_distance_m(speed_mps) - self.config.guidance.acceptance_m

    @property
    def braking(self) -> Braking:
        """What thrust astern of the depth guard does now: with what the thrusters still give and what the gate lets through."""
        gate, most = self.config.gate, self.parts.statics.most_command(self.last.verdict.result.thrust_share)
        how = self._shares, max(gate.thruster_min, -most), gate.thruster_rate
        if self._braking is None or self._braking[0] != how:
            shares, least, rate_per_s = how
            self._braking = how, Braking(self.parts.vessel, shares, least, rate_per_s)
        return self._braking[1]
