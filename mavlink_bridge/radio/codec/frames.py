"""Frames of the compact link: found without sync bytes, believed only with the right authentication tag.

Frame = 2 bytes (4 bits kind, 6 bits body length, 6 bits of the counter), body of 0...56 bytes, 4 bytes of keyed
BLAKE2s over direction, whole counter, head and body. The receiver tries every offset, so garbage, merged and split
pieces do no harm. The counter is rebuilt from its six bits and the last good one, must grow, and outlives restarts: a
replay is refused. HELLO carries the counter whole, for when an end was away.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from hashlib import blake2s
from typing import Final

TAG_BYTES: Final = 4
HEAD_BYTES: Final = 2
OVERHEAD: Final = HEAD_BYTES + TAG_BYTES
MAX_BODY: Final = 56
MAX_FRAME: Final = MAX_BODY + OVERHEAD
KEY_BYTES: Final = 32
COUNTER_BYTES: Final = 5
_WINDOW: Final = 64
_OLD: Final = 256
"""A HELLO so far behind is of an end that has lost its memory, or a recording; one that is less will catch up by itself."""
_EPOCHS: Final = 2
"""How many times 64 frames may be lost in a row before only a HELLO brings the ends together again."""


class Kind(IntEnum):
    """What a frame is."""

    HELLO = 0
    """Whole counter (5 bytes), flags."""
    KEY = 1
    DELTA = 2
    BATCH = 3
    EVENT = 4
    PLAN = 5
    """Id, and a whole plan."""
    ORDER = 6
    """Id, and a request."""
    PIECE = 7
    """Id, row of the erasure code, count and flags, part of a longer message."""
    MISSING = 8
    """Id, number of pieces that have arrived."""
    REPLY = 9
    """Id and result, reason."""
    BEACON = 10
    INFO = 11
    STOP = 12
    """Id, and a request that makes the vessel stop: goes before everything else."""
    TEXT = 14


_KINDS: Final = {kind.value: kind for kind in Kind}


class Direction(IntEnum):
    """Part of what the tag covers, so that no frame can be sent back to its sender."""

    TO_VESSEL = 0
    TO_SHORE = 1


@dataclass(frozen=True, slots=True)
class Frame:
    """One authentic frame."""

    kind: Kind
    body: bytes
    counter: int


def check_key(key: bytes) -> bytes:
    """Return the key. Raises ValueError unless it has 32 bytes that are not all the same."""
    if len(key) != KEY_BYTES or len(set(key)) < 2:
        raise ValueError("a radio key is 32 random bytes; make one with 'companion keys'")
    return key


def name_of_key(key: bytes) -> str:
    """A few signs that tell keys apart and do not give them away."""
    return blake2s(digest_size=4, key=check_key(key), person=b"keyname").hexdigest()


def _tag(key: bytes, direction: Direction, counter: int, covered: bytes) -> bytes:
    data = bytes((direction,)) + counter.to_bytes(8, "big") + covered
    return blake2s(data, digest_size=TAG_BYTES, key=key, person=b"usvradio").digest()


class Sealer:
    """Makes frames of one direction. ``counter`` is the last one used."""

    def __init__(self, key: bytes, direction: Direction, counter: int = 0) -> None:
        self._key = check_key(key)
        self._direction = direction
        self.counter = counter

    def seal(self, kind: Kind, body: bytes) -> bytes:
        """Make the next frame. Raises ValueError for a body of more than 56 bytes."""
        if len(body) > MAX_BODY:
            raise ValueError(f"a body has at most {MAX_BODY} bytes, not {len(body)}")
        self.counter += 1
        head = kind << 12 | len(body) << 6 | self.counter % _WINDOW
        covered = head.to_bytes(HEAD_BYTES, "big") + body
        return covered + _tag(self._key, self._direction, self.counter, covered)

    def hello(self, flags: int) -> bytes:
        """Make a HELLO, which is believed however far the counters are apart."""
        return self.seal(Kind.HELLO, (self.counter + 1).to_bytes(COUNTER_BYTES, "big") + bytes((flags,)))


class Opener:
    """Finds the authentic frames of one direction in a byte stream. Holds less than one frame between calls."""

    def __init__(self, key: bytes, direction: Direction, counter: int = 0) -> None:
        self._key = check_key(key)
        self._direction = direction
        self._buffer = b""
        self.counter = counter
        """Of the newest good frame."""
        self.good = 0
        self.strange_bytes = 0
        """Bytes that belong to no good frame."""
        self.old_hellos = 0
        """HELLOs with the right key and a counter of long ago."""

    def receive(self, data: bytes) -> list[Frame]:
        """Take bytes as read; return the good frames that they complete."""
        buffer = self._buffer + data
        seen = len(self._buffer)
        frames: list[Frame] = []
        at = 0
        while len(buffer) - at >= OVERHEAD:
            size = OVERHEAD + (int.from_bytes(buffer[at : at + 2], "big") >> 6 & 63)
            # a candidate that was whole at the last call was tried then
            whole = at + size <= len(buffer) and (at + size > seen or bool(frames))
            frame = self._open(buffer[at : at + size]) if whole and size <= MAX_FRAME else None
            if frame is None:
                at += 1
                continue
            frames.append(frame)
            self.strange_bytes += at
            buffer = buffer[at + size :]
            at = 0
        keep = min(len(buffer), MAX_FRAME - 1)
        self.strange_bytes += len(buffer) - keep
        self._buffer = buffer[len(buffer) - keep :]
        self.good += len(frames)
        return frames

    def _open(self, raw: bytes) -> Frame | None:
        head = int.from_bytes(raw[:HEAD_BYTES], "big")
        number = head >> 12
        kind = _KINDS.get(number)
        if kind is None:
            return None
        covered, tag = raw[:-TAG_BYTES], raw[-TAG_BYTES:]
        for counter in self._candidates(kind, head % _WINDOW, covered):
            if _tag(self._key, self._direction, counter, covered) == tag:
                if counter <= self.counter:
                    self.old_hellos += counter + _OLD < self.counter
                    return None
                self.counter = counter
                return Frame(kind, covered[HEAD_BYTES:], counter)
        return None

    def _candidates(self, kind: Kind, low: int, covered: bytes) -> list[int]:
        """Counters that the six bits may stand for: newer than the last good one; a HELLO's is what it states."""
        first = self.counter + 1 + (low - self.counter - 1) % _WINDOW
        if kind is not Kind.HELLO:
            return [first + _WINDOW * epoch for epoch in range(_EPOCHS)]
        stated = int.from_bytes(covered[HEAD_BYTES : HEAD_BYTES + COUNTER_BYTES], "big")
        return [stated] if stated % _WINDOW == low else []
