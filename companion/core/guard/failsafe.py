"""The failsafe engine: a pure step from condition flags to one action; the worst active one wins.

It holds no state of its own: the memory goes in and comes out, time is an argument. What the conditions are stands in
``failsafe_table.py``; this file only times them, latches them, lets an operator take over and clears them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

from mavlink_bridge.language.messages import Action, Severity
from mavlink_bridge.language.value import value

from .failsafe_config import FailsafeConfig, Override, Rule, microseconds, reached
from .failsafe_flags import Flags
from .failsafe_orders import Order, ends, names
from .failsafe_row import Clear, Takeover
from .failsafe_words import BACK, DOING, WAYS, capital, until

__all__ = [
    "Entry",
    "FailsafeConfig",
    "FailsafeMemory",
    "FailsafeResult",
    "Flags",
    "Override",
    "barring",
    "deaf_sticks",
    "failsafe_table_markdown",
    "holding",
    "judge",
    "step",
]


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
    told_soon: bool = False
    """That the second action is near."""


_NONE: Final = Action.NONE
SOON_US: Final = 10_000_000
"""A second action is told again so long before it comes: time to press a button."""
STEADY_US: Final = 10_000_000
"""A cause that stays away for so long is steadily gone: shorter breaks are told as nothing, so that a flapping link does not chatter."""
_NEVER = Entry(since_us=0)


@value
class FailsafeMemory:
    """All that the engine remembers between two ticks."""

    entries: Mapping[str, Entry] = field(default_factory=lambda: MappingProxyType({}))
    required_since_us: int | None = None
    """Since when a ground station is required without a break."""


@value
class FailsafeResult:
    """One tick's decision."""

    memory: FailsafeMemory
    action: Action
    causes: tuple[str, ...] = ()
    """Names of the conditions that act or warn, most urgent first."""
    texts: tuple[tuple[Severity, str], ...] = ()
    thrust_share: float = 1.0
    """Share of full thrust that each thruster may give; what command that is depends on the propellers."""


def step(memory: FailsafeMemory, flags: Flags, now_us: int, config: FailsafeConfig) -> FailsafeResult:
    """Return the action for this tick, its causes, texts for the operator, and the new memory. Pure."""
    if not memory.entries and config.watch.quiet(flags):
        since_us = _required_since(memory, flags, now_us)
        if since_us != memory.required_since_us:
            memory = FailsafeMemory({}, since_us)
        return FailsafeResult(memory, _NONE)
    return judge(memory, flags, now_us, config)


def judge(memory: FailsafeMemory, flags: Flags, now_us: int, config: FailsafeConfig) -> FailsafeResult:
    """The same as ``step`` without its short cut: every row is looked at."""
    required_since_us = _required_since(memory, flags, now_us)
    flags = _count_from_requirement(flags, required_since_us, now_us, config)
    entries: dict[str, Entry] = {}
    texts: list[tuple[Severity, str]] = []
    causes: list[str] = []
    action = Action.NONE
    before = memory.entries
    for rule in config.rules:
        row = rule.row
        old = before.get(row.name)
        raised = _come(rule, row.age, old, flags) if row.flag is None else row.flag(flags)
        if old is None and not raised:
            continue
        entry = _advance(rule, old, raised, flags, now_us)
        _tell(rule, old, entry, flags, texts)
        if entry is not None and entry.gone_us is not None:
            entry = _tell_back(rule, entry, flags, now_us, texts)
        if entry is None:
            continue
        entries[row.name] = entry
        if entry.fired_us is not None:
            causes.append(row.name)
            action = max(action, acting(rule, entry, flags))
    if action is Action.RETURN and _bars_the_way(entries, flags):
        action = Action.HOLD
    if action in (Action.HOLD, Action.RETURN) and (flags.place.position_lost or flags.place.heading_lost):
        action = Action.STOP
    result = FailsafeResult(FailsafeMemory(entries, required_since_us), action, tuple(causes), tuple(texts))
    return replace(result, thrust_share=config.oscillation_thrust) if "oscillating" in causes else result


