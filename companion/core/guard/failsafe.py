"""The failsafe engine: a pure step from condition flags to one action; the worst active one wins.

It holds no state of its own: the memory goes in and comes out, time is an argument. What the conditions are stands in
``failsafe_table.py``; this file only times them, latches them, lets an operator take over and clears them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from types import MappingProxyType
from typing import Final

from mavlink_bridge.language.messages import Action, Severity
from mavlink_bridge.language.value import value

from .failsafe_alone import Ends, ended, lets_go_in_us, nobody_orders, stands
from .failsafe_barring import bars, is_of_the_mode
from .failsafe_config import FailsafeConfig, Override, Rule, microseconds, reached
from .failsafe_entry import Entry, acting, clock_us, wanted
from .failsafe_flags import Flags
from .failsafe_orders import Order, ends, names
from .failsafe_return import back_as_ordered, broken_off, rest_us
from .failsafe_row import Clear, Condition, Takeover
from .failsafe_table import BY_NAME
from .failsafe_telling import SOON_US, Done, tell, tell_back
from .failsafe_words import BACK, TRY_AGAIN, until

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
    "stopped_by",
    "stopped_for_good",
]


_NONE: Final = Action.NONE
_FENCE: Final = BY_NAME["fence_ahead"]
_Move = tuple[Rule, Entry | None, Entry | None]
"""A condition with what was remembered of it, and with what is now."""


@value
class FailsafeMemory:
    """All that the engine remembers between two ticks."""

    entries: Mapping[str, Entry] = field(default_factory=lambda: MappingProxyType({}))
    required_since_us: int | None = None
    """Since when a ground station is required without a break."""
    alone: Mapping[str, Ends] = field(default_factory=lambda: MappingProxyType({}))
    """How conditions have ended without an order since one was given: a station that is heard for a moment gives none."""
    action: Action = Action.NONE
    """What the vessel was to do."""


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
        alone = _since_an_order(memory, flags)
        if since_us != memory.required_since_us or len(alone) != len(memory.alone):
            memory = FailsafeMemory({}, since_us, alone)
        return FailsafeResult(memory, _NONE)
    return judge(memory, flags, now_us, config)


def judge(memory: FailsafeMemory, flags: Flags, now_us: int, config: FailsafeConfig) -> FailsafeResult:
    """The same as ``step`` without its short cut: every row is looked at."""
    if memory.action >= Action.STOP and flags.ground.operator_order is Order.BYSTANDER_HOLD:
        # she lies still, and who stands by may be about to take hold of her: keeping station would turn her propellers
        flags = replace(flags, ground=replace(flags.ground, operator_order=None))
    required_since_us = _required_since(memory, flags, now_us)
    flags = _count_from_requirement(flags, required_since_us, now_us, config)
    moves = _moves(memory, flags, now_us, config)
    entries = {rule.row.name: entry for rule, _, entry in moves if entry is not None}
    alone = _counted(_since_an_order(memory, flags), entries, now_us)
    begun = Done(_NONE)
    if nobody_orders(entries, config):
        moves, alone, left_us = _without_an_order(moves, alone, now_us)
        begun = Done(_NONE, nobody=True, left_us=left_us)
        entries = {rule.row.name: entry for rule, _, entry in moves if entry is not None}
    acted = tuple((rule, entry) for rule, _, entry in moves if entry is not None and entry.fired_us is not None)
    worst, fence = _worst(begun, moves, flags), entries.get(_FENCE.name)
    if fence is not None and fence.ordered_back:
        worst, entries[_FENCE.name] = back_as_ordered(worst, fence, acted, flags, now_us)
    done = replace(_what_is_done(worst, entries, flags, now_us), acted=acted, now_us=now_us)
    if (memory.action is Action.RETURN or flags.helm.return_ordered) and done.name == _FENCE.name:
        entries[_FENCE.name] = broken_off(entries[_FENCE.name], now_us)
    texts: list[tuple[Severity, str]] = []
    for rule, old, entry in moves:
        texts += tell(rule, old, entry, flags, done)
        if entry is not None and entry.gone_us is not None:
            entries[rule.row.name], told = tell_back(rule, entries[rule.row.name], flags, done)
            texts += told
    causes = tuple(name for name, entry in entries.items() if entry.fired_us is not None)
    memory = FailsafeMemory(entries, required_since_us, alone, done.action)
    result = FailsafeResult(memory, done.action, causes, tuple(texts))
    return replace(result, thrust_share=config.oscillation_thrust) if "oscillating" in causes else result


def _moves(memory: FailsafeMemory, flags: Flags, now_us: int, config: FailsafeConfig) -> list[_Move]:
    """What this tick makes of each condition that is, or was, remembered."""
    moves: list[_Move] = []
    for rule in config.rules:
        old = memory.entries.get(rule.row.name)
        if old is not None and _is_met_anew(rule.row, old, flags) and _is_raised(rule, None, flags):
            old = None
        raised = _is_raised(rule, old, flags)
        if old is not None or raised:
            moves.append((rule, old, _advance(rule, old, raised, flags, now_us)))
    return moves


def _since_an_order(memory: FailsafeMemory, flags: Flags) -> Mapping[str, Ends]:
    """What ended without an order since an operator gave one."""
    return {} if flags.ground.operator_order is not None or flags.ground.operator_arm else memory.alone


def _counted(alone: Mapping[str, Ends], entries: Mapping[str, Entry], now_us: int) -> Mapping[str, Ends]:
    """The same, with the causes that stand again."""
    if not alone:
        return alone
    again = {name: ends for name, ends in alone.items() if name in entries and entries[name].gone_us is None}
    return {**alone, **{name: stands(ends, now_us) for name, ends in again.items()}}


def _without_an_order(
    moves: list[_Move], before: Mapping[str, Ends], now_us: int
) -> tuple[list[_Move], dict[str, Ends], dict[str, int]]:
    """End what waits for an order that nobody can give; how it has ended so far goes in and comes out, and in how long others let go."""
    alone, left_us = dict(before), {}
    left: list[_Move] = []
    for rule, old, entry in moves:
        name = rule.row.name
        in_us = None if entry is None else lets_go_in_us(rule, entry, alone.get(name), now_us)
        if entry is not None and in_us == 0 and rule.row.ends_alone:
            alone[name], entry = ended(alone.get(name), entry, now_us), None
        elif in_us is not None:
            left_us[name] = in_us
        left.append((rule, old, entry))
    return left, alone, left_us


def _worst(begun: Done, moves: list[_Move], flags: Flags) -> Done:
    """What the condition asks for that asks for most; of several the most urgent. ``begun``: what is known of them all."""
    done = begun
    for rule, _, entry in moves:
        row = rule.row
        if entry is None or entry.fired_us is None or (row.gives_way and begun.left_us.get(row.name) == 0):
            continue
        if (action := acting(rule, entry, flags)) > done.action:
            done = replace(begun, action=action, why=row.text, name=row.name, gives_way=row.gives_way)
    return done


def _what_is_done(done: Done, entries: Mapping[str, Entry], flags: Flags, now_us: int) -> Done:
    """What the worst condition asks for, as far as it can be sailed."""
    fence = entries.get(_FENCE.name)
    if done.action is Action.RETURN and fence is not None and _bars_the_way(fence, flags, now_us):
        done = _waits_before(done, fence, flags, now_us)
    if done.action in (Action.HOLD, Action.RETURN) and (flags.place.position_lost or flags.place.heading_lost):
        why = "position lost" if flags.place.position_lost else "heading lost"
        done = Done(Action.STOP, why, nobody=done.nobody, left_us=done.left_us)
    return done


def _waits_before(done: Done, fence: Entry, flags: Flags, now_us: int) -> Done:
    """A return waits in Hold: for a vessel that is to come to rest, or for a way."""
    done = replace(done, action=Action.HOLD, why=_FENCE.text, name=_FENCE.name)
    if flags.helm.return_shut_off:
        return replace(done, shut_off=True)
    left_us = rest_us(fence, now_us)
    goes_on = done.left_us if left_us is None else {**done.left_us, _FENCE.name: left_us}
    return replace(done, then=Action.RETURN, left_us=goes_on)


def _bars_the_way(fence: Entry, flags: Flags, now_us: int) -> bool:
    """A return that leads across the fence waits before it; any other only until the vessel that was stopped there has come to rest."""
    return not flags.helm.manual and (flags.helm.return_shut_off or rest_us(fence, now_us) != 0)


def _is_met_anew(row: Condition, old: Entry, flags: Flags) -> bool:
    """Whether a vessel that is armed meets what stood before she was disarmed: it is told again, and who took over then has not now."""
    return flags.ground.operator_arm and row.stands is not None and old.gone_us is not None


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


def _is_raised(rule: Rule, old: Entry | None, flags: Flags) -> bool:
    """Whether a cause stands. An age does from its delay on; of what has acted from half of it on, so that gaps add up."""
    row = rule.row
    if row.flag is not None:
        return row.flag(flags)
    assert row.age is not None
    age_s = row.age(flags)
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
        ordered_back = flags.helm.return_ordered
        return replace(entry, fired_us=now_us, stands_us=now_us, ordered_back=ordered_back) if due else entry
    return _continue(rule, entry, flags, now_us)


def _stands(rule: Rule, old: Entry, flags: Flags, now_us: int) -> Entry:
    """The cause is there: still, or again. Silence began when the station was last heard, not when it is noticed."""
    if old.gone_us is None:
        return old
    age_s = rule.row.age(flags) if rule.row.age is not None else None
    since_us = now_us if age_s is None else old.gone_us
    if age_s is not None and age_s * 1e6 < now_us - old.gone_us:
        since_us = now_us - round(age_s * 1e6)
    return replace(old, gone_us=None, stands_us=since_us, told_back=False, told_beside=False)


def _gone(old: Entry, now_us: int) -> Entry:
    """The cause is gone: its clock stands at what it has come to."""
    off_us = now_us if old.off_us is None else old.off_us
    return replace(old, gone_us=now_us, stood_us=clock_us(old, now_us), off_us=off_us)


def _continue(rule: Rule, entry: Entry, flags: Flags, now_us: int) -> Entry:
    arming = Order.ARM if flags.ground.operator_arm else None
    if ends(rule.row.name, flags.ground.operator_order) or ends(rule.row.name, arming):
        entry = replace(entry, taken=True)
    if flags.ground.operator_order is not None or not flags.helm.armed:
        entry = replace(entry, ordered_back=flags.helm.return_ordered and flags.helm.armed)
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
    if rule.row.clear is Clear.GONE or (rule.row.clear is Clear.ACTED and wanted(rule, entry) <= Action.WARN):
        return True
    if rule.row.clear in (Clear.OPERATOR, Clear.ACTED):
        return entry.taken or flags.ground.operator_order is not None or flags.ground.operator_arm
    return rule.row.clear is Clear.REARM and flags.ground.operator_arm


def holding(memory: FailsafeMemory, config: FailsafeConfig) -> tuple[str, ...]:
    """Names of the conditions of STOP or worse whose cause still stands, so that arming could not clear them."""
    standing = []
    for rule in config.rules if memory.entries else ():
        entry = memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or entry.gone_us is not None or entry.taken:
            continue
        if wanted(rule, entry) >= Action.STOP:
            standing.append(rule.row.name)
    return tuple(standing)


def barring(
    memory: FailsafeMemory, now_us: int, config: FailsafeConfig, order: Order | None = None, *, by_hand: str = ""
) -> str:
    """Why an order to sail would be undone at once: a condition that holds or stops the vessel, and that no order lifts; or "".

    ``by_hand`` is added where manual control goes on all the same.
    """
    acted = [(rule, memory.entries[rule.row.name]) for rule in config.rules if rule.row.name in memory.entries]
    barred = [(rule, entry) for rule, entry in acted if bars(rule, entry, order, now_us)]
    if not barred:
        return ""
    # what no order lifts is said first: an order that is named for another would be refused for it
    rule, entry = min(barred, key=lambda each: each[0].row.takeover is Takeover.ORDER)
    row = rule.row
    insist = f"; {by_hand}" if by_hand and row.takeover is not Takeover.NEVER else ""
    if row.takeover is Takeover.ORDER:
        return f"{row.text}: order {names(*(rule.row.name for rule, _ in barred))}{insist}"
    if row.clear is Clear.REARM:
        return f"{row.text}: arm again first"
    if entry.gone_us is None:
        return row.text + (f": {TRY_AGAIN}" if row.shows_by_thrust else "") + insist
    back_s = (now_us - entry.gone_us) // 1_000_000
    return f"{BACK[row.name]} for {back_s} of {rule.clear_us / 1e6:g} s{insist}"


def stopped_by(memory: FailsafeMemory, config: FailsafeConfig) -> str:
    """What has stopped the vessel, so that a bystander's Hold leaves her so; "" = nothing has."""
    if memory.action < Action.STOP:
        return ""
    asked = [(rule, memory.entries.get(rule.row.name)) for rule in config.rules]
    acted = [(wanted(rule, entry), rule) for rule, entry in asked if entry is not None and entry.fired_us is not None]
    return max(acted, key=lambda each: each[0])[1].row.text


def stopped_for_good(memory: FailsafeMemory, config: FailsafeConfig) -> str:
    """What has stopped a vessel that is not steered by hand, and no wait ends it; "" = nothing does."""
    for rule in config.rules if memory.entries else ():
        entry = memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or entry.gone_us is not None or not rule.row.shows_by_thrust:
            continue
        if wanted(rule, entry) >= Action.STOP:
            return f"{rule.row.text}: {TRY_AGAIN}"
    return ""


def deaf_sticks(memory: FailsafeMemory, config: FailsafeConfig) -> str:
    """Until when manual control moves nothing: "until the actuator line is readable"; "" where it is obeyed."""
    for rule in config.rules if memory.entries else ():
        row, entry = rule.row, memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or row.takeover is not Takeover.NEVER or is_of_the_mode(rule):
            continue
        if wanted(rule, entry) >= Action.HOLD:
            return until(row, "")
    return ""


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
