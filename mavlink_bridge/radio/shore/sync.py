"""What the shore lacks of what the vessel keeps, and when it asks: until it has come, one question at a time, each later than the last.

Never on a starved channel, and only when the vessel is heard.
"""

from __future__ import annotations

from typing import Final

from ..air import Priority, RadioProfile
from ..codec.info import Wanted
from ..codec.wire import Kind
from ..link import CompactLink

_GAP_US: Final = 60_000_000
_COME_US: Final = 15_000_000
"""More than the vessel's time for sending what was asked."""
_PATIENCE: Final = 8
"""How many times the first gap lies between two questions at last."""


class Sync:
    """Keeps what is lacking. Call ``step`` when a state has come."""

    def __init__(self, profile: RadioProfile, link: CompactLink) -> None:
        self._link = link
        self._is_starved = profile.link.batch > 1
        self._limit_us = round(profile.link.command_s * 1e6)
        self._first_gap_us = self._gap_us = max(_GAP_US, round(profile.link.upload_s * 1e6) + _COME_US)
        self._lacks = Wanted(0)
        self._asked = Wanted(0)
        self._asked_us: int | None = None
        self._number: int | None = None

    def lacks(self, wanted: Wanted) -> None:
        """Something has to be asked for."""
        self._lacks |= wanted

    def has(self, wanted: Wanted) -> None:
        """Something has come, or is known to be right."""
        if self._lacks & wanted:
            self._gap_us = self._first_gap_us
        self._lacks &= ~wanted
        self._asked &= ~wanted

    def ended(self, number: int) -> bool:
        """Note how a message of the link ended; False when it was not a question from here."""
        if number != self._number:
            return False
        self._number = None
        return True

    def step(self, now_us: int) -> None:
        """Ask for all that is lacking: at once for what is news, else when the gap is over."""
        if self._is_starved or self._number is not None or not self._lacks:
            return
        if self._asked_us is not None and now_us - self._asked_us < self._gap_us:
            if not self._lacks & ~self._asked & ~Wanted.INFO:
                return
        elif self._lacks & self._asked:
            self._gap_us = min(2 * self._gap_us, _PATIENCE * self._first_gap_us)
        self._asked_us, self._asked = now_us, self._lacks
        try:
            body = bytes((self._lacks,))
            self._number = self._link.submit(Kind.INFO, body, Priority.BULK, now_us, self._limit_us)
        except ValueError:
            self._number = None
