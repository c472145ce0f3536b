"""Joins the failsafe's flags: most groups are made by the part that knows them; those of the helm and the ground here."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from mavlink_bridge.language.messages import Mode

from ..guard.failsafe import Flags
from ..guard.failsafe_config import microseconds, reached
from ..guard.failsafe_flags import GroundFlags, HelmFlags, PlanFlags, StopFlags
from .controls import Controls
from .ticked import Guarded, Pursuit, Sensed

_SOUND: Final = PlanFlags()
_INVALID: Final = PlanFlags(plan_invalid=True)
_STICKS_COME_US: Final = 10_000_000
"""Who has taken Manual has reached for the sticks by then; where none ever moved, nobody steers."""


_OF_A_SHOAL: Final = frozenset(("depth_ahead", "depth_shallow", "depth_locked", "depth_braking"))
"""Rows of a vessel that shallow water has stopped."""


def flags_of(
    controls: Controls, sensed: Sensed, course: Pursuit, guarded: Guarded, *, standing: Collection[str]
) -> Flags:
    """Return this tick's flags. ``standing``: conditions that hold or have acted, and no order has come since."""
    parts = controls.parts
    shut_off = "fence_ahead" in standing and parts.mission.havens.is_shut_off(sensed.state)
    return Flags(
        helm=_helm(controls, sensed.now_us, guarded, standing, return_shut_off=shut_off),
        ground=_ground(controls, sensed),
        stop=StopFlags(terminate=controls.terminating, aborted=controls.decided.aborted),
        process=sensed.inputs.process,
        board=sensed.board.flags,
        place=parts.estimator.flags(sensed.state),
        depth=guarded.depth.flags,
        fence=guarded.fence.flags,
        plan=_INVALID if course.guided is not None and course.guided.unable else _SOUND,
        monitors=guarded.monitors,
        thrust=parts.propulsion.flags,
        traffic=parts.traffic.flags,
    )


def _helm(
    controls: Controls, now_us: int, guarded: Guarded, standing: Collection[str], *, return_shut_off: bool
) -> HelmFlags:
    navigator = controls.parts.navigator
    by_hand = navigator.mode is Mode.MANUAL
    wait_s = navigator.stick_wait_s(now_us) if by_hand else None
    is_idle = by_hand and wait_s is None and now_us - navigator.awaited_us >= _STICKS_COME_US
    is_silent = wait_s is not None and reached(wait_s, microseconds(controls.config.failsafe.manual_timeout_s))
    return HelmFlags(
        armed=controls.armed,
        autonomous=not by_hand,
        manual=by_hand and not is_idle and not is_silent,
        manual_idle=is_idle,
        manual_age_s=wait_s,
        guided_age_s=navigator.guided_age_s(now_us),
        return_ordered=controls.returns_by_order and navigator.mode is Mode.RTL,
        return_shut_off=return_shut_off,
        resume=_resume(controls, guarded, standing),
        awaits_arming="depth_locked" in standing,
    )


def _resume(controls: Controls, guarded: Guarded, standing: Collection[str]) -> str:
    """What to order to go on: not what led onto a shoal, as it stands."""
    order = controls.goes_on_with
    if not _is_shallow(guarded, standing):
        return order
    if order in (Mode.GUIDED.value, Mode.CIRCLE.value):
        return f"{order} elsewhere"
    return (
        f"{order} with item {controls.parts.mission.seq} skipped or the plan changed"
        if order == Mode.AUTO.value
        else order
    )


def by_shoal(controls: Controls) -> bool:
    """Whether shallow water has stopped the vessel: what led there does not go on as it stands."""
    return _is_shallow(controls.last.guarded, controls.last.verdict.result.memory.entries)


def _is_shallow(guarded: Guarded, standing: Collection[str]) -> bool:
    depth = guarded.depth.flags
    is_now = depth.depth_ahead or depth.depth_shallow or depth.depth_locked or depth.depth_braking
    return is_now or not _OF_A_SHOAL.isdisjoint(standing)


def _ground(controls: Controls, sensed: Sensed) -> GroundFlags:
    ages = controls.parts.operators.ages(sensed.inputs.heard, sensed.now_us)
    return GroundFlags(
        operator_order=controls.decided.order,
        operator_arm=controls.decided.armed,
        gcs_required=controls.config.operator.gcs_required,
        gcs_age_s=ages.gcs_s,
        radio_age_s=ages.radio_s,
    )
