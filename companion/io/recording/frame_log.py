"""The telemetry log's side of one link: which MAVLink frames went over it, in and out, under its number.

What comes in is cut into frames as an endpoint does it, so a frame that arrived in pieces is logged once, when it is whole;
what goes out holds whole frames already.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.framing import Deframer

from ..clock import EARLIEST_UTC_US
from ..links import Closed, LinkEvent, Received
from .key_blanker import SETUP_SIGNING, blank_frame

_WAITED_FOR_US: Final = 1_000_000
"""As a time server slews a clock; more is a clock that was set."""
_LOG_DATA: Final = b"\x78\x00\x00"
"""Message id of LOG_DATA: what is downloaded is a log already, and would push this run's own out."""


class FrameLog:
    """Hands finished records to ``sink``. ``stamp_us`` is UTC since 1970 of what happens now; its owner moves it."""

    def __init__(self, number: int, datagrams: bool, sink: Callable[[bytes], None], clock: FrameClock) -> None:
        self._number = number
        self._datagrams = datagrams
        self._sink = sink
        self._clock = clock
        self._deframers: dict[int, Deframer] = {}

    def heard(self, events: list[LinkEvent], now_us: int) -> None:
        """Log what came in."""
        for event in events:
            if isinstance(event, Received):
                deframer = self._deframers.get(event.channel)
                if deframer is None:
                    deframer = self._deframers[event.channel] = Deframer(datagrams=self._datagrams)
                for frame in deframer.receive(event.data, now_us):
                    raw = blank_frame(frame.raw) if frame.message_id == SETUP_SIGNING else frame.raw
                    self._sink(tlog.pack(self._clock.stamp_us, self._number, raw))
            elif isinstance(event, Closed):
                self._deframers.pop(event.channel, None)

    def said(self, data: bytes) -> None:
        """Log what went out."""
        records = tlog.pack_output(self._clock.stamp_us, self._number, data, leave_out=_LOG_DATA)
        if records:
            self._sink(records)


class FrameClock:
    """UTC of the present step for the telemetry log; one for all links of a run. It never goes back.

    A clock that is set forward is followed. One that is set back by less than a second is waited for; by more, the log's time runs on
    from where it was: every program that reads a log takes its stamps for growing.
    """

    __slots__ = ("_now_us", "ahead_us", "stamp_us")

    def __init__(self) -> None:
        self.stamp_us = 0
        """Microseconds since 1970."""
        self.ahead_us = 0
        """By how much the log's time runs ahead of a clock that was set back; 0 = they go together."""
        self._now_us = 0

    def move(self, utc_us: int | None, now_us: int) -> None:
        """Go to a step: ``utc_us`` by the computer's calendar (None = it has none), ``now_us`` by the loop's clock."""
        wanted_us = EARLIEST_UTC_US + now_us if utc_us is None else utc_us
        passed_us = max(0, now_us - self._now_us)
        ahead_us = self.stamp_us - wanted_us
        self.ahead_us = ahead_us if ahead_us > _WAITED_FOR_US else 0
        if self.ahead_us:
            wanted_us = self.stamp_us + passed_us
        self._now_us, self.stamp_us = now_us, max(self.stamp_us, wanted_us)
