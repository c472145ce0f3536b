"""Time questions from stations: TIMESYNC and PING are answered at once, to the asker."""

from __future__ import annotations

from typing import Any

from ..wire.codec import dialect


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
