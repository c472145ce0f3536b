"""Packets: header, fields and checksum, in both byte orders, cut out of datagrams and streams.

The sync number tells the sender's byte order; LSTS' own programs send little-endian. Input never raises: what is wrong is
counted and skipped. Nothing here knows what a message means.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

from ..crc import arc
from .fields import Message, UnknownMessage
from .layout import MAX_LENGTH, MalformedError, read_fields, write_fields
from .messages import TABLE

SYNC: Final = 0xFE54
NOBODY: Final = 0xFFFF
"""A destination that is left open: whoever hears it."""
BROADCAST: Final = 0xFFF0
ANNOUNCED: Final = 0x0000
"""The destination of an Announce."""
ENTITY_UNKNOWN: Final = 0xFF
ENTITY_SYSTEM: Final = 0

_LITTLE: Final = struct.Struct("<HHHdHBHB")
_BIG: Final = struct.Struct(">HHHdHBHB")
_CRC_BYTES: Final = 2
HEADER_BYTES: Final = _LITTLE.size
MAX_PACKET: Final = MAX_LENGTH
"""The longest packet as a whole; a UDP datagram holds 28 bytes less."""
_MARKS: Final = {False: SYNC.to_bytes(2, "little"), True: SYNC.to_bytes(2, "big")}


@dataclass(frozen=True)
class Header:
    """Who says it to whom, and when by the sender's clock."""

    source: int
    destination: int = NOBODY
    utc_s: float = 0.0
    """Since 1970."""
    source_entity: int = ENTITY_UNKNOWN
    destination_entity: int = ENTITY_UNKNOWN


@dataclass(frozen=True)
class Packet:
    header: Header
    message: Message
    big_endian: bool = False
    """As it came. What is sent is little-endian unless asked otherwise."""


def fields_bytes(message: Message) -> bytes:
    """The fields alone, little-endian: what a plan's MD5 is reckoned over. Raises ValueError as ``encode``."""
    return write_fields(message)


def parse_fields(wanted: type[Message], data: bytes) -> Message:
    """The message whose little-endian fields ``data`` is. Raises MalformedError."""
    return read_fields(wanted, data, TABLE.get)


def encode(packet: Packet) -> bytes:
    """A packet's bytes, in its byte order. Raises ValueError for a value that does not fit its field, or a packet too long."""
    message, header = packet.message, packet.header
    payload = write_fields(message, big_endian=packet.big_endian)
    if len(payload) > MAX_PACKET - HEADER_BYTES - _CRC_BYTES:
        raise ValueError(f"{type(message).__name__}: {len(payload)} bytes are more than a packet holds")
    number = message.number if isinstance(message, UnknownMessage) else message.NUMBER
    head = (_BIG if packet.big_endian else _LITTLE).pack(
        SYNC,
        number,
        len(payload),
        header.utc_s,
        header.source,
        header.source_entity,
        header.destination,
        header.destination_entity,
    )
    crc = arc(head + payload)
    return head + payload + crc.to_bytes(_CRC_BYTES, "big" if packet.big_endian else "little")


def decode(data: bytes) -> Packet:
    """The one packet that ``data`` is. Raises MalformedError."""
    if data[:2] not in _MARKS.values():
        raise MalformedError("no sync number")
    big_endian = data[:2] == _MARKS[True]
    end = _length(data, 0, big_endian=big_endian) if len(data) >= HEADER_BYTES else HEADER_BYTES
    if len(data) != end:
        raise MalformedError(f"{len(data)} bytes, where {end} are told")
    if not _sum_holds(data, big_endian=big_endian):
        raise MalformedError("the checksum is wrong")
    return _unpack(data, big_endian=big_endian)


def _length(data: bytes, at: int, *, big_endian: bool) -> int:
    size = int.from_bytes(data[at + 4 : at + 6], "big" if big_endian else "little")
    return HEADER_BYTES + size + _CRC_BYTES


def _sum_holds(data: bytes, *, big_endian: bool) -> bool:
    return arc(data[:-_CRC_BYTES]) == int.from_bytes(data[-_CRC_BYTES:], "big" if big_endian else "little")


