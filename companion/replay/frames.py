"""Finds out in words what differs between the MAVLink that a run sent and what its replay sends.

A recording keeps only length and checksum of what went to ground stations; the frames themselves are in the run's
telemetry log under the stamp of their step. So the first differences can be told message by message, field by field.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import decode
from mavlink_bridge.mavlink.wire.framing import Deframer, Frame

from ..io.log_file import parts_of


class SentFrames:
    """The vessel's own frames in a run's telemetry log, by link number and stamp."""

    def __init__(self, run_dir: Path, system_id: int) -> None:
        self._found: dict[tuple[int, int], list[Frame]] = {}
        for path in parts_of(run_dir / "mavlink.tlog"):
            for record in tlog.iterate(path.read_bytes()):
                if record.frame.system == system_id:
                    self._found.setdefault((record.link & 3, record.t_us), []).append(record.frame)

    def of(self, number: int, stamp_us: int) -> list[Frame]:
        """Frames sent on the telemetry link ``number`` at a stamp of the log (``FrameClock``)."""
        return self._found.get((number & 3, stamp_us & ~3), [])


def tell(before: list[Frame], data: bytes) -> Iterator[tuple[str, str, str]]:
    """Yield (what, before, after) for each message that differs."""
    after = Deframer(datagrams=True).receive(data, 0)
    for was, now in zip_longest(before, after):
        if was is None or now is None or was.message_id != now.message_id:
            yield "message", _text(was), _text(now)
        elif was.payload != now.payload:
            yield from _fields(was, now)
        elif was.sequence != now.sequence:
            yield f"{_fields_of(now)[0]} sequence", str(was.sequence), str(now.sequence)


def _fields(was: Frame, now: Frame) -> Iterator[tuple[str, str, str]]:
    name, old = _fields_of(was)
    new = _fields_of(now)[1]
    for key, value in old.items():
        if repr(value) != repr(new[key]):
            yield f"{name}.{key}", repr(value), repr(new[key])


def _fields_of(frame: Frame) -> tuple[str, dict[str, Any]]:
    message = decode(frame)
    if message is None:
        return f"id {frame.message_id}", {}
    return message.get_type(), {key: getattr(message, key) for key in message.get_fieldnames()}


def _text(frame: Frame | None) -> str:
    if frame is None:
        return "none"
    name, fields = _fields_of(frame)
    shown = ", ".join(f"{key}={value}" for key, value in fields.items())
    return f"{name}({shown[:200]})"
