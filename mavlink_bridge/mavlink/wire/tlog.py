"""Telemetry logs: the .tlog format that QGroundControl, MAVProxy and Mission Planner write and read.

A record is 8 bytes of big-endian microseconds since 1970 followed by one raw frame; there is no other structure. As MAVProxy
does, the two lowest bits of the stamp carry a link number, so stamps are exact to 4 us. Reading survives damage: it looks
for the next frame with a right checksum and takes the 8 bytes before it as its stamp.
"""

from __future__ import annotations

import mmap
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from .framing import INCOMPAT_SIGNED, MARKER_V1, MARKER_V2, SIGNATURE_LEN, Deframer, Frame, checksum

_STAMP: Final = struct.Struct(">Q")
_LINK_MASK: Final = 0b11
_MARKERS: Final = re.compile(rb"[\xfd\xfe]")


@dataclass(frozen=True, slots=True)
class TlogRecord:
    """One logged frame."""

    t_us: int
    """Microseconds since 1970, a multiple of 4."""
    link: int
    """0...3; in logs of programs that do not number links, the low bits of the time."""
    frame: Frame


def pack(t_us: int, link: int, raw: bytes, *, strip_signature: bool = True) -> bytes:
    """One record. ``t_us`` is UTC since 1970; ``link`` is kept modulo 4.

    The signature of a signed frame is cut off, and the frame marked unsigned, unless told otherwise: a log gets shared, and a
    signature is material for guessing a key. The checksum covers the flag, so it is made anew.
    """
    if strip_signature and len(raw) > 12 and raw[0] == MARKER_V2 and raw[2] & INCOMPAT_SIGNED:
        raw = _unsigned(raw)
    return _STAMP.pack((t_us & ~_LINK_MASK) | (link & _LINK_MASK)) + raw


def pack_output(t_us: int, link: int, data: bytes, *, leave_out: bytes = b"") -> bytes:
    """Records of what one write held: whole MAVLink frames; a rest that is none is left out.

    ``leave_out``: the three bytes of a MAVLink 2 message id that is not to be logged. Otherwise as ``pack``.
    """
    stamp = _STAMP.pack((t_us & ~_LINK_MASK) | (link & _LINK_MASK))
    kept: list[bytes] = []
    for raw in split_frames(data):
        if raw[7:10] != leave_out:
            kept += stamp, _unsigned(raw) if raw[2] & INCOMPAT_SIGNED and raw[0] == MARKER_V2 else raw
    return b"".join(kept)


def split_frames(data: bytes) -> list[bytes]:
    """Cut our own output, which holds whole MAVLink frames, into frames; a rest that is none is left out."""
    frames = []
    at, end = 0, len(data)
    while at + 8 <= end:
        if data[at] == MARKER_V2:
            after = at + data[at + 1] + (25 if data[at + 2] & INCOMPAT_SIGNED else 12)
        elif data[at] == MARKER_V1:
            after = at + data[at + 1] + 8
        else:
            break
        if after > end:
            break
        frames.append(data[at:after])
        at = after
    return frames


def _unsigned(raw: bytes) -> bytes:
    body = bytearray(raw[1 : -SIGNATURE_LEN - 2])
    body[1] &= ~INCOMPAT_SIGNED
    message_id = int.from_bytes(body[6:9], "little")
    try:
        crc = checksum(bytes(body), message_id)
    except KeyError:
        return raw
    return raw[:1] + bytes(body) + crc.to_bytes(2, "little")


@dataclass(frozen=True, slots=True)
class Unread:
    """A whole record whose frame cannot be judged: its message is not known here, or differs in the sender's dialect."""

    t_us: int
    link: int
    system: int
    component: int
    sequence: int
    message_id: int
    size: int
    """Of the frame, bytes."""


def iterate(data: bytes | mmap.mmap) -> Iterator[TlogRecord]:
    """Records of a log, oldest first, damaged pieces left out. Frames of unknown ids are passed over."""
    return (found for found in scan(data) if isinstance(found, TlogRecord))


