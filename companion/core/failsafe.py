"""The failsafe engine: a pure step from condition flags to one action; the worst active one wins.

It holds no state of its own: the memory goes in and comes out, time is an argument. What the conditions are stands in
``failsafe_table.py``; this file only times them, latches them, lets an operator take over and clears them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Final, Self

from pydantic import Field, model_validator

from companion.core.config import Config, param
from companion.core.failsafe_table import BY_NAME, TABLE, Clear, Condition, Flags, Takeover
from mavlink_bridge.imc import Action, Severity

__all__ = [
    "Entry",
    "FailsafeConfig",
    "FailsafeMemory",
    "FailsafeResult",
    "Flags",
    "Override",
    "failsafe_table_markdown",
    "holding",
    "step",
]


class Override(Config):
    """What a configuration may change of one row; the table's floors hold."""

    action: Action | None = None
    delay_s: float | None = Field(None, ge=0)


class FailsafeConfig(Config):
    """Times and actions of the failsafe conditions. Everything else is in the table."""

    gcs_timeout_s: float = param(5.0, "FS_GCS_TIMEOUT", "Ground station lost after", unit="s", ge=2, le=120)
    gcs_action: Action = param(
        Action.HOLD, "FS_GCS_ACTION", "First action on loss: 1 warn, 2 hold, 3 return, 4 stop", ge=1, le=4
    )
    gcs_then_s: float = param(60.0, "FS_GCS_THEN_T", "Second action so long after the first", unit="s", ge=0, le=3600)
    gcs_then_action: Action = param(
        Action.RETURN, "FS_GCS_THEN", "Second action on loss: 0 none, 2 hold, 3 return, 4 stop", ge=0, le=4
    )
    radio_timeout_s: float = param(
        65.0, "FS_RADIO_TIMEOUT", "Ground lost over the radio after (more than two beacons)", unit="s", ge=5, le=3600
    )
    manual_timeout_s: float = param(0.5, "FS_MAN_TIMEOUT", "Manual control lost after", unit="s", ge=0.1, le=5)
    guided_timeout_s: float = param(1.0, "FS_GUID_TIMEOUT", "Streamed set-points lost after", unit="s", ge=0.1, le=5)
    oscillation_thrust: float = param(0.3, "FS_OSC_THRUST", "Thrust allowed while control oscillates", ge=0, le=1)
    conditions: dict[str, Override] = Field(default_factory=dict)
    """Per condition name: ``action``, ``delay_s``; not below the floors that ``companion explain failsafe`` lists."""

    @model_validator(mode="after")
    def _within_floors(self) -> Self:
        problems = [text for name, over in self.conditions.items() for text in _override_problems(name, over)]
        if problems:
            raise ValueError("; ".join(problems))
        return self

    @cached_property
    def rules(self) -> tuple[Rule, ...]:
        """The table with this configuration's times and actions."""
        return tuple(self._rule(condition) for condition in TABLE)

    def _rule(self, row: Condition) -> Rule:
        over = self.conditions.get(row.name, _NO_OVERRIDE)
        action = row.action if over.action is None else over.action
        delay_s = row.delay_s if over.delay_s is None else over.delay_s
        then_s, then_action = row.then_after_s, row.then_action
        if row.name in ("gcs_lost", "radio_lost"):
            action, then_action = self.gcs_action, self.gcs_then_action
        if row.name == "gcs_lost":
            then_s = self.gcs_then_s
        delay_s = {
            "gcs_lost": self.gcs_timeout_s,
            "gcs_degraded": self.gcs_timeout_s / 2.0,
            "radio_lost": self.radio_timeout_s,
            "manual_lost": self.manual_timeout_s,
            "guided_lost": self.guided_timeout_s,
        }.get(row.name, delay_s)
        if then_action <= action:
            then_s = None
        return Rule(row, _us(delay_s), action, None if then_s is None else _us(then_s), then_action, _us(row.clear_s))


