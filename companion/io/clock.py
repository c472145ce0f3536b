"""Clocks: the only place that reads the machine's time. Everything else gets ``now_us`` as an argument.

Times are integer microseconds since the clock was made, so that adding a tick a million times stays exact. UTC is
a separate question with an honest "not known": it names log files and stamps frames, and no timer depends on it.
"""

from __future__ import annotations

import contextlib
import select
import time
from collections.abc import Sequence
from typing import Final, Protocol

EARLIEST_UTC_US: Final = 1_735_689_600_000_000
"""2025-01-01: a wall clock that shows less was never set (a computer without a battery-backed clock)."""


class Clock(Protocol):
    """Monotonic time, wall time, and waiting for either time or bytes."""

    def now_us(self) -> int:
        """Microseconds since start; never goes back."""
        ...

    def utc_us(self) -> int | None:
        """UTC in microseconds since 1970, or None while it is not known."""
        ...

    def sleep_until_us(self, t_us: int, filenos: Sequence[int] = ()) -> bool:
        """Wait until ``t_us`` or until one of the descriptors has bytes; True when descriptors have some."""
        ...


class SystemClock:
    """The machine's clock. It counts through a suspend (where the system offers that), so old data shows its age.

    ``speed``: simulated seconds in each real one.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed
        self._source = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
        self._start_ns = time.clock_gettime_ns(self._source)

    def now_us(self) -> int:
        real_us = (time.clock_gettime_ns(self._source) - self._start_ns) // 1000
        return real_us if self._speed == 1.0 else round(real_us * self._speed)

    def utc_us(self) -> int | None:
        utc_us = time.time_ns() // 1000
        return utc_us if utc_us >= EARLIEST_UTC_US else None

    def sleep_until_us(self, t_us: int, filenos: Sequence[int] = ()) -> bool:
        wait_s = max(0.0, (t_us - self.now_us()) / 1e6 / self._speed)
        poller = select.poll()
        for fileno in filenos:
            with contextlib.suppress(OSError, ValueError):
                poller.register(fileno, select.POLLIN)
        # poll() counts whole milliseconds and rounds up: wait short of the goal, then sleep the rest exactly.
        if not filenos or wait_s < 0.001:
            ready = bool(poller.poll(0)) if filenos else False
            if not ready and wait_s > 0.0:
                time.sleep(wait_s)
            return ready
        if poller.poll(int(wait_s * 1000.0)):
            return True
        rest_s = (t_us - self.now_us()) / 1e6 / self._speed
        if rest_s > 0.0:
            time.sleep(rest_s)
        return False


class ManualClock:
    """Virtual time: waiting is a jump. ``utc_at_start_us`` fixes the calendar of a simulation."""

    def __init__(self, now_us: int = 0, utc_at_start_us: int | None = None) -> None:
        self._now_us = now_us
        self._utc_at_start_us = utc_at_start_us

    def now_us(self) -> int:
        return self._now_us

    def utc_us(self) -> int | None:
        return None if self._utc_at_start_us is None else self._utc_at_start_us + self._now_us

    def advance(self, by_us: int) -> int:
        """Move on by ``by_us`` >= 0 and return the new time."""
        self._now_us += max(0, by_us)
        return self._now_us

    def sleep_until_us(self, t_us: int, filenos: Sequence[int] = ()) -> bool:
        self._now_us = max(self._now_us, t_us)
        return False
