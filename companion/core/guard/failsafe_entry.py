"""What is remembered of one failsafe condition from tick to tick, and what it asks for."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_bridge.language.messages import Action

from .failsafe_config import Rule
from .failsafe_flags import Flags
from .failsafe_row import Takeover


@dataclass(frozen=True, slots=True)
class Entry:
    """What is remembered of one condition that holds or has acted."""

    since_us: int
    """When its flag rose."""
    fired_us: int | None = None
    """When it acted; None while its delay runs."""
    gone_us: int | None = None
    """When its flag fell; None while it stands."""
    taken: bool = False
    """An operator has taken over."""
    escalated: bool = False
    stands_us: int = 0
    """Since when the cause stands without a break, from its acting on; the second action's clock runs from here."""
    stood_us: int = 0
    """What earlier spells have put on that clock."""
    told_back: bool = False
    """That the cause is steadily gone, and what goes on."""
    told_beside: bool = False
    """The same, but for the order: another condition barred it."""
    again: int = 0
    """How many returns it has broken off, as of ``again_us``."""
    again_us: int = 0
    """When it last broke one off."""
    off_us: int | None = None
    """When its flag first fell after it had begun to act, or had broken off a return; None while that is to come."""
    ordered_back: bool = False
    """A return that an operator had ordered was in force when it acted, and nothing has been ordered since."""
    told_soon: bool = False
    """That the second action is near."""


def clock_us(entry: Entry, now_us: int) -> int:
    """How long the cause has stood since it acted: all its spells together."""
    return entry.stood_us + (now_us - entry.stands_us if entry.gone_us is None else 0)


def wanted(rule: Rule, entry: Entry) -> Action:
    """What a condition that has acted asks for, whoever takes over."""
    return rule.then_action if entry.escalated else rule.action


def acting(rule: Rule, entry: Entry, flags: Flags) -> Action:
    """What a condition that has acted asks for now."""
    action = wanted(rule, entry)
    if action is Action.HOLD and flags.helm.manual_idle:
        return Action.WARN  # a boat that is let drift is brought home, but not held
    by_hand = flags.helm.manual and rule.row.takeover is not Takeover.NEVER
    on_its_way = flags.helm.return_ordered and rule.row.station
    return min(action, Action.WARN) if entry.taken or by_hand or on_its_way else action
