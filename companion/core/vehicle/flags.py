"""Joins the failsafe's flags: most are made by the part that knows them; of the helm and the ground they are made here."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Mode

from ..estimate.flags import PlaceFlags
from ..guard.failsafe import Flags
from ..guard.failsafe_flags import GroundFlags, HelmFlags, PlanFlags, StopFlags
from ..guard.fence import FenceFlags
from ..guard.monitors import MonitorFlags
from ..guard.propulsion import ThrustFlags
from .controls import Controls

_MANUAL: Final = Mode.MANUAL
_RETURN: Final = Mode.RTL


def gather(vehicle: Controls, now_us: int, seen: MonitorFlags, fence: FenceFlags) -> Flags:
    """Return this tick's flags."""
    state, estimator = vehicle.state, vehicle.estimator
    return Flags(
        helm=_helm(vehicle, now_us),
        ground=GroundFlags(
            operator_order=vehicle.ordered,
            operator_arm=vehicle.rearmed,
            gcs_required=vehicle.gcs_required,
            gcs_age_s=vehicle.ages.gcs_s,
            radio_age_s=vehicle.ages.radio_s,
        ),
        stop=StopFlags(terminate=vehicle.terminating, aborted=vehicle.aborting),
        process=vehicle.inputs.process,
        board=vehicle.board.flags,
        place=PlaceFlags(
            position_lost=state.x_m is None or state.y_m is None,
            heading_lost=state.psi_rad is None,
            position_frozen=estimator.frozen,
            sources_disagree=estimator.sources_disagree,
        ),
        depth=vehicle.guard_out.flags,
        fence=fence,
        plan=PlanFlags(plan_invalid=vehicle.guided is not None and bool(vehicle.guided.unable)),
        monitors=seen,
        thrust=ThrustFlags(thruster_weak=any(vehicle.propulsion.weak)),
    )


def _helm(vehicle: Controls, now_us: int) -> HelmFlags:
    navigator = vehicle.navigator
    by_hand = navigator.mode is _MANUAL
    stick_age_s = navigator.stick_age_s(now_us) if by_hand else None
    return HelmFlags(
        armed=vehicle.armed,
        autonomous=not by_hand,
        manual=stick_age_s is not None,
        manual_age_s=stick_age_s,
        guided_age_s=navigator.guided_age_s(now_us),
        return_ordered=vehicle.returns_by_order and navigator.mode is _RETURN,
        resume=vehicle.goes_on_with,
    )
