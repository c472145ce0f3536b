"""PlanControl: what of the console's plans is being sailed, and what a console reads of it (imc-wire §3, §4).

Each request has one answer: when it has been carried out, or refused. What happens later is told by the state alone. Whether a plan
runs is read from the vehicle, so that a plan which somebody else stopped, or that went on over a restart, is shown as it is.
An Abort stays until a separate act, a STOP a moment later, lifts it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from mavlink_bridge import imc
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.client import HeardVehicle, Job, JobOutcome, VehicleClient
from mavlink_bridge.mavlink.client.orders import manual_control
from mavlink_bridge.mavlink.client.vehicle import COMPLETE
from mavlink_bridge.mavlink.missions.plan_rules import plan_id

from ..view import PlanView
from .orders import Helm, Values
from .plan import Plan, Setting, Stage
from .remote import RemoteSticks

TELEOPERATION: Final = imc.Teleoperation.NUMBER
LIFT_AFTER_US: Final = 1_000_000
"""A STOP that is pressed with the Abort belongs to it; later it is a separate act."""
_SETTLE_US: Final = 10_000_000
"""So long after an order the vehicle's word may still be of the time before it: behind a radio states come later than answers."""
_ACTIVE: Final = 3
"""MISSION_STATE_ACTIVE."""
_ABORT_US: Final = 2_000_000
"""An abort that was not obeyed is ordered again this often."""

Done = Callable[[JobOutcome], None]


class DeskPhase(Enum):
    """What the desk is at."""

    IDLE = "idle"
    STARTING = "starting"
    SAILING = "sailing"
    BY_HAND = "by hand"


@dataclass(frozen=True, slots=True)
class StandingAbort:
    """An Abort that stands."""

    words: str
    at_us: int


