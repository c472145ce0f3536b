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
from dataclasses import replace
from typing import Final

from ..language.requests import Reply, Result
from . import memory as memory_of
from .air import Ledger, Priority, RadioProfile
from .codec.brief import STANDING_BYTES
from .codec.frames import STOPS, Opener, RadioFrame, Saying, frame_bytes
from .codec.wire import FROZEN, OVERHEAD, VERSION, Kind
from .hello import Greeting
from .patience import ANSWER_BYTES, Patience, await_answer
from .posted import STATES, PostBox, Posted
from .session import Hello, Pairing, Session
from .transfer import Transfer, TransferOutcome, WholeMessage, cut, most_bytes, read_reply, sizes
from .voice import RadioVoice
from .way_clear import WayClear

MAX_OUTGOING: Final = 16
_MAX_ANSWERS: Final = 16
_REASON_BYTES: Final = 40
_RELIABLE: Final = frozenset((Kind.PLAN, Kind.ORDER, Kind.STOP, Kind.SAFE, Kind.INFO))
_QUIET_PIECES: Final = 6
_TICK_SLIP_US: Final = 25_000
"""So far the vessel's ticks may slide in a pause."""
_VESSEL_PAUSE_US: Final = 1_500_000
_STATES_WAIT_US: Final = 8_000_000


