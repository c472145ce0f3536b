"""When to say HELLO: at the start, when asked, and when bytes come that nobody authentic seems to have sent.

HELLO carries the sender's whole counter and its session, a number that changes with each start: an end that hears a
new session forgets the old one's messages. It is repeated at growing intervals until the other end shows that it
heard.
"""

from __future__ import annotations

import random
from typing import Final

from .air import RadioProfile
from .codec.frames import COUNTER_BYTES

_PLEASE: Final = 0x80
_START_US: Final = 1_000_000
"""Both ends may start at the same moment; they should not speak at it."""
_FIRST_US: Final = 3_000_000
_SPREAD_US: Final = 10_000_000
"""Two ends that started together must not meet on the air again and again."""
_THRIFTY_FIRST_US: Final = 600_000_000
_MAX_US: Final = 3_600_000_000
_THRIFTY_HOUR_US: Final = 36_000_000
_STRANGE_BYTES: Final = 8
_QUIET_US: Final = 30_000_000
SESSIONS: Final = 128
HELLO_FRAME_BYTES: Final = COUNTER_BYTES + 7


class Greeting:
    """Keeps the time of the next HELLO and the sessions of both ends."""

    def __init__(self, profile: RadioProfile, rng: random.Random, now_us: int = 0) -> None:
        thrifty = profile.hour_us is not None and profile.hour_us < _THRIFTY_HOUR_US
        self._first_us = _THRIFTY_FIRST_US if thrifty else _FIRST_US
        self._rng = rng
        self.session = rng.randrange(SESSIONS)
        self.other_session: int | None = None
        self._due_us: int | None = now_us + rng.randrange(_START_US)
        self._wait_us = self._first_us
        self._please = True
        self._strange = 0
        self._is_sure = False

    def is_due(self, now_us: int) -> bool:
        return self._due_us is not None and now_us >= self._due_us

    @property
    def flags(self) -> int:
        return self.session | (_PLEASE if self._please else 0)

    def sent(self, now_us: int) -> None:
        """Plan the next one, when this one asked for an answer."""
        if not self._please:
            self._due_us = None
            return
        self._due_us = now_us + self._wait_us + self._rng.randrange(min(self._wait_us // 2, _SPREAD_US))
        self._wait_us = min(self._wait_us * 2, max(_MAX_US, self._first_us))

    def hurry(self, now_us: int, *, was_silent: bool) -> bool:
        """An order is to go: say HELLO before it when nobody has answered ours, or after a silence when our answer may be lost."""
        if self._is_sure or (self._due_us is None and not was_silent):
            return False
        self._please = True
        self._due_us = now_us
        return True

    def answered(self) -> None:
        """The other end has shown that it hears us."""
        self._is_sure = True
        self._due_us = None
        self._wait_us = self._first_us

    def heard(self, body: bytes, now_us: int) -> bool:
        """Take a HELLO's body; True when the other end has started anew since."""
        flags = body[COUNTER_BYTES] if len(body) > COUNTER_BYTES else 0
        if flags & _PLEASE:
            self._please = self._is_sure = False
            self._due_us = now_us
        else:
            self.answered()
        session = flags & ~_PLEASE
        is_new = session != self.other_session
        self.other_session = session
        return is_new

    def strange(self, total_bytes: int, heard_us: int | None, now_us: int) -> None:
        """Note how many bytes belong to no authentic frame: when only such come, the counters may be apart."""
        if total_bytes - self._strange < _STRANGE_BYTES or self._due_us is not None:
            return
        self._strange = total_bytes
        self.unbelieved(heard_us, now_us)

    def unbelieved(self, heard_us: int | None, now_us: int) -> None:
        """Something of the other end came that cannot be believed: after a silence tell it the counter from here, and ask for its own."""
        if self._due_us is None and (heard_us is None or now_us - heard_us > _QUIET_US):
            self._please = True
            self._due_us = now_us + self._rng.randrange(500_000)

    def authentic(self, strange_bytes: int) -> None:
        """An authentic frame came: what was strange before it does not matter."""
        self._strange = strange_bytes
