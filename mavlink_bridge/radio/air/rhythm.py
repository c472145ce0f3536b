"""When the other end is going to talk: a state comes a period after the one before it, and who talks then is not heard.

All times are times on the air: the first and the last moment of a packet, not its way along a serial line.
"""

from __future__ import annotations

from typing import Final

_EARLY_US: Final = 10_000
"""Little: to wait for a state costs 0.7 s and a station's patience each time, to be late by a tick costs one repeat, seldom."""
_LATE_US: Final = 15_000
"""What two clocks and a module may shift a state by; a longer wait costs the vessel's answer a tick more."""
_HELD_LATE_US: Final = 65_000
"""A state that was held back comes at the first tick after the pause, and has its serial line before it."""
_FORGOTTEN: Final = 12
"""Periods without a state after which the last one means nothing."""


class Rhythm:
    """Tells from the last state when the next one comes, and whether a transmission would meet it.

    A state of known length is over when its time is over: an order that waits for it need not wait for the module that brings it.
    """

    def __init__(self, period_us: int, longest_us: int) -> None:
        self._period_us = period_us
        self._longest_us = longest_us
        """How long the longest state is on the air."""
        self._next_us = longest_us
        """How long the next one is, as far as can be known."""
        self._last_us: int | None = None
        """When the last one began, as far as can be known: heard, or due at a pause's end."""
        self._late_us = _LATE_US
        self._heard_us = 0
        self._quiet_from_us = self._quiet_until_us = 0

    def answered(self, asked_us: int, until_us: int) -> None:
        """An answer came to what was asked: another order may follow, and the other end keeps off the air for it. What was due since
        it heard the question comes then.
        """
        self._settle(asked_us)
        if asked_us >= self._quiet_until_us:
            self._quiet_from_us = asked_us
        self._quiet_until_us = until_us

    def changed(self) -> None:
        """The vessel's status is another: the next state tells it whole."""
        self._next_us = self._longest_us

    def is_quiet(self, now_us: int) -> bool:
        """Whether the other end listens for another order: nothing else should be in its way."""
        return self._quiet_from_us <= now_us < self._quiet_until_us

    def heard(self, start_us: int, end_us: int, next_us: int | None) -> None:
        """A state was on the air. ``next_us``: length of the next, None = any."""
        self._next_us = self._longest_us if next_us is None else next_us
        self._last_us, self._heard_us, self._late_us = start_us, end_us, _LATE_US

    def meets(self, start_us: int, end_us: int) -> bool:
        """Whether a transmission of ours would overlap a state of the other end, this one or the next."""
        self._settle(start_us)
        if self._last_us is None or start_us - self._heard_us > _FORGOTTEN * self._period_us:
            return False
        if self.is_quiet(start_us):
            return end_us > max(self._due_us(self._quiet_from_us), self._quiet_until_us) - _EARLY_US
        return end_us > self._due_us(start_us) - _EARLY_US

    def _due_us(self, now_us: int) -> int:
        """When the state begins that is on the air now, or the next one."""
        assert self._last_us is not None
        if self._last_us > self._heard_us and now_us < self._last_us + self._next_us + self._late_us:
            return self._last_us
        passed = (now_us - self._last_us - self._next_us - self._late_us) // self._period_us + 1
        return self._last_us + max(passed, 1) * self._period_us

    def _settle(self, now_us: int) -> None:
        """A state that was due in a pause comes at its end, and the next one a period after that."""
        until_us = self._quiet_until_us
        if self._last_us is None or now_us < until_us or self._last_us >= until_us:
            return
        if self._due_us(self._quiet_from_us) < until_us:
            self._last_us, self._late_us = until_us, _HELD_LATE_US