def _bars_the_way(entries: Mapping[str, Entry], flags: Flags) -> bool:
    """A return that would lead across the fence waits before it."""
    return "fence_ahead" in entries and not flags.helm.manual


def _required_since(memory: FailsafeMemory, flags: Flags, now_us: int) -> int | None:
    if not (flags.helm.armed and flags.ground.gcs_required):
        return None
    return now_us if memory.required_since_us is None else memory.required_since_us


def _count_from_requirement(flags: Flags, since_us: int | None, now_us: int, config: FailsafeConfig) -> Flags:
    """Judge the ground by its best link: silence on one counts only while the other is silent too or unused.

    Never heard at all counts from the moment a ground station was first required, on the ordinary link's time.
    """
    if since_us is None:
        return flags
    gcs_s, radio_s = flags.ground.gcs_age_s, flags.ground.radio_age_s
    if gcs_s is None and radio_s is None:
        return replace(flags, ground=replace(flags.ground, gcs_age_s=(now_us - since_us) / 1e6))
    if gcs_s is None or radio_s is None:
        return flags
    if not reached(radio_s, microseconds(config.radio_timeout_s)):
        return replace(flags, ground=replace(flags.ground, gcs_age_s=None))
    if not reached(gcs_s, microseconds(config.gcs_timeout_s)):
        return replace(flags, ground=replace(flags.ground, radio_age_s=None))
    return flags


def _come(rule: Rule, age: Callable[[Flags], float | None] | None, old: Entry | None, flags: Flags) -> bool:
    """Whether an age has come to its delay. What has acted counts as silent from half of it on, so that gaps add up."""
    assert age is not None
    age_s = age(flags)
    return age_s is not None and reached(age_s, rule.delay_us if old is None else rule.again_us)


def _advance(rule: Rule, old: Entry | None, raised: bool, flags: Flags, now_us: int) -> Entry | None:
    """Return what is remembered after this tick; None = nothing (never acted, or cleared)."""
    if raised:
        entry = Entry(now_us) if old is None else _stands(rule, old, flags, now_us)
    else:
        assert old is not None
        if old.fired_us is None:
            return None
        entry = old if old.gone_us is not None else _gone(old, now_us)
        if _cleared(rule, entry, flags, now_us):
            return None
    if entry.fired_us is None:
        due = rule.row.age is not None or now_us - entry.since_us >= rule.delay_us
        return replace(entry, fired_us=now_us, stands_us=now_us) if due else entry
    return _continue(rule, entry, flags, now_us)


def _stands(rule: Rule, old: Entry, flags: Flags, now_us: int) -> Entry:
    """The cause is there: still, or again. Silence began when the station was last heard, not when it is noticed."""
    if old.gone_us is None:
        return old
    age_s = rule.row.age(flags) if rule.row.age is not None else None
    since_us = now_us if age_s is None else old.gone_us
    if age_s is not None and age_s * 1e6 < now_us - old.gone_us:
        since_us = now_us - round(age_s * 1e6)
    return replace(old, gone_us=None, stands_us=since_us, told_back=False)


def _gone(old: Entry, now_us: int) -> Entry:
    """The cause is gone: its clock stands at what it has come to."""
    return replace(old, gone_us=now_us, stood_us=clock_us(old, now_us))


def clock_us(entry: Entry, now_us: int) -> int:
    """How long the cause has stood since it acted: all its spells together."""
    return entry.stood_us + (now_us - entry.stands_us if entry.gone_us is None else 0)


def _continue(rule: Rule, entry: Entry, flags: Flags, now_us: int) -> Entry:
    arming = Order.ARM if flags.ground.operator_arm else None
    if ends(rule.row.name, flags.ground.operator_order) or ends(rule.row.name, arming):
        entry = replace(entry, taken=True)
    if rule.then_us is not None and entry.gone_us is None and not entry.escalated:
        left_us = rule.then_us - clock_us(entry, now_us)
        if left_us <= 0:
            entry = replace(entry, escalated=True)
        elif left_us <= SOON_US and not entry.told_soon:
            entry = replace(entry, told_soon=True)
    return entry


