"""A plan's graph as the list that it is: from the start on, each manoeuvre has one successor, and the last has none.

Branches, conditions, loops and manoeuvres that are never reached are refused by name: what is not understood is not sailed.
"""

from __future__ import annotations

from typing import Final

from mavlink_bridge import imc

from .refusal import ConsoleRefusedError

_DONE: Final = frozenset({"", "ManeuverIsDone"})
"""The one condition that consoles write: the manoeuvre is over."""


def in_order(spec: imc.PlanSpecification) -> list[imc.PlanManeuver]:
    """The manoeuvres in the order in which they are sailed. Raises ConsoleRefusedError."""
    unknown = imc.holds_unknown(spec)
    if unknown is not None:
        raise ConsoleRefusedError(f"it holds {imc.name_of(unknown.number)}, which is not read here", _holder(spec))
    nodes = {node.maneuver_id: node for node in spec.maneuvers}
    if not nodes:
        raise ConsoleRefusedError("the plan is empty")
    if len(nodes) < len(spec.maneuvers):
        names = [node.maneuver_id for node in spec.maneuvers]
        raise ConsoleRefusedError("there are two manoeuvres of this name", next(n for n in names if names.count(n) > 1))
    following = _following(spec, nodes)
    return _walk(spec.start_man_id, nodes, following)


def _holder(spec: imc.PlanSpecification) -> str:
    """The node in which something unknown stands."""
    return next((node.maneuver_id for node in spec.maneuvers if imc.holds_unknown(node) is not None), "")


def _following(spec: imc.PlanSpecification, nodes: dict[str, imc.PlanManeuver]) -> dict[str, str]:
    """Each node's successor."""
    following: dict[str, str] = {}
    for transition in spec.transitions:
        source, target = transition.source_man, transition.dest_man
        if source not in nodes:
            raise ConsoleRefusedError(f"a transition leads from it to {target}, but it is not in the plan", source)
        if target not in nodes:
            raise ConsoleRefusedError(f"it leads to {target}, which is not in the plan", source)
        if transition.conditions.strip() not in _DONE:
            raise ConsoleRefusedError(
                f'it goes on to {target} on "{transition.conditions}": only on its end is known', source
            )
        if transition.actions:
            raise ConsoleRefusedError(f"its way to {target} has actions: put them to the manoeuvre's end", source)
        if following.get(source, target) != target:
            raise ConsoleRefusedError(f"it has two successors, {following[source]} and {target}", source)
        following[source] = target
    return following


def _walk(start: str, nodes: dict[str, imc.PlanManeuver], following: dict[str, str]) -> list[imc.PlanManeuver]:
    if start not in nodes:
        raise ConsoleRefusedError(f'the plan starts with "{start}", which is not in it')
    order: list[imc.PlanManeuver] = []
    seen: set[str] = set()
    name: str | None = start
    while name is not None:
        if name in seen:
            raise ConsoleRefusedError(f"it goes back to {name}: a loop has no end", order[-1].maneuver_id)
        seen.add(name)
        order.append(nodes[name])
        name = following.get(name)
    for left in nodes:
        if left not in seen:
            raise ConsoleRefusedError("it is never reached from the plan's start", left)
    return order
