"""Who a number is: the kinds of MMSI (ITU-R M.585) and which of them may be a vessel."""

from __future__ import annotations

from enum import Enum
from typing import Final


class MmsiKind(Enum):
    """What an MMSI's digits say."""

    SHIP = "ship"
    COAST = "coast station"
    GROUP = "group"
    SAR_AIRCRAFT = "search and rescue aircraft"
    AID = "aid to navigation"
    CRAFT = "craft of a mothership"
    SART = "search and rescue transmitter"
    MAN_OVERBOARD = "man overboard beacon"
    EPIRB = "distress beacon"
    UNKNOWN = "unknown"
    """Numbers that nobody was given (8 digits, 0, 123456789): somebody is there all the same."""


DISTRESS: Final = frozenset((MmsiKind.SART, MmsiKind.MAN_OVERBOARD, MmsiKind.EPIRB))
"""Where one of these is, people are: never a vessel to deal with, always somebody to tell of."""
_BY_PREFIX: Final = (
    ("970", MmsiKind.SART),
    ("972", MmsiKind.MAN_OVERBOARD),
    ("974", MmsiKind.EPIRB),
    ("111", MmsiKind.SAR_AIRCRAFT),
    ("99", MmsiKind.AID),
    ("98", MmsiKind.CRAFT),
    ("00", MmsiKind.COAST),
    ("0", MmsiKind.GROUP),
)
"""Looked through in this order, the longest first."""
_MID: Final = range(201, 776)
"""Maritime identification digits: the flags."""
_MADE_UP: Final = frozenset((0, 1, 111_111_111, 123_456_789))


def station_of(mmsi: int) -> MmsiKind:
    """Return what kind of station a number is given to."""
    if mmsi in _MADE_UP or not 0 <= mmsi <= 999_999_999:
        return MmsiKind.UNKNOWN
    digits = f"{mmsi:09d}"
    if digits[:3] in ("000",) or (digits[0] == "0" and digits[1] != "0" and int(digits[1:4]) not in _MID):
        return MmsiKind.UNKNOWN
    for prefix, station in _BY_PREFIX:
        if digits.startswith(prefix):
            return station
    return MmsiKind.SHIP if int(digits[:3]) in _MID else MmsiKind.UNKNOWN
