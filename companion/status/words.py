"""What the vessel does now, and what it will do next, in sentences that a person reads at a glance."""

from __future__ import annotations

from typing import Final, assert_never

from mavlink_bridge.language.messages import Action, Mode, PlanState
from mavlink_bridge.language.snapshot import Outlook, Snapshot

from ..core.guard.failsafe_table import BY_NAME
from ..core.guard.failsafe_words import BACK

_WILL: Final = {
    Action.WARN: "warns",
    Action.HOLD: "HOLDS",
    Action.RETURN: "RETURNS",
    Action.STOP: "STOPS",
    Action.DISARM: "DISARMS",
    Action.TERMINATE: "TERMINATES",
}
"""What the vessel will do by itself, as a verb."""


def doing(s: Snapshot) -> str:
    """What the vessel does at this moment, in one sentence."""
    if s.terminated:
        return "Terminated: motors off until the program is started again"
    if not s.armed:
        return "Disarmed: motors off"
    if s.action is Action.STOP and s.mode is not Mode.MANUAL:
        return "Stopped: thrust is cut, it drifts"
    match s.mode:
        case Mode.MANUAL:
            return "Stopped: thrust is cut" if s.action >= Action.STOP else "Steered by hand"
        case Mode.HOLD | Mode.LOITER:
            return "Holds its place"
        case Mode.AUTO:
            return _sailing(s)
        case Mode.RTL:
            return f"Returns home{_to_go(s)}"
        case Mode.GUIDED:
            return f"Goes to a point{_to_go(s)}"
        case Mode.CIRCLE:
            return f"Circles{_radius(s)}" if s.path.on_path else f"Goes to its circle{_to_go(s)}"
        case _:
            assert_never(s.mode)


def _sailing(s: Snapshot) -> str:
    plan = s.progress
    if plan.state is PlanState.COMPLETE:
        return "Plan complete: holds its place"
    if plan.state is not PlanState.ACTIVE:
        return "Auto, but no plan is being sailed"
    item = f"Sails the plan, {item_words(plan.seq, plan.total)}"
    if s.path.orbit_radius_m is None:
        return item + _to_go(s)
    return f"{item}: circles{_radius(s)}" if s.path.on_path else f"{item}: goes to its circle{_to_go(s)}"


def item_words(number: int, total: int) -> str:
    """Where a plan stands. Items count from 0, without home, as in every text of the vessel: so the last one's number is told too."""
    return f"item {min(number, total - 1)} (last: {total - 1})"  # a plan stands behind its last one for a tick


def _to_go(s: Snapshot) -> str:
    return "" if s.path.distance_m is None else f", {s.path.distance_m:.0f} m to go"


def _radius(s: Snapshot) -> str:
    return "" if s.path.orbit_radius_m is None else f" at {abs(s.path.orbit_radius_m):.0f} m"


def coming(s: Snapshot) -> tuple[str, ...]:
    """What happens next by itself, the most urgent first: second actions on their clock, and borders on the present course."""
    found = [_clock(each) for each in s.outlook if each.next_in_s is not None]
    if s.fence.stops_in_m is not None:
        found.append(f"STOPS in {s.fence.stops_in_m:.0f} m: fence")
    return tuple(found)


def _clock(each: Outlook) -> str:
    will, left_s = _WILL[each.next_action], max(each.next_in_s or 0.0, 0.0)
    if not each.runs:
        return f"{will} after {left_s:.0f} s more of this: {each.cause} (the clock stands)"
    back = BACK.get(each.name)
    return f"{will} in {left_s:.0f} s" + (f" unless {back}" if back else f": {each.cause}")


def cause(name: str) -> str:
    """A failsafe condition in words; a name that this program does not know stays a name."""
    return BY_NAME[name].text if name in BY_NAME else name