class CompactLink:
    """Frames in and out for one end. ``save`` is called with a text to keep for the next start; ``memory`` is that text."""

    def __init__(
        self,
        profile: RadioProfile,
        pairing: Pairing,
        rng: random.Random,
        *,
        memory: str = "",
        save: Callable[[str], None] | None = None,
        now_us: int = 0,
        ledger: Ledger | None = None,
    ) -> None:
        self.profile = profile
        self.pairing = pairing
        self.ledger = ledger or Ledger(profile.hour_us, profile.stop_us)
        self.voice = RadioVoice(profile, pairing, self.ledger, self._remember)
        self.clock = self.voice.clock
        self.patience = Patience(profile, self.clock, rng, self.ledger)
        self._inboxes = memory_of.Inboxes(round(profile.link.upload_s * 1e6), round(profile.link.command_s * 1e6))
        self.heard_us: int | None = None
        """When the last frame of a session came, or an answer to our HELLO."""
        self.last_posted: tuple[int, bytes] | None = None
        """Counter and body of the posted frame that went out last."""
        self.tick_us = 0
        """The vessel's newest tick. Its states go out at ticks, so that the shore knows when the next one comes; the last one when:"""
        self.state_us: int | None = None
        self.standing: Callable[[bytes | None], bytes] = lambda order: b""
        """What goes with each answer, as it is when the answer is sent: the vessel's state. ``order``: what is accepted, if that came
        without a body and may be answered so; None where the answer is not for who spoke last."""
        self.opener = Opener(pairing)
        self._save = save or (lambda text: None)
        self._is_vessel = pairing.is_vessel
        self._standing_bytes = 0 if self._is_vessel else STANDING_BYTES
        """What the other end's answers carry between result and reason."""
        self._next_id = rng.randrange(256)
        self._outgoing: list[Transfer] = []
        self._answers: deque[Posted] = deque(maxlen=_MAX_ANSWERS)
        self._posted = PostBox()
        self._outcomes: list[TransferOutcome] = []
        self._listen_until_us = self._hold_answers_us = self.chat_until_us = self._turn = 0
        self.way = WayClear(self.clock, self.patience)
        self._greeting = Greeting(profile, rng, now_us, is_vessel=self._is_vessel)
        self._session: Session | None = None
        """The session that was heard last."""
        memory_of.read(memory, self._inboxes, self.ledger, now_us)

    def _remember(self, now_us: int) -> None:
        self._save(memory_of.write(self._inboxes, self.ledger, now_us))

    def keep(self, now_us: int, *, at_once: bool) -> None:
        """Keep for the next start what was answered and spent: at the end, and when what was kept is old."""
        if at_once or self.ledger.is_outdated(now_us):
            self._remember(now_us)

    # ---- in -----------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> list[RadioFrame | WholeMessage]:
        """Take bytes as read; return new messages and the frames that need no answer. Never raises on input."""
        found: list[RadioFrame | WholeMessage] = []
        for frame in self.opener.receive(data, now_us):
            if frame.kind is Kind.HELLO:
                self._on_hello(Hello.read(frame.body), now_us)
                continue
            self.heard_us = now_us
            self.patience.heard()
            self.way.slots.heard(frame, now_us)
            self._greeting.authentic(self.opener.strange_bytes)
            item = self._sort(frame, now_us)
            if item is not None:
                found.append(item)
        self._greeting.strange(self.opener.strange_bytes, self.heard_us, now_us)
        return found

    def _on_hello(self, hello: Hello, now_us: int) -> None:
        self._greeting.heard(now_us, please=hello.please, proof=hello.proof)
        if hello.proof:
            self.heard_us = now_us
            self.patience.heard()
        self._note_start(now_us)
        for waiting in self._outgoing:
            waiting.next_us = min(waiting.next_us, now_us)

    def _note_start(self, now_us: int) -> None:
        """Message numbers mean something within one start of the other end only."""
        session = self.pairing.current
        if session is self._session or session is None:
            return
        self._session = session
        self._greeting.started()
        if self._inboxes.turn_to(session.other):
            self._remember(now_us)

    def _sort(self, frame: RadioFrame, now_us: int) -> RadioFrame | WholeMessage | None:
        self._note_start(now_us)
        kind = frame.kind
        if self.pairing.is_foreign and kind not in FROZEN:
            return None
        if kind is Kind.MISSING:
            for item in [item for item in self._outgoing if len(frame.body) > 1 and item.id == frame.body[0]]:
                item.heard_account(frame.body[1], now_us)
            return None
        if kind is Kind.REPLY:
            return self._on_reply(frame, now_us)
        if kind in _RELIABLE or kind is Kind.PIECE:
            return self._on_message(frame, now_us)
        self.patience.other_was_talking(self._outgoing, len(frame.body) + OVERHEAD, now_us)
        return frame

    def _on_message(self, frame: RadioFrame, now_us: int) -> WholeMessage | None:
        if self.way.twice.heard(frame, now_us):
            return None
        if frame.kind is Kind.PIECE:
            # complete before the sender asked: it still sends its reserve, and would not hear an answer now
            polled = len(frame.body) > 2 and frame.body[2] & 0x80
            self._hold_answers_us = now_us if polled else now_us + self.patience.longest_us()
            message, reply, account = self._inboxes.current.piece(frame.body, now_us)
            if account is not None:
                self._answers.append(Posted(Kind.MISSING, account, Priority.COMMAND, to=self._inboxes.other))
            elif message is None and reply is None:
                # more pieces come: keep off the air for the longest one
                self._listen_until_us = now_us + self.patience.longest_us()
        else:
            message, reply = self._inboxes.current.frame(frame, now_us)
        if reply is not None:
            self._answers.append(Posted.again(frame, reply, self._inboxes.other))
        if message is not None:
            self._listen_until_us = max(self._listen_until_us, now_us + self.patience.turnaround_us)
        return message

    def _on_reply(self, frame: RadioFrame, now_us: int) -> RadioFrame | None:
        """Returns what it tells of the vessel: an answer without a body is followed by its order."""
        body, brief = frame.body, frame.is_brief
        found = read_reply(body)
        item = next((item for item in self._outgoing if item.is_answered_by(body, brief=brief)), None)
        self.way.heard_answer(item, frame_bytes(frame.kind, body), now_us)
        if item is None or found is None:
            return None if brief else frame
        self.patience.learn(item, now_us)
        self.way.answered(item)
        reason = "" if self.pairing.is_foreign else body[1 + self._standing_bytes :].decode("utf-8", "replace")
        self._finish(item, Reply(found[1], reason))
        return replace(frame, body=body + item.parts[0]) if brief else frame

    # ---- out ----------------------------------------------------------------------------------------------------

    def submit(self, kind: Kind, payload: bytes, priority: Priority, now_us: int, limit_us: int) -> int:
        """Send a message that must arrive; its outcome comes within ``limit_us``. Returns its number.

        Raises ValueError with the reason when it is too long, too much is waiting, the hour has no room for it, or the other end is of
        a version that would not understand it.
        """
        if self.pairing.is_foreign and kind not in FROZEN:
            raise ValueError(
                f"the other end speaks radio format {self.pairing.version}, this one {VERSION}: only Hold and Disarm cross"
            )
        longest, most = self.profile.max_frame_bytes, most_bytes(self.profile, limit_us)
        if len(payload) > most:
            share = 100 * most // len(payload)
            raise ValueError(f"too long for the radio ({len(payload)} bytes): about {share} % of it would pass")
        cost_us = sum(self.profile.airtime_us(size) for size in sizes(kind, payload, longest))
        if not self.ledger.allows(cost_us, priority, now_us):
            raise ValueError(self.ledger.refusal(cost_us, priority, now_us, self.profile.band_rule.name))
        if len(self._outgoing) >= MAX_OUTGOING:
            raise ValueError("too many orders wait for the radio")
        pieces = cut(kind, payload, longest)
        item = Transfer(self._next_id, kind, pieces, priority, now_us + limit_us, is_whole=self.pairing.is_foreign)
        self.patience.press(item, now_us)
        self._next_id = (self._next_id + 1) % 256
        if priority <= Priority.COMMAND:
            self._greeting.hurry(now_us, was_silent=False)
        self._outgoing.append(item)
        self._outgoing.sort(key=lambda other: other.priority)
        return item.id

    def hasten(self, number: int) -> None:
        """Send a message of ours without the pause after an answer: the other end asked for it, and waits."""
        for item in self._outgoing:
            item.is_asked_for |= item.id == number

    def press(self, number: int, now_us: int) -> None:
        """An order that is on its way is given again: somebody waits for its next try."""
        for item in [item for item in self._outgoing if item.id == number]:
            self.patience.press(item, now_us)

    def withdraw(self, numbers: Container[int], reply: Reply) -> None:
        """End messages of ours that nobody wants to arrive any more."""
        for item in [item for item in self._outgoing if item.id in numbers]:
            self._finish(item, reply)

    def post(self, kind: Kind, body: bytes, priority: Priority) -> None:
        """Send a frame that may be lost; a newer one of its kind replaces it, events aside."""
        self._posted.put(kind, body, priority)

    def answer(self, number: int, reply: Reply, now_us: int, other: bytes | None = None) -> None:
        """Answer a message that came by ``receive``. ``other``: from which start of the other end, where that may speak no more."""
        inbox = self._inboxes.current if other is None else self._inboxes.of(other)
        reason_bytes = min(_REASON_BYTES, self.profile.max_frame_bytes - ANSWER_BYTES) if self.profile.link.texts else 0
        found = None if inbox is None else inbox.answered(number, reply, reason_bytes)
        if found is None:
            return
        twofold = self.way.twice.was_said(number) and reply.result is Result.ACCEPTED
        self._answers.append(Posted.answer(found, other or self._inboxes.other, is_twofold=twofold))
        self._listen_until_us = min(self._listen_until_us, now_us)
        self._remember(now_us)

    def outcomes(self) -> list[TransferOutcome]:
        """How messages of ours have ended since the last call."""
        found, self._outcomes = self._outcomes, []
        return found

    def take(self, now_us: int) -> bytes:
        """The next frame when the air is ours, b"" otherwise."""
        late = {item.id for item in self._outgoing if now_us >= item.deadline_us}
        self.withdraw(late, Reply(Result.FAILED, "no answer from the vessel"))
        if now_us < self.way.other_until_us or not self.clock.is_free(now_us, lead_us=self._lead_us(now_us)):
            return b""
        choices = (self._an_answer, self._a_hello, self._a_stop, self._a_second, self._a_message, self._a_posted)
        return next((frame for choose in choices if (frame := choose(now_us))), b"")

    def _lead_us(self, now_us: int) -> int:
        asks = not self._answers and self._outgoing and now_us >= self._outgoing[0].next_us
        return round((self._outgoing[0].next_size() if asks else ANSWER_BYTES) * self.profile.serial_byte_us)

    def _an_answer(self, now_us: int) -> bytes:
        if not self._answers or now_us < self._hold_answers_us:
            return b""
        first = self._answers.popleft()
        body, session = first.body, self.pairing.session_with(first.to)
        if session is None:
            return b""
        if first.kind is Kind.REPLY and not self.pairing.is_foreign:
            order = first.order if read_reply(body) == (body[0] >> 3, Result.ACCEPTED) else b""
            body = body[:1] + self.standing(order if session is self._session else None) + body[1:]
        frame = self.voice.send(first.kind, body, first.priority, now_us, session=session)
        if frame:
            # the question comes again when this answer is lost: nothing of ours may be in its way; the vessel's come after a longer pause
            pause_us = self.patience.pause_us(len(frame), longer=first.is_plan_again and self._states_can_wait(now_us))
            self._listen_until_us = now_us + pause_us - _TICK_SLIP_US if self._is_vessel else self.clock.off_us
            self.way.gave_answer(now_us)
            if first.is_twofold:
                self._answers.appendleft(replace(first, is_twofold=False))
        return frame

    def _states_can_wait(self, now_us: int) -> bool:
        """A plan that comes again will once more: the air loses a lot, and a state would meet it. Not until the shore grows blind."""
        return self.state_us is not None and now_us - self.state_us < _STATES_WAIT_US

    def _a_hello(self, now_us: int) -> bytes:
        greeting = self._greeting
        priority = min([Priority.COMMAND, *(item.priority for item in self._outgoing)])
        frame = self.voice.hello(greeting, priority, now_us) if greeting.is_due(now_us) else b""
        if not frame:
            return b""
        self._listen_until_us = self.clock.off_us + self.patience.answer_us()
        if greeting.please:
            self.patience.greets(self._outgoing, now_us)
        greeting.sent(now_us)
        return frame

    def _a_stop(self, now_us: int) -> bytes:
        return self._a_transfer([item for item in self._outgoing if item.priority is Priority.STOP], now_us)

    def _a_message(self, now_us: int) -> bytes:
        if await_answer(self._outgoing, now_us):
            return b""
        if (
            self._posted.has(Kind.BEACON)
            and any(item.is_under_way for item in self._outgoing)
            and (beacon := self._a_posted(now_us))
        ):
            return beacon  # behind the pieces it would come too late, and the vessel take its station for lost
        owes = self.profile.link.batch == 1 and self._posted.state() is not None  # it has its time
        waits = owes or now_us < max(self._listen_until_us, self.chat_until_us)
        return self._a_transfer([item for item in self._outgoing if item.is_asked_for or not waits], now_us)

    def _a_transfer(self, items: list[Transfer], now_us: int) -> bytes:
        # the other end's states wait while a long message comes
        keeps_quiet = any(item.is_under_way for item in self._outgoing)
        for item in list(items):
            if now_us < item.next_us or self.patience.is_put_off(item, now_us):
                continue
            if not keeps_quiet and self.way.meets(item.next_size(), now_us, hurries=item.hurries):
                continue
            session = self.pairing.to_speak(item.tries)
            if session is None:
                self._greeting.hurry(now_us, was_silent=True)
                continue
            if session is self.pairing.rival and not item.greeted:
                # it may not know of this start yet: tell it, and go on without waiting for an answer
                item.greeted, item.next_us = True, now_us + 1
                self._greeting.introduce(now_us)
                return b""
            is_late = now_us + self.clock.span_us(item.next_size()) > item.deadline_us
            if item.kind not in STOPS and not self._is_vessel and is_late:
                continue  # it would be heard after it is given up here
            if item.asked:
                if item.tries == 1 and not item.greeted and self._greeting.hurry(now_us, was_silent=True):
                    item.greeted = True
                    return b""
                self.way.not_answered(item, now_us)
                item.begin_round()
            kind, body = item.next_frame()
            saying = self.way.twice.begin(item, now_us)
            frame = self.voice.send(kind, body, item.priority, now_us, session=session, saying=saying)
            if not frame:
                self._finish(item, Reply(Result.FAILED, "the hour's airtime is used up"))
                continue
            if item.asked:
                # the vessel's states go on between the tries of what it tells the shore
                pause_us = _VESSEL_PAUSE_US * min(item.tries, 4) * self._is_vessel
                self.patience.asks(item, now_us, self.way.rhythm, pause_us)
            elif self._is_vessel:
                item.next_us = self.clock.off_us + self.patience.answer_us()
            else:
                self.way.slots.sent(item, body)
            return frame
        return b""

    def _a_second(self, now_us: int) -> bytes:
        """The second saying, right behind the first or not at all: the other end leaves it the air."""
        for item in [item for item in self._outgoing if item.is_half_said and item.off_us == self.clock.off_us]:
            frame = self.voice.send(item.kind, item.whole, item.priority, now_us, saying=Saying.SECOND)
            item.is_half_said, item.is_said_twice = False, bool(frame)
            self.patience.asks(item, now_us, self.way.rhythm, between_us=0)
            return frame
        return b""

    def _a_posted(self, now_us: int) -> bytes:
        has_slot = self.way.slots.is_open(now_us)
        first = self._posted.state() if has_slot else self._posted.first()
        if first is None or (not has_slot and now_us < max(self._listen_until_us, self._greeting.quiet_until_us)):
            return b""
        # a message that comes in pieces would have it in its way
        is_receiving = not has_slot and self._inboxes.current.is_receiving(
            now_us, _QUIET_PIECES * self.patience.longest_us()
        )
        if await_answer(self._outgoing, now_us) or is_receiving or self.way.is_quiet(now_us):
            return b""
        if first.kind in STATES and now_us != self.tick_us:
            return b""
        # a difference tells something only to who has what it refers to
        session = self.pairing.current if first.kind is Kind.DELTA else self.pairing.to_speak(self._turn)
        if session is None or not self.way.has_room(len(first.body) + OVERHEAD, now_us):
            return b""
        frame = self.voice.send(first.kind, first.body, first.priority, now_us, session=session)
        if frame:
            self._turn += 1
            self._posted.remove(first)
            self.last_posted = self.voice.counter, first.body
            self.state_us = now_us if first.kind in STATES else self.state_us
            if self._is_vessel:
                self._listen_until_us = self.clock.off_us + self.patience.answer_us()
        return frame

    def _finish(self, item: Transfer, reply: Reply) -> None:
        self._outgoing.remove(item)
        self._outcomes.append(TransferOutcome(item.id, reply))