def scan(data: bytes | mmap.mmap) -> Iterator[TlogRecord | Unread]:
    """All records of a log, oldest first, those that cannot be judged too; damaged pieces are left out.

    What stands between two good records counts as unread records when it is cut into whole ones without a rest.
    """
    at = gap = 0
    end = len(data)
    while at + 8 < end:
        frame = _frame_at(data, at + 8)
        if frame is not None:
            if gap < at:
                yield from _unread(data, gap, at)
            (stamp,) = _STAMP.unpack(data[at : at + 8])
            yield TlogRecord(stamp & ~_LINK_MASK, stamp & _LINK_MASK, frame)
            at += 8 + len(frame.raw)
            gap = at
            continue
        at = _skip_to(data, at)
    if gap < end:
        yield from _unread(data, gap, end)


def _unread(data: bytes | mmap.mmap, at: int, end: int) -> list[Unread]:
    """The records from ``at`` to ``end``; none when they do not fill it to the byte."""
    found: list[Unread] = []
    while at < end:
        head = data[at + 8 : min(at + 18, end)]
        if len(head) < 8 or head[0] not in (MARKER_V1, MARKER_V2):
            return []
        new = head[0] == MARKER_V2
        if new and len(head) < 10:
            return []
        size = head[1] + (12 + (SIGNATURE_LEN if head[2] & INCOMPAT_SIGNED else 0) if new else 8)
        sequence, system, component = head[4:7] if new else head[2:5]
        message_id = int.from_bytes(head[7:10], "little") if new else head[5]
        (stamp,) = _STAMP.unpack(data[at : at + 8])
        found.append(
            Unread(
                t_us=stamp & ~_LINK_MASK,
                link=stamp & _LINK_MASK,
                system=system,
                component=component,
                sequence=sequence,
                message_id=message_id,
                size=size,
            )
        )
        at += 8 + size
    return found if at == end else []


_LOOKED_AT: Final = 1 << 20
_ENOUGH: Final = 50
"""Neighbours that tell what a file is."""
_SIGNS: Final = (
    (b"ULog", "a PX4 log (ULog)"),
    (b"\xa3\x95", "an ArduPilot data-flash log (.BIN)"),
    (b"SQLite format 3", "a database"),
    (b"PK\x03\x04", "a packed archive"),
    (b"\x1f\x8b", "a packed archive"),
    (b"\xfd7zXZ", "a packed archive"),
)


def not_a_log(data: bytes | mmap.mmap) -> str:
    """What a file is that is no telemetry log, in words; empty for one that is (damage and an end cut off do not matter)."""
    piece = bytes(data[:_LOOKED_AT])
    stamped, bare = _neighbours(piece)
    if bare > stamped:
        return "MAVLink frames without time stamps, as in MAVProxy's .tlog.raw: give the .tlog beside it"
    if stamped or _frame_at(piece, 8) is not None or _unread(piece, 0, len(piece)):
        return ""
    for sign, words in _SIGNS:
        if piece.startswith(sign):
            return f"{words}, no telemetry log"
    kind = "an empty file" if not piece else "text" if piece.isascii() else "not one MAVLink frame in it"
    return f"{kind}: no telemetry log"


def _neighbours(piece: bytes) -> tuple[int, int]:
    """How often a frame is followed by another after 8 bytes, and how often at once."""
    stamped = bare = at = 0
    while stamped + bare < _ENOUGH and (found := _MARKERS.search(piece, at)) is not None:
        frame = _frame_at(piece, found.start())
        if frame is None:
            at = found.start() + 1
            continue
        at = found.start() + len(frame.raw)
        stamped += _frame_at(piece, at + 8) is not None
        bare += _frame_at(piece, at) is not None
    return stamped, bare


def _skip_to(data: bytes | mmap.mmap, at: int) -> int:
    """Where to look next after no good frame stands at ``at`` + 8: the next marker, less a stamp."""
    found = _MARKERS.search(data, at + 9)
    return found.start() - 8 if found else len(data)


def _frame_at(data: bytes | mmap.mmap, at: int) -> Frame | None:
    """The frame that starts exactly here, or None."""
    head = data[at : at + 3]
    if len(head) < 3 or head[0] not in (MARKER_V1, MARKER_V2):
        return None
    length = head[1] + (8 if head[0] == MARKER_V1 else 12 + (SIGNATURE_LEN if head[2] & INCOMPAT_SIGNED else 0))
    piece = bytes(data[at : at + length])
    frames = Deframer(datagrams=True).receive(piece, 0)
    return frames[0] if len(frames) == 1 and frames[0].raw == piece else None