class Engine:
    """``values`` turns the settings of a plan into parameters; ``say`` takes what an operator should read."""

    def __init__(
        self,
        client: VehicleClient,
        helm: Helm,
        *,
        values: Callable[[tuple[Setting, ...]], Values],
        say: Callable[[int, str], None],
        stick_hold_us: int,
    ) -> None:
        self._client = client
        self._helm = helm
        self._values = values
        self._say = say
        self._stick_hold_us = stick_hold_us
        self.phase = DeskPhase.IDLE
        self.plan: Plan | None = None
        """The plan that sails, or did last."""
        self.plan_name = ""
        self.aborted: StandingAbort | None = None
        self.sticks: RemoteSticks | None = None
        self._stage: Stage | None = None
        self._stage_us: int | None = None
        self._outcome = imc.Outcome.NONE
        self._error = ""
        self._error_us: int | None = None
        self._begun_us = 0
        self._ended_us: int | None = None
        self._astray_us: int | None = None
        """Since when the vessel has not been sailing the plan that it should."""
        self._has_been_active = False
        self._job: Job | None = None
        self._is_disarming = False
        self._is_acknowledged = False
        self._disarm_us = 0
        self._now_us = 0

    # ---- orders -------------------------------------------------------------------------------------------------

    def start(self, plan: Plan, done: Done, now_us: int) -> None:
        """Sail a plan; ``done`` hears what became of the order."""
        self._now_us = now_us
        self.phase, self.plan, self.plan_name, self.sticks = DeskPhase.STARTING, plan, plan.name, None
        self._stage, self._outcome = None, imc.Outcome.NONE

        def started(outcome: JobOutcome) -> None:
            if outcome.ok:
                self.phase = DeskPhase.SAILING
                self._enter(plan.stages[0])
            else:
                self._end(imc.Outcome.FAILURE, outcome.reason)

        self._order(self._helm.start(plan, self._values(plan.on_start), self._begin), started, done)

    def load(self, plan: Plan, done: Done, now_us: int) -> None:
        """Bring a plan aboard without sailing it."""
        self._now_us = now_us
        self.plan, self.plan_name = plan, plan.name
        self._order(self._helm.load(plan), lambda outcome: None, done)

    def steer_by_hand(self, name: str, done: Done, now_us: int) -> None:
        """Hand the sticks to a console."""
        self._now_us = now_us
        self.phase, self.plan, self.plan_name, self._stage = DeskPhase.STARTING, None, name, None
        self._outcome, self.sticks = imc.Outcome.NONE, None

        def taken(outcome: JobOutcome) -> None:
            if outcome.ok:
                self.phase, self._stage_us = DeskPhase.BY_HAND, self._now_us
                self.sticks = RemoteSticks(self._stick_hold_us, self._now_us)
                self._begin()
            else:
                self._end(imc.Outcome.FAILURE, outcome.reason)

        self._order(self._helm.steer_by_hand(), taken, done)

    def stop(self, done: Done, now_us: int, *, success: bool = False) -> None:
        """Keep station; ``success``: what ran has come to its own end."""
        self._now_us = now_us
        was_running = self.phase is not DeskPhase.IDLE

        def stopped(outcome: JobOutcome) -> None:
            if was_running and outcome.ok:
                self._end(imc.Outcome.SUCCESS if success else imc.Outcome.FAILURE, "")

        self.sticks = None
        self._order(self._helm.hold(), stopped, done)

    def abort(self, words: str, now_us: int) -> None:
        """Everything off at once, and nothing more until the Abort is lifted."""
        self._now_us = now_us
        self.aborted, self._job, self.sticks = StandingAbort(words, now_us), None, None
        self._client.give_up(words)
        self._end(imc.Outcome.FAILURE, words)
        self._is_disarming, self._is_acknowledged = True, False
        self._disarm(now_us)

    def lift(self, now_us: int) -> bool:
        """Lift an Abort; False when there is none, or it has only just come."""
        if self.aborted is None or now_us - self.aborted.at_us < LIFT_AFTER_US:
            return False
        if self._error == self.aborted.words:
            self._error, self._error_us = "", None
        self.aborted = None
        self._is_disarming = self._is_disarming and not self._is_acknowledged
        return True

    # ---- time ---------------------------------------------------------------------------------------------------

    def poll(self, now_us: int, *, is_present: bool) -> None:
        """Look at the vehicle. ``is_present``: the commanding console is heard, so that its sticks may be passed on."""
        self._now_us = now_us
        vehicle = self._client.vehicle
        if vehicle is None:
            return
        if self._is_disarming:
            self._see_disarmed(vehicle, now_us)
        match self.phase:
            case DeskPhase.IDLE:
                self._look_for_mine(vehicle)
            case DeskPhase.SAILING:
                self._follow(vehicle)
            case DeskPhase.BY_HAND:
                self._pass_on(vehicle, now_us, is_present=is_present)
            case DeskPhase.STARTING:
                pass
            case _:
                assert_never(self.phase)

    def _see_disarmed(self, vehicle: HeardVehicle, now_us: int) -> None:
        """Order it until it shows; a vehicle that somebody arms again later is his. Behind a radio the first look may see an old state."""
        is_due = now_us >= self._disarm_us
        if self._is_acknowledged and not vehicle.armed and (is_due or not vehicle.by_radio):
            self._is_disarming = False
        elif is_due:
            self._disarm(now_us)

    def _disarm(self, now_us: int) -> None:
        """Order it. A vehicle that is not heard yet is disarmed when it is."""
        self._disarm_us = now_us + _ABORT_US
        if self._client.vehicle is None:
            return

        def obeyed(outcome: JobOutcome) -> None:
            self._is_acknowledged = self._is_acknowledged or outcome.ok

        self._client.start(self._helm.disarm(force=True), obeyed, now_us)

    def _look_for_mine(self, vehicle: HeardVehicle) -> None:
        """A plan of ours that sails without our order: after a restart, or because another station let it go on."""
        plan = self.plan
        if plan is None or self.aborted is not None or not _sails(vehicle) or vehicle.mission_state != _ACTIVE:
            return
        if self._ended_us is not None and self._now_us - self._ended_us < _SETTLE_US:
            return
        if vehicle.mission_id == plan_id(plan.items):
            self.phase, self._has_been_active, self._outcome = DeskPhase.SAILING, True, imc.Outcome.NONE
            self._say(6, f"{plan.name} sails on")

    def _follow(self, vehicle: HeardVehicle) -> None:
        plan = self.plan
        assert plan is not None
        settled = self._now_us - self._begun_us > _SETTLE_US
        runs = _sails(vehicle) and vehicle.mission_state in (0, _ACTIVE)
        self._has_been_active = self._has_been_active or runs or settled
        if not self._has_been_active or self._may_be_old(vehicle):
            return
        if _is_complete(vehicle, plan):
            self._end(imc.Outcome.SUCCESS, "")
        elif not vehicle.armed:
            self._lost(f"the vessel was disarmed{self._last_words()}")
        elif vehicle.mode is not Mode.AUTO:
            mode = vehicle.mode.value if vehicle.mode is not None else f"mode {vehicle.custom_mode}"
            self._lost(f"the vessel left the plan for {mode}{self._last_words()}")
        else:
            self._enter(plan.stage_of(vehicle.item))

    def _may_be_old(self, vehicle: HeardVehicle) -> bool:
        """Whether the vessel's word that it does not sail may be older than its answer to the order: a radio brings them in any order."""
        if _sails(vehicle):
            self._astray_us = None
        elif self._astray_us is None:
            self._astray_us = self._now_us
        return vehicle.by_radio and self._astray_us is not None and self._now_us - self._astray_us < _SETTLE_US

    def _enter(self, stage: Stage) -> None:
        if stage is self._stage:
            return
        before, self._stage, self._stage_us = self._stage, stage, self._now_us
        self._set((before.on_end if before is not None else ()) + stage.on_start)

    def _pass_on(self, vehicle: HeardVehicle, now_us: int, *, is_present: bool) -> None:
        steers = vehicle.armed and vehicle.mode is Mode.MANUAL
        self._has_been_active = self._has_been_active or steers or now_us - self._begun_us > _SETTLE_US
        if not steers and self._has_been_active:
            self.sticks = None
            self._lost(f"the vessel left manual mode{self._last_words()}")
            return
        due = self.sticks.due(now_us) if self.sticks is not None and is_present else None
        if due is not None:
            self._client.send(manual_control(vehicle, *due))

    # ---- inside -------------------------------------------------------------------------------------------------

    def _order(self, job: Job, settle: Done, done: Done) -> None:
        """Begin a job in place of the one before. ``settle``: what follows for the state, unless a newer order decides by then."""
        before, self._job = self._job, job

        def ended(outcome: JobOutcome) -> None:
            if self._job is job:
                self._job = None
                settle(outcome)
            done(outcome)

        if before is not None:
            self._client.give_up("overruled by a newer order", before)
        self._client.start(job, ended, self._now_us)

    def _begin(self) -> None:
        self._begun_us, self._has_been_active, self._astray_us = self._now_us, False, None

    def _end(self, outcome: imc.Outcome, error: str) -> None:
        """Nothing runs any more."""
        if self.phase is DeskPhase.SAILING and self.plan is not None and outcome is imc.Outcome.SUCCESS:
            self._set((self._stage.on_end if self._stage is not None else ()) + self.plan.on_end)
        self.phase, self._stage, self._stage_us = DeskPhase.IDLE, None, None
        self._outcome, self._ended_us = outcome, self._now_us
        if error:
            self._error, self._error_us = error, self._now_us

    def _lost(self, why: str) -> None:
        """What ran was ended by somebody else."""
        self._end(imc.Outcome.FAILURE, why)
        self._say(4, why)

    def _set(self, settings: tuple[Setting, ...]) -> None:
        values = self._values(settings)
        if values:
            self._client.start(self._helm.put(values), self._complain, self._now_us)

    def _complain(self, outcome: JobOutcome) -> None:
        if not outcome.ok:
            self._say(4, outcome.reason)

    def _last_words(self) -> str:
        words = self._client.texts_heard.reasons(max(0, self._client.texts_heard.count - 2))
        return f": {words}" if words else ""

    def view(self) -> PlanView:
        """What the state messages tell."""
        plan, stage = self.plan, self._stage
        state, operation = self._states()
        number = stage.number if stage is not None else TELEOPERATION if self.phase is DeskPhase.BY_HAND else 0xFFFF
        return PlanView(
            state=state,
            plan_id=self.plan_name,
            maneuver_id=stage.name if stage is not None else "Teleoperation" if self.phase is DeskPhase.BY_HAND else "",
            maneuver_type=number,
            maneuver_started_us=self._stage_us,
            progress_pct=100.0 * plan.stages.index(stage) / len(plan.stages) if plan and stage else None,
            maneuver_done=self.phase is DeskPhase.IDLE and self._outcome is imc.Outcome.SUCCESS,
            last_outcome=self._outcome,
            operation=operation,
            last_error=self._error,
            last_error_us=self._error_us,
        )

    def _states(self) -> tuple[imc.PlanState, imc.OpMode]:
        if self.aborted is not None:
            return imc.PlanState.BLOCKED, imc.OpMode.ERROR
        match self.phase:
            case DeskPhase.IDLE:
                ready = self._client.is_heard(self._now_us)
                return imc.PlanState.READY if ready else imc.PlanState.BLOCKED, imc.OpMode.SERVICE
            case DeskPhase.STARTING:
                return imc.PlanState.INITIALIZING, imc.OpMode.SERVICE
            case DeskPhase.SAILING | DeskPhase.BY_HAND:
                return imc.PlanState.EXECUTING, imc.OpMode.MANEUVER
            case _:
                assert_never(self.phase)


def _sails(vehicle: HeardVehicle) -> bool:
    return vehicle.armed and vehicle.mode is Mode.AUTO


def _is_complete(vehicle: HeardVehicle, plan: Plan) -> bool:
    """By its own word, or for a vehicle that says none, because it left Auto after the last item."""
    if vehicle.mission_state == COMPLETE:
        return True
    last = len(plan.items) - 1 + int(vehicle.home_item)
    return vehicle.mission_state == 0 and vehicle.mode is not Mode.AUTO and vehicle.reached == last
