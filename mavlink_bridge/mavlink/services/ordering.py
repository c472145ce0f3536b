"""Commands and SET_MODE: what an operator orders, answered when the vessel has obeyed or said why not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from ...language import requests as ask
from ...language.requests import Origin, Reply
from ...language.snapshot import Snapshot
from ..commands.command import Command
from ..commands.local import LOCAL, answer
from ..commands.service import CommandOutcome, CommandServer
from ..commands.table import NO_CUSTOM_MODE
from ..persona.modes import foreign_name, from_custom_mode
from .channel import Channel
from .service import Handler, Service


class Ordering(Service):
    """The command protocol of one endpoint (``CommandServer`` has its rules)."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._server = CommandServer(channel.config.give_up_s, channel.vehicle.deeds)

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {"COMMAND_LONG": self._on_command, "COMMAND_INT": self._on_command, "SET_MODE": self._on_set_mode}

    def reply(self, request_id: int, reply: Reply, now_us: int) -> bool:
        outcome = self._server.reply(request_id, reply, now_us)
        if outcome is not None:
            self._finish(outcome)
        return outcome is not None

    @property
    def busy(self) -> bool:
        return bool(self._server.waiting)

    def poll(self, now_us: int) -> None:
        self._channel.answer(self._server.poll(now_us), urgent=True)

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        self._server.see(snapshot.mode, snapshot.armed, now_us)

    def _finish(self, outcome: CommandOutcome) -> None:
        self._channel.answer(outcome.messages, urgent=True)
        if outcome.reason:
            self._channel.explain(outcome.reason)

    def _on_command(self, message: Any, now_us: int) -> None:
        command, sequence = Command.from_message(message), message.get_seq()
        confirmation = getattr(message, "confirmation", 0)
        again = self._server.recall(command, sequence, now_us, confirmation=confirmation)
        if again is not None:
            self._finish(again)
            if command.id not in LOCAL:
                return
        if command.id in LOCAL:
            self._local(command, sequence, now_us, is_copy=again is not None)
            return
        outcome = self._server.take_up(command, sequence, self._channel.context(), now_us)
        self._finish(outcome)
        if outcome.body is not None:
            has_home = self._channel.config.has_home_item
            origin = Origin(message.get_msgId(), message.get_payload(), command.sender, has_home)
            self._channel.ask(outcome.body, command.sender[0], partial(self._server.asked, outcome.case), origin)

    def _local(self, command: Command, sequence: int, now_us: int, *, is_copy: bool) -> None:
        """Commands without effect on the vessel may run again for a copy, whose first answer was lost."""
        done = answer(self._channel, command)
        if not is_copy:
            self._channel.answer(self._server.settle(command, sequence, done.result, now_us), urgent=True)
            if done.reason:
                self._channel.explain(done.reason)
        self._channel.answer_packed(done.messages)

    def _on_set_mode(self, message: Any, now_us: int) -> None:
        mode = from_custom_mode(message.custom_mode)
        if not message.base_mode & 1:
            self._channel.explain(NO_CUSTOM_MODE)
        elif mode is None:
            self._channel.explain(f"{foreign_name(message.custom_mode, 0.0)} is not one of this boat's modes")
        else:
            self._channel.ask(ask.SetMode(mode), message.get_srcSystem())
