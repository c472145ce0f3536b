"""Messages that must arrive, whole and once: cut into pieces, repeated until answered, executed a single time.

The sender keeps an ``Outgoing`` until its REPLY comes or its time is over; the receiver keeps an ``Incoming`` while
pieces arrive and remembers the answers of the last messages, so that the same message again is answered again and not
executed again.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Final
from zlib import crc32

from mavlink_bridge.lora.frames import Kind
from mavlink_bridge.lora.ledger import Priority
from mavlink_bridge.requests import Reply, Result

MAX_PIECES: Final = 64
_POLL, _LAST = 0x40, 0x80
_RESULTS: Final = tuple(Result)
_REMEMBERED: Final = 48


@dataclass(slots=True)
class Outgoing:
    """A message on its way."""

    id: int
    kind: Kind
    pieces: tuple[bytes, ...]
    priority: Priority
    deadline_us: int
    missing: set[int] = field(default_factory=set)
    next_us: int = 0
    """When the next frame may be sent; after a question, when the answer is overdue."""
    tries: int = 0
    """Questions asked so far."""
    asked: bool = False
    """The last frame asked for an answer that has not come."""

    @property
    def is_single(self) -> bool:
        return len(self.pieces) == 1

    def next_frame(self) -> tuple[Kind, bytes]:
        """The next frame's kind and body; notes what is still to be sent in this round."""
        if self.is_single:
            self.asked = True
            self.tries += 1
            return self.kind, bytes((self.id,)) + self.pieces[0]
        if not self.missing:
            self.asked = True
            self.tries += 1
            return Kind.PIECE, bytes((self.id, _POLL))
        index = min(self.missing)
        self.missing.discard(index)
        flags = index
        if not self.missing:
            flags |= _POLL
            self.asked = True
            self.tries += 1
        if index == len(self.pieces) - 1:
            flags |= _LAST
        return Kind.PIECE, bytes((self.id, flags)) + self.pieces[index]

    def next_size(self) -> int:
        """Bytes of the next frame."""
        if self.is_single:
            return len(self.pieces[0]) + 7
        return len(self.pieces[min(self.missing)]) + 8 if self.missing else 8

    def begin_round(self) -> None:
        """No answer came: ask again, by the message itself or, for one in pieces, by a short question."""
        self.asked = False

    def heard_missing(self, bitmap: bytes) -> None:
        """Take the receiver's account of what it has."""
        have = int.from_bytes(bitmap, "little")
        self.missing = {index for index in range(len(self.pieces)) if not have >> index & 1}
        self.asked = False


def cut(kind: Kind, payload: bytes, max_frame_bytes: int) -> tuple[bytes, ...]:
    """Cut a payload. One that fits a frame stays whole; else the pieces start with the message's kind. Raises ValueError when too long."""
    room = max_frame_bytes - 6
    if len(payload) <= room - 1:
        return (payload,)
    data = bytes((kind,)) + payload
    size = room - 2
    pieces = tuple(data[at : at + size] for at in range(0, len(data), size))
    if len(pieces) > MAX_PIECES:
        raise ValueError(f"{len(payload)} bytes are more than the {MAX_PIECES * size} that one message may have")
    return pieces


@dataclass(frozen=True, slots=True)
class Message:
    """A message that has arrived whole, for the first time."""

    id: int
    kind: Kind
    payload: bytes


@dataclass(slots=True)
class _Incoming:
    pieces: dict[int, bytes] = field(default_factory=dict)
    count: int | None = None


@dataclass(slots=True)
class _Known:
    digest: int
    reply: bytes | None = None
    """The answer's body, None while the vessel works on it."""
    is_stop: bool = False


