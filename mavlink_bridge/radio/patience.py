"""How long this end waits for the other one's answer: computed from sizes, stretched by what answers really take here."""

from __future__ import annotations

import random
from typing import Final

from .air import AirClock, Priority, RadioProfile
from .air.ledger import Ledger
from .air.rhythm import Rhythm
from .codec.brief import STANDING_BYTES
from .codec.frames import STOPS
from .codec.wire import OVERHEAD, Kind
from .hello import HELLO_FRAME_BYTES
from .transfer import Transfer

ANSWER_BYTES: Final = OVERHEAD + 1 + STANDING_BYTES
"""A REPLY without a reason."""
_MARGIN: Final = 1.03
_EAGER_US: Final = 50_000
"""The first wait of an order has nothing to spare: two tries have to fit the second and a half of a station's patience."""
_PATIENT_TRIES: Final = 14
_LONG_TRY: Final = 3
"""From this try on there is time for a refusal with its reason: our second question met the answer to the first, and was not heard; each
further one would do the same. A stop is hardly ever refused: it waits between the
shortest answer and the longest, where airtime allows it."""
_LONG_PLAN_TRIES: Final = (11, 12)
"""The same of a plan, late: a plan is mostly lost, not refused, and waiting longer before would cost half a second at 50 % loss. Two in a
row, because the first may be the question that met the answer.
"""
STORING_US: Final = 200_000
"""A plan is answered when it is stored, some ticks later than an order; a repeat in between meets the answer on the air."""
_STORED_LATER_US: Final = 60_000
"""A tick, in which storing may end before or after: a whole plan that was repeated for it kept the next clearing off the air for longer
than its station waits.
"""
_AFTER_ANSWER_US: Final = 2_000_000
"""An answer may show a state on which the next order waits, and a question whose answer was lost comes again: the vessel keeps off the
air.
"""
_PAUSE_STEP_US: Final = 100_000
"""That pause is counted from the answer's beginning in whole ticks, of any usual length: so the shore knows to the tick when a state comes
that was held back.
"""
_EXPLAINED: Final = frozenset((Kind.ORDER, Kind.STOP, Kind.SAFE))
"""Refusals of these come with words."""


