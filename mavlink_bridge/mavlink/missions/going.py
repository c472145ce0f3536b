"""Go-tos in the clothes of a mission item (current = 2): what is asked, and who waits for its MISSION_ACK."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from ...language.messages import Severity
from ...language.requests import Reply, Reposition, Result
from ..wire.cmd import Cmd
from ..wire.mapping import degE7_to_rad
from .acks import Acks
from .plan_mapping import compile_item
from .plan_rules import MISSION_RESULT, MissionResult, PlanError, PlanLimits
from .store import Sender
from .wire import item_from_message

_MAX_WAITING: Final = 16
"""More of one link that the vessel has not answered are no operator's."""


@dataclass(frozen=True, slots=True)
class GoTo:
    """What a station asks for."""

    handle: int
    target: Reposition
    message: Any
    """As it came."""


@dataclass(slots=True)
class _Going:
    sender: Sender
    is_overtaken: bool = False
    """Whether its sender has sent another one since: a refusal would be taken for the newer one's."""


class GoTos:
    """Those of one link. Their handles are negative: a plan's are not."""

    def __init__(self, acks: Acks, limits: PlanLimits, say: Callable[[Severity, str], None]) -> None:
        self._acks, self._limits, self._say = acks, limits, say
        self._going: dict[int, _Going] = {}
        self._asked: list[GoTo] = []
        self._last_handle = 0

    def take(self, message: Any, sender: Sender, now_us: int) -> list[Any]:
        """Understand one, or refuse it at once."""
        item = item_from_message(message)
        latitude, longitude = degE7_to_rad(item.x), degE7_to_rad(item.y)
        is_bad = isinstance(compile_item(0, item, self._limits), PlanError) or item.command != Cmd.WAYPOINT
        if is_bad or len(self._going) >= _MAX_WAITING:
            return [self._acks.make(sender, 0, MissionResult.INVALID, now_us)]
        self._last_handle -= 1
        self._going[self._last_handle] = _Going(sender)
        self._asked.append(GoTo(self._last_handle, Reposition(latitude, longitude), message))
        return []

    def asked(self) -> list[GoTo]:
        """Those since the last call. Say of each that it is ``begun``, or ``forget`` it."""
        asked, self._asked = self._asked, []
        return asked

    def begun(self, handle: int) -> None:
        """One is asked of the vessel: its sender wants those before it no more. It is answered by ``finish``."""
        for other, going in self._going.items():
            going.is_overtaken |= other != handle and going.sender == self._going[handle].sender

    def forget(self, handle: int) -> None:
        """One was a copy: its ACK is on its way."""
        self._going.pop(handle, None)

    def finish(self, handle: int, reply: Reply, now_us: int) -> list[Any]:
        """What became of one. Unknown handles are ignored."""
        going = self._going.pop(handle, None)
        if going is None or (going.is_overtaken and reply.result is not Result.ACCEPTED):
            return []
        if reply.reason:
            self._say(Severity.WARNING, f"Go-to refused: {reply.reason}")
        return [self._acks.make(going.sender, 0, MISSION_RESULT[reply.result], now_us)]
