"""Which of the reports are our own: by the configured number, by the receiver's word, or because it moves with us.

A transponder aboard whose number nobody wrote down looks like a vessel alongside on our course: the boat would fear itself.
Where both lie still nothing can be told: a neighbour in the harbour is no transponder of ours. Where our number is known nobody else
is us, however long she keeps alongside.
"""

from __future__ import annotations

import math
from typing import Final

_WITHIN_M: Final = 15.0
"""Between a transponder's antenna and ours, with both receivers' errors."""
_SPEED_MPS: Final = 0.7
"""Speeds over ground of one hull agree within this: a knot, and both receivers' noise."""
_COURSE_RAD: Final = math.radians(20.0)
_MOVING_MPS: Final = 1.0
"""At anchor everybody near lies still; only under way is sameness telling."""
_FOR_US: Final = 60_000_000
"""And sameness for a minute,"""
_REPORTS: Final = 3
"""in so many reports."""
_APART_M: Final = 100.0
"""Once so far apart she is somebody else for good."""
_SUSPECTS: Final = 16
"""Vessels that are watched at a time; a flood fills no memory."""


class OwnNumbers:
    """Numbers that are us."""

    def __init__(self, configured: int) -> None:
        self.configured = configured
        self._said: int | None = None
        self._found: int | None = None
        self._suspects: dict[int, tuple[int, int]] = {}
        """Since when, and how many reports."""

    def __contains__(self, mmsi: int) -> bool:
        return mmsi != 0 and mmsi in ((self.configured, self._said) if self._is_known else (self._found,))

    @property
    def _is_known(self) -> bool:
        return bool(self.configured or self._said)

    def said(self, mmsi: int) -> None:
        """The receiver calls a number its own ship (VDO)."""
        self._said = mmsi

    def compare(self, mmsi: int, apart: tuple[float, float, float], own_mps: float, now_us: int) -> bool:
        """Hold a report against us; True when it has just been found to be ours.

        ``apart``: metres between us, difference of speeds in m/s, and of courses in rad.
        """
        if mmsi == self._found:
            if apart[0] > _APART_M:
                self._found = None
            return False
        if self._is_known:
            return False
        moving = own_mps >= _MOVING_MPS
        near = apart[0] <= _WITHIN_M and abs(apart[1]) <= _SPEED_MPS and abs(apart[2]) <= _COURSE_RAD
        if not (moving and near):
            self._suspects.pop(mmsi, None)
            return False
        since_us, count = self._suspects.pop(mmsi, (now_us, 0))
        self._suspects[mmsi] = since_us, count + 1
        if len(self._suspects) > _SUSPECTS:
            del self._suspects[next(iter(self._suspects))]
        if now_us - since_us < _FOR_US or count + 1 < _REPORTS:
            return False
        self._found = mmsi
        del self._suspects[mmsi]
        return True
