"""An arming that is said twice and answered twice: what a station's patience of 1.5 s leaves room for on an air that loses.

Asked, waited for and asked again, an order has two tries of two packets each in that time: with 30 % loss one arming of four comes too
late. Said twice in a row, each way, it is four packets too, of which any one of each two is enough: one of six. It takes 0.4 s more where
nothing is lost, so a clean air never sees it. Who hears one saying leaves the air to the other one, and answers when that is over.
"""

from __future__ import annotations

from typing import Final

from .air import AirClock
from .codec.frames import RadioFrame, Saying
from .codec.wire import BRIEF_ARM, OVERHEAD, Kind
from .patience import Patience
from .transfer import BRIEF_NUMBERS, Transfer

_LOSES_US: Final = 300_000_000
"""So long after a question without an answer the air counts as one that loses: a fade of a boat that turns is over by then."""
_SLIP_US: Final = 20_000
"""By so much the second saying may be later than computed: the other end's waking."""


_LATE_US: Final = 100_000
"""By so much more it may be later, and is still the second of the same."""


class Twice:
    """Times of second sayings, for both ends."""

    def __init__(self, clock: AirClock, patience: Patience) -> None:
        self._clock = clock
        self._patience = patience
        self._gap_us = round(clock.profile.link.gap_ms * 1e3)
        self._lost_us: int | None = None
        self._number: int | None = None
        """Of the newest message that was said twice to us."""
        self.other_until_us = 0
        """So long the other end says something a second time: who talks does not hear it."""

    # ---- who orders ---------------------------------------------------------------------------------------------

    def not_answered(self, now_us: int) -> None:
        """A question found no answer in time."""
        self._lost_us = now_us

    def begin(self, item: Transfer, now_us: int) -> Saying:
        """How to say a message that is asked now. One that was asked once is repeated once: there is no time for more."""
        loses = self._lost_us is not None and now_us - self._lost_us < _LOSES_US
        is_arming = item.kind is Kind.ORDER and item.parts[0] == BRIEF_ARM
        item.is_half_said = is_arming and (loses if item.tries == 1 else item.is_said_twice)
        return Saying.FIRST if item.is_half_said else Saying.ONLY

    def heard_answer(self, item: Transfer | None, size: int, now_us: int) -> int:
        """An answer of so many bytes came, to a message of ours or to none that still waits. Returns for how long the second one comes."""
        if item is None or not item.is_said_twice or now_us > item.off_us + self._between_us():
            return 0
        again_us = self._again_us(size)
        self.other_until_us = now_us + again_us
        return again_us

    def _between_us(self) -> int:
        """From the end of our second saying to the middle between the latest first answer and the earliest second one."""
        latest_us, earliest_us = self._patience.answer_us(), self._clock.span_us(OVERHEAD) * 2 + self._gap_us
        return (latest_us + earliest_us) // 2

    # ---- who obeys ----------------------------------------------------------------------------------------------

    def heard(self, frame: RadioFrame, now_us: int) -> bool:
        """A message came: after the first saying the air is the second one's. Returns whether it is the second of what was heard before."""
        if frame.saying is Saying.ONLY:
            return False
        is_first = frame.saying is Saying.FIRST
        is_again = not is_first and now_us < self.other_until_us + _LATE_US
        self._number = BRIEF_NUMBERS + frame.body[0]
        self.other_until_us = now_us + (self._again_us(OVERHEAD) if is_first else 0)
        return is_again

    def was_said(self, number: int) -> bool:
        """Whether a message was said twice, and so is to be answered."""
        return number == self._number

    def _again_us(self, size: int) -> int:
        """From the end of a saying of so many bytes to that of the next one."""
        return self._gap_us + self._clock.span_us(size) + _SLIP_US
