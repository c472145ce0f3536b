"""What messages are called, those that are only refused included."""

from __future__ import annotations

from dataclasses import fields
from typing import Final

from .fields import Message, UnknownMessage
from .messages import TABLE

_ONLY_NAMED: Final = {
    451: "PopUp",
    454: "IdleManeuver",
    455: "LowLevelControl",
    462: "Elevator",
    465: "CustomManeuver",
    466: "VehicleFormation",
    471: "FollowSystem",
    473: "CoverArea",
    477: "FormationPlanExecution",
    478: "FollowReference",
    483: "Dislodge",
    486: "Drop",
    487: "ScheduledGoto",
    489: "Sample",
    490: "ImageTracking",
    491: "Takeoff",
    492: "Land",
    493: "AutonomousSection",
    495: "Alignment",
    499: "Magnetometer",
}
"""Manoeuvres that no surface vessel's console offers: a refusal can name them, nothing can read them."""


def name_of(number: int) -> str:
    """The message's name, or ``message 4711`` for a number that is not known."""
    if number in TABLE:
        return TABLE[number].__name__
    return _ONLY_NAMED.get(number, f"message {number}")


def holds_unknown(message: Message) -> UnknownMessage | None:
    """The first unknown message at any depth: what stands behind it was not read, so the whole may not be acted on."""
    if isinstance(message, UnknownMessage):
        return message
    for field in fields(message):
        value = getattr(message, field.name)
        inner = value if isinstance(value, tuple) else (value,)
        for item in inner:
            found = holds_unknown(item) if isinstance(item, Message) else None
            if found is not None:
                return found
    return None
