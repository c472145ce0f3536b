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
class Record:
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


def iterate(data: bytes | mmap.mmap) -> Iterator[Record]:
    """Records of a log, oldest first, damaged pieces left out. Frames of unknown ids are passed over."""
    at = 0
    end = len(data)
    while at + 8 < end:
        frame = _frame_at(data, at + 8)
        if frame is not None:
            (stamp,) = _STAMP.unpack(data[at : at + 8])
            yield Record(stamp & ~_LINK_MASK, stamp & _LINK_MASK, frame)
            at += 8 + len(frame.raw)
            continue
        at = _skip_to(data, at)


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
