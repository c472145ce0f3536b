"""Sessions of the compact link: who is at the other end *now*, and which of his frames are of now.

Each start of an end draws a nonce. The keys of a session are made of the radio key, the vessel's system id and the nonces
of both ends, one key for each direction and purpose: what was recorded of any other start, boat, direction or purpose has
the wrong key. Within a session the counter of a frame is the vessel's clock in eighths of a second: the vessel knows it,
the shore has it from what it hears. A frame that comes later than it can have taken is not believed, so an order that was
held back dies unheard. The shore can only be made to think the vessel's clock *behind*, which kills orders and revives
none. Stops have a count instead and do not age: a stop of the live session is always obeyed.

A HELLO alone never ends a session. Whoever greets gets the second place; a frame of his session, which nobody else can
make, moves him to the first, and then the old one has the second, so that a greeting recorded earlier costs nobody his place.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from hashlib import blake2s
from typing import Final

from ..language.witness import Witness
from .air import RadioProfile
from .codec.wire import VERSION, Kind

KEY_BYTES: Final = 32
NONCE_BYTES: Final = 6
"""A start repeats one of a thousand recorded ones once in 2.8e11."""
TICK_US: Final = 125_000
"""Less than the shortest frame with the least pause after it, so that the clock gives each its own counter."""
LOW: Final = 64
"""Six bits of a counter are sent: 8 s of the clock."""
SLACK_US: Final = 1_500_000
"""What a frame may take more than computed: slow modules on both ways, ticks, and the error of the clock."""
_AHEAD_US: Final = 3_000_000
"""So far the shore's idea of the vessel's clock may lag."""
_EARLY_US: Final = 500_000
"""So far the vessel bears that it leads: quartz, and counters that had to go on."""
_STOP_COUNTS: Final = 1 << 14
_BUCKET_US: Final = 600_000_000
"""The best of so long a time tells the other end's clock; two quartzes part by 0.1 s in it."""


class RadioDirection(IntEnum):
    """Part of the keys, so that no frame can be sent back to its sender."""

    TO_VESSEL = 0
    TO_SHORE = 1


class Purpose(IntEnum):
    """Part of the keys: what has leave to move the boat shares none with what only tells."""

    ORDER = 0
    STOP = 1
    TELEMETRY = 2


_PURPOSES: Final = {
    Kind.KEY: Purpose.TELEMETRY,
    Kind.DELTA: Purpose.TELEMETRY,
    Kind.BATCH: Purpose.TELEMETRY,
    Kind.EVENT: Purpose.TELEMETRY,
    Kind.TEXT: Purpose.TELEMETRY,
    Kind.POSITION: Purpose.TELEMETRY,
    Kind.STOP: Purpose.STOP,
    Kind.SAFE: Purpose.STOP,
}
"""All others are orders, or belong to their exchange."""


def check_key(key: bytes) -> bytes:
    """Return the key. Raises ValueError unless it has 32 bytes that are not all the same."""
    if len(key) != KEY_BYTES or len(set(key)) < 2:
        raise ValueError("a radio key is 32 random bytes; make one with 'companion keys'")
    return key


class OwnClock:
    """The vessel's clock aboard."""

    ahead_us: Final = _EARLY_US

    @property
    def is_known(self) -> bool:
        return True

    def at_us(self, now_us: int) -> int:
        """The vessel's time."""
        return now_us

    def told(self, vessel_us: int, now_us: int) -> None:
        """It needs nobody to tell it."""


class HeardClock:
    """The vessel's clock as the shore knows it: never ahead of it, but for the two quartzes."""

    ahead_us: Final = _AHEAD_US

    def __init__(self) -> None:
        self._best: deque[tuple[int, int]] = deque(maxlen=2)
        """Begin of each span of time, and the largest offset heard in it."""

    @property
    def is_known(self) -> bool:
        return bool(self._best)

    def at_us(self, now_us: int) -> int:
        """The vessel's time; 0 before the first word."""
        return now_us + max(offset_us for _, offset_us in self._best) if self._best else 0

    def told(self, vessel_us: int, now_us: int) -> None:
        """It was at least ``vessel_us`` when what arrived now left. What came soonest counts; what was delayed says too little."""
        offset_us = vessel_us - now_us
        if not self._best or now_us - self._best[-1][0] > _BUCKET_US:
            self._best.append((now_us, offset_us))
        else:
            since_us, best_us = self._best[-1]
            self._best[-1] = since_us, max(best_us, offset_us)


