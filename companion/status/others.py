"""Other vessels as a watcher sees them: the most dangerous and nearest, in degrees, metres and m/s, with what we owe each in words."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.traffic import Danger, OtherVessel, TrafficPicture, VesselKind
from mavlink_bridge.language.value import value

from ..core.traffic import words
from ..core.traffic.words import situation, wind_of

MOST: Final = 12
"""Vessels: more than a glance takes in; those with risk come first."""
MOST_PERSONS: Final = 8
"""Before all vessels and beside their number: a liferaft's crew, each with a beacon of his own."""
PERSON: Final = VesselKind.PERSON.value
_OLD_S: Final = 20.0
"""Whose last report is older is told so: the fastest come every two seconds, small boats' every thirty."""


@value
class Other:
    """One other vessel, or mark."""

    mmsi: int
    title: str
    kind: str
    danger: str
    lat_deg: float
    lon_deg: float
    age_s: float
    """Since she was where she said."""
    course_deg: float | None = None
    """Her bow's direction, or her course where she sends no heading."""
    speed_mps: float | None = None
    at_rest: bool = False
    length_m: int | None = None
    range_m: float | None = None
    bearing_deg: float | None = None
    cpa_m: float | None = None
    tcpa_s: float | None = None
    sentence: str = ""
    """How we meet, the closest point and what we owe her, or that it is a person; empty without risk."""


def others_of(picture: TrafficPicture, t_us: int) -> tuple[Other, ...]:
    """The first of a picture, which has persons and the most dangerous first; marks and the far off are left out."""
    persons = [each for each in picture.vessels if each.kind is VesselKind.PERSON]
    shown = [
        each
        for each in picture.vessels
        if each.kind is not VesselKind.PERSON and (each.danger is not Danger.NONE or _is_near(each, picture.range_m))
    ]
    return tuple(_other(each, t_us) for each in (*persons[:MOST_PERSONS], *shown[:MOST]))


def person_of(picture: TrafficPicture) -> str:
    """Where the nearest person is, in words; empty: none is known."""
    unplaced = words.POSITION_UNKNOWN if picture.person else ""
    return next((words.where(each) for each in picture.vessels if each.kind is VesselKind.PERSON), unplaced)


def _is_near(vessel: OtherVessel, range_m: float) -> bool:
    return vessel.range_m is None or vessel.range_m <= range_m


def _other(vessel: OtherVessel, t_us: int) -> Other:
    way = vessel.cog_rad if vessel.heading_rad is None else vessel.heading_rad
    return Other(
        mmsi=vessel.mmsi,
        title=vessel.title,
        kind=vessel.kind.value,
        danger=vessel.danger.value,
        lat_deg=round(math.degrees(vessel.lat_rad), 6),
        lon_deg=round(math.degrees(vessel.lon_rad), 6),
        age_s=round(vessel.age_s(t_us)),
        course_deg=None if way is None or vessel.at_rest else _compass(way),
        speed_mps=0.0 if vessel.at_rest else None if vessel.sog_mps is None else round(vessel.sog_mps, 1),
        at_rest=vessel.at_rest,
        length_m=None if vessel.sides is None else vessel.sides.bow_m + vessel.sides.stern_m,
        range_m=None if vessel.range_m is None else round(vessel.range_m),
        bearing_deg=None if vessel.bearing_rad is None else _compass(vessel.bearing_rad),
        cpa_m=None if vessel.cpa_m is None else round(vessel.cpa_m),
        tcpa_s=None if vessel.tcpa_s is None else round(vessel.tcpa_s),
        sentence=_sentence(vessel),
    )


def _sentence(vessel: OtherVessel) -> str:
    if vessel.kind is VesselKind.PERSON:
        return words.person(vessel)
    return "" if vessel.danger is Danger.NONE else situation(vessel)


def _compass(angle_rad: float) -> float:
    return round(math.degrees(angle_rad) % 360.0) % 360.0


def headline(other: Other) -> str:
    """What matters of her, where she is now, and how old that is."""
    now = "" if other.kind == PERSON else f"; now {where(other)}"
    return f"{other.sentence}{now}{f'; heard {other.age_s:.0f} s ago' if other.age_s >= _OLD_S else ''}"


def where(other: Other) -> str:
    """Where she is from us, in words."""
    if other.range_m is None or other.bearing_deg is None:
        return "where from us is not known"
    return f"{other.range_m:.0f} m {wind_of(math.radians(other.bearing_deg))}"
