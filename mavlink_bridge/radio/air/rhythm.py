"""When the other end is going to talk: its states come on a grid, and who talks then is not heard.

All times are times on the air: the first and the last moment of a packet, not its way along a serial line.
"""

from __future__ import annotations

from typing import Final

_NEAR_US: Final = 400_000
_EARLY_US: Final = 10_000
"""Little: to wait for a state costs 0.7 s and a station's patience each time, to be late by a tick costs one repeat, seldom."""
_LATE_US: Final = 15_000
"""What two clocks, a tick and a module may shift a state by; a longer wait costs the vessel's answer a tick more."""
_MISSES: Final = 3
"""A change of status is told off the grid; so many in a row are a new grid."""
_FORGOTTEN: Final = 12
"""Periods without a state after which the grid means nothing."""


class Rhythm:
    """Learns the grid from arrivals and says whether a transmission would meet the next state.

    A state of known length is over when its time is over: an order that waits for it need not wait for the module that brings it.
    """

    def __init__(self, period_us: int, longest_us: int) -> None:
        self._period_us = period_us
        self._longest_us = longest_us
        """How long the longest state is on the air."""
        self._next_us = longest_us
        """How long the next one is, as far as can be known."""
        self._grid_us: int | None = None
        self._over_us = 0
        self._misses = 0
        self._quiet_from_us = self._quiet_until_us = 0

    def answered(self, now_us: int, until_us: int) -> None:
        """An answer came: another order may follow, and the other end keeps off the air for it. What was due meanwhile comes then."""
        self._quiet_from_us, self._quiet_until_us = now_us, until_us

    def changed(self) -> None:
        """The vessel's status is another: the next state tells it whole."""
        self._next_us = self._longest_us

    def is_quiet(self, now_us: int) -> bool:
        """Whether the other end listens for another order: nothing else should be in its way."""
        return self._quiet_from_us <= now_us < self._quiet_until_us

    def heard(self, start_us: int, end_us: int, next_us: int | None) -> None:
        """A state was on the air; those out of rhythm (a change of status) count little. ``next_us``: length of the next, None = any."""
        self._next_us = self._longest_us if next_us is None else next_us
        if self._grid_us is not None and self._misses < _MISSES:
            off_us = (start_us - self._grid_us + _NEAR_US) % self._period_us
            if off_us > 2 * _NEAR_US:
                self._misses += 1
                return
        self._grid_us, self._over_us, self._misses = start_us, end_us, 0

    def meets(self, start_us: int, end_us: int) -> bool:
        """Whether a transmission of ours would overlap a state of the other end, this one or the next."""
        if self.is_quiet(start_us):
            return end_us > self._quiet_until_us - _EARLY_US
        since_quiet_us = start_us - self._quiet_until_us
        if 0 <= since_quiet_us < self._next_us + _LATE_US and self._over_us < self._quiet_until_us:
            return True
        if self._grid_us is None or start_us - self._grid_us > _FORGOTTEN * self._period_us:
            return False
        phase_us = (start_us - self._grid_us) % self._period_us
        is_over = start_us - self._over_us < self._period_us // 2
        if phase_us < self._next_us + _LATE_US and not is_over:
            return True
        return phase_us + end_us - start_us > self._period_us - _EARLY_US
