"""A console's plan, compiled: the items that the vehicle sails, which item belongs to which manoeuvre, and what is done besides.

Whatever is refused is refused here, before anything is sent. Actions of a plan or manoeuvre that set how it is sailed are done when
their time comes, and noted; those that set what guards the vessel are refused; settings of payloads that this vessel has not are noted
and passed over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, assert_never

from mavlink_bridge import imc
from mavlink_bridge.language import messages as ours
from mavlink_bridge.language.figures import Circle, Hover, LoiterDirection
from mavlink_bridge.language.requests import PlanItem
from mavlink_bridge.mavlink.client import Autopilot
from mavlink_bridge.mavlink.missions.plan_export import InexpressibleError, items_from_maneuvers
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.mavlink.missions.plan_rules import MAX_ITEMS
from mavlink_bridge.mavlink.wire.cmd import Cmd

from .graph import in_order
from .maneuvers import Means, sailed
from .refusal import ConsoleRefusedError

Task = ours.Goto | ours.Loiter
SETTABLE: Final = frozenset({"Guidance"})
"""Parts that a plan may set: how it is sailed. All the others guard or tune the vessel, and nobody would put them back for sure: a
bridge ashore may be gone when the plan ends."""
_NOTES_SAID: Final = 3
"""More would not be read in a console's pop-up."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter that an action sets: section and name as the console knows them, and the value's text."""

    section: str
    name: str
    value: str


@dataclass(frozen=True, slots=True)
class Stage:
    """One manoeuvre of the plan, under its name."""

    name: str
    number: int
    """Of its IMC message."""
    first: int
    """Canonical number of its first item."""
    last: int
    on_start: tuple[Setting, ...] = ()
    on_end: tuple[Setting, ...] = ()


@dataclass(frozen=True, slots=True)
class Plan:
    """What is sent, and how its progress is told back."""

    name: str
    spec: imc.PlanSpecification
    items: tuple[PlanItem, ...]
    stages: tuple[Stage, ...]
    on_start: tuple[Setting, ...] = ()
    on_end: tuple[Setting, ...] = ()
    notes: tuple[str, ...] = ()

    def stage_of(self, item: int) -> Stage:
        """The manoeuvre of a canonical item; the last beyond the end."""
        return next((stage for stage in self.stages if item <= stage.last), self.stages[-1])

    @property
    def remark(self) -> str:
        """What of the plan means nothing here, for a person; "" when all of it does."""
        more = len(self.notes) - _NOTES_SAID
        said = "; ".join(self.notes[:_NOTES_SAID])
        return f"{said}; and {more} more" if more > 0 else said


def compiled(
    spec: imc.PlanSpecification,
    means: Means,
    autopilot: Autopilot = Autopilot.OURS,
    max_speed_mps: float | None = None,
    sections: Sequence[str] = (),
) -> Plan:
    """Read a whole plan. ``sections``: the parts that have parameters here. Raises ConsoleRefusedError with node and reason."""
    notes: list[str] = []
    tasks: list[Task] = []
    spans: list[tuple[imc.PlanManeuver, int]] = []
    for node in in_order(spec):
        tasks += _tasks(node, means, autopilot, max_speed_mps, notes)
        spans.append((node, len(tasks)))
    tasks = [replace(task, seq=number) for number, task in enumerate(tasks)]
    try:
        items = items_from_maneuvers(tasks)
    except InexpressibleError as error:
        raise ConsoleRefusedError(str(error)) from None
    if len(items) > MAX_ITEMS:
        raise ConsoleRefusedError(f"{len(items)} items: {MAX_ITEMS} fit")
    if spec.variables:
        notes.append(f"{len(spec.variables)} variables are not looked at")
    stages = _stages(items, spans, sections, notes)
    _read_back(items, stages)
    return Plan(
        name=spec.plan_id,
        spec=spec,
        items=items,
        stages=stages,
        on_start=_settings(spec.start_actions, "the plan's start", sections, notes),
        on_end=_settings(spec.end_actions, "the plan's end", sections, notes),
        notes=tuple(dict.fromkeys(notes)),
    )


def _tasks(
    node: imc.PlanManeuver,
    means: Means,
    autopilot: Autopilot,
    max_speed_mps: float | None,
    notes: list[str],
) -> list[Task]:
    try:
        found = sailed(node.data, means)
        notes += [f"{node.maneuver_id}: {note}" for note in found.notes]
        tasks = [_fitted(task, autopilot, node.maneuver_id, notes) for task in found.maneuvers]
    except ConsoleRefusedError as refusal:
        raise ConsoleRefusedError(refusal.reason, node.maneuver_id) from None
    for task in tasks:
        if max_speed_mps is not None and (task.speed_mps or 0.0) > max_speed_mps + 1e-6:
            raise ConsoleRefusedError(
                f"speed {task.speed_mps:g} m/s is above the limit {max_speed_mps:g}", node.maneuver_id
            )
        if isinstance(task, ours.Loiter) and task.duration_s is None and task.turns is None:
            notes.append(f"{node.maneuver_id} has no duration: it lasts until STOP")
    return tasks


def _read_back(items: Sequence[PlanItem], stages: Sequence[Stage]) -> None:
    """Refuse here, by the manoeuvre's name, what the vessel would refuse by an item's number."""
    for error in compile_items(items).errors:
        node = next((stage.name for stage in stages if error.seq <= stage.last), "")
        raise ConsoleRefusedError(error.reason, node)


# What the autopilot can sail


def _fitted(task: Task, autopilot: Autopilot, node: str, notes: list[str]) -> Task:
    """A task as this autopilot sails it. Raises ConsoleRefusedError for what it would sail otherwise."""
    if isinstance(task, ours.Goto):
        return task
    match autopilot:
        case Autopilot.OURS:
            return task
        case Autopilot.ARDUPILOT:
            return task if isinstance(task.figure, Hover) else _in_turns(task, node, notes)
        case Autopilot.PX4 | Autopilot.OTHER:
            if isinstance(task.figure, Hover):
                return task
            raise ConsoleRefusedError(f"a {task.figure.name} loiter is not one of {autopilot.value}'s boat manoeuvres")
        case _:
            assert_never(autopilot)


def _in_turns(task: ours.Loiter, node: str, notes: list[str]) -> ours.Loiter:
    """ArduPilot's boats go round by turns, not by time, and clockwise or back only."""
    circle = task.figure
    if not isinstance(circle, Circle):
        raise ConsoleRefusedError(f"a {circle.name} loiter is not one of ArduPilot's boat manoeuvres")
    if circle.direction is LoiterDirection.INTO_DRIFT:
        raise ConsoleRefusedError("ArduPilot's boats do not choose a circle's direction by wind or current")
    if task.duration_s is None or task.speed_mps is None or circle.radius_m is None:
        raise ConsoleRefusedError("ArduPilot's boats do not circle without end: give it a duration")
    turns = max(1.0, round(task.speed_mps * task.duration_s / (6.283185307179586 * circle.radius_m)))
    notes.append(f"{node}: {task.duration_s:g} s are sailed as {turns:g} turns")
    direction = LoiterDirection.CCW if circle.direction is LoiterDirection.CCW else LoiterDirection.CW
    return replace(task, figure=replace(circle, direction=direction), duration_s=None, turns=turns)


