"""Requests that come again: by the network's copies, by a console that asks once more, across a restart. None is carried out twice.

A copy has its packet's own time stamp and is passed over. A repeat is the same request under the same number with a new time
stamp: it gets the remembered answer again. What was sent before a newer order of the same console comes too late.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge import imc
from mavlink_bridge.imc.peers import SET_BACK_S

REPEAT_S: Final = 10.0
"""Consoles give up waiting about then; the same number later is a new console's."""
_KEPT: Final = 64


@dataclass(slots=True)
class _Case:
    digest: str
    sent_s: float
    answer: imc.Message | None = None
    is_restored: bool = False
    """It was taken before a restart: what became of it is not known."""


Key = tuple[int, int, int]
"""Console's id, number of the message, request id."""


class Repeats:
    """Memory of the newest requests. ``saved``: what outlived a restart."""

    def __init__(self, saved: object = None) -> None:
        self._cases: OrderedDict[Key, _Case] = OrderedDict()
        self._newest: dict[int, float] = {}
        for row in saved if isinstance(saved, list) else ():
            if isinstance(row, list) and len(row) == 5 and all(isinstance(each, int | float | str) for each in row):
                asker, number, request_id, digest, sent_s = row
                self._cases[int(asker), int(number), int(request_id)] = _Case(
                    str(digest), float(sent_s), is_restored=True
                )
                self._newest[int(asker)] = max(self._newest.get(int(asker), 0.0), float(sent_s))

    def seen(self, asker: int, message: imc.PlanDB | imc.PlanControl, sent_s: float) -> _Case | None:
        """The case that this is a copy or a repeat of; None for a new request."""
        case = self._cases.get(_key(asker, message))
        if case is None or case.digest != _digest(message) or abs(sent_s - case.sent_s) > REPEAT_S:
            return None
        return case

    def is_late(self, asker: int, sent_s: float) -> bool:
        """Whether a newer order of the console was taken already."""
        newest = self._newest.get(asker)
        return newest is not None and 0.0 < newest - sent_s < SET_BACK_S

    def open(self, asker: int, message: imc.PlanDB | imc.PlanControl, sent_s: float, *, is_order: bool) -> None:
        """Remember a request that is carried out now."""
        key = _key(asker, message)
        self._cases.pop(key, None)
        self._cases[key] = _Case(_digest(message), sent_s)
        if is_order:
            self._newest[asker] = sent_s
            if len(self._newest) > _KEPT:
                del self._newest[next(iter(self._newest))]
        if len(self._cases) > _KEPT:
            self._cases.popitem(last=False)

    def close(self, asker: int, request: imc.PlanDB | imc.PlanControl, answer: imc.Message) -> None:
        """Remember what was answered."""
        case = self._cases.get(_key(asker, request))
        if case is not None:
            case.answer = answer

    def export(self) -> list[Any]:
        """The newest orders, for the store."""
        return [[*key, case.digest, case.sent_s] for key, case in self._cases.items() if key[1] == _ORDER][-8:]


_ORDER: Final = imc.PlanControl.NUMBER


def _key(asker: int, message: imc.PlanDB | imc.PlanControl) -> Key:
    return asker, message.NUMBER, message.request_id


def _digest(message: imc.Message) -> str:
    """What tells two requests under one number apart, those that hold something unread included."""
    content = repr(message).encode("utf-8", "surrogatepass")
    return hashlib.sha256(content).hexdigest()[:16]
