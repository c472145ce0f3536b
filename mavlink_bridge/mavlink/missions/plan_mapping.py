"""Plan items to manoeuvres, with the item, the field and the reason of every refusal.

Every item becomes exactly one manoeuvre, so a manoeuvre's ``seq`` is the item's place in the canonical plan (no home item). Altitudes are
never looked at: ground stations send 50 m by default and a boat is at the surface. Items that only a camera would mind are
accepted as ``Noted``; what the boat cannot do is refused, never replaced by something like it. Sources: MAVLink
common.xml; dune-imc §2.2. ``docs/IMC.md`` has the table.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from ...language import messages as imc
from ...language.requests import LoadPlan, PlanItem, PlanKind
from ..wire.cmd import Cmd
from .fence_mapping import compile_fence, compile_rally
from .figure_items import FIGURE_READERS
from .plan_rules import (
    DEFAULT_LIMITS,
    FRAMES,
    NOTED,
    MissionResult,
    PlanError,
    PlanLimits,
    RefusedError,
    given,
    is_here,
    parameter,
    plan_id,
    position,
    with_places,
    within,
)
from .wire import command_name, home_problem, shift_jump

__all__ = [
    "Cmd",
    "Compiled",
    "MissionResult",
    "PlanError",
    "PlanLimits",
    "compile_item",
    "compile_items",
    "load_plan",
    "plan_id",
]


@dataclass(frozen=True, slots=True)
class Compiled:
    """A plan as understood. With errors, ``plan`` is what could be read and must not be used."""

    plan: imc.PlanSpecification = field(default_factory=imc.PlanSpecification)
    errors: tuple[PlanError, ...] = ()


# One function for each command


def _waypoint(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    latitude, longitude = position(item)
    given(item, 3)
    acceptance = within(item, 2, "acceptance radius", limits.max_length_m, 0.0)
    hold = within(item, 1, "hold time", limits.max_duration_s, 0.0)
    return imc.Goto(seq, latitude, longitude, hold_s=hold, acceptance_m=acceptance or None)


def _return_home(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    return imc.ReturnHome(seq)


def _nav_delay(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    duration = given(item, 1)
    if duration is not None and duration > 0.0:
        return imc.Delay(seq, duration_s=within(item, 1, "delay", limits.max_duration_s))
    clock = [_time_field(item, number) for number in (2, 3, 4)]
    hour, minute, second = clock
    if hour is None and (minute is not None or second is not None) and any(clock):
        raise RefusedError(2, "a time of day needs its hour")
    # ground stations that only know the duration leave the clock at zero or -1
    if hour is None or (duration == 0.0 and not any(clock)):
        return imc.Delay(seq, duration_s=0.0)
    return imc.Delay(seq, until_utc_s_of_day=hour * 3600.0 + (minute or 0.0) * 60.0 + (second or 0.0))


def _time_field(item: PlanItem, number: int) -> float | None:
    value = given(item, number)
    if value is None or value == -1.0:
        return None
    return within(item, number, ("hour", "minute", "second")[number - 2], 23.0 if number == 2 else 59.0)


def _condition_delay(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    return imc.Delay(seq, duration_s=within(item, 1, "delay", limits.max_duration_s))


def _jump(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    target, repeats = given(item, 1), given(item, 2)
    if target is None or target != int(target) or not 0 <= target < limits.max_items:
        raise RefusedError(1, "the jump target is not an item of the plan")
    if int(target) == seq:
        raise RefusedError(1, "the item jumps to itself")
    if repeats is None or repeats != int(repeats) or not -1 <= repeats <= 32_767:
        raise RefusedError(2, f"number of jumps {parameter(item, 2):g} is not -1 (for ever) or a whole number from 0")
    return imc.Jump(seq, int(target), int(repeats))


def _change_speed(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    kind, speed = given(item, 1), given(item, 2)
    if kind not in (None, 0.0, 1.0):
        raise RefusedError(1, f"speed type {kind:g} is neither 0 (airspeed) nor 1 (ground speed)")
    throttle = given(item, 3)
    if speed is None or speed == -1.0:
        if throttle is not None and throttle > 0.0:
            raise RefusedError(3, "a plan sets speed in m/s, not a share of throttle")
        return imc.Noted(seq, item.command, command_name(item.command))
    if speed == -2.0:
        return imc.ChangeSpeed(seq, None)
    if not 0.0 < speed <= limits.max_speed_mps:
        raise RefusedError(2, f"speed {speed:g} m/s is outside 0 to {limits.max_speed_mps:g}")
    if given(item, 4):
        raise RefusedError(4, "relative speeds are not supported")
    return imc.ChangeSpeed(seq, speed)


def _set_home(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    if given(item, 1) == 1.0:
        return imc.SetHome(seq)
    latitude, longitude = position(item)
    return imc.SetHome(seq, latitude, longitude)


def _fence_enable(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    enable = given(item, 1)
    if enable not in (0.0, 1.0):
        raise RefusedError(1, "fence enable must be 0 or 1")
    return imc.FenceEnable(seq, enable == 1.0)


_COMPILERS: Final[dict[int, Callable[[int, PlanItem, PlanLimits], imc.Maneuver]]] = {
    **FIGURE_READERS,
    Cmd.WAYPOINT: _waypoint,
    Cmd.RETURN_TO_LAUNCH: _return_home,
    Cmd.NAV_DELAY: _nav_delay,
    Cmd.CONDITION_DELAY: _condition_delay,
    Cmd.DO_JUMP: _jump,
    Cmd.DO_CHANGE_SPEED: _change_speed,
    Cmd.DO_SET_HOME: _set_home,
    Cmd.DO_FENCE_ENABLE: _fence_enable,
}


def compile_item(seq: int, item: PlanItem, limits: PlanLimits = DEFAULT_LIMITS) -> imc.Maneuver | PlanError:
    """The manoeuvre of one item, or why it is refused. ``seq`` is its place in the canonical plan."""
    try:
        if item.command in NOTED:
            return imc.Noted(seq, item.command, command_name(item.command))
        compiler = _COMPILERS.get(item.command)
        if compiler is None:
            raise RefusedError(None, f"command {item.command} is not supported", MissionResult.UNSUPPORTED)
        if item.frame not in FRAMES:
            raise RefusedError(None, f"frame {item.frame} is not supported", MissionResult.UNSUPPORTED_FRAME)
        return compiler(seq, item, limits)
    except RefusedError as refusal:
        return PlanError(seq, refusal.field, str(refusal), refusal.result)


def item_error(kind: PlanKind, seq: int, item: PlanItem, limits: PlanLimits, offset: int) -> PlanError | None:
    """Why an item is refused as soon as it comes. Fence and rally are judged whole, at the end. ``seq`` and ``offset``: of the link."""
    if kind is not PlanKind.MISSION:
        return None
    if seq < offset:
        problem = home_problem(item)
        return PlanError(-1, None, problem, MissionResult.INVALID) if problem else None
    if is_here(item):
        return None  # where that is the items before it tell
    result = compile_item(seq - offset, shift_jump(item, -offset), limits)
    return result if isinstance(result, PlanError) else None


def compile_items(items: Sequence[PlanItem], limits: PlanLimits = DEFAULT_LIMITS) -> Compiled:
    """Compile a whole canonical mission: every item, then its jumps. All errors at once, in order."""
    if len(items) > limits.max_items:
        reason = f"{len(items)} items, {limits.max_items} fit"
        return Compiled(errors=(PlanError(limits.max_items, None, reason, MissionResult.NO_SPACE),))
    results = [compile_item(seq, item, limits) for seq, item in enumerate(with_places(items))]
    errors = [result for result in results if isinstance(result, PlanError)]
    maneuvers = tuple(result for result in results if not isinstance(result, PlanError))
    if not errors:
        errors = _jump_errors(maneuvers)
    # what is refused has no number: what makes it wrong may be what no plan can be sent with
    return Compiled(imc.PlanSpecification(maneuvers, 0 if errors else plan_id(items)), tuple(errors))


def _takes_time(maneuver: imc.Maneuver) -> bool:
    """True for a manoeuvre that cannot be over at once, so that a loop through it is a patrol and not a hang."""
    if isinstance(maneuver, imc.Delay):
        return maneuver.until_utc_s_of_day is not None or bool(maneuver.duration_s)
    return isinstance(maneuver, imc.Goto | imc.Loiter | imc.ReturnHome)


def _jump_errors(maneuvers: Sequence[imc.Maneuver]) -> list[PlanError]:
    """Jumps out of the plan, and jumps that come back without anything to sail in between."""
    errors: list[PlanError] = []
    for jump in maneuvers:
        if not isinstance(jump, imc.Jump):
            continue
        if jump.target_seq >= len(maneuvers):
            reason = "the jump target is not an item of the plan"
            errors.append(PlanError(jump.seq, 1, reason, MissionResult.INVALID_PARAM1))
        elif jump.repeats and _comes_back(jump, maneuvers):
            reason = "the jump loops without an item to sail in between"
            errors.append(PlanError(jump.seq, 1, reason, MissionResult.INVALID_PARAM1))
    return errors


def _comes_back(jump: imc.Jump, maneuvers: Sequence[imc.Maneuver]) -> bool:
    """True when the jump can be reached from its own target through items that take no time."""
    waiting, seen = [jump.target_seq], set[int]()
    while waiting:
        seq = waiting.pop()
        if seq == jump.seq:
            return True
        if seq in seen or seq >= len(maneuvers) or _takes_time(maneuvers[seq]):
            continue
        seen.add(seq)
        here = maneuvers[seq]
        if isinstance(here, imc.Jump) and here.repeats:
            waiting.append(here.target_seq)
        if not (isinstance(here, imc.Jump) and here.repeats < 0):
            waiting.append(seq + 1)
    return False


def load_plan(kind: PlanKind, items: Sequence[PlanItem], limits: PlanLimits = DEFAULT_LIMITS) -> LoadPlan | PlanError:
    """Compile canonical items of any kind into what the vessel loads, or return the first error."""
    if kind is PlanKind.FENCE:
        areas, errors = compile_fence(items, limits)
        return errors[0] if errors else LoadPlan(kind, tuple(items), fence=areas)
    if kind is PlanKind.RALLY:
        points, errors = compile_rally(items, limits)
        return errors[0] if errors else LoadPlan(kind, tuple(items), rally_rad=points)
    compiled = compile_items(items, limits)
    return compiled.errors[0] if compiled.errors else LoadPlan(kind, tuple(items), plan=compiled.plan)
