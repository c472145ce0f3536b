"""Bytes to exact MAVLink frames: versions 1 and 2, checksums checked, nothing believed that a checksum does not cover.

A frame's length byte may be noise. On a bad checksum the search therefore goes on one byte after the false marker, so that a false
head never swallows the good frames behind it; a head whose rest does not come within a time limit is given up in the same way, and
with it all heads behind it that are as old, so that noise holds up what follows for one time limit, not for one each.
Message ids that the dialect does not have cannot be checked, and are counted and dropped unless the caller asks for them.
Knows nothing of what a message means, and nothing of signatures beyond where they stand.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from ...crc import mcrf4xx
from .extensions import messages as _messages

MARKER_V1: Final = 0xFE
MARKER_V2: Final = 0xFD
MAX_FRAME: Final = 280
"""Longest frame: MAVLink 2 header 10, payload 255, checksum 2, signature 13."""
SIGNATURE_LEN: Final = 13
EVERYBODY: Final = 0
"""System id that addresses all systems, and is no sender's."""
INCOMPAT_SIGNED: Final = 0x01
STALL_US: Final = 500_000
"""Default time limit of an incomplete frame: a longest frame takes 290 ms at 9600 baud."""
COPY_WINDOW_US: Final = 1_000_000
"""The very same bytes so soon are a copy that the network made: longer than two ways differ, shorter than sequence numbers go round."""

_MARKERS: Final = re.compile(rb"[\xfd\xfe]")
_CRC_EXTRA: Final = {message_id: bytes((message.crc_extra,)) for message_id, message in _messages.items()}


@dataclass(frozen=True, slots=True)
class Frame:
    """One whole frame. ``raw`` is exactly what crossed the link, signature included."""

    raw: bytes
    version: int
    """1 or 2."""
    sequence: int
    system: int
    component: int
    message_id: int
    payload: bytes
    """As sent: MAVLink 2 senders leave out trailing zeros."""
    signed: bool = False
    link_id: int | None = None
    """Of the signature; None when unsigned."""
    timestamp: int | None = None
    """Of the signature, units of 10 us since 2015-01-01 UTC; None when unsigned."""
    known: bool = True
    """False: the dialect does not have this id, so the checksum could not be checked."""


@dataclass(slots=True)
class FramingCounters:
    """What became of the bytes. ``skipped_bytes`` were searched and held no frame."""

    bytes: int = 0
    frames: int = 0
    bad_crc: int = 0
    unknown: int = 0
    bad_flags: int = 0
    stalled: int = 0
    skipped_bytes: int = 0


class NeedMore(Exception):  # noqa: N818 - a condition of the search, not an error
    """The head at the given place is plausible, its rest has not come yet."""


