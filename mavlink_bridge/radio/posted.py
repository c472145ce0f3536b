"""Frames that may be lost, and wait for the air: of most kinds only the newest counts, and the newest state tells all."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from .air import Priority
from .codec.frames import STOPS, RadioFrame, Saying
from .codec.wire import Kind
from .transfer import Answer

STATES: Final = frozenset((Kind.KEY, Kind.DELTA))
_REPLACES: Final = {Kind.EVENT: frozenset[Kind](), Kind.TEXT: frozenset[Kind](), **dict.fromkeys(STATES, STATES)}
"""Whose place a frame takes where that is not its own kind's; words and items all count."""
_MAX: Final = 16


@dataclass(slots=True)
class Posted:
    """A frame that waits."""

    kind: Kind
    body: bytes
    priority: Priority
    order: bytes = b""
    """Of an answer: the order without a body that it answers."""
    to: bytes = b""
    """Of an answer: nonce of the start of the other end that is to have it."""
    is_plan_again: bool = False
    """Of an answer: it was given before, to a plan."""
    is_twofold: bool = False
    """Of an answer: it is to be said once more."""

    @classmethod
    def answer(cls, found: Answer, to: bytes, *, is_twofold: bool) -> Posted:
        """The answer to what came for the first time."""
        priority = Priority.STOP if found.is_stop else Priority.COMMAND
        return cls(Kind.REPLY, found.body, priority, found.order, to=to, is_twofold=is_twofold)

    @classmethod
    def again(cls, frame: RadioFrame, reply: bytes, to: bytes) -> Posted:
        """The answer that was given before to what came again."""
        return cls(
            Kind.REPLY,
            reply,
            Priority.STOP if frame.kind in STOPS else Priority.COMMAND,
            order=frame.body[1:] if frame.is_brief else b"",
            to=to,
            is_plan_again=frame.kind is Kind.PLAN,
            is_twofold=frame.saying is not Saying.ONLY,
        )


class PostBox:
    """Keeps them until they go out."""

    def __init__(self) -> None:
        self._waiting: deque[Posted] = deque(maxlen=_MAX)

    def put(self, kind: Kind, body: bytes, priority: Priority) -> None:
        """Add one; it is as urgent as those whose place it takes."""
        replaced = _REPLACES.get(kind, frozenset((kind,)))
        older = [item for item in self._waiting if item.kind in replaced]
        for item in older:
            self._waiting.remove(item)
        self._waiting.append(Posted(kind, body, min([priority, *(item.priority for item in older)])))

    def first(self) -> Posted | None:
        """The most urgent."""
        return min(self._waiting, key=lambda item: item.priority, default=None)

    def remove(self, item: Posted) -> None:
        """It went out."""
        self._waiting.remove(item)

    def state(self) -> Posted | None:
        """The newest state."""
        return next((item for item in self._waiting if item.kind in STATES), None)

    def has(self, kind: Kind) -> bool:
        return any(item.kind is kind for item in self._waiting)
