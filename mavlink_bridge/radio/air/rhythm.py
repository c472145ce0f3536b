"""When the other end is going to talk: its states come on a grid, and who talks then is not heard."""

from __future__ import annotations

from typing import Final

_NEAR_US: Final = 400_000
_EARLY_US: Final = 10_000
"""Little: to wait for a state costs 0.7 s and a station's patience each time, to be late by a tick costs one repeat, seldom."""
_LATE_US: Final = 40_000
"""What two clocks, a tick and a serial line may shift a state by."""
_MISSES: Final = 2
_FORGOTTEN: Final = 12
"""Periods without a state after which the grid means nothing."""


class Rhythm:
    """Learns the grid from arrivals and says whether a transmission would meet the next state."""

    def __init__(self, period_us: int, longest_us: int) -> None:
        self._period_us = period_us
        self._longest_us = longest_us
        """How long the longest state takes."""
        self._grid_us: int | None = None
        self._over_us = 0
        self._misses = 0
        self._quiet_from_us = self._quiet_until_us = 0

    def answered(self, now_us: int, until_us: int) -> None:
        """An answer came: another order may follow, and the other end keeps off the air for it. What was due meanwhile comes then."""
        self._quiet_from_us, self._quiet_until_us = now_us, until_us

    def is_quiet(self, now_us: int) -> bool:
        """Whether the other end listens for another order: nothing else should be in its way."""
        return self._quiet_from_us <= now_us < self._quiet_until_us

    def heard(self, sent_us: int, span_us: int) -> None:
        """A state came that was begun at ``sent_us`` and took ``span_us``; those out of rhythm (a change of status) count little."""
        if self._grid_us is not None and self._misses < _MISSES:
            off_us = (sent_us - self._grid_us + _NEAR_US) % self._period_us
            if off_us > 2 * _NEAR_US:
                self._misses += 1
                return
        self._grid_us, self._over_us, self._misses = sent_us, sent_us + span_us, 0

    def meets(self, start_us: int, end_us: int) -> bool:
        """Whether a transmission of ours would overlap a state of the other end, this one or the next."""
        if self.is_quiet(start_us):
            return end_us > self._quiet_until_us - _EARLY_US
        if 0 <= start_us - self._quiet_until_us < self._longest_us + _LATE_US and self._over_us < self._quiet_until_us:
            return True
        if self._grid_us is None or start_us - self._grid_us > _FORGOTTEN * self._period_us:
            return False
        phase_us = (start_us - self._grid_us) % self._period_us
        is_over = start_us - self._over_us < self._period_us // 2
        if phase_us < self._longest_us + _LATE_US and not is_over:
            return True
        return phase_us + end_us - start_us > self._period_us - _EARLY_US
