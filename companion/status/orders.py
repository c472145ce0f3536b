"""Orders of the page: Hold and Disarm, by challenge and response, judged aboard. No I/O, no clock.

The page asks for a challenge, answers it with HMAC-SHA-256 under the page's key (RFC 2104, FIPS 180-4) over purpose, vessel, nonce
and order, and the vessel carries the order out once, within the challenge's life. The key crosses no link; whoever carries the messages,
the page's own server too, can drop them and nothing else. A challenge costs the vessel no memory: it knows its own by a tag. The
vessel's answer carries a tag of the same key, so that nobody can pretend that it has obeyed.
"""

from __future__ import annotations

import hashlib
import hmac
from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Final, NamedTuple, assert_never

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, RequestBody, SetMode

LIFE_US: Final = 5_000_000
"""A challenge older than this is dead: more than a press, a slow link and a slow telephone need together."""
_ASK: Final = "usv-companion page order 1"
_TELL: Final = "usv-companion page answer 1"
"""What a tag is for; one of an order is none of an answer."""
_MOST_USED: Final = 4096
"""Orders rightly keyed within one life; beyond that, all are refused until some have died."""


class PageOrder(Enum):
    """What the page may order: what stops. Nothing here starts motion."""

    HOLD = "hold"
    DISARM = "disarm"
    CHECK = "check"
    """Does nothing: whether the key is right is found out before it is needed."""


def body_of(order: PageOrder) -> RequestBody | None:
    """The request that an order is; None: nothing is asked of the vessel."""
    match order:
        case PageOrder.CHECK:
            return None
        case PageOrder.HOLD:
            return SetMode(Mode.HOLD)
        case PageOrder.DISARM:
            return Arm(arm=False)
        case _:
            assert_never(order)


class RefusedOrder(NamedTuple):
    """An order that is not carried out, and why."""

    why: str


def tag(key: bytes, purpose: str, *parts: str) -> str:
    """The tag of a message under a key, hexadecimal. Parts hold no line ends, so that no two messages are one text."""
    return hmac.new(key, "\n".join((purpose, *parts)).encode(), hashlib.sha256).hexdigest()


class Challenges:
    """Challenges of one vessel in one life of its process. ``key`` None: no order is taken.

    ``vessel``: its random id. ``random_fn`` gives that many bytes that nobody can guess.
    """

    def __init__(self, key: bytes | None, vessel: str, random_fn: Callable[[int], bytes]) -> None:
        self.key = key
        self.vessel = vessel
        self._random = random_fn
        self._own = random_fn(32)
        self._used: deque[tuple[int, str, str]] = deque()
        self._used_nonces: set[str] = set()
        self._newest: dict[str, str] = {}
        """Of each page that has ordered within one life, when the youngest challenge of its orders was made."""

    def challenge(self, now_us: int) -> str:
        """A fresh nonce: when it was made, chance, and the tag by which it is known again."""
        body = f"{now_us:016x}{self._random(8).hex()}"
        return body + self._mark(body)

    def judge(self, order: str, nonce: str, response: str, now_us: int, *, page: str = "") -> PageOrder | RefusedOrder:
        """Return the order when the response is right, fresh and new; else why it is refused.

        ``page``: which open page says it, by a name of its own choice; "" is none. An order that was held up on the way is refused
        when a later one of the same page has come before it; other pages' orders are other people's, and stand.
        """
        if self.key is None:
            return RefusedOrder("no key aboard: the page only shows")
        if len(nonce) != 64 or not hmac.compare_digest(nonce[32:].encode(), self._mark(nonce[:32]).encode()):
            return RefusedOrder("not a challenge of this vessel's life: press again")
        if not 0 <= now_us - int(nonce[:16], 16) <= LIFE_US:
            return RefusedOrder("too late: press again")
        right = tag(self.key, _ASK, self.vessel, nonce, order)
        if not hmac.compare_digest(right.encode(), response.encode()):
            return RefusedOrder("wrong key")
        if not self._is_new(nonce, now_us):
            return RefusedOrder("heard before: press again")
        if page and nonce[:16] < self._newest.get(page, ""):
            return RefusedOrder("a later order came first: press again")
        self._take(nonce, page, now_us)
        try:
            return PageOrder(order)
        except ValueError:
            return RefusedOrder("the page may order Hold and Disarm only")

    def answer_tag(self, nonce: str, outcome: str) -> str:
        """What proves the vessel's answer to whoever has the key."""
        return "" if self.key is None else tag(self.key, _TELL, self.vessel, nonce, outcome)

    def _mark(self, body: str) -> str:
        return hmac.new(self._own, body.encode(), hashlib.sha256).hexdigest()[:32]

    def _is_new(self, nonce: str, now_us: int) -> bool:
        while self._used and now_us - self._used[0][0] > LIFE_US:
            _, dead, page = self._used.popleft()
            self._used_nonces.discard(dead)
            if self._newest.get(page) == dead[:16]:
                del self._newest[page]
        return nonce not in self._used_nonces and len(self._used) < _MOST_USED

    def _take(self, nonce: str, page: str, now_us: int) -> None:
        self._used.append((now_us, nonce, page))
        self._used_nonces.add(nonce)
        if page:
            self._newest[page] = nonce[:16]
