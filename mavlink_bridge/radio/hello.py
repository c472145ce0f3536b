"""When to say HELLO: at the start, when greeted, and when bytes come that nobody authentic seems to have sent.

It is repeated at growing intervals until a frame of the session shows that the other end heard it. Where the hour is short the
shore's first repeat comes soon, and any other only when it leaves the hour what an opening and the answers to two orders take: a
HELLO into the void must not cost the answer to who comes later. Greetings that prove nothing (an old recording looks like one) are
answered ever more seldom until one proves itself, so that they buy a stranger next to no airtime; the answer serves every gateway
that listens, so that they do not use up somebody else's either.
"""

from __future__ import annotations

import random
from typing import Final

from .air import RadioProfile
from .codec.state import KEY_BYTES, TIME_BYTES
from .codec.wire import OVERHEAD
from .session import NONCE_BYTES

_START_US: Final = 1_000_000
"""Both ends may start at the same moment; they should not speak at it."""
_FIRST_US: Final = 3_000_000
_SPREAD_US: Final = 10_000_000
"""Two ends that started together must not meet on the air again and again."""
_THRIFTY_FIRST_US: Final = 600_000_000
_SOON_US: Final = 5_000_000
"""Two first greetings that met: the shore says its own again, the vessel, whose answers cost more, does not."""
_CROSSED_US: Final = 2_000_000
"""Two first greetings cross when they are due within a second, and the later one is heard a packet after that."""
_TURN_US: Final = 250_000
"""What two serial lines each way and a tick add to the air."""
_MAX_US: Final = 3_600_000_000
_STRANGE_BYTES: Final = 8
_QUIET_US: Final = 30_000_000
_ANSWER_GAP_US: Final = 2_000_000
_ANSWER_GROWTH: Final = 1.5
_ANSWER_GAP_MAX_US: Final = 60_000_000
"""At most 0.7 % of the time on the air, for who sends old greetings for ever."""
_ANSWER_GAP_THRIFTY_US: Final = 1_800_000_000
_SUSPECT: Final = 3
"""After so many answers that came to nothing the next one proves itself to nobody in particular, and so serves all."""
HELLO_FRAME_BYTES: Final = 1 + NONCE_BYTES + 4 + OVERHEAD
"""The longer one, the vessel's."""


SHOWN_BYTES: Final = KEY_BYTES + TIME_BYTES + OVERHEAD
"""The state that shows the vessel to a shore that has just started; it tells its time."""
_ORDERS: Final = 2


def kept_us(profile: RadioProfile) -> int:
    """What a HELLO that nobody waits for leaves in the hour: an opening, and the answers to two orders."""
    return profile.airtime_us(HELLO_FRAME_BYTES + SHOWN_BYTES) + _ORDERS * profile.stop_us