def _cleared(rule: Rule, entry: Entry, flags: Flags, now_us: int) -> bool:
    assert entry.gone_us is not None
    if now_us - entry.gone_us < rule.clear_us:
        return False
    if rule.row.clear is Clear.GONE or (rule.row.clear is Clear.ACTED and _wanted(rule, entry) <= Action.WARN):
        return True
    if rule.row.clear in (Clear.OPERATOR, Clear.ACTED):
        return entry.taken or flags.ground.operator_order is not None or flags.ground.operator_arm
    return rule.row.clear is Clear.REARM and flags.ground.operator_arm


def _wanted(rule: Rule, entry: Entry) -> Action:
    return rule.then_action if entry.escalated else rule.action


def acting(rule: Rule, entry: Entry, flags: Flags) -> Action:
    """What a condition that has acted asks for now."""
    action = _wanted(rule, entry)
    by_hand = flags.helm.manual and rule.row.takeover is not Takeover.NEVER
    on_its_way = flags.helm.return_ordered and rule.row.station
    return min(action, Action.WARN) if entry.taken or by_hand or on_its_way else action


def _tell(rule: Rule, old: Entry | None, entry: Entry | None, flags: Flags, texts: list[tuple[Severity, str]]) -> None:
    """Say what has begun, with what is done about it: with the sticks in an operator's hand that may be nothing."""
    row, before = rule.row, old or _NEVER
    if entry is None:
        if before.fired_us is not None and not (row.stands is not None and row.stands(flags)):
            texts.append((Severity.INFO, f"Over: {row.text}"))
        return
    action = acting(rule, entry, flags)
    fires = entry.fired_us is not None and before.fired_us is None
    grows = entry.escalated and not before.escalated
    if fires or grows:
        texts.append((Severity.CRITICAL if grows else row.severity, _sentence(row.text, action)))
        _foretell(rule, entry, action, flags, texts)
    if entry.told_soon and not before.told_soon and not entry.escalated and action is rule.action:
        texts.append((Severity.WARNING, f"{rule.then_action.name} in {SOON_US // 1_000_000} s: {row.text}"))
    if entry.taken and not before.taken:
        texts.append((Severity.WARNING, f"Operator takes over: {row.text}"))


def _foretell(rule: Rule, entry: Entry, action: Action, flags: Flags, texts: list[tuple[Severity, str]]) -> None:
    """Say what comes next and what ends it, of whatever does more than warn or will."""
    if action < _wanted(rule, entry):
        return
    end = until(rule.row, flags.helm.resume)
    if rule.then_us is not None and not entry.escalated:
        texts.append((Severity.WARNING, f"{rule.then_action.name} in {rule.then_us / 1e6:g} s; {end}"))
    elif end:
        texts.append((Severity.INFO, capital(end)))


def _tell_back(rule: Rule, entry: Entry, flags: Flags, now_us: int, texts: list[tuple[Severity, str]]) -> Entry:
    """Say once that a cause is steadily gone, what the vessel does meanwhile, and which order goes on."""
    assert entry.gone_us is not None
    way, stands = WAYS.get(rule.row.clear), rule.row.stands
    if stands is not None and stands(flags):
        return entry
    if entry.told_back or way is None or now_us - entry.gone_us < max(rule.clear_us, STEADY_US):
        return entry
    action = acting(rule, entry, flags)
    if action is _wanted(rule, entry):
        clock = ""
        if rule.then_us is not None and not entry.escalated:
            clock = f"clock stopped at {entry.stood_us // 1_000_000} of {rule.then_us / 1e6:g} s, "
        order = way.format(flags.helm.resume or "Auto")
        texts.append((Severity.INFO, f"{capital(BACK[rule.row.name])}: {clock}{DOING[action]}: {order} to go on"))
    return replace(entry, told_back=True)


