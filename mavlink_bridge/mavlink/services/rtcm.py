"""Corrections for the GNSS receiver: GPS_RTCM_DATA back to whole RTCM 3 frames, and nothing but such frames.

What a station sends here is written to the receiver's serial line, where any other byte could reconfigure it. So each sender has a
stream of its own, frames are cut by their own length, and only those whose CRC-24Q is right pass (RTCM 10403.3, 4.2: 0xD3, six
zero bits, ten bits of length, body, CRC). Where a message ends is told by the frame alone: QGroundControl cuts messages of exactly
180, 360 and 540 bytes with or without an empty last part, by its version, and longer ones than four parts into a plain stream or
into parts whose number runs over into the sequence's bits.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Final

from ...crc import crc24q
from ...language.requests import RtcmData

PART_BYTES: Final = 180
"""Data of one GPS_RTCM_DATA (common.xml)."""
MAX_SENDERS: Final = 4
"""More base stations at once than anybody has; the one that was heard longest ago goes."""
_PREAMBLE: Final = 0xD3
_HEAD_BYTES, _CRC_BYTES = 3, 3
_PARTS: Final = 4
"""Two bits number the parts of a message."""


class FrameCutter:
    """RTCM 3 frames out of a byte stream. Holds less than one frame."""

    def __init__(self) -> None:
        self.bad_crc = 0
        """Beginnings of a frame whose CRC was wrong."""
        self.skipped_bytes = 0
        """Bytes that belong to no frame."""
        self._buffer = b""

    @property
    def pending(self) -> bool:
        """Whether a frame has begun and is not whole yet."""
        return bool(self._buffer)

    def receive(self, data: bytes) -> list[bytes]:
        """Take bytes; return the frames that they complete, each from its preamble to its CRC."""
        buffer, frames = self._buffer + data, []
        while True:
            at = buffer.find(_PREAMBLE)
            self.skipped_bytes += len(buffer) if at < 0 else at
            buffer = b"" if at < 0 else buffer[at:]
            if len(buffer) < _HEAD_BYTES:
                break
            size = _HEAD_BYTES + (buffer[1] << 8 | buffer[2]) + _CRC_BYTES
            if buffer[1] & 0xFC == 0 and len(buffer) < size:
                break
            if buffer[1] & 0xFC == 0 and crc24q(buffer[:size]) == 0:
                frames.append(buffer[:size])
                buffer = buffer[size:]
                continue
            self.bad_crc += buffer[1] & 0xFC == 0
            self.skipped_bytes += 1
            buffer = buffer[1:]
        self._buffer = buffer
        return frames

    def drop(self) -> None:
        """Give up a frame that has begun: its rest was lost."""
        self.skipped_bytes += len(self._buffer)
        self._buffer = b""


class _Sender:
    """The parts of one station, in order, on their way into its stream."""

    def __init__(self) -> None:
        self.cutter = FrameCutter()
        self._sequence: int | None = None
        self._next = 0
        self._early: dict[int, bytes] = {}

    def receive(self, flags: int, data: bytes) -> list[bytes]:
        if not flags & 1:
            self._sequence = None
            return self.cutter.receive(data)
        part, sequence = flags >> 1 & 3, flags >> 3
        if self._runs_over(flags):
            self._next += 1
            return self.cutter.receive(data)
        if sequence != self._sequence or (part == 0 and self._next):
            self._begin(sequence)
        self._early[part] = data
        frames = []
        while (piece := self._early.pop(self._next, None)) is not None:
            self._next += 1
            frames += self.cutter.receive(piece)
        return frames

    def _begin(self, sequence: int) -> None:
        self.cutter.drop()
        self._sequence, self._next, self._early = sequence, 0, {}

    def _runs_over(self, flags: int) -> bool:
        """Whether this is part five or later of a message, as older QGroundControls number it: added to the sequence's bits."""
        if self._sequence is None or self._next < _PARTS or not self.cutter.pending:
            return False
        return flags == (1 | self._next << 1 | self._sequence << 3) & 0xFF


class RtcmAssembler:
    """GPS_RTCM_DATA of any number of stations. ``complain`` is told of refused frames, at the 1st, 10th, 100th and so on."""

    def __init__(self, complain: Callable[[str], None] = lambda reason: None) -> None:
        self._complain = complain
        self._senders: OrderedDict[tuple[int, int], _Sender] = OrderedDict()
        self.refused = 0
        """Frames with a wrong CRC, and messages that held no frame."""
        self._tell_at = 1

    def receive(self, message: Any) -> RtcmData | None:
        """Take one message; return the frames that it completes, if any."""
        sender = self._sender(message.get_srcSystem(), message.get_srcComponent())
        cutter = sender.cutter
        bad, skipped = cutter.bad_crc, cutter.skipped_bytes
        frames = sender.receive(message.flags, bytes(message.data[: min(message.len, PART_BYTES)]))
        if cutter.bad_crc > bad or cutter.skipped_bytes > skipped:
            self._refuse(max(1, cutter.bad_crc - bad))
        return RtcmData(b"".join(frames)) if frames else None

    def _sender(self, system: int, component: int) -> _Sender:
        who = system, component
        found = self._senders.pop(who, None) or _Sender()
        self._senders[who] = found
        if len(self._senders) > MAX_SENDERS:
            self._senders.popitem(last=False)
        return found

    def _refuse(self, count: int) -> None:
        self.refused += count
        if self.refused >= self._tell_at:
            self._tell_at = 10 ** len(str(self.refused))
            self._complain(
                f"corrections for GNSS refused, {self.refused} so far: no whole RTCM 3 frame with a right CRC"
            )
