"""A row of the failsafe table: when a condition holds, what happens, how it clears, who may go on all the same; and rows that are alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from operator import attrgetter

from mavlink_bridge.language.messages import Action, Severity

from .failsafe_flags import Flags, autonomous


class Clear(Enum):
    """When a condition that has acted lets go. Always only after its flag is gone for ``clear_s``."""

    GONE = "when the cause is gone"
    OPERATOR = "cause gone, then an operator's order or re-arm"
    REARM = "cause gone, then a re-arm"
    ACTED = "a warning when the cause is gone; once it has acted, an operator's order or re-arm"
    RESTART = "only by a restart"


class Takeover(Enum):
    """Who may go on while the cause is still there; the action is then no more than WARN."""

    NEVER = "nobody"
    MANUAL = "manual control"
    ORDER = "manual control, or an order that is named for it"


@dataclass(frozen=True, slots=True)
class Condition:
    """One row. ``flag`` is timed by the engine; an ``age`` is compared with the delay itself."""

    name: str
    action: Action
    text: str
    flag: Callable[[Flags], bool] | None = None
    age: Callable[[Flags], float | None] | None = None
    delay_s: float = 0.0
    clear: Clear = Clear.OPERATOR
    clear_s: float = 0.0
    takeover: Takeover = Takeover.NEVER
    floor: Action = Action.WARN
    """The least action a configuration may choose."""
    delay_max_s: float = 120.0
    """The longest delay a configuration may choose."""
    then_after_s: float | None = None
    """Seconds of the action after which ``then_action`` follows."""
    then_action: Action = Action.NONE
    severity: Severity = Severity.CRITICAL
    stands: Callable[[Flags], bool] | None = None
    """The cause by itself, where ``flag`` also asks what the vessel does: disarmed, or steered by hand, it has not come back by that."""
    station: bool = False
    """The cause is a silent station: its order is speech and ends it; a return that an operator ordered goes on in spite of it."""
    gives_way: bool = False
    """It says that nobody steers: where the station is silent as well, it stands in no return's way."""
    shows_by_thrust: bool = False
    """Stopped, the vessel never shows that the cause is gone: what was found is forgotten with a disarm, and watched for anew."""
    ends_alone: bool = False
    """Its cause gone, it ends without an order where the station has been silent for so long that the vessel is to return."""


def of_others(name: str, cause: str, severity: Severity) -> Condition:
    """A row of the traffic watch: it warns and does no more."""
    return Condition(
        name, Action.WARN, cause, attrgetter(f"traffic.{name}"), clear=Clear.GONE, clear_s=5.0, severity=severity
    )


def of_thrusters(name: str, cause: str) -> Condition:
    """A row of the thrusters' watch after which nothing can be sailed but by hand. Disarmed, nothing has shown that they are sound."""
    found = attrgetter(f"thrust.{name}")
    return Condition(
        name,
        Action.STOP,
        cause,
        found,
        stands=lambda f: found(f) or not f.helm.armed,
        takeover=Takeover.MANUAL,
        shows_by_thrust=True,
    )


def of_place(name: str, cause: str) -> Condition:
    """A row of what it takes to steer: it acts while the vessel steers itself, and its cause stands also while it does not."""
    stands = attrgetter(f"place.{name}")
    return Condition(
        name,
        Action.STOP,
        cause,
        lambda f: stands(f) and autonomous(f),
        stands=stands,
        clear_s=5.0,
        takeover=Takeover.MANUAL,
        floor=Action.STOP,
        delay_max_s=2,
        ends_alone=True,
    )