# Items and actions


def _stages(
    items: Sequence[PlanItem],
    spans: Sequence[tuple[imc.PlanManeuver, int]],
    sections: Sequence[str],
    notes: list[str],
) -> tuple[Stage, ...]:
    """Which items each manoeuvre became: a speed belongs to what is sailed with it."""
    ends = [number for number, item in enumerate(items) if item.command != Cmd.DO_CHANGE_SPEED]
    stages: list[Stage] = []
    first = 0
    for node, count in spans:
        last = ends[count - 1]
        assert node.data is not None
        stages.append(
            Stage(
                name=node.maneuver_id,
                number=node.data.NUMBER,
                first=first,
                last=last,
                on_start=_settings(node.start_actions, node.maneuver_id, sections, notes),
                on_end=_settings(node.end_actions, node.maneuver_id, sections, notes),
            )
        )
        first = last + 1
    return tuple(stages)


def _settings(
    actions: Sequence[imc.Message], where: str, sections: Sequence[str], notes: list[str]
) -> tuple[Setting, ...]:
    """The settings of this vessel among actions; all are noted. Raises ConsoleRefusedError for one that is not a plan's to set."""
    found: list[Setting] = []
    for action in actions:
        if not isinstance(action, imc.SetEntityParameters):
            notes.append(f"{where}: {imc.name_of(action.NUMBER)} does nothing here")
        elif action.name not in sections:
            notes.append(f"{where}: there is no {action.name} here, its settings are passed over")
        elif action.name not in SETTABLE:
            names = ", ".join(each.name for each in action.params[:_NOTES_SAID]) or action.name
            raise ConsoleRefusedError(
                f"a plan may not set {names} ({action.name}): set it by itself, before START", where
            )
        else:
            found += [Setting(action.name, each.name, each.value) for each in action.params]
            notes += [f"{where} sets {each.name} = {each.value}, which stays" for each in action.params]
    return tuple(found)
