"""MISSION_ACKs, and the memory of the last ones: a station that missed its ACK repeats its last item and is told again."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Final

from ..wire.codec import dialect
from .plan_rules import MissionResult
from .store import Sender

_MAX: Final = 16
_REMEMBER_US: Final = 10_000_000
_APART_US: Final = 100_000
"""Repeats closer than this are left out: several late items are one missed ACK."""


@dataclass(slots=True)
class _Last:
    message: Any
    made_us: int
    sent_us: int


class Acks:
    """Makes the MISSION_ACKs of one link. Bounded."""

    def __init__(self) -> None:
        self._last: OrderedDict[tuple[Sender, int], _Last] = OrderedDict()

    def make(self, sender: Sender, mission_type: int, result: MissionResult, now_us: int, plan_id: int = 0) -> Any:
        """A new MISSION_ACK, remembered for ``repeat``."""
        message = dialect.MAVLink_mission_ack_message(*sender, int(result), mission_type, opaque_id=plan_id)
        self._last[sender, mission_type] = _Last(message, now_us, now_us)
        if len(self._last) > _MAX:
            self._last.popitem(last=False)
        return message

    def repeat(self, sender: Sender, mission_type: int, now_us: int) -> list[Any]:
        """The last ACK of this transfer once more, when it is not older than 10 s."""
        last = self._last.get((sender, mission_type))
        if last is None or now_us - last.made_us > _REMEMBER_US or now_us - last.sent_us < _APART_US:
            return []
        last.sent_us = now_us
        return [last.message]

    def forget(self, sender: Sender, mission_type: int) -> None:
        """A new transfer begins."""
        self._last.pop((sender, mission_type), None)
