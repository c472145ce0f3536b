"""The airtime ledger: a sliding hour of transmissions that refuses what the rule does not allow.

Five classes share the hour. Class 0 (stop, abort, their answers) may use all of it; the last fifth, and at least five stops,
is never lent to the others. The time away during a restart does not count, so a restored ledger errs on the safe side; it also charges
what may not have been written down in time. All is noted even where nothing limits it: the next start may be with a
profile that does.
"""

from __future__ import annotations

from collections import deque
from enum import IntEnum
from typing import Final

HOUR_US: Final = 3_600_000_000
_BUCKET_US: Final = 60_000_000
_USUAL_LIMIT_US: Final = 360_000_000
"""Where there is no limit the hour is written down as often as if it were this one."""
STOPS_KEPT: Final = 5
_OUTDATED_US: Final = 600_000_000
"""An end that is killed has to take what it saved for spent just now: it shall not be of hours ago."""
_REPEATS_US: Final = 60_000_000
"""After a minute of a stop's repeats that nobody hears half of what the hour held is left, after two a third, whatever the band."""
_PRESSES_US: Final = 300_000_000
"""So long waits the hour's last stop after one that nobody heard, of five left the next one twelve seconds, about the time after which
an operator is told that nobody answers: each press finds its first try.
"""
_UNSAVED: Final = 0.01
"""Share of the hour's limit that may be used between two savings."""


class Priority(IntEnum):
    """Classes of traffic; a lower number goes first."""

    STOP = 0
    COMMAND = 1
    EVENT = 2
    STATE = 3
    BULK = 4


_SHARE: Final = {
    Priority.STOP: 1.0,
    Priority.COMMAND: 0.8,
    Priority.EVENT: 0.75,
    Priority.STATE: 0.70,
    Priority.BULK: 0.6,
}
"""Up to which part of the hour's limit each class may fill it."""


