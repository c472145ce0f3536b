"""Missions, fences and rally points; which item comes next; a go-to in the clothes of a mission item."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from ...language.requests import PlanKind, Reply, RequestBody, SetCurrent
from ...language.snapshot import Snapshot
from ..commands.command import Command, Refused
from ..commands.service import AnswerForm, CommandServer
from ..commands.table import canonical_seq
from ..missions.going import GoTo
from ..missions.service import MissionServer, MissionTiming, UploadLocks
from .channel import Channel
from .service import Handler, Service


class Planning(Service):
    """The mission protocol of one endpoint (``MissionServer`` has its rules). ``orders``: its memory of what was ordered; ``locks``: of
    all endpoints of the vessel.
    """

    def __init__(
        self, channel: Channel, orders: CommandServer, *, locks: UploadLocks | None, timing: MissionTiming | None
    ) -> None:
        config = channel.config
        self._channel, self._orders = channel, orders
        self._server = MissionServer(
            channel.vehicle.plans,
            home_item=config.has_home_item,
            system_id=config.system_id,
            component_id=config.component_id,
            locks=locks,
            timing=timing,
        )
        self._handles: dict[int, tuple[int, PlanKind]] = {}
        """The server's handle of what the vessel was asked for, by the request's number."""
        self._jumps: set[int] = set()
        """Requests for another item, whose place is shown when they are answered."""

    @property
    def handles(self) -> Mapping[str, Handler]:
        return dict.fromkeys(self._server.handles, self._on_mission) | {"MISSION_SET_CURRENT": self._on_set_current}

    def reply(self, request_id: int, reply: Reply, now_us: int) -> bool:
        if request_id in self._jumps:
            self._jumps.discard(request_id)
            self._channel.show_plans_place()
        if request_id not in self._handles:
            return False
        handle, kind = self._handles.pop(request_id)
        plan_id = self._channel.vehicle.plans.plan_id(kind)
        self._channel.answer(self._server.finish(handle, reply, plan_id, now_us), urgent=True)
        self._hand_on()
        return True

    @property
    def busy(self) -> bool:
        return self._server.busy

    def poll(self, now_us: int) -> None:
        self._channel.answer(self._server.poll(now_us), urgent=self._channel.is_slow)
        self._hand_on()

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        if self._channel.is_slow:
            self._channel.hush(streams=self._server.busy)

    def _on_mission(self, message: Any, now_us: int) -> None:
        self._channel.answer(self._server.handle(message, now_us), urgent=self._channel.is_slow)
        self._hand_on()

    def _on_set_current(self, message: Any, now_us: int) -> None:
        try:
            seq = canonical_seq(message.seq, self._channel.context())
        except Refused as refusal:
            self._channel.explain(str(refusal))
            return
        self._channel.ask(SetCurrent(seq), message.get_srcSystem(), self._jumps.add)

    def _hand_on(self) -> None:
        """Pass on what a mission message led to: a whole plan, a go-to, texts."""
        for handle, load in self._server.loads():
            self._ask(handle, load, load.kind, 0)
        for to in self._server.go_tos.asked():
            self._go(to)
        for severity, text in self._server.drain_texts():
            if text:
                self._channel.say(severity, text)

    def _go(self, to: GoTo) -> None:
        """A go-to is an order like a command, with the same memory: a repeat does not start the boat after somebody stopped it."""
        now_us, sequence = self._channel.now_us, to.message.get_seq()
        command, go_tos = Command.of_go_to(to.message), self._server.go_tos
        again = self._orders.recall(command, sequence, now_us, told=AnswerForm.ELSEWHERE)
        if again is None:
            case = self._orders.begin(command, sequence, to.target, now_us)
            go_tos.begun(to.handle)
            self._ask(to.handle, to.target, PlanKind.MISSION, command.sender[0], partial(self._orders.asked, case))
        elif again.reply is None:
            go_tos.forget(to.handle)
        else:
            self._channel.answer(go_tos.finish(to.handle, again.reply, now_us), urgent=True)

    def _ask(
        self,
        handle: int,
        body: RequestBody,
        kind: PlanKind,
        sender: int,
        asked: Callable[[int], object] = lambda number: None,
    ) -> None:
        def note(number: int) -> None:
            self._handles[number] = handle, kind
            asked(number)

        self._channel.ask(body, sender, note)
