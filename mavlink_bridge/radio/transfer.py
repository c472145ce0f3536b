"""Messages that must arrive, whole and once: cut into pieces, repeated until answered, executed a single time.

The sender keeps an ``Transfer`` until its REPLY comes or its time is over; the receiver keeps an ``Incoming`` while
pieces arrive and remembers the answers of the last messages, so that the same message again is answered again and not
executed again.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Final
from zlib import crc32

from ..language.requests import Reply, Result
from .air import Priority, RadioProfile
from .codec import erasure
from .codec.bits import BitsError
from .codec.frames import RadioFrame, frame_bytes, is_brief
from .codec.wire import BRIEF_AIMS, BRIEF_HOLD, OVERHEAD, RESULT, Kind
from .words import shortened

POLL: Final = 0x80
"""In the third byte of a piece: it asks for an answer, or for an account of what has come."""
PIECE_HEAD: Final = 3
"""Number of the message, row, and flags."""
_LENGTH_MARK: Final = b"\x80"
_REPAIR_MAX: Final = 2.5
_REPAIR_MIN_SHARE: Final = 1.0 / _REPAIR_MAX
_REMEMBERED: Final = 48
BRIEF_NUMBERS: Final = 256
"""Added to the five bits of a number that a frame without a body tells: these are numbers of a kind of their own."""
_COMING: Final = 4
_BRIEF_TRIES: Final = 2


@dataclass(slots=True)
class Transfer:
    """A message on its way. Long ones go as rows of an erasure code: any ``len(parts)`` of them are enough."""

    id: int
    kind: Kind
    parts: tuple[bytes, ...]
    priority: Priority
    deadline_us: int
    next_us: int = 0
    """When the next frame may be sent; after a question, when the answer is overdue."""
    off_us: int = 0
    """When the last question left the air."""
    late_us: int = 0
    """How long after the question before it the last one was asked, from the air being free."""
    quiet_us: int = 0
    """Until when the answer to the last question may be on its way."""
    tries: int = 0
    """Questions asked so far."""
    greeted: bool = False
    """A HELLO went out between its first try and the second."""
    asked: bool = False
    """The last frame asked for an answer that has not come."""
    left: int = 0
    """Rows still to be sent before the next question."""
    sent: int = 0
    """Rows sent so far."""
    arrived: int = 0
    """Rows that the other end is known to have."""

    def __post_init__(self) -> None:
        self.left = len(self.parts)

    is_half_said: bool = False
    """The last frame is the first of two that say it; the second comes next."""
    is_said_twice: bool = False
    is_disturbed: bool = False
    """Something else was said between the last question and its answer, which says nothing of how soon answers come."""
    is_asked_for: bool = False
    """The other end asked for it, and waits."""
    is_pressed: bool = True
    """It was ordered, or ordered again, since its last try."""
    is_whole: bool = False
    """The other end may be of a version that understands only the frozen form."""

    @property
    def is_single(self) -> bool:
        return len(self.parts) == 1

    @property
    def is_brief(self) -> bool:
        """Whether it goes without a body."""
        return is_brief(self.kind, self.parts[0]) or (self.kind is Kind.SAFE and self.parts[0] == BRIEF_HOLD)

    @property
    def hurries(self) -> bool:
        """Whether stations have so little patience with it that it should rather be lost now and then than come late."""
        return self.is_brief and BRIEF_AIMS[self.parts[0]] is not None

    @property
    def is_under_way(self) -> bool:
        """Whether the other end knows that a long message is coming, and keeps quiet for it."""
        return not self.is_single and self.sent > 1

    @property
    def whole(self) -> bytes:
        """Number and message, of one that fits a frame."""
        return bytes((self.id,)) + self.parts[0]

    def is_answered_by(self, body: bytes, *, brief: bool) -> bool:
        """Whether a REPLY is the answer to this; ``brief``: to a message without a body."""
        found = read_reply(body)
        return found is not None and self.id & 31 == found[0] and (self.is_brief or not brief)

    def next_size(self) -> int:
        """Bytes of the next frame."""
        if self.is_single:
            return frame_bytes(self._goes_as, self.whole)
        return len(self.parts[0]) + OVERHEAD + 3 if self.left else OVERHEAD + 3

    def next_frame(self) -> tuple[Kind, bytes]:
        """The next frame's kind and body: the message, a row of it, or a short question."""
        if self.is_single:
            kind, self.asked = self._goes_as, True
            self.tries += 1
            return kind, self.whole
        head, body = 0, b""
        if self.left:
            head = self._row()
            body = erasure.piece(self.parts, head)
            self.sent += 1
            self.left -= 1
        flags = len(self.parts) - 1
        if not self.left:
            flags |= POLL
            self.asked = True
            self.tries += 1
        return Kind.PIECE, bytes((self.id, head, flags)) + body

    @property
    def _goes_as(self) -> Kind:
        """A Hold that was not answered twice goes as it is frozen: counted, not aging."""
        is_short = self.kind is Kind.SAFE and self.is_brief and not self.is_whole and self.tries < _BRIEF_TRIES
        return Kind.ORDER if is_short else self.kind

    def _row(self) -> int:
        if self.sent < len(self.parts):
            return self.sent
        spare = erasure.ROWS - erasure.MAX_PIECES
        return erasure.MAX_PIECES + (self.sent - len(self.parts)) % spare

    def begin_round(self) -> None:
        """No answer came. While the other end probably lacks something send more rows, later a row and a short question in turn."""
        self.asked = False
        if self.is_single:
            return
        lacking = 2 * len(self.parts) - self.arrived - self.sent
        if lacking > 0:
            self.left = max((2 * lacking) // 3, 1)
        elif self.tries % 3 == 0:
            self.left = 1

    def other_talked(self, began_us: int, now_us: int, answer_us: int) -> None:
        """Something else came that was on the air from ``began_us`` on: the question was over before and is answered after it, or
        was not heard and is asked again.
        """
        if not self.asked or now_us >= self.next_us:
            return
        self.is_disturbed = True
        if self.off_us <= began_us:
            self.quiet_us = max(self.quiet_us, now_us + answer_us)
            self.next_us = max(self.next_us, self.quiet_us)
        else:
            self.begin_round()
            self.next_us = now_us

    def heard_account(self, arrived: int, now_us: int) -> None:
        """Take the number of rows that the other end has; what is missing is sent with a reserve for what is lost so often."""
        self.arrived = max(self.arrived, arrived)
        share = max(arrived / max(self.sent, 1), _REPAIR_MIN_SHARE)
        self.left = math.ceil((len(self.parts) - self.arrived) / share)
        self.asked, self.next_us = False, now_us


def cut(kind: Kind, payload: bytes, max_frame_bytes: int) -> tuple[bytes, ...]:
    """Cut a payload. One that fits a frame stays whole; else the parts, equally long, hold the message's kind and the payload.

    Raises ValueError when it is too long.
    """
    room = max_frame_bytes - OVERHEAD - (kind in (Kind.STOP, Kind.SAFE))
    if len(payload) <= room - 1:
        return (payload,)
    data = bytes((kind,)) + payload + _LENGTH_MARK
    count = math.ceil(len(data) / (room - 3))
    if count > erasure.MAX_PIECES:
        raise ValueError(f"{len(payload)} bytes are more than one message may have")
    size = math.ceil(len(data) / count)
    data = data.ljust(count * size, b"\0")
    return tuple(data[at : at + size] for at in range(0, len(data), size))


def sizes(kind: Kind, payload: bytes, max_frame_bytes: int) -> list[int]:
    """Bytes of the frames that carry a message when nothing is lost. Raises ValueError when it is too long."""
    pieces = cut(kind, payload, max_frame_bytes)
    if len(pieces) == 1:
        return [frame_bytes(kind, b"\0" + payload)]
    return [len(piece) + OVERHEAD + 3 for piece in pieces]


def most_bytes(profile: RadioProfile, limit_us: int) -> int:
    """How long a message may be that can cross within the time where nothing is lost."""
    longest, gap_us = profile.max_frame_bytes, round(profile.link.gap_ms * 1e3)
    pieces = min(erasure.MAX_PIECES, limit_us // (profile.airtime_us(longest) + gap_us))
    return max(pieces * (longest - OVERHEAD - PIECE_HEAD) - 1 - len(_LENGTH_MARK), longest - OVERHEAD - 1)


@dataclass(frozen=True, slots=True)
class TransferOutcome:
    """How a message of ours ended."""

    id: int
    reply: Reply


@dataclass(frozen=True, slots=True)
class WholeMessage:
    """A message that has arrived whole, for the first time."""

    id: int
    kind: Kind
    payload: bytes


@dataclass(frozen=True, slots=True)
class Answer:
    """What answers a message: the body, whether that was a stop, and what was ordered if it came without a body."""

    body: bytes
    is_stop: bool
    order: bytes


@dataclass(slots=True)
class _Incoming:
    count: int
    rows: dict[int, bytes] = field(default_factory=dict)
    heard_us: int = 0
    """When its last piece came."""


@dataclass(slots=True)
class _Known:
    digest: int
    reply: bytes | None = None
    """The answer's body, None while the vessel works on it."""
    is_stop: bool = False
    order: bytes = b""
    """What was ordered, if it came without a body."""
    came_us: int = 0


class Inbox:
    """The receiving side. ``given_up_us``: how long after its last piece a message can no longer be completed by its sender; ``order_us``:
    the same of an order in one frame.
    """

    def __init__(self, given_up_us: int, order_us: int) -> None:
        self._given_up_us = given_up_us
        self._order_us = order_us
        self._coming: OrderedDict[int, _Incoming] = OrderedDict()
        self._known: OrderedDict[int, _Known] = OrderedDict()
        self.duplicates = 0

    def is_receiving(self, now_us: int, quiet_us: int) -> bool:
        """Whether a message is coming in pieces, the last of them within ``quiet_us``. One given up half way hinders nobody."""
        return any(now_us - coming.heard_us < quiet_us for coming in self._coming.values())

    def forget(self) -> None:
        """The other end has started anew: its numbers mean nothing any more."""
        self._coming.clear()
        self._known.clear()

    def whole(self, kind: Kind, body: bytes) -> tuple[WholeMessage | None, bytes | None]:
        """Take a one-frame message: (it, None) the first time, (None, the answer) again, (None, None) while it is worked on."""
        if not body:
            return None, None
        return self._accept(body[0], kind, body[1:])

    def frame(self, frame: RadioFrame, now_us: int) -> tuple[WholeMessage | None, bytes | None]:
        """Take a message that came in one frame, as ``whole`` does."""
        if frame.is_brief:
            return self._brief(frame, now_us)
        if frame.kind is Kind.SAFE and frame.body[1:] == BRIEF_HOLD:
            known = self._known.get(BRIEF_NUMBERS + (frame.body[0] & 31))
            if known is not None and known.order == BRIEF_HOLD and now_us - known.came_us < self._order_us:
                self.duplicates += 1
                return None, known.reply
        return self.whole(frame.kind, frame.body)

    def _brief(self, frame: RadioFrame, now_us: int) -> tuple[WholeMessage | None, bytes | None]:
        """Take an order that came without a body. Five bits of its number come round soon: it is the same one only while its sender
        may still repeat it.
        """
        number = BRIEF_NUMBERS + frame.body[0]
        known = self._known.get(number)
        if known is not None and now_us - known.came_us >= self._order_us:
            del self._known[number]
        message, reply = self._accept(number, frame.kind, frame.body[1:])
        if message is not None:
            self._known[number].came_us, self._known[number].order = now_us, message.payload
        return message, reply

    def piece(self, body: bytes, now_us: int) -> tuple[WholeMessage | None, bytes | None, bytes | None]:
        """Take a piece: (message, answer, account of the rows when asked for)."""
        if len(body) < 3:
            return None, None, None
        number, row, poll, count = body[0], body[1], bool(body[2] & POLL), (body[2] & 0x3F) + 1
        known = self._known.get(number)
        if known is not None:
            # it came whole before: its answer was lost, or is still being worked on
            return None, known.reply if poll else None, None
        coming = self._part(number, count, now_us)
        if len(body) > 3 and len(coming.rows) < count:
            coming.rows[row] = body[3:]
        data = erasure.rebuild(coming.rows, count) if len(coming.rows) >= count else None
        if data is not None:
            del self._coming[number]
            return self._finish(number, data.rstrip(b"\0")[:-1])
        return None, None, bytes((number, len(coming.rows))) if poll else None

    def _part(self, number: int, count: int, now_us: int) -> _Incoming:
        """What has come of a message so far. Rows of one that was given up must not mix with those of a later one of its number."""
        for old in [key for key, item in self._coming.items() if now_us - item.heard_us > self._given_up_us]:
            del self._coming[old]
        coming = self._coming.get(number)
        if coming is None or coming.count != count:
            coming = self._coming[number] = _Incoming(count)
            while len(self._coming) > _COMING:
                self._coming.popitem(last=False)
        coming.heard_us = now_us
        return coming

    def _finish(self, number: int, data: bytes) -> tuple[WholeMessage | None, bytes | None, bytes | None]:
        try:
            kind = Kind(data[0])
        except (ValueError, IndexError):
            return None, None, None
        message, reply = self._accept(number, kind, data[1:], crc32(data))
        return message, reply, None

    def _accept(
        self, number: int, kind: Kind, payload: bytes, digest: int | None = None
    ) -> tuple[WholeMessage | None, bytes | None]:
        digest = crc32(bytes((kind,)) + payload) if digest is None else digest
        known = self._known.get(number)
        if known is not None and known.digest == digest:
            self.duplicates += 1
            return None, known.reply
        self._known.pop(number, None)
        self._known[number] = _Known(digest, is_stop=kind in (Kind.STOP, Kind.SAFE))
        while len(self._known) > _REMEMBERED:
            self._known.popitem(last=False)
        return WholeMessage(number, kind, payload), None

    def answered(self, number: int, reply: Reply, reason_bytes: int) -> Answer | None:
        """Note the answer to a message; None for an unknown number."""
        known = self._known.get(number)
        if known is None:
            return None
        reason = b"" if reply.result is Result.ACCEPTED else shortened(reply.reason, reason_bytes)
        known.reply = bytes(((number & 31) << 3 | RESULT.number(reply.result),)) + reason
        return Answer(known.reply, known.is_stop, known.order)

    def save(self) -> list[list[int | str | None]]:
        """What must outlive a restart, so that nothing is executed twice."""
        return [
            [number, known.digest, known.reply.hex() if known.reply else None] for number, known in self._known.items()
        ]

    def restore(self, saved: list[list[int | str | None]], now_us: int = 0) -> None:
        """Raises ValueError or TypeError for what ``save`` did not make. What was not answered then counts as failed."""
        failed = RESULT.number(Result.FAILED)
        for number, digest, reply in saved:
            if not isinstance(number, int) or not isinstance(digest, int):
                raise TypeError("number and digest must be whole numbers")
            body = bytes.fromhex(reply) if isinstance(reply, str) else bytes(((number & 31) << 3 | failed,))
            self._known[number & (2 * BRIEF_NUMBERS - 1)] = _Known(digest, body, came_us=now_us)


def read_reply(body: bytes) -> tuple[int, Result] | None:
    """The frozen first byte of a REPLY: low five bits of the message's number, and the result; None for what no end sends."""
    if not body:
        return None
    try:
        return body[0] >> 3, RESULT.member(body[0] & 7)
    except BitsError:
        return None
