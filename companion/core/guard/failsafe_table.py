"""The one table of failsafe conditions: it drives the engine, its tests, the manual and ``companion explain failsafe``.

Each row says when a condition holds (a plain look at ``Flags``), how long it must hold, what happens by default and at
the least, how it clears, and whether an operator may take over. Deadlines are those of the fault matrix
(firmware-reliability §C), structure and clear rules those of architecture-study §4.8. To add a condition: add a field
to ``Flags`` and a row here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from mavlink_bridge.language.messages import Action, Severity

from .failsafe_flags import Flags


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
    station: bool = False
    """The cause is a silent station: its order is speech and ends it; a return that an operator ordered goes on in spite of it."""


def _gcs_age(flags: Flags) -> float | None:
    return flags.gcs_age_s if flags.armed and flags.gcs_required else None


def _radio_age(flags: Flags) -> float | None:
    return flags.radio_age_s if flags.armed and flags.gcs_required else None


def _autonomous(flags: Flags) -> bool:
    return flags.armed and flags.autonomous


W, H, R, S, D, T = Action.WARN, Action.HOLD, Action.RETURN, Action.STOP, Action.DISARM, Action.TERMINATE
OPERATOR, REARM, GONE, RESTART = Clear.OPERATOR, Clear.REARM, Clear.GONE, Clear.RESTART
INFO = Severity.INFO

TABLE: Final[tuple[Condition, ...]] = (
    Condition(
        "terminate", T, "terminated by the operator", lambda f: f.terminate, clear=RESTART, floor=T, delay_max_s=0
    ),
    Condition("emergency_stop", D, "emergency stop", lambda f: f.emergency_stop, clear=REARM, floor=D, delay_max_s=0),
    Condition(
        "aborted", D, "an operator's stop", lambda f: f.aborted, clear=REARM, floor=D, delay_max_s=0, severity=INFO
    ),
    Condition("time_jump", D, "the computer stood still", lambda f: f.time_jump, clear=REARM, floor=S, delay_max_s=0),
    Condition("task_failing", D, "a part keeps failing", lambda f: f.task_failing, clear=REARM, floor=S, delay_max_s=0),
    Condition("actuator_lost", D, "actuators lost", lambda f: f.actuator_lost, clear=REARM, floor=S, delay_max_s=0.2),
    Condition(
        "actuator_reset", D, "actuator board restarted", lambda f: f.actuator_reset, clear=REARM, floor=S, delay_max_s=0
    ),
    Condition(
        "actuator_mismatch",
        D,
        "actuators apply something else",
        lambda f: f.actuator_mismatch,
        clear=REARM,
        floor=S,
        delay_max_s=0.5,
    ),
    Condition(
        "actuator_garbage",
        S,
        "actuator line unreadable",
        lambda f: f.actuator_garbage,
        clear=GONE,
        clear_s=2.0,
        floor=S,
        delay_max_s=1,
    ),
    Condition(
        "position_lost",
        S,
        "position lost",
        lambda f: f.position_lost and _autonomous(f),
        clear_s=5.0,
        takeover=Takeover.MANUAL,
        floor=S,
        delay_max_s=2,
    ),
    Condition(
        "heading_lost",
        S,
        "heading lost",
        lambda f: f.heading_lost and _autonomous(f),
        clear_s=5.0,
        takeover=Takeover.MANUAL,
        floor=S,
        delay_max_s=2,
    ),
    Condition(
        "depth_locked",
        S,
        "too shallow: locked, no manoeuvre",
        lambda f: f.depth_locked,
        clear=REARM,
        takeover=Takeover.MANUAL,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "depth_shallow",
        S,
        "too shallow: a correcting manoeuvre is allowed",
        lambda f: f.depth_shallow,
        takeover=Takeover.ORDER,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "depth_ahead",
        S,
        "shallow water ahead",
        lambda f: f.depth_ahead and _autonomous(f),
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=0,
    ),
    Condition(
        "depth_braking",
        H,
        "shallow water: braking",
        lambda f: f.depth_braking,
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=0,
    ),
    Condition(
        "depth_blind",
        S,
        "water depth unknown",
        lambda f: f.depth_blind and _autonomous(f),
        takeover=Takeover.MANUAL,
        delay_max_s=30,
    ),
    Condition(
        "fence_ahead",
        H,
        "fence ahead",
        lambda f: f.fence_ahead and _autonomous(f),
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=0,
    ),
    Condition(
        "fence_breach",
        H,
        "outside the fence",
        lambda f: f.fence_breach and f.armed,
        takeover=Takeover.ORDER,
        floor=W,
        delay_max_s=0.5,
    ),
    Condition(
        "manual_lost",
        S,
        "manual control lost",
        age=lambda f: f.manual_age_s if f.armed else None,
        delay_s=0.5,
        clear=GONE,
        floor=S,
        delay_max_s=5,
    ),
    Condition(
        "guided_lost",
        H,
        "guided set-points stopped",
        age=lambda f: f.guided_age_s if f.armed else None,
        delay_s=1.0,
        clear=GONE,
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=5,
    ),
    Condition(
        "gcs_lost",
        H,
        "ground station lost",
        age=_gcs_age,
        delay_s=5.0,
        takeover=Takeover.MANUAL,
        then_after_s=60.0,
        then_action=R,
        station=True,
    ),
    Condition(
        "radio_lost",
        H,
        "ground station lost over the radio",
        age=_radio_age,
        delay_s=65.0,
        takeover=Takeover.MANUAL,
        delay_max_s=3600,
        then_after_s=120.0,
        then_action=R,
        station=True,
    ),
    Condition(
        "gcs_degraded",
        W,
        "ground station silent",
        age=_gcs_age,
        delay_s=2.5,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "tick_very_late",
        S,
        "control loop stalled",
        lambda f: f.tick_very_late,
        clear=GONE,
        clear_s=10.0,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "overruns",
        W,
        "control loop overloaded",
        lambda f: f.overruns,
        clear=GONE,
        clear_s=10.0,
        delay_max_s=10,
        then_after_s=10.0,
        then_action=S,
        severity=Severity.WARNING,
    ),
    Condition(
        "tick_late", W, "control loop late", lambda f: f.tick_late, clear=GONE, clear_s=10.0, severity=Severity.WARNING
    ),
    Condition(
        "plan_invalid",
        H,
        "the plan cannot go on",
        lambda f: f.plan_invalid and f.armed,
        takeover=Takeover.ORDER,
        floor=H,
    ),
    Condition(
        "battery_empty",
        S,
        "battery empty",
        lambda f: f.battery_empty and f.armed,
        delay_s=5.0,
        takeover=Takeover.ORDER,
        delay_max_s=30,
    ),
    Condition(
        "battery_critical",
        R,
        "battery critical",
        lambda f: f.battery_critical and f.armed,
        delay_s=5.0,
        takeover=Takeover.ORDER,
        delay_max_s=60,
    ),
    Condition(
        "battery_low",
        W,
        "battery low",
        lambda f: f.battery_low,
        delay_s=5.0,
        clear=GONE,
        clear_s=5.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "battery_lost",
        W,
        "battery sensor lost",
        lambda f: f.battery_lost,
        delay_s=1.0,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "stuck",
        W,
        "thrust without speed",
        lambda f: f.stuck and f.armed,
        clear=Clear.ACTED,
        clear_s=10.0,
        takeover=Takeover.MANUAL,
        then_after_s=10.0,
        then_action=S,
        severity=Severity.WARNING,
    ),
    Condition(
        "moving_in_neutral",
        W,
        "moving with thrusters in neutral",
        lambda f: f.moving_in_neutral,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "drifting_while_stopped",
        W,
        "drifting while stopped by a failsafe",
        lambda f: f.drifting_while_stopped,
        clear=GONE,
        severity=Severity.ALERT,
    ),
    Condition("oscillating", W, "control oscillates: thrust cut", lambda f: f.oscillating, clear=OPERATOR),
    Condition(
        "thruster_weak", W, "a thruster gives too little", lambda f: f.thruster_weak, clear=Clear.ACTED, clear_s=10.0
    ),
    Condition(
        "depth_lost",
        W,
        "no water depth",
        lambda f: f.depth_lost,
        clear=GONE,
        clear_s=2.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "position_frozen",
        W,
        "position does not move",
        lambda f: f.position_frozen,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "sources_disagree",
        W,
        "position sources disagree",
        lambda f: f.sources_disagree,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "actuator_noise",
        W,
        "errors on the actuator line",
        lambda f: f.actuator_noise,
        clear=GONE,
        clear_s=2.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "storage_fault",
        W,
        "cannot store: running from memory",
        lambda f: f.storage_fault,
        clear=GONE,
        severity=Severity.WARNING,
    ),
)
"""Most urgent first, so that the first cause shown is the one to look at."""

BY_NAME: Final = {condition.name: condition for condition in TABLE}
