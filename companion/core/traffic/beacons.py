"""Distress beacons (970, 972, 974): which of them are in earnest, what is told of each, and who sends before knowing where it is.

The status of a position report is the beacon's own switch and wins over a text; a text may come minutes later, or not at all.
"""

from __future__ import annotations

from typing import Final, TypeVar

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.traffic import OtherVessel, VesselKind, beacon_name

from ..ais.reports import PositionReport, SafetyText
from .table import PERSON_LIFE_S, TRACKS_MAX
from .throttle import Throttle
from .words import POSITION_UNKNOWN, Text, where

_ACTIVE: Final = 14
"""Navigational status of a beacon that is used in earnest,"""
_TESTED: Final = 15
"""and of one in test."""
_ANEW_US: Final = 3_600_000_000
"""A beacon sends eight times a minute, and waves hide it for minutes: who is heard after an hour is in the water anew."""
_AGAIN_US: Final = 60_000_000
"""A switch that flaps between test and earnest, or is forged so, is told of both once in a minute."""
_What = TypeVar("_What")


_Word = tuple[bool, bool]
"""What is told of a beacon: whether as a test, and whether with a place."""


class _Told:
    """What was told of one beacon."""

    __slots__ = ("_at_us", "_last", "_mmsi", "heard_us")

    def __init__(self, mmsi: int, heard_us: int) -> None:
        self._mmsi = mmsi
        self.heard_us = heard_us
        """When it was heard last."""
        self._last: _Word | None = None
        self._at_us: dict[_Word, int] = {}

    def tell(self, word: _Word, place: str, now_us: int, throttle: Throttle) -> list[Text]:
        """What is news; what finds no room is told when there is some, if it is still so then."""
        test, placed = word
        last = self._last
        if last is not None and last[0] is test and (last[1] or not placed):
            return []
        at_us = self._at_us.get(word)
        if (at_us is not None and now_us - at_us < _AGAIN_US) or not throttle.has_room(now_us):
            return []
        throttle.spend(now_us)
        self._last = word
        self._at_us[word] = now_us
        if test:
            return [(Severity.NOTICE, f"{beacon_name(self._mmsi)} beacon {self._mmsi} in test: {place}")]
        return [(Severity.ALERT, f"{beacon_name(self._mmsi)} beacon {self._mmsi}: {place}")]


class DistressBeacons:
    """What is known of each: of as many as there are tracks, those heard last."""

    def __init__(self) -> None:
        self._said_active: dict[int, None] = {}
        """Those whose text says that they are in earnest."""
        self._unplaced: dict[int, int] = {}
        """Those in earnest that have no position yet, and when they were heard."""
        self._told: dict[int, _Told] = {}
        self._throttles = {True: Throttle(), False: Throttle()}
        """For tests and for persons: no number of tests keeps a person from being told."""

    def take_text(self, report: SafetyText) -> None:
        """Take a beacon's text. One that says nothing of a test is in earnest."""
        if "TEST" in report.text.upper():
            self._said_active.pop(report.mmsi, None)
        else:
            _remember(self._said_active, report.mmsi, None)

    def kind_of(self, report: PositionReport) -> VesselKind:
        """Whether a beacon that reports is a person or a test: by its status, and by its text where that says neither."""
        said_active = report.mmsi in self._said_active and report.status != _TESTED
        in_earnest = report.status == _ACTIVE or said_active
        return VesselKind.PERSON if in_earnest else VesselKind.BEACON_TEST

    def take_unplaced(self, report: PositionReport, now_us: int) -> list[Text]:
        """Take a report without a position, of a beacon that has no place: its first minutes are so. Return what is worth a word."""
        test = self.kind_of(report) is VesselKind.BEACON_TEST
        if test:
            self._unplaced.pop(report.mmsi, None)
        else:
            _remember(self._unplaced, report.mmsi, now_us)
        told = self._hear(report.mmsi, now_us)
        return told.tell((test, False), POSITION_UNKNOWN, now_us, self._throttles[test])

    def tell(self, vessel: OtherVessel) -> list[Text]:
        """Return what is to be told of a beacon that has a place."""
        self._unplaced.pop(vessel.mmsi, None)
        what = vessel.kind is VesselKind.BEACON_TEST, vessel.range_m is not None
        told = self._hear(vessel.mmsi, vessel.reported_us)
        return told.tell(what, where(vessel), vessel.t_us, self._throttles[what[0]])

    @property
    def are_unplaced(self) -> bool:
        """Whether a person's beacon sends without a position."""
        return bool(self._unplaced)

    def expire(self, now_us: int) -> bool:
        """Forget who has been silent for as long as a person with a place is kept; True when one was forgotten."""
        over = [mmsi for mmsi, heard_us in self._unplaced.items() if now_us - heard_us > PERSON_LIFE_S * 1e6]
        for mmsi in over:
            del self._unplaced[mmsi]
        return bool(over)

    def _hear(self, mmsi: int, heard_us: int) -> _Told:
        """What was told of a beacon; nothing of one that is heard again after a long silence."""
        told = self._told.get(mmsi)
        if told is None or heard_us - told.heard_us > _ANEW_US:
            told = _Told(mmsi, heard_us)
        told.heard_us = max(told.heard_us, heard_us)
        _remember(self._told, mmsi, told)
        return told


def _remember(known: dict[int, _What], mmsi: int, what: _What) -> None:
    known.pop(mmsi, None)
    known[mmsi] = what
    if len(known) > TRACKS_MAX:
        del known[next(iter(known))]
