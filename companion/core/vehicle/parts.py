"""The parts of one vessel, made once from its settings and its hull; each keeps its own memory, none knows another's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..estimate import Estimator
from ..guard.board_watch import BoardWatch
from ..guard.depth.guard import DepthGuard
from ..guard.diagnosis import Diagnosis
from ..guard.fence import Fence
from ..guard.gate import Gate
from ..guard.monitors import Monitors
from ..guard.propulsion import PropulsionWatch
from ..guide import Guidance
from ..hull import Handling, VesselConfig
from ..hull.geometry import geometry_of
from ..hull.statics import Statics
from ..steer import make_controller
from ..steer.law import Controller
from ..steer.slow_compass import SlowCompass
from ..steer.turned import ModelledTurn
from ..traffic import Traffic
from .config import VehicleConfig
from .haven import Havens
from .mission import Mission
from .navigator import Navigator
from .operators import Operators
from .plan_fence import PlanFence
from .plan_reach import PlanReach
from .progress_watch import ProgressWatch, turning_us


@dataclass(frozen=True, slots=True)
class Parts:
    """In the order in which a tick comes to them."""

    vessel: VesselConfig
    statics: Statics
    """What the hull file says of speed, thrust and way, worked out beforehand."""
    estimator: Estimator
    turned: ModelledTurn
    board: BoardWatch
    propulsion: PropulsionWatch
    diagnosis: Diagnosis
    traffic: Traffic
    operators: Operators
    mission: Mission
    navigator: Navigator
    plan_reach: PlanReach
    plan_fence: PlanFence
    progress: ProgressWatch
    guidance: Guidance
    controller: Controller
    slow_compass: SlowCompass
    guard: DepthGuard
    fence: Fence
    monitors: Monitors
    gate: Gate

    def configure(self, config: VehicleConfig, old: VehicleConfig) -> None:
        """Take new live settings; a change of gains does not bump the actuators."""
        failsafe = config.failsafe
        self.operators.configure(config.operator.ids, gcs_s=failsafe.gcs_timeout_s, radio_s=failsafe.radio_timeout_s)
        self.mission.configure(config.mission)
        self.plan_reach.configure(config.mission)
        self.navigator.configure(config.modes, failsafe.manual_timeout_s)
        if config.guidance != old.guidance:
            self.guidance.configure(config.guidance)
        if config.steering != old.steering:
            self.controller.configure(config.steering)
        if config.estimate != old.estimate:
            self.estimator.configure(config.estimate)
        if config.depth != old.depth:
            self.guard.configure(config.depth)
        if config.fence != old.fence:
            self.fence.configure(config.fence)
        if config.monitors != old.monitors:
            self.monitors.configure(config.monitors)
        if config.traffic != old.traffic:
            self.traffic.configure(config.traffic)
        if config.gate != old.gate:
            self.gate.configure(config.gate)


def make_parts(config: VehicleConfig, vessel: VesselConfig, sources: Sequence[str]) -> Parts:
    """Make them. ``sources``: names of the sensor links, in the order of their numbers."""
    geometry, period_us = geometry_of(vessel, sources), config.system.period_us
    fence, failsafe = Fence(config.fence), config.failsafe
    mission = Mission(config.mission, Havens(config.mission, fence))
    return Parts(
        vessel=vessel,
        statics=Statics(vessel),
        estimator=Estimator(config.estimate, geometry),
        turned=ModelledTurn(vessel),
        board=BoardWatch(),
        propulsion=PropulsionWatch(vessel, heading_late_s=config.estimate.heading_late_s),
        diagnosis=Diagnosis(vessel),
        traffic=Traffic(config.traffic),
        operators=Operators(config.operator.ids, gcs_s=failsafe.gcs_timeout_s, radio_s=failsafe.radio_timeout_s),
        mission=mission,
        navigator=Navigator(config.modes, mission, failsafe.manual_timeout_s),
        plan_reach=PlanReach(config.mission),
        plan_fence=PlanFence(fence),
        progress=ProgressWatch(turning_us(Handling(vessel))),
        guidance=Guidance(config.guidance, vessel),
        slow_compass=SlowCompass(),
        controller=make_controller(config.steering.profile, config.steering, vessel),
        guard=DepthGuard(config.depth, geometry),
        fence=fence,
        monitors=Monitors(config.monitors, geometry.rudder_max_rad, period_us),
        gate=Gate(config.gate, geometry.rudder_max_rad, period_us),
    )
