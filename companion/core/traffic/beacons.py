"""Distress beacons (970, 972, 974): which of them are in earnest, what is told of each, and who sends before knowing where it is.

The status of a position report is the beacon's own switch and wins over a text; a text may come minutes later, or not at all.
"""

from __future__ import annotations

from typing import Final, TypeVar

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.traffic import OtherVessel, VesselKind, beacon_name

from ..ais.reports import PositionReport, SafetyText
from .table import PERSON_LIFE_S, TRACKS_MAX
from .words import POSITION_UNKNOWN, Text, where

_ACTIVE: Final = 14
"""Navigational status of a beacon that is used in earnest."""
_ANEW_US: Final = 3_600_000_000
"""A beacon sends eight times a minute, and waves hide it for minutes: who is heard after an hour is in the water anew."""
_What = TypeVar("_What")


class DistressBeacons:
    """What is known of each: of as many as there are tracks, those heard last."""

    def __init__(self) -> None:
        self._said_active: dict[int, None] = {}
        """Those whose text says that they are in earnest."""
        self._unplaced: dict[int, int] = {}
        """Those in earnest that have no position yet, and when they were heard."""
        self._told: dict[int, tuple[bool, bool]] = {}
        """What was told of each: whether as a test, and whether with a place."""
        self._heard_us: dict[int, int] = {}
        """When each of those was heard last."""

    def take_text(self, report: SafetyText) -> None:
        """Take a beacon's text. One that says nothing of a test is in earnest."""
        if "TEST" in report.text.upper():
            self._said_active.pop(report.mmsi, None)
        else:
            _remember(self._said_active, report.mmsi, None)

    def kind_of(self, report: PositionReport) -> VesselKind:
        """Whether a beacon that reports is a person or a test."""
        in_earnest = report.status == _ACTIVE or report.mmsi in self._said_active
        return VesselKind.PERSON if in_earnest else VesselKind.BEACON_TEST

    def take_unplaced(self, report: PositionReport, now_us: int) -> list[Text]:
        """Take a report without a position, of a beacon that has no place: its first minutes are so. Return what is worth a word."""
        test = self.kind_of(report) is VesselKind.BEACON_TEST
        if test:
            self._unplaced.pop(report.mmsi, None)
        else:
            _remember(self._unplaced, report.mmsi, now_us)
        self._hear(report.mmsi, now_us)
        return self._tell(report.mmsi, POSITION_UNKNOWN, test=test, placed=False)

    def tell(self, vessel: OtherVessel) -> list[Text]:
        """Return what is to be told of a beacon that has a place."""
        self._unplaced.pop(vessel.mmsi, None)
        test, placed = vessel.kind is VesselKind.BEACON_TEST, vessel.range_m is not None
        self._hear(vessel.mmsi, vessel.reported_us)
        return self._tell(vessel.mmsi, where(vessel), test=test, placed=placed)

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

    def _hear(self, mmsi: int, heard_us: int) -> None:
        """Forget what was told of a beacon that is heard again after a long silence."""
        before_us = self._heard_us.get(mmsi, heard_us)
        if heard_us - before_us > _ANEW_US:
            self._told.pop(mmsi, None)
        _remember(self._heard_us, mmsi, max(before_us, heard_us))

    def _tell(self, mmsi: int, place: str, *, test: bool, placed: bool) -> list[Text]:
        told = self._told.get(mmsi)
        if told is not None and told[0] is test and (told[1] or not placed):
            return []
        _remember(self._told, mmsi, (test, placed))
        if test:
            return [(Severity.NOTICE, f"{beacon_name(mmsi)} beacon {mmsi} in test: {place}")]
        return [(Severity.ALERT, f"{beacon_name(mmsi)} beacon {mmsi}: {place}")]


def _remember(known: dict[int, _What], mmsi: int, what: _What) -> None:
    known.pop(mmsi, None)
    known[mmsi] = what
    if len(known) > TRACKS_MAX:
        del known[next(iter(known))]
