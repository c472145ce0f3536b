"""The vessel's parts, and what an operator may do with them: arm, stop, set, switch, say.

``vehicle.py`` runs the parts once per tick; ``orders.py`` carries out requests through here. Nothing here takes time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.messages import (
    Action,
    Desired,
    Distance,
    EstimatedState,
    FenceArea,
    GuardState,
    LogText,
    Mode,
    PlanSpecification,
    PlanState,
    Severity,
    Source,
)
from mavlink_bridge.language.requests import FORGET_MAX_M, DistanceInput, ForgetDepth
from mavlink_bridge.language.snapshot import ControlTrace, FenceStatus, Outlook

from ..estimate import Estimator
from ..guard.board_watch import BoardReport, BoardWatch
from ..guard.depth.guard import DepthGuard, GuardOutput
from ..guard.failsafe import FailsafeMemory, FailsafeResult
from ..guard.failsafe_orders import Order
from ..guard.fence import Fence
from ..guard.gate import Gate
from ..guard.monitors import Monitors
from ..guard.propulsion import PropulsionWatch
from ..guide import Guidance, GuidanceOutput
from ..hull import VesselConfig
from ..hull.geometry import geometry_of
from ..hull.statics import Statics, top_speed_mps
from ..hull.stopping import braking_distance_m
from ..steer import make_controller
from ..steer.law import lowered_text, steady_speed_mps
from .config import TickInputs, VehicleConfig
from .mission import Mission, Point
from .navigator import Navigator
from .operators import Ages, Operators
from .plan_depth import plan_legs
from .plan_fence import PlanFence
from .plan_reach import PlanReach
from .voyage import RESUMED_M, Voyage

_STATION: Final = Source("station", "DISTANCE_SENSOR")

_TOLD_UNKNOWN: Final = 0.01
"""Share of a plan in uncharted water that an operator is told of: less is a border of the chart."""


GUARD_OFF: Final = "depth guard OFF: nothing watches the water under the keel"


class Controls:
    """Holds the parts and the latest results of each; one method for each thing that an order may change."""

    def __init__(self, config: VehicleConfig, vessel: VesselConfig, sources: Sequence[str]) -> None:
        self.operators = Operators()
        self._adopt(config)
        self.vessel = vessel
        self.geometry = geometry = geometry_of(vessel, sources)
        period_us = config.system.period_us
        self.statics = Statics(vessel)
        self.estimator = Estimator(config.estimate, geometry)
        self.mission = Mission(config.mission)
        self.navigator = Navigator(config.modes, self.mission, config.failsafe.manual_timeout_s)
        self.guidance = Guidance(config.guidance, vessel)
        self.controller = make_controller(config.steering.profile, config.steering, vessel)
        self.guard = DepthGuard(config.depth, geometry)
        self.fence = Fence(config.fence)
        self.plan_fence = PlanFence(self.fence)
        self.plan_reach = PlanReach(config.mission)
        self.propulsion = PropulsionWatch(vessel)
        self.monitors = Monitors(config.monitors, geometry.rudder_max_rad, period_us)
        self.gate = Gate(config.gate, geometry.rudder_max_rad, period_us)
        self.armed = False
        self.state = EstimatedState(0)
        self.memory = FailsafeMemory()
        self.result = FailsafeResult(self.memory, Action.NONE)
        self.guard_out = GuardOutput(GuardState.UNKNOWN, None, None, None)
        self.fence_status = FenceStatus()
        self._generation: int | None = None
        self.desired: Desired | None = None
        self.trace = ControlTrace()
        self.guided: GuidanceOutput | None = None
        self._output = self.gate.neutral(0, "start")
        self.inputs = TickInputs()
        self.board_watch, self.board = BoardWatch(), BoardReport()
        self._home_by_operator = False
        self.voyage = Voyage()
        self.started_at: Point | None = None
        """Where the vessel first knew its place in this process, rad."""
        self.terminating = self.aborting = self.rearmed = False
        self.ordered: Order | None = None
        """What an operator has decided since the last tick."""
        self.ages = Ages()
        self.outlook: tuple[Outlook, ...] = ()
        self.returns_by_order = False
        """The return under way, if there is one, was an operator's order."""
        self.interrupted: Mode | None = None
        """What the vessel was doing when a failsafe or the guard broke it off, until an operator's next order."""
        self._owner: tuple[int, int] | None = None
        self.ticks = 0
        self.utc_us: int | None = None
        """UTC of this tick, microseconds since 1970; None = unknown."""
        self._last_us: int | None = None
        self._text_number = 0
        self._texts: list[LogText] = []
        self._depth_inputs: list[Distance] = []
        self.standing = self._say_guard()
        """What a station that comes late should hear too."""
        self._steady_mps = math.inf
        self._limit_speed()

    def _say_guard(self) -> tuple[tuple[Severity, str], ...]:
        """Say what the depth guard's margins allow, or that nothing guards the depth; return it."""
        told = (Severity.INFO, self.guard.startup_warning(self._stopping))
        if not self.depth_enabled:
            told = (Severity.WARNING, GUARD_OFF)
        self.say(*told)
        return (told,)

    @property
    def goes_on_with(self) -> str:
        """The mode that an order would go on with: the one broken off, or the one in force; "" = none."""
        mode = self.interrupted or self.navigator.mode
        return "" if mode in (Mode.HOLD, Mode.MANUAL) else mode.value

    def configure(self, config: VehicleConfig) -> None:
        """Take new live settings; a change of gains does not bump the actuators."""
        old = self.config
        self._adopt(config)
        self.mission.configure(config.mission)
        self.plan_reach.configure(config.mission)
        self.navigator.configure(config.modes, config.failsafe.manual_timeout_s)
        if config.guidance != old.guidance:
            self.guidance.configure(config.guidance)
        if config.steering != old.steering:
            self.controller.configure(config.steering)
            self._limit_speed()
        if config.estimate != old.estimate:
            self.estimator.configure(config.estimate)
        if config.depth != old.depth:
            self.guard.configure(config.depth)
            self.standing = self._say_guard()
        if config.fence != old.fence:
            self.fence.configure(config.fence)
        if config.monitors != old.monitors:
            self.monitors.configure(config.monitors)
        if config.gate != old.gate:
            self.gate.configure(config.gate)

    def _adopt(self, config: VehicleConfig) -> None:
        """Keep the settings, and at hand what of them is asked for in every tick."""
        self.config = config
        self._failsafe = config.failsafe
        self.operators.configure(
            config.operator.ids, gcs_s=config.failsafe.gcs_timeout_s, radio_s=config.failsafe.radio_timeout_s
        )
        self.gcs_required = config.operator.gcs_required
        self.depth_enabled = config.depth.enabled
        self._loiter_radius_m = config.guidance.loiter_radius_m
        self._brakes = config.depth.brake

    def load_plan(self, plan: PlanSpecification) -> None:
        self.mission.load(plan)
        lat_rad, lon_rad = self.state.lat_rad, self.state.lon_rad
        here = None if lat_rad is None or lon_rad is None else (lat_rad, lon_rad)
        unknown = self.guard.unknown_share(plan_legs(plan.maneuvers, here, self._loiter_radius_m))
        if unknown is not None and unknown >= _TOLD_UNKNOWN:
            self.say(Severity.NOTICE, f"{100.0 * unknown:.0f} % of this plan lies in unknown water")

    def load_fence(self, areas: Sequence[FenceArea]) -> None:
        self.fence.load(areas)

    def load_rally(self, points: tuple[Point, ...]) -> None:
        self.mission.rally = points

    def arm(self, now_us: int, sender: int) -> None:
        """Permit thrust. The caller has asked ``prearm_reasons``."""
        if not self.armed:
            self.say(Severity.INFO, "armed")
            if not self.depth_enabled:
                self.say(Severity.WARNING, GUARD_OFF)
            self.controller.reset(self.state)
            self.navigator.forget_hold()  # where it was disarmed, or switched on, may be far away by now
            if not self.voyage.keeps_home:
                self._set_home_here()
            if self.navigator.mode is Mode.AUTO:
                self.look_at_reach()
        self.voyage.armed(now_us, self.here)
        self.armed = self.rearmed = True

    @property
    def here(self) -> Point | None:
        """Where the vessel is, rad; None = not known."""
        state = self.state
        return None if state.lat_rad is None or state.lon_rad is None else (state.lat_rad, state.lon_rad)

    def resume_voyage(self, place: Point | None, home: Point | None, *, by_operator: bool) -> None:
        """The process before this one ended under way: home stays where it was, and arming is no departure."""
        self.voyage.resume(place)
        if home is None:
            return
        self.mission.home, self._home_by_operator = home, by_operator
        where = f"{math.degrees(home[0]):.5f} {math.degrees(home[1]):.5f}"
        self.say(Severity.NOTICE, f"the voyage goes on: home is at {where}; arm, then Return leads there")

    def look_where_started(self) -> None:
        """The place is known for the first time: a voyage that went on far from here was ended on a trailer."""
        self.started_at = here = self.here
        home = self.mission.home
        if here is None or home is None or not self.voyage.keeps_home:
            return
        away_m = inverse(*home, *here)[0]
        if away_m > RESUMED_M:
            self.voyage, self.mission.home, self._home_by_operator = Voyage(), here, False
            self.say(
                Severity.WARNING, f"the voyage before began {away_m / 1000.0:.0f} km away: it is over, and home is here"
            )

    @property
    def lasting_voyage(self) -> dict[str, object] | None:
        """What of a voyage must outlive the process, for ``resume_voyage``; None when there is none."""
        lasting = self.voyage.lasting
        if lasting is None:
            return None
        return {"place": lasting[0], "home": self.mission.home, "by_operator": self._home_by_operator}

    def reach_refusal(self, first: int, *, under_way: bool = False) -> str:
        """Return why the plan lies too far away to be sailed from item ``first`` on, or an empty string."""
        mission = self.mission
        goes_on = first == mission.seq and mission.state in (PlanState.PAUSED, PlanState.ACTIVE)
        return self.plan_reach.refusal(
            mission.plan, first, self.state, mission.home, goes_on=goes_on, under_way=under_way
        )

    def look_at_reach(self) -> None:
        """Loading a plan or arming in Auto starts it: one that lies too far away is told, and the vessel holds instead."""
        mission, in_auto = self.mission, self.navigator.mode is Mode.AUTO
        refusal = self.reach_refusal(mission.seq, under_way=self.armed and mission.state is PlanState.ACTIVE)
        if refusal and in_auto:
            self.navigator.enter(Mode.HOLD, self.state)
        if refusal:
            self.say(Severity.WARNING, f"{refusal}{': holding here' if in_auto else ''}")

    def disarm(self, why: str, *, abort: bool = False, by_operator: bool = False) -> None:
        """Neutral from this tick on. ``abort`` (IMC Abort) also pauses the plan; only an operator goes on."""
        self.voyage.disarmed(self._last_us or 0, self.here, by_operator=by_operator)
        if self.armed:
            self.say(Severity.INFO, f"disarmed: {why}")
        self.armed = False
        if abort:
            self.aborting = True
        if self.navigator.mode is not Mode.MANUAL:
            self.break_off()

    def break_off(self, into: Mode = Mode.HOLD) -> None:
        """Change mode without an order: to hold, or to another mode, and to hold where that is refused."""
        before = self.navigator.mode
        if before is not Mode.HOLD:
            self.interrupted = before
        self.returns_by_order = False
        if self.navigator.enter(into, self.state) and into is not Mode.HOLD:
            self.navigator.enter(Mode.HOLD, self.state)

    def terminate(self, why: str) -> None:
        self.say(Severity.EMERGENCY, why)
        self.terminating = True
        self.armed = False

    def operator_acted(self, order: Order) -> None:
        """An operator has given an order; latched failsafes look at it in the next tick."""
        self.ordered = order
        self.interrupted = None
        self.returns_by_order = self.navigator.mode is Mode.RTL

    def manual_owner(self, sender: int, now_us: int) -> int:
        """Return who has the sticks; the sender when they were free. A change of hands is told to everybody."""
        owner = self._owner
        if owner is None or now_us - owner[1] > self.config.operator.owner_timeout_s * 1e6:
            self._hand_over(sender, now_us)
        elif owner[0] == sender:
            self._owner = (sender, now_us)
        assert self._owner is not None
        return self._owner[0]

    def take_sticks(self, sender: int, now_us: int) -> None:
        """Another station orders manual control: it need not wait when the sticks of the one before have stopped."""
        owner = self._owner
        stopped = owner is not None and now_us - owner[1] > self.config.failsafe.manual_timeout_s * 1e6
        if sender and stopped:
            self._hand_over(sender, now_us)

    def _hand_over(self, sender: int, now_us: int) -> None:
        before = self._owner
        self._owner = (sender, now_us)
        if before is not None and before[0] != sender:
            self.say(Severity.INFO, f"ground station {sender} has the sticks now, not {before[0]}")

    def set_home(self, lat_rad: float | None, lon_rad: float | None) -> str:
        """Set home to a position or to here; return a refusal or an empty string."""
        if lat_rad is None or lon_rad is None:
            lat_rad, lon_rad = self.state.lat_rad, self.state.lon_rad
        if lat_rad is None or lon_rad is None:
            return "no position"
        self.mission.home = (lat_rad, lon_rad)
        self._home_by_operator = True
        return ""

    def enable_fence(self, enable: bool) -> str:
        self.fence.enable(enable)
        return ""

    def depth_input(self, body: DistanceInput, now_us: int) -> None:
        self._depth_inputs.append(Distance(now_us, body.value_m, signal_quality=body.signal_quality, source=_STATION))

    @property
    def guard_state(self) -> GuardState:
        return self.guard.state

    def unlock_guard(self) -> None:
        self.guard.unlock_once()
        self.say(Severity.WARNING, "depth guard unlocked once by the operator")

    def forget_depth(self, body: ForgetDepth) -> str:
        """Forget own soundings around a place and tell which; return a refusal or an empty string."""
        lat_rad, lon_rad = body.lat_rad, body.lon_rad
        if lat_rad is None or lon_rad is None:
            lat_rad, lon_rad = self.state.lat_rad, self.state.lon_rad
        if lat_rad is None or lon_rad is None:
            return "no position"
        if not 0.0 < body.radius_m <= FORGET_MAX_M:
            return f"depths are forgotten within {FORGET_MAX_M:g} m at most"
        if self.guard.memory is None:
            return "there is no depth memory (depth.memory.enabled)"
        cells, least_m = self.guard.forget(lat_rad, lon_rad, body.radius_m)
        where = f"within {body.radius_m:g} m"
        if least_m is None:
            self.say(Severity.NOTICE, f"No depths remembered {where}")
        else:
            self.say(Severity.WARNING, f"Forgot {cells} sounded cells {where}, shallowest {least_m:.2f} m; charts stay")
        return ""

    def say(self, severity: Severity, text: str) -> None:
        """Queue a text for every operator."""
        self._text_number += 1
        self._texts.append(LogText(self._text_number, self._last_us or 0, severity, text))

    def _set_home_here(self) -> None:
        """Home is where the vessel was last armed, and before that where it first knew its place, unless an operator set it."""
        state = self.state
        if not self._home_by_operator and state.lat_rad is not None and state.lon_rad is not None:
            self.mission.home = (state.lat_rad, state.lon_rad)

    def _limit_speed(self) -> None:
        """Keep to the speed up to which the steering law has its margins on this hull, and tell it when it is lowered."""
        steady_mps = steady_speed_mps(self.controller)
        if steady_mps is None or steady_mps == self._steady_mps:
            return
        self._steady_mps = steady_mps
        self.guidance.limit_speed(steady_mps)
        told = lowered_text(steady_mps, top_speed_mps(self.vessel))
        if told:
            self.say(Severity.WARNING, told)

    def _stopping(self, speed_mps: float) -> float:
        if self._brakes:
            return braking_distance_m(self.vessel, speed_mps)
        return self.statics.stopping_distance_m(speed_mps)
