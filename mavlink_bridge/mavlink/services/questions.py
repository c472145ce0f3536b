"""What is answered at once and without the vessel: TIMESYNC and PING, rates of streams, and "this boat cannot do that"."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from ..wire.codec import dialect
from .channel import Channel
from .foreign import CANNOT
from .service import Handler, Service


class Questions(Service):
    """Small questions of one endpoint's stations."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {name: partial(self._cannot, why) for name, why in CANNOT.items()} | {
            "PING": lambda message, now_us: self._channel.answer(ping(message)),
            "TIMESYNC": lambda message, now_us: self._channel.answer(timesync(message, now_us)),
            "REQUEST_DATA_STREAM": self._on_data_stream,
        }

    def _cannot(self, why: str, message: Any, now_us: int) -> None:
        self._channel.explain(why, rarely=True)

    def _on_data_stream(self, message: Any, now_us: int) -> None:
        if self._channel.config.profile == "lan":
            rate_hz, on = message.req_message_rate, message.start_stop == 1
            self._channel.streams.set_group(message.req_stream_id, rate_hz, on)


def timesync(message: Any, now_us: int) -> list[Any]:
    """Answer TIMESYNC with our time when it is a question (tc1 = 0); an answer to somebody else is not answered."""
    if message.tc1 != 0:
        return []
    return [
        dialect.MAVLink_timesync_message(
            tc1=now_us * 1000,
            ts1=message.ts1,
            target_system=message.get_srcSystem(),
            target_component=message.get_srcComponent(),
        )
    ]


def ping(message: Any) -> list[Any]:
    """Answer a PING request (target 0/0) to its sender; a PING with a target is an answer already."""
    if message.target_system != 0 or message.target_component != 0:
        return []
    return [
        dialect.MAVLink_ping_message(
            time_usec=message.time_usec,
            seq=message.seq,
            target_system=message.get_srcSystem(),
            target_component=message.get_srcComponent(),
        )
    ]