class Inbox:
    """The receiving side."""

    def __init__(self) -> None:
        self._coming: OrderedDict[int, _Incoming] = OrderedDict()
        self._known: OrderedDict[int, _Known] = OrderedDict()
        self.duplicates = 0

    @property
    def is_receiving(self) -> bool:
        """Whether a message has come in part."""
        return bool(self._coming)

    def forget(self) -> None:
        """The other end has started anew: its numbers mean nothing any more."""
        self._coming.clear()
        self._known.clear()

    def whole(self, kind: Kind, body: bytes) -> tuple[Message | None, bytes | None]:
        """Take a one-frame message: (it, None) the first time, (None, the answer) again, (None, None) while it is worked on."""
        if not body:
            return None, None
        return self._accept(body[0], kind, body[1:])

    def piece(self, body: bytes) -> tuple[Message | None, bytes | None, bytes | None]:
        """Take a piece: (message, answer, account of the pieces when asked for)."""
        if len(body) < 2:
            return None, None, None
        number, index = body[0], body[1] & (MAX_PIECES - 1)
        known = self._known.get(number)
        if known is not None:
            # it came whole before: its answer was lost, or is still being worked on
            return None, known.reply if body[1] & _POLL else None, None
        coming = self._coming.get(number)
        if coming is None:
            coming = self._coming[number] = _Incoming()
            while len(self._coming) > 4:
                self._coming.popitem(last=False)
        if len(body) > 2:
            coming.pieces[index] = body[2:]
        if body[1] & _LAST:
            coming.count = index + 1
        if coming.count is not None and all(place in coming.pieces for place in range(coming.count)):
            data = b"".join(coming.pieces[place] for place in range(coming.count))
            del self._coming[number]
            return self._finish(number, data)
        if not body[1] & _POLL:
            return None, None, None
        have = sum(1 << place for place in coming.pieces)
        account = bytes((number,)) + have.to_bytes((max(coming.pieces, default=0) + 8) // 8, "little")
        return None, None, account

    def _finish(self, number: int, data: bytes) -> tuple[Message | None, bytes | None, bytes | None]:
        try:
            kind = Kind(data[0])
        except ValueError:
            return None, None, None
        message, reply = self._accept(number, kind, data[1:], crc32(data))
        return message, reply, None

    def _accept(
        self, number: int, kind: Kind, payload: bytes, digest: int | None = None
    ) -> tuple[Message | None, bytes | None]:
        digest = crc32(bytes((kind,)) + payload) if digest is None else digest
        known = self._known.get(number)
        if known is not None and known.digest == digest:
            self.duplicates += 1
            return None, known.reply
        self._known.pop(number, None)
        self._known[number] = _Known(digest, is_stop=kind is Kind.STOP)
        while len(self._known) > _REMEMBERED:
            self._known.popitem(last=False)
        return Message(number, kind, payload), None

    def answered(self, number: int, reply: Reply, reason_bytes: int) -> tuple[bytes, bool] | None:
        """Note the answer to a message; return its frame body and whether the message was a stop; None for an unknown number."""
        known = self._known.get(number)
        if known is None:
            return None
        reason = b"" if reply.result is Result.ACCEPTED else reply.reason.encode()[:reason_bytes]
        known.reply = bytes(((number & 31) << 3 | _RESULTS.index(reply.result),)) + reason
        return known.reply, known.is_stop

    def save(self) -> list[list[int | str | None]]:
        """What must outlive a restart, so that nothing is executed twice."""
        return [
            [number, known.digest, known.reply.hex() if known.reply else None] for number, known in self._known.items()
        ]

    def restore(self, saved: list[list[int | str | None]]) -> None:
        """Raises ValueError or TypeError for what ``save`` did not make. What was not answered then counts as failed."""
        failed = _RESULTS.index(Result.FAILED)
        for number, digest, reply in saved:
            if not isinstance(number, int) or not isinstance(digest, int):
                raise TypeError("number and digest must be whole numbers")
            body = bytes.fromhex(reply) if isinstance(reply, str) else bytes(((number & 31) << 3 | failed,))
            self._known[number & 0xFF] = _Known(digest, body)


def read_reply(body: bytes) -> tuple[int, Reply] | None:
    """Take a REPLY apart: low five bits of the message's number, and the answer."""
    if not body or body[0] & 7 >= len(_RESULTS):
        return None
    return body[0] >> 3, Reply(_RESULTS[body[0] & 7], body[1:].decode("utf-8", "replace"))