class Ledger:
    """Counts airtime against ``limit_us`` an hour; None = no limit (a dummy load). ``stop_us``: what a stop, or its answer, takes."""

    def __init__(self, limit_us: int | None, stop_us: int = 0) -> None:
        self.limit_us = limit_us
        self.stop_us = stop_us
        self._spent: deque[tuple[int, int]] = deque()
        self._total_us = 0
        self._since_saved_us = 0
        self._saved: tuple[int, int] = (0, 0)
        """When the hour was last written down, and how much it held."""

    def used_us(self, now_us: int) -> int:
        """Airtime of the last hour."""
        while self._spent and self._spent[0][0] <= now_us - HOUR_US:
            self._total_us -= self._spent.popleft()[1]
        return self._total_us

    def left_us(self, priority: Priority, now_us: int) -> int | None:
        """What a class may still send now; None = no limit."""
        if self.limit_us is None:
            return None
        return max(self._cap_us(priority) - self.used_us(now_us), 0)

    def stops_left(self, now_us: int) -> int | None:
        """How many stops this hour still holds; None = any number."""
        left_us = self.left_us(Priority.STOP, now_us)
        return None if left_us is None or not self.stop_us else left_us // self.stop_us

    def stop_gap_us(self, now_us: int, *, again: bool) -> int:
        """Least time from a stop that nobody heard to the next one, ``again`` the same or a newly ordered one.

        A gap that grows as the square of what is gone spends the hour ever more slowly: it is never spent in a hole of minutes.
        """
        left_us = self.left_us(Priority.STOP, now_us)
        if left_us is None or self.limit_us is None or not self.stop_us:
            return 0
        left = max(left_us / self.stop_us, 1.0)
        scale_us = max(_PRESSES_US, _REPEATS_US * self.limit_us / self.stop_us) if again else _PRESSES_US
        return round(scale_us / (left * left))

    def _cap_us(self, priority: Priority) -> int:
        """Up to which airtime of the hour a class may fill it."""
        limit_us = self.limit_us or 0
        if priority is Priority.STOP:
            return limit_us
        return min(int(limit_us * _SHARE[priority]), max(limit_us - STOPS_KEPT * self.stop_us, 0))

    def allows(self, airtime_us: int, priority: Priority, now_us: int) -> bool:
        left_us = self.left_us(priority, now_us)
        return left_us is None or airtime_us <= left_us

    def could_ever(self, airtime_us: int, priority: Priority) -> bool:
        """Whether an empty hour would hold it."""
        return self.limit_us is None or airtime_us <= self._cap_us(priority)

    def wait_us(self, airtime_us: int, priority: Priority, now_us: int) -> int | None:
        """Time until a class may send so much; None = never."""
        if self.limit_us is None or self.allows(airtime_us, priority, now_us):
            return 0
        missing_us = self.used_us(now_us) + airtime_us - self._cap_us(priority)
        for end_us, spent_us in self._spent:
            missing_us -= spent_us
            if missing_us <= 0:
                return end_us + HOUR_US - now_us
        return None

    def surely_us(self, airtime_us: int, priority: Priority, now_us: int) -> int:
        """Time until a class may send so much at the latest, when perhaps more was sent than is noted here: all that is allowed."""
        cap_us = self._cap_us(priority)
        missing_us = max(self.used_us(now_us) - cap_us, 0) + self._unsaved_us + airtime_us
        for end_us, spent_us in self._spent:
            missing_us -= spent_us
            if missing_us <= 0:
                return end_us + HOUR_US - now_us
        return HOUR_US

    def refusal(self, airtime_us: int, priority: Priority, now_us: int, band: str) -> str:
        """Say in one sentence why a class may not send so much now, and when it may."""
        need = f"it takes {airtime_us / 1e6:.1f} s of airtime"
        wait_us = self.wait_us(airtime_us, priority, now_us)
        if not self.could_ever(airtime_us, priority) or wait_us is None:
            limit_s = (self.limit_us or 0) / 1e6
            return f"{need}, and band {band} allows {limit_s:.1f} s an hour, a fifth of it or five stops kept"
        left_s = (self.left_us(priority, now_us) or 0) / 1e6
        return f"{need}, {left_s:.1f} s are left in this hour; possible in {wait_us / 60e6:.0f} min"

    def charge(self, airtime_us: int, end_us: int) -> None:
        """Note a transmission that ends at ``end_us``."""
        self._since_saved_us += airtime_us
        self.used_us(end_us)
        self._spent.append((end_us, airtime_us))
        self._total_us += airtime_us

    @property
    def should_be_saved(self) -> bool:
        return self._since_saved_us > self._unsaved_us

    def is_outdated(self, now_us: int) -> bool:
        """Whether what was written down holds air that is free again, or soon will be."""
        saved_us, used_us = self._saved
        return used_us > 0 and now_us - saved_us >= _OUTDATED_US

    @property
    def _unsaved_us(self) -> int:
        return int((_USUAL_LIMIT_US if self.limit_us is None else self.limit_us) * _UNSAVED)

    def save(self, now_us: int) -> list[tuple[int, int]]:
        """Return (age in s, airtime in us) by minutes, ages rounded down."""
        self._saved = now_us, self.used_us(now_us)
        minutes: dict[int, list[int]] = {}
        for end_us, spent_us in self._spent:
            minute = minutes.setdefault(end_us // _BUCKET_US, [0, 0])
            minute[0] = max(minute[0], end_us)
            minute[1] += spent_us
        self._since_saved_us = 0
        return [(max(now_us - end_us, 0) // 1_000_000, spent_us) for end_us, spent_us in minutes.values()]

    def restore(self, saved: list[tuple[int, int]], now_us: int) -> None:
        """Take over a saved hour as if no time had passed, plus what may have been sent after the saving."""
        for age_s, spent_us in sorted(saved, reverse=True):
            self._spent.append((now_us - age_s * 1_000_000, spent_us))
            self._total_us += spent_us
        self.charge(self._unsaved_us, now_us)
        self._since_saved_us = 0