def _sentence(text: str, action: Action) -> str:
    body = capital(text)
    return body if action is Action.WARN else f"{body}: {action.name}"


def holding(memory: FailsafeMemory, config: FailsafeConfig) -> tuple[str, ...]:
    """Names of the conditions of STOP or worse whose cause still stands, so that arming could not clear them."""
    standing = []
    for rule in config.rules if memory.entries else ():
        entry = memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or entry.gone_us is not None or entry.taken:
            continue
        if _wanted(rule, entry) >= Action.STOP:
            standing.append(rule.row.name)
    return tuple(standing)


def barring(
    memory: FailsafeMemory, now_us: int, config: FailsafeConfig, order: Order | None = None, *, by_hand: str = ""
) -> str:
    """Why an order to sail would be undone at once: a condition that holds or stops the vessel, and that no order lifts; or "".

    ``by_hand`` is added where manual control goes on all the same.

    What depends on the mode that the order leaves (it lets go the moment its flag falls) does not bar, nor does what disarms:
    a mode is chosen before arming.
    """
    for rule in config.rules if memory.entries else ():
        row, entry = rule.row, memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or row.station:
            continue
        insist = f"; {by_hand}" if by_hand and row.takeover is not Takeover.NEVER else ""
        if row.takeover is Takeover.ORDER:
            if _bars(row.name, entry, order) and _wanted(rule, entry) > Action.WARN:
                return f"{row.text}: order {names(row.name)}{insist}"
            continue
        if _wanted(rule, entry) not in (Action.HOLD, Action.STOP):
            continue
        if row.clear is Clear.REARM:
            return f"{row.text}: arm again first"
        if _is_of_the_mode(rule):
            continue
        if entry.gone_us is None:
            return row.text + insist
        if now_us - entry.gone_us < rule.clear_us:
            back_s = (now_us - entry.gone_us) // 1_000_000
            return f"{BACK[row.name]} for {back_s} of {rule.clear_us / 1e6:g} s{insist}"
    return ""


def deaf_sticks(memory: FailsafeMemory, config: FailsafeConfig) -> str:
    """Until when manual control moves nothing: "until the actuator line is readable"; "" where it is obeyed."""
    for rule in config.rules if memory.entries else ():
        row, entry = rule.row, memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or row.takeover is not Takeover.NEVER or _is_of_the_mode(rule):
            continue
        if _wanted(rule, entry) >= Action.HOLD:
            return until(row, "")
    return ""


def _is_of_the_mode(rule: Rule) -> bool:
    """Whether a condition lets go the moment its flag falls, as those do that depend on the mode."""
    return rule.row.clear is Clear.GONE and not rule.clear_us


def _bars(name: str, entry: Entry, order: Order | None) -> bool:
    """Whether an order is none of those that go on in spite of a standing cause. Holding is always one; a stream is no order."""
    stands = entry.gone_us is None and not entry.taken
    return stands and order not in (None, Order.HOLD) and not ends(name, order)


def failsafe_table_markdown(config: FailsafeConfig | None = None) -> str:
    """Return the table for people: the defaults, or a configuration's own values."""
    lines = [
        "| condition | after s | action | then | clears | takeover | least action | longest delay s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for rule in (config or FailsafeConfig()).rules:
        row = rule.row
        then = "" if rule.then_us is None else f"{rule.then_action.name} after {rule.then_us / 1e6:g} s"
        clears = row.clear.value + (f", for {row.clear_s:g} s" if row.clear_s else "")
        lines.append(
            f"| `{row.name}`: {row.text} | {rule.delay_us / 1e6:g} | {rule.action.name} | {then} | {clears} "
            f"| {_yields_to(row.name, row.takeover)} | {row.floor.name} | {row.delay_max_s:g} |"
        )
    return "\n".join(lines) + "\n"


def _yields_to(name: str, takeover: Takeover) -> str:
    return f"manual control, or an order: {names(name)}" if takeover is Takeover.ORDER else takeover.value
