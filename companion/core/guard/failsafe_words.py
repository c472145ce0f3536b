"""What an operator is told of a failsafe condition beside its name: that its cause is gone, what the vessel does, which order goes on."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Action

from .failsafe_table import Clear

BACK: Final = {
    "emergency_stop": "emergency stop released",
    "time_jump": "the computer runs again",
    "task_failing": "the failing part is quiet",
    "actuator_lost": "actuators are back",
    "actuator_reset": "the actuator board runs again",
    "actuator_mismatch": "actuators do as told again",
    "position_lost": "position is back",
    "heading_lost": "heading is back",
    "depth_locked": "deep enough again",
    "depth_shallow": "deep enough again",
    "depth_ahead": "no shallow water ahead now",
    "depth_braking": "braking is over",
    "depth_blind": "water depth is known again",
    "fence_ahead": "no fence ahead now",
    "fence_breach": "inside the fence again",
    "gcs_lost": "ground station is back",
    "radio_lost": "ground station is back over the radio",
    "plan_invalid": "the plan can go on",
    "battery_empty": "battery voltage is back",
    "battery_critical": "battery voltage is back",
    "stuck": "thrust moves the boat again",
    "oscillating": "control is steady again",
}
"""By row: the cause is gone, and an order is waited for."""

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


def capital(text: str) -> str:
    return text[0].upper() + text[1:]
