"""One end of the compact link: what to send next, and what the other end said. Both ends run this; they differ in what
they say.

Answers go first, then stops, orders, events, states, bulk, each within its share of the hour. After a question the
end listens until the answer is overdue; after each frame of its own making it leaves the air to the other end for as
long as a stop would take. All randomness comes in from outside.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Container
from dataclasses import dataclass
from typing import Final

from ..language.requests import Reply, Result
from . import memory as memory_of
from .air import AirClock, Ledger, Priority, RadioProfile
from .air.rhythm import Rhythm
from .codec.frames import Direction, Frame, Kind, Opener, Sealer, name_of_key
from .hello import HELLO_FRAME_BYTES, SESSIONS, Greeting
from .patience import Patience
from .transfer import Inbox, Message, Outcome, Outgoing, cut, read_reply

MAX_OUTGOING: Final = 16
_MAX_POSTED: Final = 16
_REASON_BYTES: Final = 40
_RELIABLE: Final = frozenset((Kind.PLAN, Kind.ORDER, Kind.STOP, Kind.INFO))
_QUIET_PIECES: Final = 6
_AFTER_ANSWER: Final = 3
_VESSEL_PAUSE_US: Final = 1_500_000


@dataclass(slots=True)
class _Posted:
    kind: Kind
    body: bytes
    priority: Priority


class CompactLink:
    """Frames in and out for one end. ``save`` is called with a text to keep for the next start; ``memory`` is that text."""

    def __init__(
        self,
        profile: RadioProfile,
        key: bytes,
        outward: Direction,
        rng: random.Random,
        *,
        memory: str = "",
        save: Callable[[str], None] | None = None,
        now_us: int = 0,
        ledger: Ledger | None = None,
    ) -> None:
        self.profile = profile
        inward = Direction.TO_VESSEL if outward is Direction.TO_SHORE else Direction.TO_SHORE
        self.ledger = ledger or Ledger(profile.hour_us)
        self.clock = AirClock(profile)
        self._patience = Patience(profile, self.clock, rng)
        self.inbox = Inbox(round(profile.link.upload_s * 1e6))
        self.heard_us: int | None = None
        """When the last authentic frame came."""
        self.frames_out = self.bytes_out = 0
        self.last_posted: tuple[int, bytes] | None = None
        """Counter and body of the posted frame that went out last."""
        self._key_name = name_of_key(key)
        self._sealer = Sealer(key, outward)
        self.opener = Opener(key, inward)
        self._save = save or (lambda text: None)
        self._is_vessel = outward is Direction.TO_SHORE
        self._next_id = rng.randrange(256)
        self._outgoing: list[Outgoing] = []
        self._answers: deque[_Posted] = deque(maxlen=_MAX_POSTED)
        self._posted: deque[_Posted] = deque(maxlen=_MAX_POSTED)
        self._outcomes: list[Outcome] = []
        self._listen_until_us = self._hold_answers_us = 0
        self.rhythm: Rhythm | None = None
        """The other end's grid of states, where it keeps one."""
        self._greeting = Greeting(profile, rng, now_us)
        self._heard_ceiling = 0
        self._restore(memory, now_us)

    def _remember(self, now_us: int) -> None:
        self._ceiling = self._sealer.counter + memory_of.CEILING
        if self.heard_us is not None:
            self._heard_ceiling = self.opener.counter + memory_of.HEARD_AHEAD
        self._write(self._ceiling, self._heard_ceiling, now_us)

    def _write(self, tx: int, rx: int, now_us: int) -> None:
        greeting = self._greeting
        kept = memory_of.Kept(tx, rx, self._next_id, greeting.session, greeting.other_session)
        self._save(memory_of.write(kept, self.inbox, self.ledger, now_us, self._key_name))

    def close(self, now_us: int) -> None:
        """Keep for the next start what was used and heard, and no reserve."""
        self._write(self._sealer.counter, self.opener.counter, now_us)

    def _restore(self, memory: str, now_us: int) -> None:
        """Take over the last run's counters, answers and airtime."""
        kept = memory_of.read(memory, self.inbox, self.ledger, now_us, self._key_name)
        if kept is not None:
            self._sealer.counter = kept.tx + memory_of.RESTART_GAP
            self.opener.counter = self._heard_ceiling = kept.rx
            self._next_id = kept.next_id % 256
            self._greeting.session = (kept.session + 1) % SESSIONS
            self._greeting.other_session = kept.other_session
        self._remember(now_us)

    # ---- in -----------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> list[Frame | Message]:
        """Take bytes as read; return new messages and the frames that need no answer. Never raises on input."""
        found: list[Frame | Message] = []
        old_hellos = self.opener.old_hellos
        for frame in self.opener.receive(data):
            self.heard_us = now_us
            self._greeting.authentic(self.opener.strange_bytes)
            item = self._sort(frame, now_us)
            if item is not None:
                found.append(item)
        if self.heard_us is not None and self.opener.counter > self._heard_ceiling - memory_of.HEARD_MARGIN:
            self._remember(now_us)
        if self.opener.old_hellos > old_hellos:
            self._greeting.unbelieved(self.heard_us, now_us)
        self._greeting.strange(self.opener.strange_bytes, self.heard_us, now_us)
        return found

    def _sort(self, frame: Frame, now_us: int) -> Frame | Message | None:
        kind = frame.kind
        if kind is Kind.HELLO:
            if self._greeting.heard(frame.body, now_us):
                self.inbox.forget()
                if self._greeting.is_due(now_us):
                    # it refuses what it may have heard before it started; the answer tells it the counter from now on
                    self._sealer.counter += memory_of.HEARD_AHEAD
                self._remember(now_us)
            for waiting in self._outgoing:
                waiting.next_us = min(waiting.next_us, now_us)
            return None
        if kind in (Kind.REPLY, Kind.MISSING):
            self._greeting.answered()
            (self._on_reply if kind is Kind.REPLY else self._on_missing)(frame.body, now_us)
            return None
        if kind in _RELIABLE or kind is Kind.PIECE:
            return self._on_message(frame, now_us)
        self._other_was_talking(now_us)
        return frame

    def _on_message(self, frame: Frame, now_us: int) -> Message | None:
        message: Message | None
        if frame.kind is Kind.PIECE:
            # complete before the sender asked: it still sends its reserve, and would not hear an answer now
            polled = len(frame.body) > 2 and frame.body[2] & 0x80
            self._hold_answers_us = now_us if polled else now_us + self._patience.longest_us()
            message, reply, account = self.inbox.piece(frame.body, now_us)
            if account is not None:
                self._answers.append(_Posted(Kind.MISSING, account, Priority.COMMAND))
            elif message is None and reply is None:
                # more pieces come: keep off the air for the longest one
                self._listen_until_us = now_us + self._patience.longest_us()
        else:
            message, reply = self.inbox.whole(frame.kind, frame.body)
        if reply is not None:
            stop = frame.kind is Kind.STOP
            self._answers.append(_Posted(Kind.REPLY, reply, Priority.STOP if stop else Priority.COMMAND))
        if message is not None:
            self._listen_until_us = max(self._listen_until_us, now_us + self._patience.turnaround_us)
        return message

    def _on_reply(self, body: bytes, now_us: int) -> None:
        found = read_reply(body)
        if found is None:
            return
        for item in self._outgoing:
            if item.id & 31 == found[0]:
                self._patience.learn(item, now_us)
                self._finish(item, found[1])
                return

    def _on_missing(self, body: bytes, now_us: int) -> None:
        for item in self._outgoing:
            if len(body) > 1 and item.id == body[0]:
                item.heard_account(body[1])
                item.next_us = now_us

    def _other_was_talking(self, now_us: int) -> None:
        """What we asked meanwhile was not heard, as the other end cannot hear while it talks: ask again at once."""
        for item in self._outgoing:
            if item.asked and now_us < item.next_us and self.clock.off_us < now_us:
                item.begin_round()
                item.next_us = now_us

    # ---- out ----------------------------------------------------------------------------------------------------

    def cost_us(self, kind: Kind, payload: bytes) -> int:
        """Airtime of a message without any repeat."""
        pieces = cut(kind, payload, self.profile.max_frame_bytes)
        extra = 7 if len(pieces) == 1 else 9
        return sum(self.profile.airtime_us(len(piece) + extra) for piece in pieces)

    def submit(self, kind: Kind, payload: bytes, priority: Priority, now_us: int, limit_us: int) -> int:
        """Send a message that must arrive; its outcome comes within ``limit_us``. Returns its number.

        Raises ValueError with the reason when it is too long, too much is waiting, or the hour has no room for it.
        """
        cost_us = self.cost_us(kind, payload)
        if not self.ledger.allows(cost_us, priority, now_us):
            raise ValueError(self.ledger.refusal(cost_us, priority, now_us, self.profile.band_rule.name))
        if len(self._outgoing) >= MAX_OUTGOING:
            raise ValueError("too many orders wait for the radio")
        pieces = cut(kind, payload, self.profile.max_frame_bytes)
        item = Outgoing(self._next_id, kind, pieces, priority, now_us + limit_us)
        self._next_id = (self._next_id + 1) % 256
        if priority <= Priority.COMMAND:
            self._greeting.hurry(now_us, was_silent=False)
        self._outgoing.append(item)
        self._outgoing.sort(key=lambda other: other.priority)
        return item.id

    def withdraw(self, numbers: Container[int], reply: Reply) -> None:
        """End messages of ours that nobody wants to arrive any more."""
        for item in [item for item in self._outgoing if item.id in numbers]:
            self._finish(item, reply)

    def post(self, kind: Kind, body: bytes, priority: Priority) -> None:
        """Send a frame that may be lost; a newer one of its kind replaces it, events aside."""
        if kind is not Kind.EVENT and kind is not Kind.TEXT:
            self._posted = deque((item for item in self._posted if item.kind is not kind), maxlen=_MAX_POSTED)
        self._posted.append(_Posted(kind, body, priority))

    @property
    def has_posted(self) -> bool:
        """Whether a posted frame still waits."""
        return bool(self._posted)

    def answer(self, number: int, reply: Reply, now_us: int) -> None:
        """Answer a message that came by ``receive``."""
        reason_bytes = min(_REASON_BYTES, self.profile.max_frame_bytes - 7) if self.profile.link.texts else 0
        found = self.inbox.answered(number, reply, reason_bytes)
        if found is None:
            return
        body, is_stop = found
        self._answers.append(_Posted(Kind.REPLY, body, Priority.STOP if is_stop else Priority.COMMAND))
        self._listen_until_us = min(self._listen_until_us, now_us)
        self._remember(now_us)

    def outcomes(self) -> list[Outcome]:
        """How messages of ours have ended since the last call."""
        found, self._outcomes = self._outcomes, []
        return found

    @property
    def other_session(self) -> int | None:
        """The start of the other end that its message numbers belong to."""
        return self._greeting.other_session

    @property
    def strange_bytes(self) -> int:
        """Bytes that belong to no authentic frame."""
        return self.opener.strange_bytes

    @property
    def waiting(self) -> int:
        """Messages that have no outcome yet."""
        return len(self._outgoing)

    def take(self, now_us: int) -> bytes:
        """The next frame when the air is ours, b"" otherwise."""
        self._expire(now_us)
        # the way of the next frame along the serial line counts as time off the air
        if not self.clock.is_free(now_us, lead_us=self._lead_us(now_us)):
            return b""
        for choose in (self._an_answer, self._a_hello, self._a_stop, self._a_message, self._a_posted):
            frame = choose(now_us)
            if frame:
                return frame
        return b""

    def _lead_us(self, now_us: int) -> int:
        size = 7
        if not self._answers and self._outgoing and now_us >= self._outgoing[0].next_us:
            size = self._outgoing[0].next_size()
        return round(size * self.profile.serial_byte_us)

    def _an_answer(self, now_us: int) -> bytes:
        if not self._answers or now_us < self._hold_answers_us:
            return b""
        first = self._answers.popleft()
        frame = self._send(first.kind, first.body, first.priority, now_us)
        if frame:
            # the question comes again when this answer is lost: nothing of ours may be in its way
            self._listen_until_us = self.clock.off_us + _AFTER_ANSWER * self._patience.longest_us()
        return frame

    def _a_hello(self, now_us: int) -> bytes:
        priority = min([Priority.COMMAND, *(item.priority for item in self._outgoing)])
        if not self._greeting.is_due(now_us) or not self._may(HELLO_FRAME_BYTES, priority, now_us):
            return b""
        frame = self._sealer.hello(self._greeting.flags)
        self._went_out(frame, now_us)
        self._listen()
        for item in self._outgoing:
            # who is answering does not hear
            item.next_us = max(item.next_us, self.clock.off_us + self._patience.hello_us())
        self._greeting.sent(now_us)
        return frame

    def _a_stop(self, now_us: int) -> bytes:
        return self._a_transfer([item for item in self._outgoing if item.priority is Priority.STOP], now_us)

    def _a_message(self, now_us: int) -> bytes:
        if now_us < self._listen_until_us or self._awaits_answer(now_us):
            return b""
        return self._a_transfer(self._outgoing, now_us)

    def _a_transfer(self, items: list[Outgoing], now_us: int) -> bytes:
        for item in list(items):
            if now_us < item.next_us:
                continue
            if not item.is_under_way and self._would_meet(item.next_size(), now_us):
                continue
            if item.asked:
                if item.tries == 1 and not item.greeted and self._greeting.hurry(now_us, was_silent=True):
                    item.greeted = True
                    return b""
                item.begin_round()
            kind, body = item.next_frame()
            frame = self._send(kind, body, item.priority, now_us)
            if not frame:
                self._finish(item, Reply(Result.FAILED, "the hour's airtime is used up"))
                continue
            if item.asked:
                late_us = max(now_us - item.off_us, 0) if item.tries > 1 else 0
                item.off_us, item.late_us = self.clock.off_us, late_us
                item.quiet_us = self.clock.off_us + self._patience.of(item)
                # the vessel's states go on between the tries of what it tells the shore
                item.next_us = item.quiet_us + (_VESSEL_PAUSE_US * min(item.tries, 4) if self._is_vessel else 0)
            elif self._is_vessel:
                item.next_us = self.clock.off_us + self._patience.answer_us()
            return frame
        return b""

    def _awaits_answer(self, now_us: int) -> bool:
        return any(item.asked and now_us < item.quiet_us for item in self._outgoing)

    def _a_posted(self, now_us: int) -> bytes:
        if not self._posted or now_us < self._listen_until_us or self._awaits_answer(now_us):
            return b""
        if self._is_receiving(now_us):
            return b""
        first = min(self._posted, key=lambda item: item.priority)
        if self._would_meet(len(first.body) + 6, now_us):
            return b""
        frame = self._send(first.kind, first.body, first.priority, now_us)
        if frame:
            self._posted.remove(first)
            self.last_posted = self._sealer.counter, first.body
            self._listen()
        return frame

    def _would_meet(self, size: int, now_us: int) -> bool:
        return self.rhythm is not None and self.rhythm.meets(now_us, now_us + self.clock.span_us(size))

    def _is_receiving(self, now_us: int) -> bool:
        """A message comes in pieces: what need not be said now would only be in its way."""
        return self.inbox.is_receiving(now_us, _QUIET_PIECES * self._patience.longest_us())

    def _send(self, kind: Kind, body: bytes, priority: Priority, now_us: int) -> bytes:
        if not self._may(len(body) + 6, priority, now_us):
            return b""
        frame = self._sealer.seal(kind, body)
        self._went_out(frame, now_us)
        return frame

    def _may(self, size: int, priority: Priority, now_us: int) -> bool:
        return self.ledger.allows(self.profile.airtime_us(size), priority, now_us)

    def _went_out(self, frame: bytes, now_us: int) -> None:
        self.frames_out += 1
        self.bytes_out += len(frame)
        self.clock.sent(len(frame), now_us)
        self.ledger.charge(self.profile.airtime_us(len(frame)), self.clock.off_us)
        if self.ledger.should_be_saved or self._sealer.counter >= self._ceiling - 1:
            self._remember(now_us)

    def _listen(self) -> None:
        self._listen_until_us = self.clock.off_us + self._patience.answer_us()

    def _expire(self, now_us: int) -> None:
        for item in [item for item in self._outgoing if now_us >= item.deadline_us]:
            self._finish(item, Reply(Result.FAILED, "no answer from the vessel"))

    def _finish(self, item: Outgoing, reply: Reply) -> None:
        self._outgoing.remove(item)
        self._outcomes.append(Outcome(item.id, reply))
