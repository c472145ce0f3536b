"""What waits to be sent on one link, in order of importance, under a byte budget.

Four shelves: *urgent* (acknowledgements, HEARTBEAT), *answers* (what somebody asked for), *telemetry* (a newer value replaces an
older one of the same kind) and *bulk* (long lists, made only when there is room). The budget is a token bucket in bytes whose last
share only urgent frames may use, so that nothing else can starve them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from ..persona import Budget
from ..wire.payload import Packed

MAX_URGENT: Final = 256
MAX_ANSWERS: Final = 2048
RESERVE_BYTES: Final = 120.0
LONGEST_FRAME: Final = 293.0
_WINDOW_US: Final = 10_000_000
_BIN_US: Final = 250_000


Bulk = Callable[[int], Packed | None]
"""Given now_us, the next message of a long list or None when there is none at the moment."""
Seal = Callable[[Iterable[Packed]], bytes]
"""Makes frames of payloads, one behind the other; called in the order of sending."""


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
    """A token bucket with a second condition: over any 10 s no more than ten seconds' worth, bursts included.

    Of those ten seconds a share is kept for urgent frames, so that telemetry that filled the window does not silence the
    HEARTBEAT: 600 bytes, at most half.
    """

    __slots__ = ("_bins", "_bucket", "_reserve", "_total", "_urgent", "_window_bytes", "_window_others")

    def __init__(self, budget: Budget) -> None:
        burst = max(float(budget.burst_bytes), LONGEST_FRAME + 60.0)
        self._bucket = TokenBucket(budget.bytes_per_s, burst)
        self._window_bytes = max(budget.bytes_per_s * _WINDOW_US * 1e-6, LONGEST_FRAME)
        self._window_others = self._window_bytes - min(5.0 * RESERVE_BYTES, self._window_bytes / 2)
        self._bins: deque[list[int]] = deque()
        self._total = 0
        self._urgent = 0
        self._reserve = min(RESERVE_BYTES, burst - LONGEST_FRAME)

    def at(self, now_us: int) -> None:
        """Bring up to a time."""
        self._bucket.refill(now_us)
        while self._bins and self._bins[0][0] <= now_us - _WINDOW_US - _BIN_US:
            _, size, urgent = self._bins.popleft()
            self._total -= size
            self._urgent -= urgent

    def for_urgent(self) -> float:
        """Bytes that may go now."""
        left = self._window_bytes - self._total
        level = self._bucket.level
        return level if level < left else left

    def for_others(self, urgent_now: int) -> float:
        """Bytes that may go now, ``urgent_now`` included, when something stays for urgent frames to come."""
        others = self._total - self._urgent
        window = min(self._window_others - others, self._window_bytes - self._total - urgent_now)
        return min(self._bucket.level - self._reserve, window + urgent_now)

    def spend(self, size: int, urgent: int, now_us: int) -> None:
        self._bucket.spend(size)
        self._total += size
        self._urgent += urgent
        if self._bins and self._bins[-1][0] > now_us - _BIN_US:
            self._bins[-1][1] += size
            self._bins[-1][2] += urgent
        else:
            self._bins.append([now_us, size, urgent])


class Outbox:
    """The messages that wait on one link. ``overhead_bytes`` is what framing adds: 12, or 25 when signed."""

    def __init__(self, budget: Budget, seal: Seal, overhead_bytes: int = 12) -> None:
        self._allowance = _Allowance(budget)
        self._seal = seal
        self.overhead_bytes = overhead_bytes
        self._urgent: deque[Packed] = deque()
        self._answers: deque[Packed] = deque()
        self._telemetry: dict[int, Packed] = {}
        self._bulk: deque[Bulk] = deque()
        self._bulk_head: Packed | None = None
        self._turn = False
        self.waits = False
        """False: nothing is queued, ``take`` has nothing."""
        self.dropped = 0
        self.sent_bytes = 0

    def urgent(self, packed: Packed) -> None:
        """Queue an acknowledgement or a HEARTBEAT. Beyond the bound the oldest goes."""
        if len(self._urgent) >= MAX_URGENT:
            self._urgent.popleft()
            self.dropped += 1
        self._urgent.append(packed)
        self.waits = True

    def answer(self, packed: Packed) -> None:
        """Queue what somebody asked for. Beyond the bound the new one is dropped: whoever asked asks again."""
        if len(self._answers) >= MAX_ANSWERS:
            self.dropped += 1
        else:
            self._answers.append(packed)
            self.waits = True

    def telemetry(self, made: Mapping[int, Packed], silent: Iterable[int] = ()) -> None:
        """Queue periodic messages by their ids, each in place of an older one that still waits; take back the ``silent``."""
        self._telemetry.update(made)
        for number in silent:
            self._telemetry.pop(number, None)
        self.waits = True

    def bulk(self, source: Bulk) -> None:
        """Add a source of a long list, asked when nothing more important waits, until it has nothing left."""
        if source not in self._bulk:
            self._bulk.append(source)
            self.waits = True

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return whole frames within the budget and ``limit_bytes``, b"" when nothing is due.

        A single frame that is longer than the limit is handed out alone, or it would block the rest for ever.
        """
        if not self.waits:
            return b""
        allowance = self._allowance
        allowance.at(now_us)
        taken: list[Packed] = []
        urgent, answers = self._urgent, self._answers
        urgent_size = size = self._take_first(urgent, taken, 0, limit_bytes, allowance.for_urgent())
        if not urgent:
            left = allowance.for_others(urgent_size)
            if answers:
                size = self._take_first(answers, taken, size, limit_bytes, left)
            if not answers:
                size = self._fill(taken, size, limit_bytes, left, now_us)
        self.waits = bool(urgent or answers or self._telemetry or self._bulk or self._bulk_head)
        if not taken:
            return b""
        allowance.spend(size, urgent_size, now_us)
        self.sent_bytes += size
        return self._seal(taken)

    def size_of(self, packed: Packed) -> int:
        """Bytes of a message's frame."""
        return len(packed[1]) + self.overhead_bytes

    def _take_first(self, waiting: deque[Packed], taken: list[Packed], size: int, room: int, left: float) -> int:
        """Move messages from the first up to one that does not fit; return the size of all that are taken."""
        while waiting:
            grown = size + len(waiting[0][1]) + self.overhead_bytes
            if (grown > room and taken) or grown > left:
                break
            taken.append(waiting.popleft())
            size = grown
        return size

    def _fill(self, taken: list[Packed], size: int, room: int, left: float, now_us: int) -> int:
        """Telemetry and lists take turns, so that neither a list nor fast streams starve the other."""
        telemetry, overhead = self._telemetry, self.overhead_bytes
        if not (self._bulk or self._bulk_head):
            return self._fill_alone(taken, size, room, left)
        while telemetry or self._bulk or self._bulk_head:
            self._turn = not self._turn
            key: int | None = None
            if telemetry and (self._turn or not (self._bulk or self._bulk_head)):
                key = next(iter(telemetry))
                packed: Packed | None = telemetry[key]
            else:
                packed = self._bulk_head or self._next_bulk(now_us)
                self._bulk_head = packed
            if packed is None:
                continue
            grown = size + len(packed[1]) + overhead
            if (grown > room and taken) or grown > left:
                break
            taken.append(packed)
            size = grown
            if key is None:
                self._bulk_head = None
            else:
                del telemetry[key]
        return size

    def _fill_alone(self, taken: list[Packed], size: int, room: int, left: float) -> int:
        """The same while no list is there: every turn is telemetry's."""
        telemetry, overhead = self._telemetry, self.overhead_bytes
        count = 0
        for packed in telemetry.values():
            self._turn = not self._turn
            grown = size + len(packed[1]) + overhead
            if (grown > room and taken) or grown > left:
                break
            taken.append(packed)
            size = grown
            count += 1
        if count == len(telemetry):
            telemetry.clear()
        else:
            for key in list(telemetry)[:count]:
                del telemetry[key]
        return size

    def _next_bulk(self, now_us: int) -> Packed | None:
        """The next message of a list; lists take turns, one that is done goes."""
        while self._bulk:
            packed = self._bulk[0](now_us)
            if packed is not None:
                self._bulk.rotate(-1)
                return packed
            self._bulk.popleft()
        return None


MakeOutbox = Callable[[Budget, Seal, int], Outbox]
"""Budget, frame maker, bytes that framing adds."""
