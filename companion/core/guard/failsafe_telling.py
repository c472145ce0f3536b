"""What an operator is told when a failsafe condition begins, grows and is gone: what the vessel does, whatever that row alone asks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

from mavlink_bridge.language.messages import Action, Severity

from .failsafe_barring import Acted, Beside, beside
from .failsafe_config import Rule
from .failsafe_entry import Entry, acting, wanted
from .failsafe_flags import Flags
from .failsafe_row import Clear
from .failsafe_words import BACK, DOING, SHORT, SHUT_OFF, WAYS, capital, named, order_named, until

SOON_US: Final = 10_000_000
"""A second action is told again so long before it comes: time to press a button."""
STEADY_US: Final = 10_000_000
"""A cause that stays away for so long is steadily gone: shorter breaks are told as nothing, so that a flapping link does not chatter."""
_NEVER: Final = Entry(since_us=0)


@dataclass(frozen=True, slots=True)
class Done:
    """What the vessel does, whatever a single row asks."""

    action: Action
    why: str = ""
    """The cause that asks for it, in words."""
    name: str = ""
    """Its row."""
    then: Action = Action.NONE
    """What goes on by itself when that cause is gone."""
    shut_off: bool = False
    """A return waits because its way leads across the fence."""
    gives_way: bool = False
    """That cause gives way to a return for want of a station."""
    nobody: bool = False
    """Nobody is there to order, and what can end without an order does."""
    left_us: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    """By row: in how long it lets a return go on without an order, if its cause stays as it is."""

    acted: tuple[Acted, ...] = ()
    """All conditions that have acted."""
    now_us: int = 0

    def beside(self, rule: Rule, flags: Flags) -> Beside:
        """What the others leave of the order that a condition's text would name."""
        return beside(rule, self.acted, flags, named(rule.row, flags.helm.resume), self.now_us)

    @property
    def is_over(self) -> bool:
        """Whether the cause of what the vessel does is gone: she waits for an order."""
        return any(entry.gone_us is not None for rule, entry in self.acted if rule.row.name == self.name)

    def doing(self, flags: Flags, words: Mapping[Action, str]) -> str:
        """What the vessel does, in words."""
        return words[self.action if flags.helm.armed else Action.DISARM]

    def instead_of(self, action: Action) -> str:
        """In brackets, what is done instead of what a row asks: "stopped: position lost"; "" = just that is done."""
        if action is self.action or min(action, self.action) <= Action.WARN:
            return ""
        return f"{SHORT[self.action]}: {self.why}"


def tell(rule: Rule, old: Entry | None, entry: Entry | None, flags: Flags, done: Done) -> list[tuple[Severity, str]]:
    """Say what has begun, with what is done about it: with the sticks in an operator's hand that may be nothing."""
    row, before = rule.row, old or _NEVER
    texts: list[tuple[Severity, str]] = []
    if entry is None:
        if before.fired_us is not None and not (row.stands is not None and row.stands(flags)):
            texts.append((Severity.INFO, f"Over: {row.text}"))
        return texts
    action = acting(rule, entry, flags)
    instead = done.instead_of(action)
    fires = entry.fired_us is not None and before.fired_us is None
    grows = entry.escalated and not before.escalated
    if fires or grows:
        texts.append((Severity.CRITICAL if grows else row.severity, _sentence(row.text, action, instead)))
        if instead and done.shut_off and action is Action.RETURN:
            texts.append((Severity.WARNING, SHUT_OFF.format(DOING[done.action])))
        elif grows and done.gives_way and done.nobody:
            texts.append((Severity.WARNING, f"{action.name} in {_seconds(done.left_us[done.name])} s: {row.text}"))
        elif not instead or done.gives_way:
            texts += _foretold(rule, entry, flags, done)
    is_next = not instead or done.gives_way
    if entry.told_soon and not before.told_soon and not entry.escalated and action is rule.action and is_next:
        texts.append((Severity.WARNING, f"{rule.then_action.name} in {SOON_US // 1_000_000} s: {row.text}"))
    if entry.taken and not before.taken:
        texts.append((Severity.WARNING, f"Operator takes over: {row.text}"))
    return texts


