"""The one table of failsafe conditions: it drives the engine, its tests, the manual and ``companion explain failsafe``.

Each row says when a condition holds (a plain look at ``Flags``), how long it must hold, what happens by default and at
the least, how it clears, and whether an operator may take over. Deadlines are those of the fault matrix
(firmware-reliability §C), structure and clear rules those of architecture-study §4.8. To add a condition: add a field
to the group of flags whose owner knows it, and a row here.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Final

from mavlink_bridge.language.messages import Action, Severity

from .failsafe_flags import SILENT_S, autonomous, gcs_age, gcs_silent, radio_age, radio_silent
from .failsafe_row import Clear, Condition, Takeover, of_others, of_place, of_thrusters

W, H, R, S, D, T = Action.WARN, Action.HOLD, Action.RETURN, Action.STOP, Action.DISARM, Action.TERMINATE
OPERATOR, REARM, GONE, RESTART = Clear.OPERATOR, Clear.REARM, Clear.GONE, Clear.RESTART
INFO = Severity.INFO
STEADY_S: Final = 30.0
"""A station that is heard each few seconds is one bad link: told as silent once, and as heard again when it has been so for that long."""


TABLE: Final[tuple[Condition, ...]] = (
    Condition(
        "terminate", T, "terminated by the operator", lambda f: f.stop.terminate, clear=RESTART, floor=T, delay_max_s=0
    ),
    Condition(
        "emergency_stop", D, "emergency stop", lambda f: f.board.emergency_stop, clear=REARM, floor=D, delay_max_s=0
    ),
    Condition(
        "aborted", D, "an operator's stop", lambda f: f.stop.aborted, clear=REARM, floor=D, delay_max_s=0, severity=INFO
    ),
    Condition(
        "time_jump", D, "the computer stood still", lambda f: f.monitors.time_jump, clear=REARM, floor=S, delay_max_s=0
    ),
    Condition(
        "task_failing", D, "a part keeps failing", lambda f: f.process.task_failing, clear=REARM, floor=S, delay_max_s=0
    ),
    Condition(
        "actuator_lost", D, "actuators lost", lambda f: f.board.actuator_lost, clear=REARM, floor=S, delay_max_s=0.2
    ),
    Condition(
        "actuator_reset",
        D,
        "actuator board restarted",
        lambda f: f.board.actuator_reset,
        clear=REARM,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "actuator_mismatch",
        D,
        "actuators apply something else",
        lambda f: f.board.actuator_mismatch,
        clear=REARM,
        floor=S,
        delay_max_s=0.5,
    ),
    Condition(
        "actuator_garbage",
        S,
        "actuator line unreadable",
        lambda f: f.board.actuator_garbage,
        clear=GONE,
        clear_s=2.0,
        floor=S,
        delay_max_s=1,
    ),
    of_place("position_lost", "position lost"),
    of_place("heading_lost", "heading lost"),
    Condition(
        "depth_locked",
        S,
        "too shallow: locked, no manoeuvre",
        lambda f: f.depth.depth_locked,
        clear=REARM,
        takeover=Takeover.MANUAL,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "depth_shallow",
        S,
        "too shallow: a correcting manoeuvre is allowed",
        lambda f: f.depth.depth_shallow,
        stands=lambda f: f.depth.depth_shallow or f.depth.depth_locked or f.helm.awaits_arming,
        takeover=Takeover.ORDER,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "depth_ahead",
        S,
        "shallow water ahead",
        lambda f: f.depth.depth_ahead and autonomous(f),
        stands=attrgetter("depth.depth_ahead"),
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=0,
    ),
    Condition(
        "depth_braking",
        H,
        "shallow water: braking",
        lambda f: f.depth.depth_braking,
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=0,
    ),
    Condition(
        "depth_blind",
        S,
        "water depth unknown",
        lambda f: f.depth.depth_blind and autonomous(f),
        stands=attrgetter("depth.depth_blind"),
        takeover=Takeover.MANUAL,
        delay_max_s=30,
        ends_alone=True,
    ),
    Condition(
        "fence_ahead",
        H,
        "fence ahead",
        lambda f: f.fence.fence_ahead and autonomous(f),
        stands=attrgetter("fence.fence_ahead"),
        takeover=Takeover.MANUAL,
        floor=H,
        delay_max_s=0,
    ),
    Condition(
        "fence_breach",
        H,
        "outside the fence",
        lambda f: f.fence.fence_breach and f.helm.armed,
        stands=attrgetter("fence.fence_breach"),
        takeover=Takeover.ORDER,
        floor=W,
        delay_max_s=0.5,
    ),
    Condition(
        "manual_lost",
        S,
        "manual control lost",
        age=lambda f: f.helm.manual_age_s if f.helm.armed else None,
        delay_s=0.5,
        clear=GONE,
        floor=S,
        delay_max_s=5,
        gives_way=True,
    ),
    Condition(
        "guided_lost",
        H,
        "guided set-points stopped",
        age=lambda f: f.helm.guided_age_s if f.helm.armed else None,
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
        age=gcs_age,
        stands=gcs_silent,
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
        age=radio_age,
        stands=radio_silent,
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
        age=gcs_age,
        stands=gcs_silent,
        delay_s=SILENT_S,
        clear=GONE,
        clear_s=STEADY_S,
        severity=Severity.WARNING,
    ),
    Condition(
        "tick_very_late",
        S,
        "control loop stalled",
        lambda f: f.monitors.tick_very_late,
        clear=GONE,
        clear_s=10.0,
        floor=S,
        delay_max_s=0,
    ),
    Condition(
        "overruns",
        W,
        "control loop overloaded",
        lambda f: f.monitors.overruns,
        clear=GONE,
        clear_s=10.0,
        delay_max_s=10,
        then_after_s=10.0,
        then_action=S,
        severity=Severity.WARNING,
    ),
    Condition(
        "tick_late",
        W,
        "control loop late",
        lambda f: f.monitors.tick_late,
        clear=GONE,
        clear_s=10.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "plan_invalid",
        H,
        "the plan cannot go on",
        lambda f: f.plan.plan_invalid and f.helm.armed,
        stands=lambda f: f.plan.plan_invalid or not f.helm.armed,
        takeover=Takeover.ORDER,
        floor=H,
    ),
    Condition(
        "battery_empty",
        S,
        "battery empty",
        lambda f: f.monitors.battery_empty and f.helm.armed,
        stands=attrgetter("monitors.battery_empty"),
        delay_s=5.0,
        takeover=Takeover.ORDER,
        delay_max_s=30,
    ),
    Condition(
        "battery_critical",
        R,
        "battery critical",
        lambda f: f.monitors.battery_critical and f.helm.armed,
        stands=attrgetter("monitors.battery_critical"),
        delay_s=5.0,
        takeover=Takeover.ORDER,
        delay_max_s=60,
    ),
    Condition(
        "battery_low",
        W,
        "battery low",
        lambda f: f.monitors.battery_low,
        delay_s=5.0,
        clear=GONE,
        clear_s=5.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "battery_lost",
        W,
        "battery sensor lost",
        lambda f: f.monitors.battery_lost,
        delay_s=1.0,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "stuck",
        W,
        "thrust without speed",
        lambda f: f.monitors.stuck and f.helm.armed,
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
        lambda f: f.monitors.moving_in_neutral,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "drifting_while_stopped",
        W,
        "drifting while stopped by a failsafe",
        lambda f: f.monitors.drifting_while_stopped,
        clear=GONE,
        severity=Severity.ALERT,
    ),
    Condition(
        "oscillating",
        W,
        "control oscillates: thrust cut until steady",
        lambda f: f.monitors.oscillating,
        clear=GONE,
    ),
    of_thrusters("thruster_reversed", "a thruster pushes the wrong way"),
    of_thrusters("thruster_alone", "this hull cannot be steered by one thruster"),
    Condition(
        "thruster_weak",
        W,
        "a thruster gives too little",
        lambda f: f.thrust.thruster_weak,
        clear=Clear.ACTED,
        clear_s=10.0,
    ),
    of_others("person_in_water", "a person's beacon sends", Severity.ALERT),
    of_others("traffic_close", "a vessel is close", Severity.CRITICAL),
    of_others("traffic_lost", "a vessel with risk is not heard", Severity.WARNING),
    of_others("ais_lost", "AIS is silent", Severity.WARNING),
    Condition(
        "depth_lost",
        W,
        "no water depth",
        lambda f: f.depth.depth_lost,
        clear=GONE,
        clear_s=2.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "position_frozen",
        W,
        "position does not move",
        lambda f: f.place.position_frozen,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "sources_disagree",
        W,
        "position sources disagree",
        lambda f: f.place.sources_disagree,
        clear=GONE,
        severity=Severity.WARNING,
    ),
    Condition(
        "actuator_noise",
        W,
        "errors on the actuator line",
        lambda f: f.board.actuator_noise,
        clear=GONE,
        clear_s=2.0,
        severity=Severity.WARNING,
    ),
    Condition(
        "storage_fault",
        W,
        "cannot store: running from memory",
        lambda f: f.process.storage_fault,
        clear=GONE,
        severity=Severity.WARNING,
    ),
)
"""Most urgent first, so that the first cause shown is the one to look at."""

BY_NAME: Final = {condition.name: condition for condition in TABLE}