Clock = OwnClock | HeardClock


@dataclass(slots=True, kw_only=True)
class Session:
    """One start of the vessel with one start of the shore."""

    key: bytes
    system_id: int
    other: bytes
    """Nonce of the other end."""
    nonces: bytes
    """The vessel's, then the shore's."""
    clock: Clock
    span_us: Callable[[int], int]
    """What a frame of so many bytes takes from the write to the end on the air."""
    version: int = VERSION
    """Of the other end."""
    heard_us: int | None = None
    """When its last frame came; the other end has then proved to know both nonces."""
    since_us: int = 0
    """When the other end greeted first."""
    tick_in: int = -1
    stop_in: int = -1
    tick_out: int = -1
    stop_out: int = -1
    _keys: dict[tuple[RadioDirection, Purpose], bytes] = field(default_factory=dict)

    def tag(self, direction: RadioDirection, kind: Kind, counter: int, covered: bytes, size: int) -> bytes:
        """The tag of a frame of this session."""
        which = direction, _PURPOSES.get(kind, Purpose.ORDER)
        key = self._keys.get(which)
        if key is None:
            data = bytes((self.system_id, *which)) + self.nonces
            key = self._keys[which] = blake2s(data, key=self.key, person=b"usvsessn").digest()
        return blake2s(counter.to_bytes(8, "big") + covered, digest_size=size, key=key, person=b"usvframe").digest()

    def next_tick(self, now_us: int) -> int:
        """Counter of the next frame that ages."""
        self.tick_out = max(self.clock.at_us(now_us) // TICK_US, self.tick_out + 1)
        return self.tick_out

    def next_stop(self) -> int:
        """Count of the next stop."""
        self.stop_out += 1
        return self.stop_out

    def tick_of(self, low: int, size: int, now_us: int) -> int | None:
        """The counter behind six bits; None when it is not newer than the last, or the frame of ``size`` bytes too old."""
        vessel_us = self.clock.at_us(now_us)
        newest = (vessel_us + self.clock.ahead_us) // TICK_US
        counter = newest - (newest - low) % LOW
        is_late = vessel_us - (counter + 1) * TICK_US > self.span_us(size) + SLACK_US
        return None if is_late or counter <= self.tick_in else counter

    def stop_of(self, low: int) -> int:
        """The count behind fourteen bits: newer than the last."""
        first = self.stop_in + 1
        return first + (low - first) % _STOP_COUNTS


@dataclass(frozen=True, slots=True)
class Hello:
    """Frozen for all versions. 4 bits version, 4 bits flags; nonce; of the vessel its clock in ticks, 4 bytes."""

    nonce: bytes
    please: bool
    """An answer is asked for."""
    proof: bool
    """The tag covers the other end's nonce: this is an answer."""
    tick: int | None
    version: int = VERSION

    @property
    def body(self) -> bytes:
        tick = b"" if self.tick is None else (self.tick & 0xFFFF_FFFF).to_bytes(4, "big")
        return bytes((self.version << 4 | self.please << 3 | self.proof << 2,)) + self.nonce + tick

    @classmethod
    def read(cls, body: bytes) -> Hello:
        """The body of a HELLO that is long enough."""
        tick = int.from_bytes(body[1 + NONCE_BYTES :], "big") if len(body) > 1 + NONCE_BYTES else None
        return cls(body[1 : 1 + NONCE_BYTES], bool(body[0] & 8), bool(body[0] & 4), tick, body[0] >> 4)


class Pairing:
    """One end's nonce and its sessions with the other end: the one that counts, and the one that may replace it."""

    def __init__(
        self,
        key: bytes,
        system_id: int,
        outward: RadioDirection,
        nonce: bytes,
        profile: RadioProfile,
        *,
        witness: Witness | None = None,
    ) -> None:
        if len(nonce) != NONCE_BYTES:
            raise ValueError(f"a nonce has {NONCE_BYTES} bytes")
        self._key = check_key(key)
        self.witness = witness or Witness()
        self.system_id = system_id
        self.outward = outward
        self.inward = RadioDirection.TO_VESSEL if outward is RadioDirection.TO_SHORE else RadioDirection.TO_SHORE
        self.nonce = nonce
        self.own_version = VERSION
        self.current: Session | None = None
        self.rival: Session | None = None
        self._profile = profile

    @property
    def is_vessel(self) -> bool:
        return self.outward is RadioDirection.TO_SHORE

    @property
    def sessions(self) -> tuple[Session, ...]:
        """In the order in which a frame is tried."""
        return tuple(session for session in (self.current, self.rival) if session is not None)

    def session_with(self, other: bytes) -> Session | None:
        """The session with that start of the other end; None when it is over."""
        return next((session for session in self.sessions if session.other == other), None)

    @property
    def other(self) -> bytes | None:
        """The start of the other end that counts."""
        return None if self.current is None else self.current.other

    @property
    def version(self) -> int | None:
        """Radio format of the other end, None while it has not been heard."""
        session = self.current or self.rival
        return None if session is None else session.version

    @property
    def is_foreign(self) -> bool:
        """Whether the other end is of another version, so that only what is frozen is understood."""
        return self.version not in (None, self.own_version)

    def hello(self, now_us: int, *, please: bool, proof: bool) -> tuple[bytes, bytes]:
        """Body of our HELLO, and the nonce that its tag covers."""
        answered = self.rival or self.current
        proven = answered.other if proof and answered is not None else b""
        tick = now_us // TICK_US if self.is_vessel else None
        return Hello(self.nonce, please, bool(proven), tick, self.own_version).body, proven

    def hello_tag(self, direction: RadioDirection, covered: bytes, proof: bytes, size: int) -> bytes:
        """The tag of a HELLO, under the radio key itself. ``proof``: the other end's nonce where it answers it, else empty."""
        data = bytes((direction, self.system_id)) + proof + covered
        return blake2s(data, digest_size=size, key=self._key, person=b"usvhello").digest()

    def proof_of(self, body: bytes) -> bytes | None:
        """What the tag of the other end's HELLO has to cover; None for what is no HELLO."""
        if len(body) != 1 + NONCE_BYTES + (0 if self.is_vessel else 4):
            return None
        return self.nonce if body[0] & 4 else b""

    def is_namesake(self, body: bytes, covered: bytes, tag: bytes) -> bool:
        """Whether another vessel greets under our key and number. Not our own echo, and not what only looks like a greeting."""
        if not self.is_vessel or len(body) != 1 + NONCE_BYTES + 4 or body[0] & 3 or Hello.read(body).version != VERSION:
            return False
        if Hello.read(body).nonce == self.nonce:
            return False
        proofs = [session.other for session in self.sessions] if Hello.read(body).proof else [b""]
        return self.witness.verdict(
            lambda: any(self.hello_tag(self.outward, covered, proof, len(tag)) == tag for proof in proofs)
        )

    def greeted(self, body: bytes, size: int, now_us: int) -> None:
        """An authentic HELLO, perhaps an old one: it makes a session, and is believed no further while another one counts."""
        hello = Hello.read(body)
        session = self.session_with(hello.nonce)
        if session is None:
            session = self.rival = self._session(hello.nonce, now_us)
        session.version = hello.version
        if hello.tick is not None:
            session.clock.told(hello.tick * TICK_US + self._profile.span_us(size), now_us)
        if self.current is None and hello.proof:
            self._promote(session)

    def _session(self, other: bytes, now_us: int) -> Session:
        nonces = self.nonce + other if self.is_vessel else other + self.nonce
        clock: Clock = OwnClock() if self.is_vessel else HeardClock()
        span_us = self._profile.span_us
        return Session(
            key=self._key,
            system_id=self.system_id,
            other=other,
            nonces=nonces,
            clock=clock,
            span_us=span_us,
            since_us=now_us,
        )

    def believed(self, session: Session, is_stop: bool, counter: int, size: int, now_us: int) -> None:
        """A frame of a session was right: it is of now, and its sender knows both nonces."""
        if is_stop:
            session.stop_in = counter
        else:
            session.tick_in = counter
            session.clock.told(counter * TICK_US + self._profile.span_us(size), now_us)
        session.heard_us = now_us
        if session is not self.current:
            self._promote(session)

    def _promote(self, session: Session) -> None:
        self.rival = self.current
        self.current = session

    def to_speak(self, tries: int) -> Session | None:
        """The session for a message of ours: while it is open whether the other end has started anew, each in turn."""
        rival = self.rival
        if rival is None or not rival.clock.is_known:
            return self.current
        if self.current is None:
            return rival
        is_open = self.current.heard_us is None or self.current.heard_us <= rival.since_us
        return rival if is_open and tries % 2 == 0 else self.current
