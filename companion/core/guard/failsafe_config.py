"""Times and actions of the failsafe conditions: the table's rows with what a configuration makes of them."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final, Self

from pydantic import BeforeValidator, Field, model_validator

from mavlink_bridge.language.messages import Action

from ..config import Config, param
from .failsafe_flags import Flags
from .failsafe_row import Clear, Condition
from .failsafe_table import BY_NAME, TABLE


def _by_name(value: object) -> object:
    if isinstance(value, str) and value.upper() not in Action.__members__:
        raise ValueError(f"must be one of {', '.join(name.lower() for name in Action.__members__)}")
    return Action[value.upper()] if isinstance(value, str) else value


ActionByName = Annotated[Action, BeforeValidator(_by_name)]
"""An action, also by its name in a configuration file."""


class Override(Config):
    """What a configuration may change of one row; the table's floors hold."""

    action: ActionByName | None = None
    """What is done instead; not less than the floor of this condition."""
    delay_s: float | None = Field(None, ge=0)
    """How long the cause must stand before; not beyond the longest of this condition."""


class FailsafeConfig(Config):
    """Times and actions of the failsafe conditions. Everything else is in the table."""

    gcs_timeout_s: float = param(5.0, "FS_GCS_TIMEOUT", "Ground station lost after", unit="s", ge=2, le=120)
    gcs_action: ActionByName = param(
        Action.HOLD, "FS_GCS_ACTION", "First action on loss: 1 warn, 2 hold, 3 return, 4 stop", ge=1, le=4
    )
    gcs_then_s: float = param(60.0, "FS_GCS_THEN_T", "Second action so long after the first", unit="s", ge=0, le=3600)
    gcs_then_action: ActionByName = param(
        Action.RETURN, "FS_GCS_THEN", "Second action on loss: 0 none, 2 hold, 3 return, 4 stop", ge=0, le=4
    )
    radio_timeout_s: float = param(
        65.0, "FS_RADIO_TIMEOUT", "Ground lost over the radio after (more than two beacons)", unit="s", ge=5, le=3600
    )
    manual_timeout_s: float = param(0.5, "FS_MAN_TIMEOUT", "Manual control lost after", unit="s", ge=0.1, le=5)
    guided_timeout_s: float = param(1.0, "FS_GUID_TIMEOUT", "Streamed set-points lost after", unit="s", ge=0.1, le=5)
    oscillation_thrust: float = param(
        0.3, "FS_OSC_THRUST", "Share of full thrust allowed while control oscillates", ge=0, le=1
    )
    thruster_action: ActionByName = param(
        Action.WARN,
        "FS_THR_ACTION",
        "A thruster gives too little: 1 warn and sail on with what is left, 2 hold, 3 return, 4 stop",
        ge=1,
        le=4,
    )
    conditions: dict[str, Override] = Field(default_factory=dict)
    """Per condition name: ``action``, ``delay_s``; not below the floors that ``companion explain failsafe`` lists."""

    @model_validator(mode="after")
    def _within_floors(self) -> Self:
        problems = [text for name, over in self.conditions.items() for text in _override_problems(name, over)]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @cached_property
    def rules(self) -> tuple[Rule, ...]:
        """The table with this configuration's times and actions."""
        return tuple(self._rule(condition) for condition in TABLE)

    @cached_property
    def watch(self) -> QuietWatch:
        """The short cut for a quiet tick."""
        return QuietWatch(self.rules)

    def _rule(self, row: Condition) -> Rule:
        over = self.conditions.get(row.name, _NO_OVERRIDE)
        action = row.action if over.action is None else over.action
        delay_s = row.delay_s if over.delay_s is None else over.delay_s
        then_s, then_action = row.then_after_s, row.then_action
        if row.name in ("gcs_lost", "radio_lost"):
            action, then_action = self.gcs_action, self.gcs_then_action
        if row.name == "thruster_weak":
            action = self.thruster_action
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
        return Rule(
            row=row,
            delay_us=microseconds(delay_s),
            action=action,
            then_us=None if then_s is None else microseconds(then_s),
            then_action=then_action,
            clear_us=microseconds(row.clear_s),
            again_us=microseconds(delay_s / 2.0 if row.clear is Clear.OPERATOR else delay_s),
        )


_NO_OVERRIDE: Final = Override()
_BY_PARAMETER: Final = {
    "gcs_lost": "gcs_timeout_s",
    "gcs_degraded": "gcs_timeout_s",
    "radio_lost": "radio_timeout_s",
    "manual_lost": "manual_timeout_s",
    "guided_lost": "guided_timeout_s",
}
"""Conditions whose times and actions are keys, and parameters, of their own; and one of these keys."""
_ACTION_BY_PARAMETER: Final = {"thruster_weak": "thruster_action"}
"""Those of which the action alone is one."""


def _override_problems(name: str, over: Override) -> list[str]:
    row, key = BY_NAME.get(name), f"conditions.{name}"
    if row is None:
        alike = difflib.get_close_matches(name, BY_NAME, 1)
        mend = f"did you mean {alike[0]}?" if alike else "'companion explain failsafe' lists them"
        return [f"{key}: no such condition; {mend}"]
    if name in _BY_PARAMETER:
        return [f"{key}: has its own keys in [failsafe], such as {_BY_PARAMETER[name]}"]
    problems = []
    if over.action is not None and name in _ACTION_BY_PARAMETER:
        problems.append(f"{key}.action: is its own key, {_ACTION_BY_PARAMETER[name]}, in [failsafe]")
    elif over.action is not None and over.action < row.floor:
        problems.append(f"{key}.action = {over.action.name.lower()}: must be at least {row.floor.name.lower()}")
    if over.delay_s is not None and over.delay_s > row.delay_max_s:
        problems.append(f"{key}.delay_s = {over.delay_s:g}: must be at most {row.delay_max_s:g}")
    return problems


def microseconds(seconds: float) -> int:
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
    again_us: int
    """An age from which on what has acted counts as there again: half of the delay where outages add up."""


class QuietWatch:
    """Whether anything at all is up, in one look: most ticks of a good day end here."""

    __slots__ = ("_young",)

    def __init__(self, rules: Sequence[Rule]) -> None:
        self._young = tuple((rule.row.age, (rule.delay_us - 1) / 1e6) for rule in rules if rule.row.age is not None)

    def quiet(self, flags: Flags) -> bool:
        """True when no row's flag is up and no age is within a microsecond of its delay."""
        if flags.any_alarm():
            return False
        if not flags.helm.armed:
            return True
        ground = flags.ground
        if ground.gcs_required and ground.gcs_age_s is None and ground.radio_age_s is None:
            return False
        for age, young_s in self._young:
            age_s = age(flags)
            if age_s is not None and not age_s < young_s:  # no number is not young
                return False
        return True


def reached(age_s: float, limit_us: int) -> bool:
    """Whether an age has come to a limit, to the microsecond; an age that is not a number has."""
    return not age_s * 1e6 < limit_us - 0.5
