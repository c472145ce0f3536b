"""What waits to be sent on one link, in order of importance, under a byte budget.

Four shelves: *urgent* (acknowledgements, HEARTBEAT), *answers* (what somebody asked for), *telemetry* (a newer value replaces an
older one of the same kind) and *bulk* (long lists, made only when there is room). The budget is a token bucket in bytes whose last
share only urgent frames may use, so that nothing else can starve them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from mavlink_bridge.endpoint_config import Budget
from mavlink_bridge.wire import Packed

MAX_URGENT: Final = 256
MAX_ANSWERS: Final = 2048
RESERVE_BYTES: Final = 120.0
LONGEST_FRAME: Final = 293.0
_WINDOW_US: Final = 10_000_000
_BIN_US: Final = 250_000


Bulk = Callable[[int], Packed | None]
"""Given now_us, the next message of a long list or None when there is none at the moment."""
Seal = Callable[[Packed], bytes]
"""Makes a frame of a payload; called in the order of sending."""


class TokenBucket:
    """Tokens refill with time up to a burst; what they buy is free-running flow with short bursts."""

    __slots__ = ("_burst", "_last_us", "_rate_per_us", "level")

    def __init__(self, rate_per_s: float, burst: float) -> None:
        self._burst = burst
        self._rate_per_us = rate_per_s * 1e-6
        self._last_us: int | None = None
        self.level = burst

    def refill(self, now_us: int) -> None:
        """Add what the time since the last call is worth; time that steps back adds nothing."""
        if self._last_us is None:
            self._last_us = now_us
        elif now_us > self._last_us:
            self.level = min(self._burst, self.level + (now_us - self._last_us) * self._rate_per_us)
            self._last_us = now_us

    def spend(self, amount: float) -> None:
        self.level -= amount


class _Allowance:
    """A token bucket with a second condition: over any 10 s no more than ten seconds' worth, bursts included."""

    __slots__ = ("_bins", "_bucket", "_total", "_window_bytes", "reserve")

    def __init__(self, budget: Budget) -> None:
        burst = max(float(budget.burst_bytes), LONGEST_FRAME + 60.0)
        self._bucket = TokenBucket(budget.bytes_per_s, burst)
        self._window_bytes = max(budget.bytes_per_s * _WINDOW_US * 1e-6, LONGEST_FRAME)
        self._bins: deque[list[int]] = deque()
        self._total = 0
        self.reserve = min(RESERVE_BYTES, burst - LONGEST_FRAME)

    def at(self, now_us: int) -> None:
        """Bring up to a time."""
        self._bucket.refill(now_us)
        while self._bins and self._bins[0][0] <= now_us - _WINDOW_US - _BIN_US:
            self._total -= self._bins.popleft()[1]

    def permits(self, size: int, reserve: float) -> bool:
        """True when ``size`` bytes may go while ``reserve`` bytes are kept for more important ones."""
        return size + reserve <= self._bucket.level and self._total + size + reserve <= self._window_bytes

    def spend(self, size: int, now_us: int) -> None:
        self._bucket.spend(size)
        self._total += size
        if self._bins and self._bins[-1][0] > now_us - _BIN_US:
            self._bins[-1][1] += size
        else:
            self._bins.append([now_us, size])


class Outbox:
    """The messages that wait on one link. ``overhead_bytes`` is what framing adds: 12, or 25 when signed."""

    def __init__(self, budget: Budget, seal: Seal, overhead_bytes: int = 12) -> None:
        self._allowance = _Allowance(budget)
        self._seal = seal
        self.overhead_bytes = overhead_bytes
        self._urgent: deque[Packed] = deque()
        self._answers: deque[Packed] = deque()
        self._telemetry: dict[object, Packed] = {}
        self._bulk: list[Bulk] = []
        self._bulk_head: Packed | None = None
        self._turn = 0
        self.dropped = 0
        self.sent_bytes = 0

    def urgent(self, packed: Packed) -> None:
        """Queue an acknowledgement or a HEARTBEAT. Beyond the bound the oldest goes."""
        if len(self._urgent) >= MAX_URGENT:
            self._urgent.popleft()
            self.dropped += 1
        self._urgent.append(packed)

    def answer(self, packed: Packed) -> None:
        """Queue what somebody asked for. Beyond the bound the new one is dropped: whoever asked asks again."""
        if len(self._answers) >= MAX_ANSWERS:
            self.dropped += 1
        else:
            self._answers.append(packed)

    def telemetry(self, key: object, packed: Packed) -> None:
        """Queue a periodic message; an older one with the same key that still waits is replaced."""
        self._telemetry[key] = packed

    def bulk(self, source: Bulk) -> None:
        """Add a source of a long list, asked when nothing more important waits. It stays for ever."""
        self._bulk.append(source)

    def forget(self, key: object) -> None:
        """Take back a periodic message that waits."""
        self._telemetry.pop(key, None)

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return whole frames within the budget and ``limit_bytes``, b"" when nothing is due.

        A single frame that is longer than the limit is handed out alone, or it would block the rest for ever.
        """
        self._allowance.at(now_us)
        chunks: list[bytes] = []
        room = limit_bytes
        while True:
            size = self._send_urgent(chunks, room, now_us) or self._send_other(chunks, room, now_us)
            if not size:
                break
            room -= size
        return b"".join(chunks)

    def _send_urgent(self, chunks: list[bytes], room: int, now_us: int) -> int:
        if not self._urgent:
            return 0
        size = len(self._urgent[0].payload) + self.overhead_bytes
        if (size > room and chunks) or not self._allowance.permits(size, 0.0):
            return 0
        return self._emit(chunks, self._urgent.popleft(), now_us)

    def _send_other(self, chunks: list[bytes], room: int, now_us: int) -> int:
        if self._urgent:
            return 0
        packed, release = self._choose(now_us)
        if packed is None or release is None:
            return 0
        size = len(packed.payload) + self.overhead_bytes
        if (size > room and chunks) or not self._allowance.permits(size, self._allowance.reserve):
            return 0
        release()
        return self._emit(chunks, packed, now_us)

    def _choose(self, now_us: int) -> tuple[Packed | None, Callable[[], object] | None]:
        """Answers first; telemetry and bulk take turns, so that neither a list nor fast streams starve the other."""
        if self._answers:
            return self._answers[0], self._answers.popleft
        self._turn ^= 1
        if self._turn and self._telemetry:
            return self._oldest_telemetry()
        if self._bulk_head is None:
            self._bulk_head = self._next_bulk(now_us)
        if self._bulk_head is not None:
            return self._bulk_head, self._release_bulk
        if self._telemetry:
            return self._oldest_telemetry()
        return None, None

    def _oldest_telemetry(self) -> tuple[Packed, Callable[[], object]]:
        key = next(iter(self._telemetry))
        return self._telemetry[key], lambda: self._telemetry.pop(key)

    def _release_bulk(self) -> None:
        self._bulk_head = None

    def _next_bulk(self, now_us: int) -> Packed | None:
        for position, source in enumerate(self._bulk):
            packed = source(now_us)
            if packed is not None:
                self._bulk.append(self._bulk.pop(position))
                return packed
        return None

    def _emit(self, chunks: list[bytes], packed: Packed, now_us: int) -> int:
        frame = self._seal(packed)
        self._allowance.spend(len(frame), now_us)
        self.sent_bytes += len(frame)
        chunks.append(frame)
        return len(frame)
