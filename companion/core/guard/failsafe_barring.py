"""Which conditions stand in the way of an order: those that would undo it at once, and what of them a text for another one must know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import Action
from mavlink_bridge.language.value import value

from .failsafe_config import Rule
from .failsafe_entry import Entry, acting, wanted
from .failsafe_flags import Flags
from .failsafe_orders import Order, ends
from .failsafe_row import Clear, Takeover

Acted = tuple[Rule, Entry]
"""A condition that has acted, and what is remembered of it."""


@value
class Beside:
    """What other conditions leave of the order that a condition's text would name."""

    barred: str = ""
    """The condition that no order lifts, in words; "" = none does."""
    names_order: bool = False
    """Its own text will name the order, once it is gone."""
    rows: tuple[str, ...] = ()
    """Names of the conditions that only some orders lift,"""
    is_order_lost: bool = False
    """and the order that would go on is none of them."""


NOTHING: Final = Beside()


def is_of_the_mode(rule: Rule) -> bool:
    """Whether a condition lets go the moment its flag falls, as those do that depend on the mode."""
    return rule.row.clear is Clear.GONE and not rule.clear_us


def bars(rule: Rule, entry: Entry, order: Order | None, now_us: int) -> bool:
    """Whether a condition undoes an order to sail at once.

    What depends on the mode that the order leaves (it lets go the moment its flag falls) does not, nor does what disarms: a mode is
    chosen before arming. Holding is always obeyed where an order may take over; a stream is no order.
    """
    row = rule.row
    if entry.fired_us is None or row.station:
        return False
    if row.takeover is Takeover.ORDER:
        stands = entry.gone_us is None and not entry.taken
        return (
            stands
            and wanted(rule, entry) > Action.WARN
            and order not in (None, Order.HOLD)
            and not ends(row.name, order)
        )
    if wanted(rule, entry) not in (Action.HOLD, Action.STOP):
        return False
    if row.clear is Clear.REARM:
        return True
    return not is_of_the_mode(rule) and (entry.gone_us is None or now_us - entry.gone_us < rule.clear_us)


def beside(mine: Rule, acted: Sequence[Acted], flags: Flags, order: Order | None, now_us: int) -> Beside:
    """Look at all conditions but one that a text is about: would they undo the order that it names? None: it only asks to arm."""
    found, arms = NOTHING, not flags.helm.armed or mine.row.clear is Clear.REARM
    # the disarm that ends a standing one that only thrust shows ends all of them
    forgets = mine.row.shows_by_thrust and any(rule is mine and entry.gone_us is None for rule, entry in acted)
    for rule, entry in acted:
        row, entry = rule.row, _as_it_stands(rule, entry, flags)
        is_over = arms and entry.gone_us is not None and row.clear is not Clear.RESTART
        is_forgotten = forgets and row.shows_by_thrust
        if rule is mine or is_over or is_forgotten or acting(rule, entry, flags) < Action.HOLD:
            continue
        is_undone = _is_undone(rule, entry, flags, order, now_us)
        if row.takeover is not Takeover.ORDER:
            if is_undone and not found.barred:
                found = replace(found, barred=row.text, names_order=row.clear is not Clear.GONE)
        elif entry.gone_us is None:
            found = replace(found, rows=(*found.rows, row.name), is_order_lost=found.is_order_lost or is_undone)
    return found


def _as_it_stands(rule: Rule, entry: Entry, flags: Flags) -> Entry:
    """Disarmed, what has not come back by that stands still; but what only thrust shows is forgotten."""
    row = rule.row
    if row.stands is None or row.shows_by_thrust or not row.stands(flags):
        return entry
    return replace(entry, gone_us=None)


def _is_undone(rule: Rule, entry: Entry, flags: Flags, order: Order | None, now_us: int) -> bool:
    """Whether an order would not be obeyed: refused, or accepted and nothing done."""
    action, row = acting(rule, entry, flags), rule.row
    if row.clear in (Clear.RESTART, Clear.REARM):
        return action >= Action.STOP
    if order is not Order.HOLD:
        return bars(rule, entry, order, now_us)
    # a Hold is accepted where a stop stands, and holds nothing
    waits = entry.gone_us is None or now_us - entry.gone_us < rule.clear_us
    return action is Action.STOP and waits and not is_of_the_mode(rule) and not ends(row.name, order)