def _foretold(rule: Rule, entry: Entry, flags: Flags, done: Done) -> list[tuple[Severity, str]]:
    """What comes next and what ends it, of whatever does more than warn or will."""
    action = acting(rule, entry, flags)
    if action < wanted(rule, entry):
        return []
    end = until(rule.row, flags.helm.resume, done.beside(rule, flags))
    if done.shut_off and rule.row.name == done.name:
        return [(Severity.WARNING, SHUT_OFF.format(DOING[action]))]
    if action is done.action and rule.row.ends_alone and done.nobody:
        end = f"until {BACK[rule.row.name]}, then {DOING[Action.RETURN]}"
    if action is done.action and done.then is not Action.NONE:
        end = f"until {BACK[rule.row.name]}, then {DOING[done.then]}"
    if rule.row.gives_way and rule.row.name in done.left_us:
        return [(Severity.WARNING, f"{Action.RETURN.name} in {_seconds(done.left_us[rule.row.name])} s; {end}")]
    if rule.then_us is not None and not entry.escalated:
        return [(Severity.WARNING, f"{rule.then_action.name} in {rule.then_us / 1e6:g} s; {end}")]
    return [(Severity.INFO, capital(end))] if end else []


def tell_back(rule: Rule, entry: Entry, flags: Flags, done: Done) -> tuple[Entry, list[tuple[Severity, str]]]:
    """Say once that a cause is steadily gone, what the vessel does meanwhile, and what goes on: she by herself, or which order.

    No order is named that another condition would undo: that one's text names it, or, where it ends by itself, this one's then.
    """
    assert entry.gone_us is not None
    stands = rule.row.stands
    if stands is not None and stands(flags):
        return entry, []
    if entry.told_back or rule.row.clear not in WAYS or done.now_us - entry.gone_us < max(rule.clear_us, STEADY_US):
        return entry, []
    if acting(rule, entry, flags) is not wanted(rule, entry):
        return replace(entry, told_back=True), []
    others = done.beside(rule, flags)
    if others.barred:
        told = replace(entry, told_back=others.names_order, told_beside=True)
        does = done.doing(flags, SHORT)
        return told, [] if entry.told_beside else [(Severity.INFO, f"{_back(rule)} ({does}: {others.barred})")]
    return replace(entry, told_back=True), [_goes_on(rule, entry, flags, done)]


def _goes_on(rule: Rule, entry: Entry, flags: Flags, done: Done) -> tuple[Severity, str]:
    """That a cause is gone, and what goes on, where nothing stands against it."""
    action, name, back = acting(rule, entry, flags), rule.row.name, _back(rule)
    instead = done.instead_of(action)
    if instead and done.action is Action.RETURN and not done.is_over:
        return Severity.INFO, f"{back} ({instead})"
    if done.shut_off and name == done.name:
        return Severity.WARNING, SHUT_OFF.format(DOING[action])
    if name in done.left_us:
        in_s = _seconds(done.left_us[name])
        return Severity.INFO, f"{back}: {DOING[action]}: {DOING[Action.RETURN]} in {in_s} s"
    clock = ""
    if rule.then_us is not None and not entry.escalated:
        clock = f"clock stopped at {entry.stood_us // 1_000_000} of {rule.then_us / 1e6:g} s, "
    order = WAYS[rule.row.clear].format(order_named(flags.helm.resume, done.beside(rule, flags)))
    if not flags.helm.armed and rule.row.clear is not Clear.REARM:
        order = f"arm, then {order}"
    return Severity.INFO, f"{back}: {clock}{done.doing(flags, DOING)}: {order} to go on"


def _back(rule: Rule) -> str:
    return capital(BACK[rule.row.name])


def _seconds(left_us: int) -> int:
    return -(-left_us // 1_000_000)


def _sentence(text: str, action: Action, instead: str) -> str:
    body = capital(text)
    if instead:
        return f"{body} ({instead})"
    return body if action is Action.WARN else f"{body}: {action.name}"