def _unpack(data: bytes, *, big_endian: bool) -> Packet:
    _, number, _, utc_s, source, source_entity, destination, destination_entity = (
        _BIG if big_endian else _LITTLE
    ).unpack_from(data)
    header = Header(
        source=source,
        destination=destination,
        utc_s=utc_s,
        source_entity=source_entity,
        destination_entity=destination_entity,
    )
    payload = data[HEADER_BYTES:-_CRC_BYTES]
    wanted = TABLE.get(number)
    message = (
        UnknownMessage(number, payload)
        if wanted is None
        else read_fields(wanted, payload, TABLE.get, big_endian=big_endian)
    )
    return Packet(header, message, big_endian)


@dataclass(slots=True)
class PacketCounters:
    """What became of the bytes. ``skipped_bytes`` were searched and held no packet."""

    packets: int = 0
    unknown: int = 0
    """Whole packets of messages that the table does not have."""
    bad_crc: int = 0
    malformed: int = 0
    """Whole packets whose fields do not fit their length."""
    stalled: int = 0
    skipped_bytes: int = 0


STALL_US: Final = 5_000_000
"""A packet's rest comes within this, or its head was none: the longest takes 3 s at 180 kbit/s."""
_EFFORT: Final = 16
"""So many bytes may be summed for each one that comes: false heads must not cost more than an honest stream would."""


class PacketReader:
    """Cuts bytes into packets. Holds less than one packet between calls.

    ``datagrams``: every call holds whole packets, so nothing is carried over to the next.
    """

    def __init__(self, *, datagrams: bool = False, counters: PacketCounters | None = None) -> None:
        self.counters = counters or PacketCounters()
        self._datagrams = datagrams
        self._buffer = b""
        self._head_us = 0
        self._effort = 0

    @property
    def pending(self) -> int:
        """Bytes of an incomplete packet."""
        return len(self._buffer)

    def receive(self, data: bytes, now_us: int) -> list[Packet]:
        """Take bytes as read and return the packets that they complete. Empty data serves the time limit."""
        stalled = bool(self._buffer) and now_us - self._head_us > STALL_US
        held = self._buffer
        buffer = held + data
        self._effort = min(self._effort + _EFFORT * len(data), _EFFORT * MAX_PACKET)
        packets, rest = self._cut(buffer)
        if stalled and len(rest) == len(buffer):
            self.counters.stalled += 1
            self.counters.skipped_bytes += 1
            packets, rest = self._cut(rest[1:])
        if not held or len(rest) != len(buffer):
            self._head_us = now_us
        self._buffer = rest
        return packets

    def _cut(self, buffer: bytes) -> tuple[list[Packet], bytes]:
        """The packets in ``buffer``, and the incomplete one at its end."""
        packets: list[Packet] = []
        at = 0
        while (found := _next_mark(buffer, at)) is not None:
            self.counters.skipped_bytes += found - at
            at = found
            end = self._end_at(buffer, at)
            if end is None:
                if not self._datagrams:
                    return packets, buffer[at:]
                self.counters.stalled += 1
            elif end - at > self._effort:
                self.counters.skipped_bytes += len(buffer) - at
                return packets, b""
            elif (length := self._take(buffer[at:end], packets)) is not None:
                at += length
                continue
            self.counters.skipped_bytes += 1
            at += 1
        rest = b"" if self._datagrams else buffer[max(at, len(buffer) - 1) :]
        self.counters.skipped_bytes += len(buffer) - at - len(rest)
        return packets, rest

    def _end_at(self, buffer: bytes, at: int) -> int | None:
        """Where the packet ends whose head is at ``at``; None while its rest is not here."""
        if len(buffer) - at < HEADER_BYTES:
            return None
        end = at + _length(buffer, at, big_endian=buffer[at : at + 2] == _MARKS[True])
        return end if end <= len(buffer) else None

    def _take(self, raw: bytes, packets: list[Packet]) -> int | None:
        """Take one packet in; its length, or None when it is a false head. A whole packet with wrong fields is passed over."""
        big_endian = raw[:2] == _MARKS[True]
        self._effort -= len(raw)
        if not _sum_holds(raw, big_endian=big_endian):
            self.counters.bad_crc += 1
            return None
        try:
            packet = _unpack(raw, big_endian=big_endian)
        except MalformedError:
            self.counters.malformed += 1
            return len(raw)
        self.counters.packets += 1
        self.counters.unknown += isinstance(packet.message, UnknownMessage)
        packets.append(packet)
        return len(raw)


def _next_mark(buffer: bytes, at: int) -> int | None:
    """Where the next sync number of either byte order begins."""
    places = [place for mark in _MARKS.values() if (place := buffer.find(mark, at)) >= 0]
    return min(places, default=None)