_NO_OVERRIDE: Final = Override()
_BY_PARAMETER: Final = ("gcs_lost", "gcs_degraded", "radio_lost", "manual_lost", "guided_lost")


def _override_problems(name: str, over: Override) -> list[str]:
    row = BY_NAME.get(name)
    if row is None:
        return [f"{name}: no such condition"]
    if name in _BY_PARAMETER:
        return [f"{name}: has its own keys, such as gcs_timeout_s"]
    problems = []
    if over.action is not None and over.action < row.floor:
        problems.append(f"{name}: action at least {row.floor.name}")
    if over.delay_s is not None and over.delay_s > row.delay_max_s:
        problems.append(f"{name}: delay_s at most {row.delay_max_s:g}")
    return problems


def _us(seconds: float) -> int:
    return round(seconds * 1e6)


@dataclass(frozen=True, slots=True)
class Rule:
    """A row with its configured times (microseconds) and actions."""

    row: Condition
    delay_us: int
    action: Action
    then_us: int | None
    then_action: Action
    clear_us: int


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


@dataclass(frozen=True, slots=True)
class FailsafeMemory:
    """All that the engine remembers between two ticks."""

    entries: Mapping[str, Entry] = field(default_factory=lambda: MappingProxyType({}))
    required_since_us: int | None = None
    """Since when a ground station is required without a break."""


@dataclass(frozen=True, slots=True)
class FailsafeResult:
    """One tick's decision."""

    memory: FailsafeMemory
    action: Action
    causes: tuple[str, ...] = ()
    """Names of the conditions that act or warn, most urgent first."""
    texts: tuple[tuple[Severity, str], ...] = ()
    thrust_limit: float = 1.0
    """Share of full thrust that the gate may pass."""


def step(memory: FailsafeMemory, flags: Flags, now_us: int, config: FailsafeConfig) -> FailsafeResult:
    """Return the action for this tick, its causes, texts for the operator, and the new memory. Pure."""
    required_since_us = _required_since(memory, flags, now_us)
    flags = _count_from_requirement(flags, required_since_us, now_us, config)
    entries: dict[str, Entry] = {}
    texts: list[tuple[Severity, str]] = []
    causes: list[str] = []
    action = Action.NONE
    for rule in config.rules:
        old = memory.entries.get(rule.row.name)
        raised = _raised(rule, flags)
        if old is None and not raised:
            continue
        entry = _advance(rule, old, raised, flags, now_us)
        _tell(rule, old, entry, texts)
        if entry is None:
            continue
        entries[rule.row.name] = entry
        if entry.fired_us is not None:
            causes.append(rule.row.name)
            action = max(action, _action(rule, entry, flags))
    if action in (Action.HOLD, Action.RETURN) and (flags.position_lost or flags.heading_lost):
        action = Action.STOP
    limit = config.oscillation_thrust if "oscillating" in causes else 1.0
    return FailsafeResult(FailsafeMemory(entries, required_since_us), action, tuple(causes), tuple(texts), limit)


def _required_since(memory: FailsafeMemory, flags: Flags, now_us: int) -> int | None:
    if not (flags.armed and flags.gcs_required):
        return None
    return now_us if memory.required_since_us is None else memory.required_since_us


def _count_from_requirement(flags: Flags, since_us: int | None, now_us: int, config: FailsafeConfig) -> Flags:
    """Judge the ground by its best link: silence on one counts only while the other is silent too or unused.

    Never heard at all counts from the moment a ground station was first required, on the ordinary link's time.
    """
    if since_us is None:
        return flags
    gcs_s, radio_s = flags.gcs_age_s, flags.radio_age_s
    if gcs_s is None and radio_s is None:
        return replace(flags, gcs_age_s=(now_us - since_us) / 1e6)
    if radio_s is not None and radio_s < config.radio_timeout_s:
        return replace(flags, gcs_age_s=None)
    if gcs_s is not None and gcs_s < config.gcs_timeout_s:
        return replace(flags, radio_age_s=None)
    return flags


