"""How often the sounder is heard: one that is slow sees a slope late, which its owner should know before it matters."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from operator import sub
from typing import Final

from .input import Altitude

_GAPS: Final = 15
"""Gaps of which the middle one is the period: a fifth of the readings of a sounder of 1 Hz may be lost, and it is seldom called slow."""
_SLOW_US: Final = 1_500_000
"""From here on a rate comes from the last four readings, which take the sounder 4.5 s and more."""
_SILENT_US: Final = 5_000_000
"""A gap from here on is a silence, which is told as such."""


class SounderPace:
    """Note the readings that passed; ``told`` what there is to tell."""

    def __init__(self) -> None:
        self._heard_us: int | None = None
        self._gaps_us: deque[int] = deque(maxlen=_GAPS)
        self._is_told = False

    def note(self, passed: Sequence[Altitude]) -> None:
        """Take the readings that were believed."""
        if self._is_told or not passed:
            return
        times_us = [each.t_us for each in passed]
        earlier_us = times_us[:-1] if self._heard_us is None else [self._heard_us, *times_us[:-1]]
        self._gaps_us.extend(gap for gap in map(sub, times_us[-len(earlier_us) :], earlier_us) if gap < _SILENT_US)
        self._heard_us = times_us[-1]

    def told(self) -> str:
        """What to tell, once a start; empty = nothing."""
        if self._is_told or len(self._gaps_us) < _GAPS:
            return ""
        period_us = sorted(self._gaps_us)[_GAPS // 2]
        self._is_told = period_us >= _SLOW_US
        return f"Depth sounder: a reading each {period_us * 1e-6:.1f} s: slopes are seen late" if self._is_told else ""
