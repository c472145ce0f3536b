"""Frames of the compact link: found without sync bytes, believed only with the right authentication tag.

Frame = 2 bytes (4 bits kind, 6 bits body length, 6 bits of a counter), body of 0...55 bytes, 5 bytes of keyed BLAKE2s. The
receiver tries every offset, so garbage, merged and split pieces do no harm; at each offset it tries at most two tags (the
session and the one that may replace it), and it counts them. What the counters are, and why a frame that is believed is of
now, is ``session``'s. HELLO opens a session and is told by a tag of its own.

The orders for which a station has the least patience, Hold among them, go without a body, one step of airtime shorter: a length that no
body has marks them, and in the place of the kind stand the low four bits of the message's number; its fifth bit and which order it is
stand in the length. (Hold: the kind of a state, and the low four bits in the length. So goes an arming that is said twice, with other bits
of the length set.) So goes the vessel's answer to one of them when it says no more than "accepted": which state of the plan stands where
the order stood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from ..session import LOW, Pairing, Session
from .wire import (
    BRIEF_AIMS,
    BRIEF_ARM,
    BRIEF_FROM,
    BRIEF_HOLD,
    BRIEF_ORDERS,
    HEAD_BYTES,
    MAX_BODY,
    MAX_FRAME,
    OVERHEAD,
    TAG_BYTES,
    Kind,
)

STOPS: Final = frozenset((Kind.STOP, Kind.SAFE))
"""Kinds with a count of their own instead of the clock: its upper eight bits are the first byte of the body."""
BRIEF_REPLY_BYTES: Final = 2
_STATES: Final = (Kind.KEY, Kind.DELTA)
"""No state goes to the vessel: so a Hold is marked, and an arming that is said twice. Which of them tells the fifth bit of the number."""
_SECOND: Final = 32
"""The length's other bits there: 0, the number's low four and 0 are a Hold; 0, these and 1 the first saying; 1, 0 and these the second."""
_KINDS: Final = {kind.value: kind for kind in Kind}


class Saying(Enum):
    """Which one of an order's sayings a frame is."""

    ONLY = "only"
    FIRST = "first of two"
    SECOND = "second of two"


@dataclass(frozen=True, slots=True)
class RadioFrame:
    """One authentic frame."""

    kind: Kind
    body: bytes
    counter: int
    is_brief: bool = False
    """It came without a body: of the message's number five bits are known; an answer tells only what it changed."""
    saying: Saying = Saying.ONLY


def _head(kind: Kind, size: int, low: int) -> bytes:
    return (kind << 12 | size << 6 | low).to_bytes(HEAD_BYTES, "big")


def is_brief(kind: Kind, payload: bytes) -> bool:
    """Whether a message of such a payload goes without a body."""
    return kind is Kind.ORDER and payload in BRIEF_AIMS


def is_brief_reply(kind: Kind, body: bytes) -> bool:
    """Whether an answer goes without a body: "accepted" and a state of the plan are all that it says."""
    return kind is Kind.REPLY and len(body) == BRIEF_REPLY_BYTES and not body[0] & 7


def frame_bytes(kind: Kind, body: bytes) -> int:
    """Size of the frame that carries a body."""
    return (
        OVERHEAD if is_brief(kind, body[1:]) or is_brief_reply(kind, body) else OVERHEAD + len(body) + (kind in STOPS)
    )


def _covered(kind: Kind, body: bytes, low: int, saying: Saying) -> bytes:
    """What goes out in front of the tag."""
    if is_brief_reply(kind, body):
        return _brief_head(body[0] >> 3, body[1], low)
    if is_brief(kind, body[1:]):
        if body[1:] == BRIEF_HOLD or saying is not Saying.ONLY:
            number = body[0] & 15
            size = _SECOND | number if saying is Saying.SECOND else number << 1 | (saying is Saying.FIRST)
            return _head(_STATES[body[0] >> 4 & 1], size, low)
        return _brief_head(body[0], BRIEF_ORDERS.index(body[1:]), low)
    return _head(kind, len(body), low) + body


def _brief_head(number: int, which: int, low: int) -> bytes:
    size = BRIEF_FROM | (number >> 4 & 1) << 2 | which
    return ((number & 15) << 12 | size << 6 | low).to_bytes(HEAD_BYTES, "big")


def _brief_body(kind: Kind, head: int) -> bytes:
    """The body that a frame without one stands for."""
    size = head >> 6 & 63
    number, which = head >> 12 | (size >> 2 & 1) << 4, size & 3
    return bytes((number << 3, which)) if kind is Kind.REPLY else bytes((number,)) + BRIEF_ORDERS[which]


def _marked(head: int, counter: int) -> RadioFrame:
    """The order that the kind of a state marks."""
    size, high = head >> 6 & 63, (head >> 12 == _STATES[1]) << 4
    if size & _SECOND:
        return RadioFrame(Kind.ORDER, bytes((size & 15 | high,)) + BRIEF_ARM, counter, True, Saying.SECOND)
    number = bytes((size >> 1 | high,))
    if size & 1:
        return RadioFrame(Kind.ORDER, number + BRIEF_ARM, counter, True, Saying.FIRST)
    return RadioFrame(Kind.SAFE, number + BRIEF_HOLD, counter, True)