class Deframer:
    """Cuts a byte stream into frames. Holds less than one frame between calls.

    ``pass_unknown``: hand on frames of ids that the dialect does not have (``known`` False) when the bytes behind them
    confirm their length: another marker or the end of the data. ``datagrams``: every call holds whole frames, so nothing
    is carried over to the next.
    """

    __slots__ = ("_arrivals", "_buffer", "_in_step", "_tail", "counters", "datagrams", "pass_unknown", "stall_us")

    def __init__(self, *, stall_us: int = STALL_US, pass_unknown: bool = False, datagrams: bool = False) -> None:
        self.stall_us = stall_us
        self.pass_unknown = pass_unknown
        self.datagrams = datagrams
        self.counters = FramingCounters()
        self._buffer = b""
        self._arrivals: list[tuple[int, int]] = []
        """Of the pending bytes: up to which place they came, and when, oldest first."""
        self._in_step = True
        self._tail = b""
        """Signature of a frame that ended with the data, in case it was cut short."""

    def receive(self, data: bytes, now_us: int) -> list[Frame]:
        """Take bytes as read from a link and return the frames that they complete. Empty data serves the time limit."""
        self.counters.bytes += len(data)
        if not data and not self._is_expired(0, now_us):
            return []
        if self._tail and data and data[0] not in (MARKER_V1, MARKER_V2):
            data = self._tail + data
        buffer = self._buffer + data
        if data:
            self._tail = b""
            self._arrivals.append((len(buffer), now_us))
        frames, at = self._cut(buffer, now_us)
        self._buffer = buffer[at:]
        if at:
            self._arrivals = [(end - at, t_us) for end, t_us in self._arrivals if end > at]
        return frames

    def _is_expired(self, at: int, now_us: int) -> bool:
        """Whether the byte at this place has waited for longer than a frame takes. Each has its own time: a good frame that has
        just begun behind an old false head is not given up with it.
        """
        for end, t_us in self._arrivals:
            if end > at:
                return now_us - t_us > self.stall_us
        return False

    def reset(self) -> None:
        """Forget what is pending, as when the link was opened anew."""
        self._buffer = b""
        self._arrivals = []
        self._in_step = True
        self._tail = b""

    @property
    def pending(self) -> int:
        """Bytes of an incomplete frame."""
        return len(self._buffer)

    def _cut(self, buffer: bytes, now_us: int) -> tuple[list[Frame], int]:
        """Return the frames in ``buffer`` and where an incomplete head begins that may still be completed; its end when there is none."""
        frames: list[Frame] = []
        at = 0
        while (found := _MARKERS.search(buffer, at)) is not None:
            if found.start() != at:
                self._skip(found.start() - at)
            at = found.start()
            try:
                frame = self._frame_at(buffer, at)
            except NeedMore:
                if not self.datagrams and not self._is_expired(at, now_us):
                    return frames, at
                self.counters.stalled += 1
                frame = None
            if frame is None:
                self._skip(1)
                at += 1
                continue
            self._in_step = True
            self.counters.frames += 1
            frames.append(frame)
            at = self._behind(frame, buffer, at)
        self._skip(len(buffer) - at)
        return frames, len(buffer)

    def _behind(self, frame: Frame, buffer: bytes, at: int) -> int:
        """Where to go on after a frame. No checksum covers a signature: one that lost a byte ends inside the next frame."""
        end = at + len(frame.raw)
        if not frame.signed:
            return end
        if end == len(buffer):
            self._tail = frame.raw[-SIGNATURE_LEN:]
            return end
        return end if buffer[end] in (MARKER_V1, MARKER_V2) else end - SIGNATURE_LEN

    def _skip(self, count: int) -> None:
        if count:
            self.counters.skipped_bytes += count
            self._in_step = False

    def _frame_at(self, buffer: bytes, at: int) -> Frame | None:
        """The frame that starts at ``at``; None for a false marker. Raises NeedMore."""
        left = len(buffer) - at
        version = 2 if buffer[at] == MARKER_V2 else 1
        header = 10 if version == 2 else 6
        if version == 2 and left > 2 and buffer[at + 2] & ~INCOMPAT_SIGNED:
            self.counters.bad_flags += self._in_step
            return None
        if left < header:
            raise NeedMore
        message_id = int.from_bytes(buffer[at + 7 : at + 10], "little") if version == 2 else buffer[at + 5]
        known = message_id in _CRC_EXTRA
        if not known:
            # a false marker mostly names an unknown id: only one where a frame was due is counted as such
            self.counters.unknown += self._in_step
            if not self.pass_unknown:
                return None
        body_end = at + header + buffer[at + 1]
        signed = version == 2 and bool(buffer[at + 2] & INCOMPAT_SIGNED)
        end = body_end + 2 + (SIGNATURE_LEN if signed else 0)
        if end > len(buffer):
            raise NeedMore
        if not self._confirmed(buffer, at, body_end, end, message_id if known else None):
            return None
        return _frame(buffer[at:end], version, header, message_id, signed=signed, known=known)

    def _confirmed(self, buffer: bytes, at: int, body_end: int, end: int, message_id: int | None) -> bool:
        if message_id is None:
            return end == len(buffer) or buffer[end] in (MARKER_V1, MARKER_V2)
        crc = checksum(buffer[at + 1 : body_end], message_id)
        if crc == buffer[body_end] | buffer[body_end + 1] << 8:
            return True
        self.counters.bad_crc += self._in_step
        return False


def checksum(covered: bytes, message_id: int) -> int:
    """CRC-16/MCRF4XX of a frame without its marker, checksum and signature, and of the message's CRC_EXTRA byte."""
    return mcrf4xx(covered + _CRC_EXTRA[message_id])


def _frame(raw: bytes, version: int, header: int, message_id: int, *, signed: bool, known: bool) -> Frame:
    first = 4 if version == 2 else 2
    payload_end = header + raw[1]
    return Frame(
        raw=raw,
        version=version,
        sequence=raw[first],
        system=raw[first + 1],
        component=raw[first + 2],
        message_id=message_id,
        payload=raw[header:payload_end],
        signed=signed,
        link_id=raw[payload_end + 2] if signed else None,
        timestamp=int.from_bytes(raw[payload_end + 3 : payload_end + 9], "little") if signed else None,
        known=known,
    )


class DuplicateFilter:
    """Finds copies made by the network: the very same bytes again within a short time.

    A station that repeats itself uses a new sequence number, so its repeats are other bytes and pass. Bounded: the
    oldest memory goes first.
    """

    __slots__ = ("_seen", "duplicates", "size", "window_us")

    def __init__(self, window_us: int = COPY_WINDOW_US, size: int = 256) -> None:
        self.window_us = window_us
        self.size = size
        self.duplicates = 0
        self._seen: OrderedDict[bytes, int] = OrderedDict()

    def is_new(self, frame: Frame, now_us: int) -> bool:
        """False for a copy; remembers a frame that is none."""
        if self.is_copy(frame, now_us):
            return False
        self.remember(frame, now_us)
        return True

    def is_copy(self, frame: Frame, now_us: int) -> bool:
        """Whether the very same bytes came a short time ago. A copy is not remembered: who does not count is heard now and then."""
        seen_us = self._seen.get(frame.raw)
        if seen_us is None or not 0 <= now_us - seen_us <= self.window_us:
            return False
        self.duplicates += 1
        return True

    def remember(self, frame: Frame, now_us: int) -> None:
        self._seen.pop(frame.raw, None)
        self._seen[frame.raw] = now_us
        if len(self._seen) > self.size:
            self._seen.popitem(last=False)
