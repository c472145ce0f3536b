"""What the vessel tells of itself over the compact link: which kind of state packet, and when."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Final

from ..language.messages import GuardState
from ..language.snapshot import Snapshot
from .air import Priority, RadioProfile
from .air.profile import batch_bytes
from .codec.batch import encode_batch
from .codec.brief import encode_position
from .codec.state import (
    KEY_BYTES,
    as_key_mark,
    decode_delta,
    delta_parts,
    encode_delta,
    encode_key,
    reached_in,
    settle,
)
from .codec.state_fields import RadioState, with_flags
from .codec.wire import OVERHEAD, SEVERITY, Kind
from .hello import SHOWN_BYTES
from .link import CompactLink
from .words import Waiting, crosses

_OWN_ORDER_US: Final = 3_500_000
_STATUS_GAP_US: Final = 1_500_000
_THRIFTY_GAP_US: Final = 600_000_000
_TEXT_GAP_US: Final = 5_000_000
_TEXT_BYTES: Final = 50
_KEYS_KEPT: Final = 16
CHAT_US: Final = 8_000_000
"""Words come at no known moment, so an order may meet them; orders come in runs."""
CHAT_GAP_US: Final = 3_000_000
"""Who speaks without a pause is deaf to a stop."""
_HEALTH_GAP_US: Final = 15_000_000
_EVENT_US: Final = 12_000_000
"""Two states and a pause after an answer."""
_SHORT: Final = 0.03
"""Share of the hour: some thirty states, before it is used up."""
_BEACON_US: Final = 2_000_000
"""The shore's first word after a HELLO takes so long at most: a state at once would meet it on the air."""
_SHOWN_US: Final = 5_000_000
"""A word of the shore that crossed our state on its way asks for no other one."""
WHOLE_KEYS: Final = 4
"""Battery, satellites and tilt are told by keys only: one goes after so many times ``key_s`` though differences would do."""
_POSITION_GAP_US: Final = 15_000_000
"""To a shore of another version: enough to find the boat by."""


@dataclass(frozen=True, slots=True)
class _Base:
    """A state that differences may refer to once the shore has named it: its mark, the state as the shore has it, and when it was made."""

    mark: int
    state: RadioState
    made_us: int
    is_key: bool


@dataclass(frozen=True, slots=True)
class _Posted:
    """A state on its way out: as the shore will show it, and what it may serve as."""

    shown: RadioState
    base: _Base