def _raised(rule: Rule, flags: Flags) -> bool:
    if rule.row.age is not None:
        age_s = rule.row.age(flags)
        return age_s is not None and _us(age_s) >= rule.delay_us
    assert rule.row.flag is not None
    return rule.row.flag(flags)


def _advance(rule: Rule, old: Entry | None, raised: bool, flags: Flags, now_us: int) -> Entry | None:
    """Return what is remembered after this tick; None = nothing (never acted, or cleared)."""
    if raised:
        entry = Entry(now_us) if old is None else replace(old, gone_us=None)
    else:
        assert old is not None
        if old.fired_us is None:
            return None
        entry = replace(old, gone_us=now_us if old.gone_us is None else old.gone_us)
        if _cleared(rule, entry, flags, now_us):
            return None
    if entry.fired_us is None:
        due = rule.row.age is not None or now_us - entry.since_us >= rule.delay_us
        return replace(entry, fired_us=now_us) if due else entry
    return _continue(rule, entry, now_us - entry.fired_us, flags)


def _continue(rule: Rule, entry: Entry, acting_us: int, flags: Flags) -> Entry:
    if rule.row.takeover is Takeover.OPERATOR and (flags.operator_order or flags.operator_arm):
        entry = replace(entry, taken=True)
    if rule.then_us is not None and not entry.escalated and acting_us >= rule.then_us:
        entry = replace(entry, escalated=True)
    return entry


def _cleared(rule: Rule, entry: Entry, flags: Flags, now_us: int) -> bool:
    assert entry.gone_us is not None
    if now_us - entry.gone_us < rule.clear_us:
        return False
    if rule.row.clear is Clear.GONE:
        return True
    if rule.row.clear is Clear.OPERATOR:
        return entry.taken or flags.operator_order or flags.operator_arm
    return rule.row.clear is Clear.REARM and flags.operator_arm


def _action(rule: Rule, entry: Entry, flags: Flags) -> Action:
    action = rule.then_action if entry.escalated else rule.action
    by_hand = flags.manual and rule.row.takeover is not Takeover.NEVER
    return min(action, Action.WARN) if entry.taken or by_hand else action


def _tell(rule: Rule, old: Entry | None, entry: Entry | None, texts: list[tuple[Severity, str]]) -> None:
    row = rule.row
    if entry is None:
        if old is not None and old.fired_us is not None:
            texts.append((Severity.NOTICE, f"Over: {row.text}"))
        return
    if entry.fired_us is not None and (old is None or old.fired_us is None):
        texts.append((row.severity, _sentence(row.text, rule.action)))
    elif entry.escalated and old is not None and not old.escalated:
        texts.append((Severity.CRITICAL, _sentence(row.text, rule.then_action)))
    if entry.taken and old is not None and not old.taken:
        texts.append((Severity.WARNING, f"Operator takes over: {row.text}"))


def _sentence(text: str, action: Action) -> str:
    body = text[0].upper() + text[1:]
    return body if action is Action.WARN else f"{body}: {action.name}"


def holding(memory: FailsafeMemory, config: FailsafeConfig) -> tuple[str, ...]:
    """Names of the conditions of STOP or worse whose cause still stands, so that arming could not clear them."""
    standing = []
    for rule in config.rules:
        entry = memory.entries.get(rule.row.name)
        if entry is None or entry.fired_us is None or entry.gone_us is not None or entry.taken:
            continue
        if (rule.then_action if entry.escalated else rule.action) >= Action.STOP:
            standing.append(rule.row.name)
    return tuple(standing)


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
            f"| {row.takeover.value} | {row.floor.name} | {row.delay_max_s:g} |"
        )
    return "\n".join(lines) + "\n"
