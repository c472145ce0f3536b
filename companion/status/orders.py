"""Orders of the page: Hold and Disarm, by challenge and response, judged aboard. No I/O, no clock.

The page asks for a challenge, answers it with HMAC-SHA-256 under the page's key (RFC 2104, FIPS 180-4) over purpose, vessel, nonce,
order and the page's own name, and the vessel carries the order out once, within the challenge's life; who says it again is told the
same answer again. The key crosses no link; whoever carries the messages, the page's own server too, can drop them, and hold them up for
that life, and nothing else. A challenge costs the vessel no memory: it knows its own by a tag. The vessel's answer carries a tag of the
same key, so that nobody can pretend that it has obeyed.
"""

from __future__ import annotations

import hashlib
import hmac
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final, NamedTuple, assert_never

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, RequestBody, SetMode

LIFE_US: Final = 5_000_000
"""A challenge older than this is dead: more than a press, a slow link and a slow telephone need together."""
_ASK: Final = "usv-companion page order 2"
_ASK_NAMELESS: Final = "usv-companion page order 1"
"""Of a page without a name, or one that was loaded before names were proved: its Hold is obeyed until somebody loads it again."""
_TELL: Final = "usv-companion page answer 1"
"""What a tag is for; one of an order is none of an answer."""
_AGE: Final = 24
"""Characters of a nonce by which it is told which of two is older: the time is a tick's, in which several may be made, and so their
number follows it."""
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


@dataclass(slots=True)
class HeardOrder:
    """An order that has come already, for whoever says it again: a browser does so when its connection breaks before the answer."""

    order: str
    page: str
    nonce: str
    taken_us: int
    answer: dict[str, Any] | None = None
    """What the vessel said to it; None until then."""
    waiting: list[Callable[[dict[str, Any]], None]] = field(default_factory=list)

    def tell(self, say: Callable[[dict[str, Any]], None]) -> None:
        """Say the answer, now or as soon as there is one."""
        if self.answer is None:
            self.waiting.append(say)
        else:
            say(self.answer)

    def answered(self, answer: dict[str, Any]) -> None:
        """Keep the answer, and say it to all who wait."""
        self.answer = answer
        for say in self.waiting:
            say(answer)
        self.waiting.clear()


def tag(key: bytes, purpose: str, *parts: str) -> str:
    """The tag of a message under a key, hexadecimal. Parts hold no line ends, so that no two messages are one text."""
    return hmac.new(key, "\n".join((purpose, *parts)).encode(), hashlib.sha256).hexdigest()


def _is_same(one: str, other: str) -> bool:
    """In a time that tells nothing of where they differ."""
    return hmac.compare_digest(one.encode(), other.encode())


class Challenges:
    """Challenges of one vessel in one life of its process. ``key`` None: no order is taken.

    ``vessel``: its random id. ``random_fn`` gives that many bytes that nobody can guess.
    """

    def __init__(self, key: bytes | None, vessel: str, random_fn: Callable[[int], bytes]) -> None:
        self.key = key
        self.vessel = vessel
        self._random = random_fn
        self._own = random_fn(32)
        self._made = 0
        self._used: deque[HeardOrder] = deque()
        self._heard: dict[str, HeardOrder] = {}
        """The orders that have come within one life, by their nonces."""
        self._newest: dict[str, str] = {}
        """Of each page that has ordered within one life, how young the youngest challenge of its orders is."""

    def challenge(self, now_us: int) -> str:
        """A fresh nonce: when it was made, its number, chance, and the tag by which it is known again."""
        self._made = (self._made + 1) % (1 << 32)
        body = f"{now_us:016x}{self._made:08x}{self._random(4).hex()}"
        return body + self._mark(body)

    def judge(
        self, order: str, nonce: str, response: str, now_us: int, *, page: str = ""
    ) -> PageOrder | HeardOrder | RefusedOrder:
        """Return the order when the response is right, fresh and new; what has been heard already; else why it is refused.

        ``page``: which page says it, by a name of its own choice; one that is not under the response's tag is none. An order that was
        held up on the way is refused when a later one of the same page has come before it; other pages' are other people's, and stand.
        """
        if self.key is None:
            return RefusedOrder("no key aboard: the page only shows")
        if len(nonce) != 64 or not _is_same(nonce[32:], self._mark(nonce[:32])):
            return RefusedOrder("not a challenge of this vessel's life: press again")
        self._forget(now_us)
        asked = (self.vessel, nonce, order)
        named = _is_same(tag(self.key, _ASK, *asked, page), response)
        is_right = named or _is_same(tag(self.key, _ASK_NAMELESS, *asked), response)
        earlier = self._heard.get(nonce)
        if earlier is not None and is_right and earlier.order == order:
            return earlier
        if not 0 <= now_us - int(nonce[:16], 16) <= LIFE_US:
            return RefusedOrder("too late: press again")
        if not is_right:
            return RefusedOrder("wrong key")
        if earlier is not None:
            return RefusedOrder("heard before: press again")
        if len(self._used) >= _MOST_USED:
            return RefusedOrder("too many orders: press again")
        page = page if named else ""
        if page and nonce[:_AGE] < self._newest.get(page, ""):
            return RefusedOrder("a later order came first: press again")
        try:
            known = PageOrder(order)
        except ValueError:
            return RefusedOrder("the page may order Hold and Disarm only")
        self._take(HeardOrder(order, page, nonce, now_us))
        return known

    def answered(self, nonce: str, outcome: str, **more: float | None) -> dict[str, Any]:
        """The vessel's answer to an order, with what proves it to whoever has the key; kept, to be the same when it is asked again."""
        answer = {"outcome": outcome, "tag": self.answer_tag(nonce, outcome), **more}
        heard = self._heard.get(nonce)
        if heard is not None:
            heard.answered(answer)
        return answer

    def answer_tag(self, nonce: str, outcome: str) -> str:
        """What proves the vessel's answer to whoever has the key."""
        return "" if self.key is None else tag(self.key, _TELL, self.vessel, nonce, outcome)

    def _mark(self, body: str) -> str:
        return hmac.new(self._own, body.encode(), hashlib.sha256).hexdigest()[:32]

    def _forget(self, now_us: int) -> None:
        while self._used and now_us - self._used[0].taken_us > LIFE_US:
            dead = self._used.popleft()
            del self._heard[dead.nonce]
            if self._newest.get(dead.page) == dead.nonce[:_AGE]:
                del self._newest[dead.page]

    def _take(self, heard: HeardOrder) -> None:
        self._used.append(heard)
        self._heard[heard.nonce] = heard
        if heard.page:
            self._newest[heard.page] = heard.nonce[:_AGE]
