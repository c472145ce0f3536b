"""When the other end is going to talk: a state comes a period after the one before it, and who talks then is not heard.

All times are times on the air, the first and the last moment of a packet, but for what is said to be written: the vessel writes at its
ticks, and a longer packet is longer on its serial line before it is on the air.
"""

from __future__ import annotations

from typing import Final

_EARLY_US: Final = 10_000
"""Little: to wait for a state costs 0.7 s and a station's patience each time, to be late by a tick costs one repeat, seldom."""
_LATE_US: Final = 15_000
"""What two clocks and a module may shift a state by; a longer wait costs the vessel's answer a tick more."""
HELD_LATE_US: Final = 20_000
"""A state that was held back comes at the pause's end, or a tick later where a tick came late."""
TOLD_LATE_US: Final = 65_000
"""One that waited until the vessel had told something comes at a tick of its own choice, and has its serial line before it."""
_HELD_US: Final = 2_500_000
"""So long after a question at most the pause after its answer ends."""
_FORGOTTEN: Final = 12
"""Periods without a state after which the last one means nothing."""


class Rhythm:
    """Tells from the last state when the next one comes, and whether a transmission would meet it.

    A state of known length is over when its time is over: an order that waits for it need not wait for the module that brings it.
    """

    def __init__(self, period_us: int, longest_us: int) -> None:
        self._period_us = period_us
        self._longest_us = longest_us
        self.next_us = longest_us
        """How long the next one is on the air, as far as can be known: it may be longer, for a depth that changes fast."""
        self.lead_us = 0
        """How long it is on the serial line before."""
        self._last_us: int | None = None
        """When the last one was written, as far as can be known: heard, or due at a pause's end."""
        self._late_us = _LATE_US
        self._heard_us = 0
        self._quiet_from_us = self._quiet_until_us = 0
        self._held_late_us = HELD_LATE_US
        self._unsure_us: int | None = None
        """When a state was due that may have been held back for a question to which no answer was heard."""

    def answered(self, asked_us: int, until_us: int, *, late_us: int = HELD_LATE_US) -> None:
        """An answer came to what was asked: another order may follow, and the other end keeps off the air for it. What was due since
        it heard the question is written then, or up to ``late_us`` later.
        """
        self._settle(asked_us)
        if asked_us >= self._quiet_until_us:
            self._quiet_from_us = asked_us
        if until_us > self._quiet_until_us:
            self._quiet_until_us, self._held_late_us = until_us, late_us

    def may_come_later(self) -> None:
        """The pause after the last answer may be a longer one."""
        self._unsure_us = self._quiet_until_us

    def is_quiet(self, now_us: int) -> bool:
        """Whether the other end listens for another order: nothing else should be in its way."""
        return self._quiet_from_us <= now_us < self._quiet_until_us

    def heard(self, written_us: int, end_us: int) -> None:
        """A state was on the air."""
        self._last_us, self._heard_us, self._late_us = written_us, end_us, _LATE_US
        self._unsure_us = None

    def unanswered(self, asked_us: int) -> None:
        """No answer was heard to what was asked: if the other end gave one, a state due then comes later, and all after it."""
        if self._last_us is None or self._unsure_us is not None:
            return
        due_us = self._due_us(asked_us, self.next_us)
        self._unsure_us = due_us if due_us < asked_us + _HELD_US else None

    def meets(self, start_us: int, end_us: int, *, hurries: bool = False) -> bool:
        """Whether a transmission of ours would overlap a state of the other end, this one or the next. One that ``hurries`` takes the state
        for as long as it should be, another for the longest.
        """
        begins_us = self._begins_us(start_us, self.next_us if hurries else max(self.next_us, self._longest_us))
        return begins_us is not None and end_us > begins_us - _EARLY_US

    def over_us(self, now_us: int, within_us: int) -> int | None:
        """When the state is over that begins ``within_us`` from now; None: none does."""
        begins_us = self._begins_us(now_us, self.next_us)
        if begins_us is None or begins_us >= now_us + within_us:
            return None
        return begins_us + self.next_us + self._late_us

    def _begins_us(self, now_us: int, long_us: int) -> int | None:
        """When the state begins that is on the air now, or the next one; None: nothing is known of it. ``long_us``: taken for so long."""
        self._settle(now_us)
        if self._unsure_us is not None and now_us >= self._unsure_us + self.lead_us + long_us + self._late_us:
            # it was lost, or is still to come: to keep clear of the wrong time is worse than of none
            self._last_us = self._unsure_us = None
        if self._last_us is None or now_us - self._heard_us > _FORGOTTEN * self._period_us:
            return None
        if self.is_quiet(now_us):
            return max(self._due_us(self._quiet_from_us, long_us), self._quiet_until_us) + self.lead_us
        return self._due_us(now_us, long_us) + self.lead_us

    def _due_us(self, now_us: int, long_us: int) -> int:
        """When it is written by the grid alone, pauses left out."""
        assert self._last_us is not None
        over_us = self.lead_us + long_us + self._late_us
        if self._last_us > self._heard_us and now_us < self._last_us + over_us:
            return self._last_us
        passed = (now_us - self._last_us - over_us) // self._period_us + 1
        return self._last_us + max(passed, 1) * self._period_us

    def _settle(self, now_us: int) -> None:
        """A state that was due in a pause comes at its end, and the next one a period after that."""
        until_us = self._quiet_until_us
        if self._last_us is None or now_us < until_us or self._last_us >= until_us:
            return
        if self._due_us(self._quiet_from_us, self.next_us) < until_us:
            self._last_us, self._late_us = until_us, self._held_late_us