class Patience:
    """Times of answers. All randomness comes from ``rng``."""

    def __init__(self, profile: RadioProfile, clock: AirClock, rng: random.Random, ledger: Ledger) -> None:
        self.turnaround_us = round(profile.link.turnaround_ms * 1e3)
        self._command_us = round(profile.link.command_s * 1e6)
        self._longest_bytes = profile.max_frame_bytes
        self._ledger = ledger
        self._unheard_us: int | None = None
        """When the last stop left the air, if nothing has been heard since."""
        self._slack = 1.0
        self._clock = clock
        self._rng = rng
        self._slowest_us = {False: 0, True: 0}
        """What an answer takes here, of plans apart from other messages; 0 = none has been measured."""

    def answer_us(self) -> int:
        """From the end of a frame of ours to the end of its short answer."""
        return self.turnaround_us + self._clock.span_us(ANSWER_BYTES)

    def hello_us(self) -> int:
        """From the end of our HELLO to the end of the other one's."""
        return self.turnaround_us + self._clock.span_us(HELLO_FRAME_BYTES)

    def longest_us(self) -> int:
        """The same for the longest frame there is."""
        return self.turnaround_us + self._clock.span_us(self._longest_bytes)

    def of(self, item: Transfer) -> int:
        """How long to wait for an answer: a little longer and less regular with each try, so that neither fades nor talkers keep step."""
        slowest_us = self._slowest_us[item.kind is Kind.PLAN]
        base_us = max(self.answer_us(), slowest_us)
        if item.kind is Kind.PLAN and (item.tries == 1 or not slowest_us):
            base_us += _STORED_LATER_US if slowest_us else STORING_US
        is_late = item.tries >= _LONG_TRY and item.kind in _EXPLAINED
        # in step with another gateway's questions each repeat of a stop would be met
        is_random = is_late and item.kind in STOPS
        if is_random:
            return base_us + self._rng.randrange(max(self.longest_us() + self.longest_us() // 8 - base_us, 1))
        if is_late or (item.kind is Kind.PLAN and item.tries in _LONG_PLAN_TRIES):
            base_us = max(base_us, self.longest_us())
        elif item.tries == 1 and item.kind in _EXPLAINED:
            base_us = max(self.answer_us() - _EAGER_US, slowest_us)
        growth = 1.0 if item.tries <= _PATIENT_TRIES else 1.2 ** min(item.tries - _PATIENT_TRIES, 8)
        return round(base_us * growth) + self._rng.randrange(max(base_us // 8, 1)) * (item.tries > 1)

    # ---- stops that nobody hears --------------------------------------------------------------------------------

    def heard(self) -> None:
        """The other end is there: the next stop need not wait."""
        self._unheard_us = None

    def stop_wait_us(self, now_us: int, *, again: bool) -> int:
        """How long a stop waits, newly ordered or ``again``, so that the hour is not spent on what nobody hears."""
        if self._unheard_us is None:
            return 0
        gap_us = round(self._ledger.stop_gap_us(now_us, again=again) * self._slack)
        return max(self._unheard_us + gap_us - now_us, 0)

    def press(self, item: Transfer, now_us: int) -> None:
        """It is ordered, or ordered again while it is on its way: a stop is tried as soon and as long as a new one would be."""
        item.is_pressed = True
        if item.priority is Priority.STOP:
            end_us = now_us + self.stop_wait_us(now_us, again=False) + self._command_us
            item.deadline_us = max(item.deadline_us, end_us)

    def is_put_off(self, item: Transfer, now_us: int) -> bool:
        """Whether it is a stop that still waits."""
        return item.priority is Priority.STOP and self.stop_wait_us(now_us, again=not item.is_pressed) > 0

    def repeats_us(self, now_us: int) -> int:
        """How far apart the repeats of a stop are that nobody has answered; 0 where the last one was heard."""
        return 0 if self._unheard_us is None else self._ledger.stop_gap_us(now_us, again=True)

    def _stop_went(self, now_us: int) -> None:
        """Where gaps are long they are what keeps two gateways out of step."""
        self._unheard_us = self._clock.off_us
        is_slow = self._ledger.stop_gap_us(now_us, again=True) > self.longest_us()
        self._slack = self._rng.uniform(0.75, 1.25) if is_slow else 1.0

    def greets(self, items: list[Transfer], now_us: int) -> None:
        """A HELLO that asks for an answer goes out: who is answering does not hear."""
        for item in items:
            item.next_us = max(item.next_us, self._clock.off_us + self.hello_us())
            if item.priority is Priority.STOP:
                self._stop_went(now_us)

    def asks(self, item: Transfer, now_us: int, rhythm: Rhythm | None, between_us: int) -> None:
        """A question goes out. ``between_us``: what is left free between two tries."""
        item.late_us = max(now_us - item.off_us, 0) if item.tries > 1 else 0
        item.off_us, item.is_disturbed = self._clock.off_us, False
        item.quiet_us = self.overdue_us(item, rhythm)
        item.next_us = item.quiet_us + between_us
        item.is_pressed = False
        if item.priority is Priority.STOP:
            self._stop_went(now_us)

    def overdue_us(self, item: Transfer, rhythm: Rhythm | None) -> int:
        """When the answer to the question on the air is overdue. A state that begins before the vessel can answer goes first."""
        off_us = self._clock.off_us
        due_us = off_us + self.of(item) + (self.answer_us() if item.is_said_twice else 0)
        over_us = None if rhythm is None else rhythm.over_us(off_us, self.turnaround_us)
        return due_us if over_us is None else max(due_us, over_us + self.answer_us())

    def pause_us(self, size: int, *, longer: bool = False) -> int:
        """From the beginning of an answer of the vessel, of so many bytes, to its next state, if that is due by then."""
        least_us = self._clock.span_us(size) + _AFTER_ANSWER_US * (1 + longer)
        return -(-least_us // _PAUSE_STEP_US) * _PAUSE_STEP_US

    def learn(self, item: Transfer, now_us: int) -> None:
        """Measure how long an answer takes here; one that comes while the question is being repeated, or sooner after it than an answer can
        be on the air, belongs to the asking before. Of two answers nobody knows which one it is.
        """
        if item.is_said_twice:
            return
        is_to_this = not item.is_disturbed and now_us - item.off_us >= self._clock.span_us(ANSWER_BYTES)
        if item.tries == 1 or is_to_this:
            took_us = now_us - item.off_us
        elif now_us < item.off_us:
            took_us = item.late_us + now_us - item.off_us + self._clock.span_us(item.next_size())
        else:
            return
        seen_us = round(took_us * _MARGIN)
        if 0 < seen_us <= 4 * self.answer_us():
            is_plan = item.kind is Kind.PLAN
            self._slowest_us[is_plan] = max(seen_us, (3 * self._slowest_us[is_plan] + seen_us) // 4)

    def other_was_talking(self, items: list[Transfer], size: int, now_us: int) -> None:
        """What we asked while the other end talked was not heard: ask again at once. What was over before is answered after it."""
        began_us, _ = self._clock.came_us(size, now_us)
        for item in items if self._clock.off_us < now_us else ():
            item.other_talked(began_us, now_us, self.answer_us())


def await_answer(items: list[Transfer], now_us: int) -> bool:
    """Whether the answer to one of our messages may be on its way."""
    return any(item.asked and now_us < item.quiet_us for item in items)