class Sealer:
    """Makes frames of one direction. ``tag_bytes`` is less than 5 only where the security itself is measured."""

    def __init__(self, pairing: Pairing, *, tag_bytes: int = TAG_BYTES) -> None:
        self._pairing = pairing
        self._tag_bytes = tag_bytes
        self.counter = -1
        """Of the last frame."""

    def seal(self, kind: Kind, body: bytes, now_us: int, session: Session, saying: Saying = Saying.ONLY) -> bytes:
        """Make the next frame of a session; ``saying``: of an arming. Raises ValueError for a body that is too long."""
        if kind in STOPS:
            self.counter = session.next_stop()
            body = bytes((self.counter // LOW & 0xFF,)) + body
        else:
            self.counter = session.next_tick(now_us)
        if len(body) > MAX_BODY:
            raise ValueError(f"a body has at most {MAX_BODY} bytes, not {len(body)}")
        covered = _covered(kind, body, self.counter % LOW, saying)
        pairing = self._pairing
        return covered + pairing.witness.made(
            lambda: session.tag(pairing.outward, kind, self.counter, covered, self._tag_bytes)
        )

    def hello(self, body: bytes, proof: bytes) -> bytes:
        """Make a HELLO."""
        covered = _head(Kind.HELLO, len(body), 0) + body
        pairing = self._pairing
        return covered + pairing.witness.made(
            lambda: pairing.hello_tag(pairing.outward, covered, proof, self._tag_bytes)
        )


class Opener:
    """Finds the authentic frames of one direction in a byte stream. Holds less than one frame between calls."""

    def __init__(self, pairing: Pairing, *, tag_bytes: int = TAG_BYTES) -> None:
        self._pairing = pairing
        self._tag_bytes = tag_bytes
        self._overhead = HEAD_BYTES + tag_bytes
        self._brief_kind = Kind.ORDER if pairing.is_vessel else Kind.REPLY
        self._buffer = b""
        self.good = 0
        self.strange_bytes = 0
        """Bytes that belong to no good frame."""
        self.trials = 0
        """Tags computed and compared, by which a frame may be believed."""
        self.namesakes = 0
        """Greetings of another vessel under this one's key and number."""
        self.on_good: Callable[[int, int], None] = lambda size, now_us: None
        """Told of each good frame: its bytes, and the time."""

    def receive(self, data: bytes, now_us: int) -> list[RadioFrame]:
        """Take bytes as read; return the good frames that they complete."""
        buffer = self._buffer + data
        seen = len(self._buffer)
        frames: list[RadioFrame] = []
        at = 0
        while len(buffer) - at >= self._overhead:
            head = int.from_bytes(buffer[at : at + HEAD_BYTES], "big")
            size = self._overhead + (0 if self._is_brief(head) else head >> 6 & 63)
            # a candidate that was whole at the last call was tried then
            whole = at + size <= len(buffer) and (at + size > seen or bool(frames))
            frame = self._open(buffer[at : at + size], now_us) if whole and size <= MAX_FRAME else None
            if frame is None:
                at += 1
                continue
            frames.append(frame)
            self.on_good(size, now_us)
            self.strange_bytes += at
            buffer = buffer[at + size :]
            at = 0
        keep = min(len(buffer), MAX_FRAME - 1)
        self.strange_bytes += len(buffer) - keep
        self._buffer = buffer[len(buffer) - keep :]
        self.good += len(frames)
        return frames

    def _is_brief(self, head: int) -> bool:
        return (head >> 6 & 63) >= BRIEF_FROM or self._is_marked(head)

    def _is_marked(self, head: int) -> bool:
        return self._pairing.is_vessel and head >> 12 in _STATES and head >> 6 & 63 < BRIEF_FROM

    def _open(self, raw: bytes, now_us: int) -> RadioFrame | None:
        head = int.from_bytes(raw[:HEAD_BYTES], "big")
        brief = self._is_brief(head)
        kind = self._brief_kind if brief else _KINDS.get(head >> 12)
        if kind is None or (self._is_marked(head) and head >> 6 & 48 == 48):
            return None
        covered, tag = raw[: -self._tag_bytes], raw[-self._tag_bytes :]
        if kind is Kind.HELLO:
            return self._hello(covered, tag, now_us)
        for session in self._pairing.sessions:
            counter = self._counter(session, kind, head % LOW, covered, now_us)
            if counter is None:
                continue
            if self._is_right(session, kind, counter, covered, tag):
                self._pairing.believed(session, kind in STOPS, counter, len(raw), now_us)
                if self._is_marked(head):
                    return _marked(head, counter)
                body = _brief_body(kind, head) if brief else covered[HEAD_BYTES + (kind in STOPS) :]
                return RadioFrame(kind, body, counter, brief)
        return None

    def _is_right(self, session: Session, kind: Kind, counter: int, covered: bytes, tag: bytes) -> bool:
        self.trials += 1
        pairing = self._pairing
        return pairing.witness.verdict(
            lambda: session.tag(pairing.inward, kind, counter, covered, self._tag_bytes) == tag
        )

    @staticmethod
    def _counter(session: Session, kind: Kind, low: int, covered: bytes, now_us: int) -> int | None:
        """The one counter that the bits may stand for; None when a frame with it could not be believed."""
        if kind not in STOPS:
            return session.tick_of(low, len(covered) + TAG_BYTES, now_us)
        return session.stop_of(covered[HEAD_BYTES] * LOW + low) if len(covered) > HEAD_BYTES else None

    def _hello(self, covered: bytes, tag: bytes, now_us: int) -> RadioFrame | None:
        pairing = self._pairing
        proof = pairing.proof_of(covered[HEAD_BYTES:])
        if proof is None:
            self.namesakes += pairing.is_namesake(covered[HEAD_BYTES:], covered, tag)
            return None
        self.trials += 1
        size = self._tag_bytes
        if not pairing.witness.verdict(lambda: pairing.hello_tag(pairing.inward, covered, proof, size) == tag):
            return None
        pairing.greeted(covered[HEAD_BYTES:], len(covered) + TAG_BYTES, now_us)
        return RadioFrame(Kind.HELLO, covered[HEAD_BYTES:], 0)
