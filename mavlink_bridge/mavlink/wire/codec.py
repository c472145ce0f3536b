"""Frames to MAVLink messages and back, and the one place from which the rest of the project imports the dialect.

A ``Codec`` belongs to one link: it counts the sequence numbers of what it encodes and signs it when a signer is set.
Decoding never raises and judges nothing: NaN, unknown enum values and texts that are not UTF-8 come through, for
the services to answer. It does its own packing, because the library's signing and parsing state is not used.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from operator import attrgetter
from typing import Any, Final, Protocol

from ...crc import mcrf4xx
from .extensions import dialect, messages
from .framing import INCOMPAT_SIGNED, MARKER_V2, Frame

__all__ = ["Codec", "FrameSigner", "Message", "decode", "dialect", "payload"]

_HEADER: Final = struct.Struct("<BBBBBB")
_MARKER: Final = bytes((MARKER_V2,))
_SEALS: Final = {
    message_id: (message_id.to_bytes(3, "little"), bytes((message_class.crc_extra,)))
    for message_id, message_class in messages.items()
}
"""The id as it stands at the end of a header, and what the checksum covers behind the payload."""

Message = Any
"""A message object of the dialect; the library leaves no better type."""


class FrameSigner(Protocol):
    """What makes the 13 signature bytes (``signing.Signer``)."""

    def sign(self, unsigned: bytes) -> bytes:
        """Return link id, time stamp and signature for a frame whose flags already say 'signed'."""
        ...


class _Layout:
    """How one message class lies in its payload."""

    __slots__ = ("_get", "_has_arrays", "_order", "_spans", "arrays", "make", "unpacker")

    def __init__(self, message_class: Any) -> None:
        self.make = message_class
        self.unpacker: struct.Struct = message_class.unpacker
        # the library counts a char array as one value; so does struct
        lengths: list[int] = message_class.lengths
        starts = [sum(lengths[:index]) for index in range(len(lengths))]
        self._spans = [(starts[index], lengths[index]) for index in message_class.orders]
        self._has_arrays = any(length != 1 for length in lengths)
        self.arrays: list[int] = lengths
        names: list[str] = message_class.ordered_fieldnames
        # a text field is a str for reading; the bytes that go out stand beside it
        is_text = {
            name: kind == "char" for name, kind in zip(message_class.fieldnames, message_class.fieldtypes, strict=True)
        }
        self._get = attrgetter(*(f"_{name}_raw" if is_text[name] else name for name in names))
        self._order = len(names)

    def pack(self, message: Message) -> bytes:
        values: Any = self._get(message)
        if self._order == 1:
            values = (values,)
        if self._has_arrays:
            values = self._flat(values)
        return self.unpacker.pack(*values)

    def _flat(self, values: Any) -> list[Any]:
        flat: list[Any] = []
        for value, length in zip(values, self.arrays, strict=True):
            if length == 1:
                flat.append(value)
            else:
                flat.extend(value[:length])
                flat.extend([0] * (length - len(value)))
        return flat

    def unpack(self, payload: bytes) -> list[Any]:
        """Field values in the order in which the message class takes them."""
        size = self.unpacker.size
        values = self.unpacker.unpack(payload[:size].ljust(size, b"\0"))
        fields: list[Any] = []
        for start, length in self._spans:
            value = values[start] if length == 1 else list(values[start : start + length])
            fields.append(value)
        return fields


_layouts: Final[dict[int, _Layout]] = {}


def _layout(message_id: int) -> _Layout:
    layout = _layouts.get(message_id)
    if layout is None:
        layout = _layouts[message_id] = _Layout(messages[message_id])
    return layout


def decode(frame: Frame) -> Message | None:
    """The message in a frame, or None for an id that the dialect does not have. Never raises.

    Text fields are ``str``; ``get_srcSystem()``, ``get_srcComponent()``, ``get_seq()``, ``get_signed()`` tell of the frame.
    """
    if frame.message_id not in messages:
        return None
    layout = _layout(frame.message_id)
    message = layout.make(*layout.unpack(frame.payload))
    message._header = dialect.MAVLink_header(
        frame.message_id,
        incompat_flags=INCOMPAT_SIGNED if frame.signed else 0,
        mlen=len(frame.payload),
        seq=frame.sequence,
        srcSystem=frame.system,
        srcComponent=frame.component,
    )
    message._payload = frame.payload
    message._msgbuf = bytearray(frame.raw)
    message._signed = frame.signed
    message._link_id = frame.link_id
    crc_at = len(frame.raw) - 2 - (13 if frame.signed else 0)
    message._crc = frame.raw[crc_at] | frame.raw[crc_at + 1] << 8
    return message


def payload(message: Message) -> bytes:
    """The payload of a message as MAVLink 2 sends it, trailing zeros left out; links can share it.

    Raises struct.error for a value that its field cannot hold: a fault of the caller.
    """
    packed = _layout(message.get_msgId()).pack(message)
    return packed.rstrip(b"\0") or packed[:1]


class Codec:
    """Encodes for one link under one identity. ``signer`` may be set or cleared at any time."""

    __slots__ = ("_sequence", "component_id", "link_id", "signer", "system_id")

    def __init__(self, system_id: int, component_id: int, link_id: int = 0, signer: FrameSigner | None = None) -> None:
        self.system_id = system_id
        self.component_id = component_id
        self.link_id = link_id
        self.signer = signer
        self._sequence = 0

    def encode(self, message: Message) -> bytes:
        """One frame with the next sequence number. Raises struct.error for a value that its field cannot hold."""
        return self.seal(message.get_msgId(), payload(message))

    def seal(self, message_id: int, body: bytes) -> bytes:
        """Put header, checksum and signature around what ``payload`` made; takes the next sequence number."""
        return self.seal_all(((message_id, body),))

    def seal_all(self, messages: Iterable[tuple[int, bytes]]) -> bytes:
        """Return the frames of ids and payloads one behind the other, in this order."""
        signer, sequence, system, component = self.signer, self._sequence, self.system_id, self.component_id
        flags = INCOMPAT_SIGNED if signer else 0
        parts: list[bytes] = []
        for message_id, body in messages:
            number, crc_extra = _SEALS[message_id]
            covered = _HEADER.pack(len(body), flags, 0, sequence, system, component) + number + body
            sequence = sequence + 1 & 0xFF
            crc = mcrf4xx(covered + crc_extra).to_bytes(2, "little")
            parts += _MARKER, covered, crc
            if signer is not None:
                parts.append(signer.sign(_MARKER + covered + crc))
        self._sequence = sequence
        return b"".join(parts)

    def decode(self, frame: Frame) -> Message | None:
        """The message in a frame, or None for an unknown id. Never raises."""
        return decode(frame)
