"""The causes that the hull's motion can tell apart, and their words for the operator."""

from __future__ import annotations

from enum import Enum, auto
from typing import assert_never


class Cause(Enum):
    """One fault of the propulsion. A lost propeller and a fouled one differ in degree only."""

    WEAK = auto()
    """Of the only thruster."""
    REVERSED = auto()
    PORT_WEAK = auto()
    STARBOARD_WEAK = auto()
    PORT_REVERSED = auto()
    STARBOARD_REVERSED = auto()
    SWAPPED = auto()
    SLIP = auto()
    RUDDERS_STILL = auto()
    RUDDERS_REVERSED = auto()


def words(cause: Cause) -> str:
    """What an operator is told: what it looks like and what to look at."""
    return f"Suspected: {_found(cause)}"


def withdrawn(cause: Cause) -> str:
    """What an operator is told when a heading that was wrong explains it."""
    return f"No longer suspected: {_found(cause)}; a wrong heading looks like it"


def _found(cause: Cause) -> str:
    match cause:
        case Cause.WEAK:
            found = "the thruster gives little (lost, weed)"
        case Cause.REVERSED:
            found = "the thruster pushes the wrong way"
        case Cause.PORT_WEAK:
            found = "port thruster gives little (lost, weed)"
        case Cause.STARBOARD_WEAK:
            found = "starboard thruster gives little (lost, weed)"
        case Cause.PORT_REVERSED:
            found = "port thruster pushes the wrong way"
        case Cause.STARBOARD_REVERSED:
            found = "starboard thruster pushes the wrong way"
        case Cause.SWAPPED:
            found = "thrusters changed over"
        case Cause.SLIP:
            found = "both thrusters give little or nothing, or the boat is held (weed, a tow, aground)"
        case Cause.RUDDERS_STILL:
            found = "rudders stuck or free"
        case Cause.RUDDERS_REVERSED:
            found = "rudders work the wrong way"
        case _:
            assert_never(cause)
    return found
