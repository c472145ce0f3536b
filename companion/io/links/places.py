"""Who keeps his place on a link that anybody may speak to, when there are more comers than places."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Final, TypeVar

RESERVED: Final = 2
"""Places that strangers never fill: an operator and his second device."""
STRANGER_IDLE_US: Final = 5_000_000
"""A stranger of a datagram link who says nothing for so long is forgotten; a station sends a heartbeat each second."""
NEWCOMERS_PER_S: Final = 50.0
NEWCOMERS_AT_ONCE: Final = 100.0
"""Strangers that are received; each costs a little time, and addresses are easily made up."""


@dataclass(slots=True)
class LinkPlace:
    """One occupied place."""

    host: str
    since_us: int
    trusted: bool = False


Key = TypeVar("Key", bound=Hashable)


def to_leave(places: Iterable[tuple[Key, LinkPlace]], now_us: int) -> Key | None:
    """The stranger who goes when another comes: the oldest of the host that has most of them. None: nobody may be sent away.

    One host cannot drive out the strangers of others, among whom the operator's new computer is; and whoever came just now has
    not had the time to prove anything.
    """
    strangers = [(key, place) for key, place in places if not place.trusted]
    crowd = Counter(place.host for _, place in strangers)
    able = [(key, place) for key, place in strangers if place.since_us < now_us]
    if not able:
        return None
    return min(able, key=lambda each: (-crowd[each[1].host], each[1].since_us))[0]


def room_for_strangers(most: int) -> int:
    """How many of ``most`` places strangers may hold."""
    return max(1, most - RESERVED)
