"""How an end of the compact link speaks: it seals a frame, keeps to the hour, and knows until when its own frame is on the air."""

from __future__ import annotations

from collections.abc import Callable

from .air.ledger import Ledger, Priority
from .air.pacing import AirClock
from .air.profile import RadioProfile
from .codec.frames import Saying, Sealer, frame_bytes
from .codec.wire import Kind
from .hello import HELLO_FRAME_BYTES, SHOWN_BYTES, Greeting, kept_us
from .session import Pairing, Session


class RadioVoice:
    """One end's transmitter. ``spent`` is called when the hour should be written down."""

    def __init__(self, profile: RadioProfile, pairing: Pairing, ledger: Ledger, spent: Callable[[int], None]) -> None:
        self._profile = profile
        self._pairing = pairing
        self._sealer = Sealer(pairing)
        self._spent = spent
        self.ledger = ledger
        self.clock = AirClock(profile)
        self.bytes_out = 0
        self.shows: Callable[[], bytes] = bytes
        """The body of the state that goes behind a HELLO; empty for none."""

    @property
    def counter(self) -> int:
        """Of the last frame."""
        return self._sealer.counter

    def may(self, size: int, priority: Priority, now_us: int) -> bool:
        """Whether the hour has room for a frame of so many bytes."""
        return self.ledger.allows(self._profile.airtime_us(size), priority, now_us)

    def send(
        self,
        kind: Kind,
        body: bytes,
        priority: Priority,
        now_us: int,
        *,
        session: Session | None = None,
        saying: Saying = Saying.ONLY,
    ) -> bytes:
        """The frame, of ``session`` or of the one that counts; b"" when there is none or the hour has no room."""
        session = session or self._pairing.current
        if session is None or not self.may(frame_bytes(kind, body), priority, now_us):
            return b""
        frame = self._sealer.seal(kind, body, now_us, session, saying)
        self._went_out(frame, now_us)
        return frame

    def hello(self, greeting: Greeting, priority: Priority, now_us: int) -> bytes:
        """The HELLO that is due, b"" when the hour has no room; to who has just started the vessel shows itself in the same packet, where
        that leaves room for the answer to an order.
        """
        hello_us = self._profile.airtime_us(HELLO_FRAME_BYTES)
        if not self.ledger.allows(hello_us + kept_us(self._profile) * greeting.is_idle, priority, now_us):
            return b""
        body, proven = self._pairing.hello(now_us, please=greeting.please, proof=greeting.proof)
        frame = self._sealer.hello(body, proven)
        session = self._pairing.rival or self._pairing.current
        shown_us = self._profile.airtime_us(HELLO_FRAME_BYTES + SHOWN_BYTES) + self._profile.stop_us
        if proven and session is not None and self.ledger.allows(shown_us, Priority.EVENT, now_us):
            state = self.shows()
            frame += self._sealer.seal(Kind.KEY, state, now_us, session) if state else b""
        self._went_out(frame, now_us)
        return frame

    def foreign(self, frame: bytes, now_us: int) -> bytes:
        """A frame that is not of this format, when the air is ours and the hour has room for it; else b""."""
        if not self.clock.is_free(now_us) or not self.may(len(frame), Priority.EVENT, now_us):
            return b""
        self._went_out(frame, now_us)
        return frame

    def _went_out(self, frame: bytes, now_us: int) -> None:
        self.bytes_out += len(frame)
        self.clock.sent(len(frame), now_us)
        self.ledger.charge(self._profile.airtime_us(len(frame)), self.clock.off_us)
        if self.ledger.should_be_saved:
            self._spent(now_us)
