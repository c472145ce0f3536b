"""One upload in progress: which items are still missing, when to ask again, when to give up.

On a clean link it asks for one item at a time in order, as the mission protocol describes. After a loss it keeps several requests under
way, so that a plan of hundreds of items still gets through when a third of the frames is lost. The waiting time follows the round trips
seen, between 0.3 s and the configured time; it is given up after so many repeats without hearing one item. Source: MAVLink
mission protocol (1.5 s, 5 retries); Karn's rule (no round trip from a repeated request).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ...language.requests import PlanItem

MAX_WINDOW: Final = 8
_MIN_WAIT_US: Final = 300_000
_LOST_US: Final = 300_000


@dataclass(slots=True)
class _Asked:
    sent_us: int
    repeated: bool = False


class Upload:
    """Collects items ``first``...``first + count - 1``. Sends nothing itself: methods return the numbers to ask for."""

    def __init__(
        self, first: int, count: int, now_us: int, retry_us: int, retries: int, window: int = MAX_WINDOW
    ) -> None:
        self.first = first
        self.count = count
        self.items: dict[int, PlanItem] = {}
        self.heard_us = now_us
        self._retry_us = retry_us
        self._retries = retries
        self._max_window = window
        self._base_us = retry_us
        self._rtt_us: float | None = None
        self._silent = 0
        self._window = 1
        self._asked: dict[int, _Asked] = {}
        self._next = first

    @property
    def complete(self) -> bool:
        return len(self.items) == self.count

    def begin(self, now_us: int) -> list[int]:
        """The first numbers to ask for."""
        return self._fill(now_us)

    def take(self, seq: int, item: PlanItem, now_us: int) -> list[int] | None:
        """Keep an item that was asked for; return the next numbers to ask for. None when it was not asked for."""
        asked = self._asked.pop(seq, None)
        if asked is None:
            return None
        if not asked.repeated:
            self._learn(now_us - asked.sent_us)
        self.items[seq] = item
        self.heard_us = now_us
        self._silent = 0
        return self._fill(now_us)

    def again(self, seq: int, now_us: int) -> list[int]:
        """Numbers to ask for once more, because an item came again that was not asked for: what was asked for since was lost.

        Requests younger than 0.3 s are left alone, so that copies made by a network do not double the dialogue.
        """
        if seq not in self.items:
            return []
        late = [number for number, asked in self._asked.items() if now_us - asked.sent_us >= _LOST_US]
        for number in late:
            self._asked[number] = _Asked(now_us, repeated=True)
        self.heard_us = now_us
        return late

    def overdue(self, now_us: int) -> list[int] | None:
        """Numbers to ask for again; None when it is time to give up."""
        wait_us = min(self._base_us << self._silent, self._retry_us)
        late = [seq for seq, asked in self._asked.items() if now_us - asked.sent_us >= wait_us]
        if not late:
            return []
        if now_us - self.heard_us >= wait_us:
            if self._silent >= self._retries:
                return None
            self._silent += 1
        if self.items:  # before the first item it may be the station that is gone, not one frame
            self._window = min(self._max_window, self._window * 2)
        for seq in late:
            self._asked[seq] = _Asked(now_us, repeated=True)
        return late + self._fill(now_us)

    def _fill(self, now_us: int) -> list[int]:
        """Open requests in order up to the window; what was asked for once is only repeated by ``overdue``."""
        new: list[int] = []
        while len(self._asked) < self._window and self._next < self.first + self.count:
            self._asked[self._next] = _Asked(now_us)
            new.append(self._next)
            self._next += 1
        return new

    def _learn(self, rtt_us: int) -> None:
        self._rtt_us = float(rtt_us) if self._rtt_us is None else 0.75 * self._rtt_us + 0.25 * rtt_us
        self._base_us = min(max(int(2 * self._rtt_us) + 100_000, _MIN_WAIT_US), self._retry_us)
