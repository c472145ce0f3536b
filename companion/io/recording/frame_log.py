"""The telemetry log's side of one link: which MAVLink frames went over it, in and out, under its number.

What comes in is cut into frames as an endpoint does it, so a frame that arrived in pieces is logged once, when it is whole;
what goes out holds whole frames already.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.framing import Deframer

from ..links import Closed, LinkEvent, Received

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
                    self._sink(tlog.pack(self._clock.stamp_us, self._number, frame.raw))
            elif isinstance(event, Closed):
                self._deframers.pop(event.channel, None)

    def said(self, data: bytes) -> None:
        """Log what went out."""
        records = tlog.pack_output(self._clock.stamp_us, self._number, data, leave_out=_LOG_DATA)
        if records:
            self._sink(records)


class FrameClock:
    """UTC of the present step for the telemetry log; one for all links of a run."""

    __slots__ = ("stamp_us",)

    def __init__(self, stamp_us: int) -> None:
        self.stamp_us = stamp_us
        """Microseconds since 1970."""
