"""What an operator is told of a failsafe condition beside its name: that its cause is gone, what the vessel does, which order goes on."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Action

from .failsafe_barring import NOTHING, Beside
from .failsafe_orders import Order, names, to_resume
from .failsafe_row import Clear, Condition, Takeover

BACK: Final = {
    "emergency_stop": "the emergency stop is released",
    "aborted": "nothing stands against arming",
    "time_jump": "the computer runs again",
    "task_failing": "the failing part is quiet",
    "actuator_lost": "actuators are back",
    "actuator_reset": "the actuator board runs again",
    "actuator_mismatch": "actuators do as told again",
    "position_lost": "position is back",
    "heading_lost": "heading is back",
    "depth_locked": "it is deep enough again",
    "depth_shallow": "it is deep enough again",
    "depth_ahead": "the boat's way is off",
    "depth_braking": "braking is over",
    "depth_blind": "water depth is known again",
    "fence_ahead": "no fence is ahead",
    "fence_breach": "the boat is inside the fence again",
    "gcs_lost": "ground station is back",
    "radio_lost": "ground station is back over the radio",
    "plan_invalid": "the plan can go on",
    "battery_empty": "battery voltage is back",
    "battery_critical": "battery voltage is back",
    "stuck": "the thrust has rested",
    "actuator_garbage": "the actuator line is readable",
    "manual_lost": "sticks are heard again",
    "guided_lost": "Guided is ordered again",
    "tick_very_late": "the control loop keeps its time",
    "overruns": "the control loop keeps its time",
    "thruster_reversed": "the thrusters push as told",
    "thruster_alone": "both thrusters push again",
    "thruster_weak": "the thrusters give what they are told",
}
"""By row: what is said when the cause is gone. Every row that may do more than warn, or waits for an order, has its words."""

WAYS: Final = {Clear.OPERATOR: "order {}", Clear.ACTED: "order {}", Clear.REARM: "arm again"}
"""By clear rule: what goes on once the cause is gone; where nothing is asked for, nothing stands here."""

DOING: Final = {
    Action.WARN: "the warning stays",
    Action.HOLD: "holding",
    Action.RETURN: "returning",
    Action.STOP: "stopped",
    Action.DISARM: "disarmed",
}
"""What the vessel does while a condition acts so."""


SHORT: Final = {**DOING, Action.NONE: "", Action.WARN: "warning", Action.TERMINATE: "terminated"}
"""The same in a panel's row."""

TAKEN_OVER: Final = "taken over"
"""Said there of a condition from which an operator has."""

SHUT_OFF: Final = "Fence across the way back: {}: order a go-to round it, or change the fence"
"""Said of a return that waits before the fence; with what the vessel does meanwhile."""

TRY_AGAIN: Final = "disarm and arm again to try"
"""Said where an order is refused for what only thrust shows, and a stopped vessel gives none."""

_ENDS: Final = {
    Clear.OPERATOR: ", then order {}",
    Clear.ACTED: ", then order {}",
    Clear.REARM: ", then arm again",
    Clear.GONE: "",
}


def until(row: Condition, resume: str, others: Beside = NOTHING) -> str:
    """Say how a condition ends: "until position is back, then order Auto"; "" for one that only warns and ends by itself.

    No order is named that ``others`` would undo.
    """
    if row.clear is Clear.RESTART:
        return "until the program is started again"
    back = BACK.get(row.name)
    if back is None:
        return ""
    if row.shows_by_thrust:
        back = "disarmed and armed again"
    if others.barred and row.clear in WAYS:
        return f"until {back} (also: {others.barred})"
    way = _ENDS[row.clear].format(order_named(resume, others))
    now = names(row.name, *others.rows) if row.takeover is Takeover.ORDER else ""
    return f"until {back}{way}" + (f"; or order {now} now" if now else "")


def doing(action: Action, done: Action | None, why: str) -> str:
    """Say what the vessel does while a condition asks for ``action``: just that, or what is ``done`` for another one, ``why``."""
    if done is None or action is done:
        return SHORT[action]
    if min(action, done) <= Action.WARN:
        return SHORT[Action.WARN]
    return f"{SHORT[done]} ({why})" if why else f"{SHORT[done]} instead"


def named(row: Condition, resume: str) -> Order | None:
    """The order that a condition's text would name; None: only to arm."""
    return None if row.clear is Clear.REARM else to_resume(resume)


def order_named(resume: str, others: Beside) -> str:
    """The order that goes on: what was broken off, or what other conditions that stand let through."""
    return (others.is_order_lost and names(*others.rows)) or resume or "Auto"


def capital(text: str) -> str:
    return text[0].upper() + text[1:]
