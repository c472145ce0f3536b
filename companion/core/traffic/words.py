"""What the operator hears about other vessels."""

from __future__ import annotations

import math
from typing import Final, assert_never

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.traffic import TCPA_MOST_S, Danger, OtherVessel, Role
from mavlink_bridge.language.units import wrap_2pi

from .sectors import Duty, duty_of, hampered_of

Text = tuple[Severity, str]
_NAME_MAX: Final = 20
"""As long as AIS gives names."""
POSITION_UNKNOWN: Final = "position unknown"
"""Of a beacon that does not know where it is: its first minutes are so."""
_AWAY: Final = "going away, not yet clear"
_NOW_S: Final = 0.5
"""What would be told as in 0 s."""
_WINDS: Final = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


def wind_of(bearing_rad: float) -> str:
    """A bearing as one of eight points."""
    return _WINDS[round(wrap_2pi(bearing_rad) / math.tau * 8) % 8]


def how(role: Role) -> str:
    """What a vessel does, seen from us."""
    match role:
        case Role.NONE:
            return "coming close"
        case Role.HEAD_ON:
            return "head-on"
        case Role.GIVE_WAY:
            return "crossing from starboard"
        case Role.STAND_ON:
            return "crossing from port"
        case Role.OVERTAKING:
            return "being overtaken"
        case Role.OVERTAKEN:
            return "overtaking us"
        case Role.OBSTACLE:
            return "in the way"
        case _:
            assert_never(role)


def owed(vessel: OtherVessel) -> str:
    """What the rules ask of us, in words, and why where her side does not say it; empty where they ask nothing."""
    hampered = hampered_of(vessel.status, vessel.ship_type)
    duty = duty_of(vessel.role, hampered)
    why = "" if hampered is None or duty is duty_of(vessel.role) else f": she is {hampered.value}"
    match duty:
        case Duty.NONE:
            return ""
        case Duty.GIVE_WAY:
            return f"we give way{why}"
        case Duty.STAND_ON:
            return "we stand on"
        case Duty.NOT_IMPEDE:
            return f"we do not impede her{why}"
        case _:
            assert_never(duty)


def _closest(vessel: OtherVessel) -> str:
    if vessel.going_away:
        return _AWAY
    distance, seconds = max(0.0, vessel.cpa_m or 0.0), vessel.tcpa_s or 0.0
    if seconds >= TCPA_MOST_S:
        return f"CPA {distance:.0f} m"
    return f"CPA {distance:.0f} m {f'in {seconds:.0f} s' if seconds >= _NOW_S else 'now'}"


def situation(vessel: OtherVessel) -> str:
    """How we meet, the closest point and what we owe her."""
    duty = owed(vessel)
    rest = f"; {duty}" if duty else ""
    course = "" if vessel.going_away else f"{how(vessel.role)}, "
    return f"{vessel.title[:_NAME_MAX]} {course}{_closest(vessel)}{rest}"


def begun(vessel: OtherVessel) -> Text:
    """Risk has begun."""
    return Severity.WARNING, f"Traffic: {situation(vessel)}"


def close(vessel: OtherVessel) -> Text:
    """She is within half of the wanted clearance, or is about to be."""
    off = None if vessel.hull_m is None else f"{max(0.0, vessel.hull_m):.0f} m off"
    if off is None or vessel.going_away:
        told = _closest(vessel)
    else:
        told = off if (vessel.tcpa_s or 0.0) < _NOW_S else f"{_closest(vessel)}; now {off}"
    return Severity.CRITICAL, f"Traffic: {vessel.title[:_NAME_MAX]} close, {told}"


def clear(vessel: OtherVessel) -> Text:
    """She is past and clear."""
    return Severity.INFO, f"Traffic: {vessel.title[:_NAME_MAX]} past and clear"


def lost(vessel: OtherVessel, now_us: int) -> Text:
    """A vessel with risk has fallen silent."""
    where = "" if vessel.range_m is None else f", was {vessel.range_m:.0f} m away"
    return Severity.WARNING, f"Traffic: {vessel.title[:_NAME_MAX]} not heard for {vessel.age_s(now_us):.0f} s{where}"


def gone(vessel: OtherVessel) -> Text:
    """A track with risk has ended without being past and clear."""
    return Severity.WARNING, f"Traffic: {vessel.title[:_NAME_MAX]} lost: not heard any more"


def change(before: Danger, vessel: OtherVessel) -> Text | None:
    """The text for a change of danger; None when there is none worth it."""
    match vessel.danger:
        case Danger.NONE:
            return None if before is Danger.NONE else clear(vessel)
        case Danger.RISK:
            return begun(vessel) if before is Danger.NONE else None
        case Danger.CLOSE:
            return None if before is Danger.CLOSE else close(vessel)
        case danger:
            assert_never(danger)


def person(vessel: OtherVessel) -> str:
    """The headline of a person's beacon."""
    return f"PERSON IN THE WATER {where(vessel)}, {vessel.beacon} beacon {vessel.mmsi}"


def where(vessel: OtherVessel) -> str:
    """How far off and in which direction."""
    if vessel.range_m is None or vessel.bearing_rad is None:
        return f"{POSITION_UNKNOWN} here"
    return f"{vessel.range_m:.0f} m {wind_of(vessel.bearing_rad)}"