class Greeting:
    """Keeps the time of the next HELLO and what it has to say."""

    def __init__(self, profile: RadioProfile, rng: random.Random, now_us: int = 0, *, is_vessel: bool = False) -> None:
        self._is_thrifty = profile.is_thrifty
        self._first_us = _THRIFTY_FIRST_US if self._is_thrifty else _FIRST_US
        self._rng = rng
        self._due_us: int | None = now_us + rng.randrange(_START_US)
        self._wait_us = self._first_us
        self._is_vessel = is_vessel
        self._greeting_us = profile.airtime_us(HELLO_FRAME_BYTES)
        self._answer_us = profile.airtime_us(HELLO_FRAME_BYTES + SHOWN_BYTES) + _TURN_US
        """The vessel's longest answer is here so long after it has heard us, and is off the air itself."""
        self._asked_us: int | None = None
        """When our newest greeting that nobody has answered went out."""
        self.quiet_until_us = 0
        """Until then the vessel answers us: nothing of ours may be in its way."""
        self._is_soon = self._is_thrifty and not is_vessel
        """The first repeat has not been planned yet."""
        self.is_idle = False
        """The next one is a repeat that nobody waits for."""
        self.please = True
        self._is_answer = False
        self._strange = 0
        self._is_sure = False
        self._answered_us: int | None = None
        self._answer_gap_us = _ANSWER_GAP_US
        self._vain = 0
        """Answers since a new start of the other end proved itself."""

    def is_due(self, now_us: int) -> bool:
        return self._due_us is not None and now_us >= self._due_us

    @property
    def proof(self) -> bool:
        """Whether the next HELLO proves itself to who greeted last."""
        return self._is_answer and self._vain < _SUSPECT

    def sent(self, now_us: int) -> None:
        """Plan the next one, when this one asked for an answer."""
        if self._is_answer:
            self._answered_us = now_us
            self._vain += 1
            limit_us = _ANSWER_GAP_THRIFTY_US if self._is_thrifty else _ANSWER_GAP_MAX_US
            self._answer_gap_us = min(round(self._answer_gap_us * _ANSWER_GROWTH), limit_us)
        self._is_answer = False
        if not self.please:
            self._due_us = None
            return
        self._asked_us = now_us
        if self._is_soon:
            self._is_soon = False
            self._due_us = now_us + _SOON_US + self._rng.randrange(_SPREAD_US)
            return
        self.is_idle = True
        self._due_us = now_us + self._wait_us + self._rng.randrange(min(self._wait_us // 2, _SPREAD_US))
        self._wait_us = min(self._wait_us * 2, max(_MAX_US, self._first_us))

    def hurry(self, now_us: int, *, was_silent: bool) -> bool:
        """An order is to go: say HELLO before it when nobody has answered ours, or after a silence when our answer may be lost."""
        if self._is_sure or (self._due_us is None and not was_silent):
            return False
        self.please, self.is_idle = True, False
        self._due_us = now_us
        return True

    def introduce(self, now_us: int) -> None:
        """Prove ourselves, unasked, to who greeted last and may not have heard our answer."""
        self._is_answer, self.please, self.is_idle = True, False, False
        self._due_us = now_us

    def heard(self, now_us: int, *, please: bool, proof: bool) -> None:
        """A HELLO came, perhaps an old one. ``proof``: it answers one of this start."""
        if proof:
            self.answered()
        if not please:
            return
        self._is_answer, self.please, self.is_idle = True, False, False
        due_us = self._clear_us(now_us)
        due_us = due_us if self._answered_us is None else max(due_us, self._answered_us + self._answer_gap_us)
        self._due_us = due_us if self._due_us is None else min(self._due_us, due_us)

    def _clear_us(self, now_us: int) -> int:
        """When to answer. Where two greetings crossed both ends would answer at once, and neither be heard: the shore lets the vessel."""
        if not self._is_vessel and self._asked_us is not None and now_us - self._asked_us < _CROSSED_US:
            self.quiet_until_us = max(now_us, self._asked_us + self._greeting_us) + self._answer_us
        return max(now_us, self.quiet_until_us)

    def answered(self) -> None:
        """The other end has heard us."""
        self._is_sure, self._asked_us = True, None
        self._wait_us = self._first_us
        if not self._is_answer:
            self._due_us = None

    def strange(self, total_bytes: int, heard_us: int | None, now_us: int) -> None:
        """Note how many bytes belong to no authentic frame: when only such come, the other end may have started anew."""
        if total_bytes - self._strange < _STRANGE_BYTES or self._due_us is not None:
            return
        self._strange = total_bytes
        if heard_us is None or now_us - heard_us > _QUIET_US:
            self.please, self._is_sure, self.is_idle = True, False, False
            self._due_us = now_us + self._rng.randrange(500_000)

    def authentic(self, strange_bytes: int) -> None:
        """A frame of the session came: the other end has heard us, and what was strange before does not matter."""
        self._strange = strange_bytes
        self.answered()

    def started(self) -> None:
        """A new start of the other end has proved itself: answers are not in vain."""
        self._vain, self._answer_gap_us = 0, _ANSWER_GAP_US