class Reporter:
    """Chooses between key, difference and batch. Differences refer only to a state that the shore has acknowledged."""

    def __init__(self, profile: RadioProfile, link: CompactLink) -> None:
        self.profile = profile
        self._link = link
        self._state_us = round(profile.link.state_s * 1e6)
        self._key_us = round(profile.link.key_s * 1e6)
        self._next_us: int | None = None
        self._sent_us: int | None = None
        self._status_us: int | None = None
        self._told: RadioState | None = None
        self._sent: dict[int, _Base] = {}
        """By the low sixteen bits of the counters of their frames."""
        self._base: _Base | None = None
        self._whole_us = 0
        """When a key last went out."""
        self._mark = 0
        self._health_us = self._fix_us = 0
        self._skipped = 0
        """Places of the grid left free since the last state."""
        self.chat_us = 0
        """Until then an operator is at work: what can wait stays out of the way of his next order."""
        self._reached: deque[int] = deque(maxlen=16)
        """Low eight bits of each."""
        self._reached_us = 0
        self._text_bytes = min(_TEXT_BYTES, profile.max_frame_bytes - OVERHEAD - 1)
        self._samples: deque[RadioState] = deque(maxlen=profile.link.batch)
        """The newest: a batch for which the hour has no room is told later, not of longer ago."""
        self._batch = b""
        """The one that is posted and has not gone out."""
        self._show_us: int | None = None
        """From when on a start of the shore that is new wants to be shown the vessel; when one last was:"""
        self._shown_us: int | None = None
        self._pending: dict[bytes, _Posted] = {}
        self.told: RadioState | None = None
        """Mode, armed bit, plan and readiness as the last state that told them, or the last answer, went out with them."""
        self._texts = Waiting()
        self._text_us: int | None = None

    def acknowledged(self, counter_low: int) -> None:
        """The shore has the state that went out in the frame with these sixteen bits of the counter."""
        self._collect()
        found = self._sent.get(counter_low)
        if found is not None:
            self._base = found
            # what is older, or has its mark, will not be named any more
            newer = {number: item for number, item in self._sent.items() if item.made_us > found.made_us}
            self._sent = {counter_low: found} | {
                number: item for number, item in newer.items() if item.mark != found.mark
            }

    def shore_ordered(self, now_us: int) -> None:
        """The shore has its answer: what changes by its own order need not be told in the way of its next words."""
        self._status_us = max(now_us + _OWN_ORDER_US, self._status_us or 0)
        self.chat_us = self._link.chat_until_us = now_us + CHAT_US

    def want_key(self) -> None:
        """The shore has no key, or lost it."""
        self._base = None
        self._next_us = None

    def another(self) -> None:
        """Another start of the shore counts from now on, perhaps for a moment: what was sent to the one before, it does not have."""
        self._collect()
        self._base = self.told = None
        self._sent.clear()

    def met(self, now_us: int) -> None:
        """A start of the shore has proved itself, or says that it has no state: the next batch may be half an hour away."""
        is_answered = self._shown_us is not None and now_us - self._shown_us < _SHOWN_US
        if self.profile.link.batch > 1 and not is_answered:
            self._show_us = self._show_us or now_us + _BEACON_US

    def step(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue what is due. Call once per tick."""
        self._collect()
        self._next_after_sent()
        state = RadioState.of(snapshot)
        if self._link.pairing.is_foreign:
            self._position(state, now_us)
            return
        self._queue_texts(now_us, snapshot)
        if self.profile.link.batch == 1:
            self._reached.extend(seq & 0xFF for seq in snapshot.progress.reached)
        self._tell_reached(now_us)
        if self._show_us is not None and now_us >= self._show_us:
            self._show(state, now_us)
        elif self._base is None and any(not waiting.base.is_key for waiting in self._pending.values()):
            self._post_key(state, now_us, Priority.STATE)  # who is to hear it has not what it refers to
        elif self._link.way.slots.is_open(now_us) and self._may_spend(now_us):
            self._post_state(state, now_us, Priority.STATE)
        elif self._status_is_new(state, now_us):
            self._status_us = now_us
            if self.profile.link.batch == 1:
                self._post_state(state, now_us, Priority.EVENT)
            else:
                self._show_us = now_us
        elif self._next_us is None or now_us >= self._next_us:
            self._periodic(state, now_us)
        elif self._waits_outdated(state):
            self._post_state(state, now_us, Priority.STATE)

    def _waits_outdated(self, state: RadioState) -> bool:
        """Whether the state on its way out waited for an order's sake, and the order has changed what it tells: the shore, which has the
        answer, would show the old again.
        """
        return any(waiting.shown.status != settle(state).status for waiting in self._pending.values())

    def _tell_reached(self, now_us: int) -> None:
        """Items go with the states; where those have no room for them they go alone."""
        if not self._reached:
            self._reached_us = now_us
        elif now_us >= max(self.chat_us, self._reached_us + _EVENT_US):
            self.chat_us = now_us + CHAT_GAP_US
            self._link.post(Kind.EVENT, bytes(self._reached), Priority.EVENT)
            self._reached.clear()

    def _show(self, state: RadioState, now_us: int) -> None:
        """Show the vessel as soon as the hour has room for it, and for no start to come: the next batch pays."""
        if self._link.voice.may(SHOWN_BYTES, Priority.EVENT, now_us):
            self._link.post(Kind.KEY, self.shown(state, now_us), Priority.EVENT)

    def shown(self, state: RadioState, now_us: int) -> bytes:
        """The body of the state that shows the vessel to a start of the shore, now on its way."""
        self._show_us, self._shown_us = None, now_us
        # an answer may be brief only where it is known what the shore has
        self._told, self.told = state, None
        self._samples.clear()
        return encode_key(state, timed=True)

    def _next_after_sent(self) -> None:
        """The next state comes a period after the last one, also when that one had to wait or came early: so the shore can tell."""
        sent_us = self._link.state_us
        if self.profile.link.batch == 1 and sent_us is not None and sent_us != self._sent_us:
            self._sent_us, self._next_us = sent_us, sent_us + self._state_us

    def _position(self, state: RadioState, now_us: int) -> None:
        """All that a shore of another version understands."""
        if self._next_us is None or now_us >= self._next_us:
            self._next_us = now_us + max(self._state_us * self.profile.link.batch, _POSITION_GAP_US)
            self._link.post(Kind.POSITION, encode_position(state), Priority.STATE)

    def answered(self, state: RadioState) -> None:
        """An answer has told mode, armed bit, item and readiness: they need not be told once more in the way of the next order."""
        self._collect()
        if self._told is not None:
            self._told = _standing_so(self._told, state)
        if self.told is not None:
            self.told = _standing_so(self.told, state)

    def _status_is_new(self, state: RadioState, now_us: int) -> bool:
        """What matters for safety goes at once when it changes; the rest goes with the next state, when the shore knows that one comes."""
        if self._told is None or (self._status_us is not None and now_us - self._status_us < self._status_gap_us):
            return False
        told = self._told
        if self.profile.link.batch == 1 and state.mode is not told.mode:
            return True
        is_shoal = state.guard is not told.guard and state.guard >= GuardState.CORRECTION
        return state.armed != told.armed or state.action > told.action or is_shoal

    @property
    def _status_gap_us(self) -> int:
        return _STATUS_GAP_US if self.profile.link.batch == 1 else _THRIFTY_GAP_US

    def _periodic(self, state: RadioState, now_us: int) -> None:
        due_us = now_us if self._next_us is None else self._next_us
        self._next_us = max(due_us + self._state_us, now_us)
        if self.profile.link.batch > 1:
            self._collect_sample(state, now_us)
            return
        if not self._may_spend(now_us):
            return
        self._post_state(state, now_us, Priority.STATE)

    def _post_state(self, state: RadioState, now_us: int, priority: Priority) -> None:
        """A difference where one does, else a key: an older state may still serve while its successor waits for the shore's word."""
        base = self._base
        body = None
        if base is not None and now_us - base.made_us < self._key_us and not self._needs_key(state, base.state, now_us):
            # an item more makes a state longer than the shore foretells: not while the next order may wait for its end
            reached = b"" if now_us < self.chat_us else bytes(self._reached)
            says = self._flags_are_new(state, now_us)
            body = encode_delta(base.state, base.mark, state, says_status=says, reached=reached)
        if base is None or body is None:
            self._post_key(state, now_us, priority)
            return
        successor = _Base(as_key_mark(base.mark), decode_delta(base.state, body), now_us, is_key=False)
        self._told, self._pending = state, {body: _Posted(settle(state), successor)}
        self._link.post(Kind.DELTA, body, priority)

    def _may_spend(self, now_us: int) -> bool:
        """Whether a state is sent at this place of the grid: every second or third one while the hour is short, so that the picture
        slows down and does not stop, and none that would wait for the hour and then come where nobody expects it.
        """
        left_us = self._link.ledger.left_us(Priority.STATE, now_us)
        if left_us is None:
            return True
        short_us = round(_SHORT * (self.profile.hour_us or 0))
        if self._skipped < (left_us < short_us) + (left_us < short_us // 2):
            self._skipped += 1
            return False
        self._skipped = 0
        return left_us >= self.profile.airtime_us(KEY_BYTES + OVERHEAD)

    def _needs_key(self, state: RadioState, base: RadioState, now_us: int) -> bool:
        """What only a key tells goes at once where it matters for a start, else now and then, and not in the way of orders."""
        if state.fix is not base.fix and now_us >= self._fix_us:
            self._fix_us = now_us + _HEALTH_GAP_US
            return True
        return now_us >= max(self.chat_us, self._whole_us + WHOLE_KEYS * self._key_us)

    def _flags_are_new(self, state: RadioState, now_us: int) -> bool:
        """Readiness that changed goes with the next state; while it flickers, now and then."""
        if self.told is None or state.flags == self.told.flags or now_us < self._health_us:
            return False
        self._health_us = now_us + _HEALTH_GAP_US
        return True

    def _collect_sample(self, state: RadioState, now_us: int) -> None:
        """Tell a batch when it is full, to somebody, and when the hour has room; one that still waits is told anew, not when it is old."""
        self._told = self._told or state
        self._samples.append(state)
        size = self.profile.link.batch
        is_due = len(self._samples) == size and self._show_us is None and bool(self._link.pairing.sessions)
        if self._batch or (is_due and self._link.voice.may(batch_bytes(size), Priority.STATE, now_us)):
            self._batch = encode_batch(tuple(self._samples), round(self.profile.link.state_s))
            self._link.post(Kind.BATCH, self._batch, Priority.STATE)
            self._told = state

    def _post_key(self, state: RadioState, now_us: int, priority: Priority) -> None:
        self._mark = (self._mark + 1) % 4
        if self._base is not None and self._mark == self._base.mark:
            self._mark = (self._mark + 1) % 4
        body = encode_key(state, self._mark)
        self._told = state
        shown = settle(state)
        self._pending = {body: _Posted(shown, _Base(self._mark, shown, now_us, is_key=True))}
        self._link.post(Kind.KEY, body, priority)

    def _collect(self) -> None:
        """Learn in which frame the last key went out, and what has been told by now."""
        if self._link.last_posted is None:
            return
        counter, body = self._link.last_posted
        if body == self._batch:
            self._batch = b""
            self._samples.clear()
        found = self._pending.pop(body, None)
        if found is None:
            return
        is_key = found.base.is_key
        for _ in reached_in(b"" if is_key else body)[: len(self._reached)]:
            self._reached.popleft()
        tells_all = self.told is None or is_key or delta_parts(body).changes
        self.told = found.shown if self.told is None or tells_all else with_flags(found.shown, self.told)
        self._whole_us = found.base.made_us if is_key else self._whole_us
        self._may_be_named(counter & 0xFFFF, found.base)

    def _may_be_named(self, counter_low: int, sent: _Base) -> None:
        """What went out may be referred to when the shore names it. The shore has one state by each mark: a key takes that of older
        differences, and they leave it to a key that the shore may have.
        """
        if sent.is_key:
            self._sent = {number: item for number, item in self._sent.items() if item.mark != sent.mark}
        elif any(item.is_key and item.mark == sent.mark and item is not self._base for item in self._sent.values()):
            return
        self._sent.pop(counter_low, None)
        self._sent[counter_low] = sent
        while len(self._sent) > _KEYS_KEPT:
            self._sent.pop(next(iter(self._sent)))

    def _queue_texts(self, now_us: int, snapshot: Snapshot) -> None:
        if not self.profile.link.texts:
            return
        for text in snapshot.texts:
            if crosses(text.severity, text.text):
                self._texts.put(text.severity, text.text)
        if self._texts and now_us >= self.chat_us and (self._text_us is None or now_us - self._text_us >= _TEXT_GAP_US):
            severity, words = self._texts.take(self._text_bytes)
            self._text_us = now_us
            self.chat_us = now_us + CHAT_GAP_US
            self._link.post(Kind.TEXT, bytes((SEVERITY.number(severity),)) + words, Priority.EVENT)


def _standing_so(state: RadioState, now: RadioState) -> RadioState:
    """The state with what an answer tells of the present one."""
    return replace(
        state,
        mode=now.mode,
        armed=now.armed,
        plan_state=now.plan_state,
        seq=now.seq % 128,
        prearm_ok=now.prearm_ok,
    )
