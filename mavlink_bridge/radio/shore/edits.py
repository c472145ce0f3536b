"""Changes of a part of a plan. The rest is what the shore takes for the plan aboard, where somebody may have put another one over another
link: so the vessel is asked which plan she has, and a change goes to her only when it was made of that one.

What she says before she has answered the question may be older than the question: then she is asked anew. Somebody may still
change the plan while the change is on the air; where a state tells of it in time the change is called back.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Final

from ...language.requests import LoadPlan, Reply, RequestBody, Result
from ...mavlink.missions.plan_rules import plan_id
from ...mavlink.missions.store import ANOTHER_ABOARD
from ..air import Priority
from ..codec.info import Kept, Wanted
from ..codec.wire import Kind
from ..link import CompactLink
from ..transfer import TransferOutcome
from .orders import OVERTAKEN, PendingOrders

ANOTHER: Final = Reply(Result.DENIED, ANOTHER_ABOARD)
_UNTOLD: Final = Reply(Result.FAILED, "the vessel did not say which one she has; nothing was changed")
_QUESTION: Final = bytes((Wanted.INFO,))


@dataclass(slots=True, eq=False)
class Edit:
    """A change that waits for the vessel's word."""

    owner: Hashable
    body: LoadPlan
    station: Hashable
    until_us: int
    number: int | None = None
    """The question on the air; None: it was answered."""
    came_early: bool = False
    """She said what she has while the question was on the air: perhaps before she heard it."""


class Edits:
    """Those of one shore that have not been sent yet. ``send``: gives one to the air, and raises ValueError for what does not cross."""

    def __init__(self, link: CompactLink, pending: PendingOrders, send: Callable[[Edit, int], None]) -> None:
        self._link = link
        self._pending = pending
        self._send = send
        self._limit_us = round(link.profile.link.upload_s * 1e6)
        """A station waits twice as long for an upload: as long again is left for the plan itself."""
        self._waiting: list[Edit] = []
        self._ended: list[tuple[Hashable, Reply]] = []

    def take(self, owner: Hashable, body: RequestBody, station: Hashable, now_us: int) -> bool:
        """Ask the vessel before a change; False for everything else. Raises ValueError with the reason when the question does not cross."""
        if not isinstance(body, LoadPlan):
            return False
        # a change must not come after the plan that followed it
        others = [edit for edit in self._waiting if edit.body.kind is body.kind]
        self._end([edit for edit in others if plan_id(edit.body.items) != plan_id(body.items)], OVERTAKEN)
        if body.base_id is None:
            return False
        edit = Edit(owner, body, station, now_us + self._limit_us)
        self._ask(edit, now_us)
        self._waiting.append(edit)
        return True

    def _ask(self, edit: Edit, now_us: int) -> None:
        limit_us = edit.until_us - now_us
        edit.number = self._link.submit(Kind.INFO, _QUESTION, Priority.COMMAND, now_us, limit_us)
        edit.came_early = False

    def ended(self, outcome: TransferOutcome) -> bool:
        """Note how a question ended; False when the message was none from here."""
        edit = next((edit for edit in self._waiting if edit.number == outcome.id), None)
        if edit is None:
            return False
        edit.number = None
        if outcome.reply.result is not Result.ACCEPTED:
            self._end([edit], outcome.reply)
        return True

    def told(self, kept: Kept, now_us: int) -> None:
        """The vessel has said what she has."""
        for edit in self._waiting:
            edit.came_early |= edit.number is not None
        for edit in [edit for edit in self._waiting if edit.number is None and not edit.came_early]:
            self._waiting.remove(edit)
            if self._pending.join(edit.owner, edit.body, edit.station) is None:
                self._judge(edit, kept, now_us)

    def _judge(self, edit: Edit, kept: Kept, now_us: int) -> None:
        if kept.plan_id(edit.body.kind) != edit.body.base_id:
            self._end([edit], ANOTHER)
        elif self._pending.is_on_its_way(edit.body.kind):
            self._end([edit], OVERTAKEN)
        else:
            self._try(self._send, edit, now_us)

    def tick(self, now_us: int) -> None:
        """Ask anew, and give up."""
        self._end([edit for edit in self._waiting if now_us >= edit.until_us], _UNTOLD)
        for edit in [edit for edit in self._waiting if edit.number is None and edit.came_early]:
            self._try(self._ask, edit, now_us)

    def replies(self) -> list[tuple[Hashable, Reply]]:
        """Answers since the last call, with the owners given to ``take``."""
        found, self._ended = self._ended, []
        return found

    def _try(self, submit: Callable[[Edit, int], None], edit: Edit, now_us: int) -> None:
        try:
            submit(edit, now_us)
        except ValueError as error:
            self._end([edit], Reply(Result.DENIED, str(error)))

    def _end(self, edits: list[Edit], reply: Reply) -> None:
        self._waiting = [edit for edit in self._waiting if edit not in edits]
        self._ended += [(edit.owner, reply) for edit in edits]
