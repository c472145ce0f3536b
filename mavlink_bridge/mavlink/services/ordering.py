"""Commands and SET_MODE: what an operator orders, answered when the vessel has obeyed or said why not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from ...language.requests import Origin, Reply
from ...language.snapshot import Snapshot
from ..commands.command import Command
from ..commands.local import LOCAL, answer
from ..commands.service import AnswerForm, CommandOutcome, CommandServer
from ..wire.codec import dialect
from ..wire.payload import Packed, packed
from .channel import Channel
from .service import Handler, Service


class Ordering(Service):
    """The command protocol of one endpoint (``CommandServer`` has its rules)."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.server = CommandServer(channel.config.give_up_s, channel.vehicle.deeds)
        """Remembers what was ordered, for other services too."""

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {"COMMAND_LONG": self._on_command, "COMMAND_INT": self._on_command, "SET_MODE": self._on_set_mode}

    def reply(self, request_id: int, reply: Reply, now_us: int) -> bool:
        outcome = self.server.reply(request_id, reply, now_us)
        if outcome is not None:
            self._finish(outcome)
        return outcome is not None

    @property
    def busy(self) -> bool:
        return bool(self.server.waiting)

    def poll(self, now_us: int) -> None:
        self._channel.answer(self.server.poll(now_us), urgent=True)

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        self.server.see(snapshot.mode, snapshot.armed, now_us)

    def _finish(self, outcome: CommandOutcome) -> None:
        self._channel.answer(outcome.messages, urgent=True)
        if outcome.reason:
            self._channel.explain(outcome.reason)

    def _on_command(self, message: Any, now_us: int) -> None:
        command, sequence = Command.from_message(message), message.get_seq()
        confirmation = getattr(message, "confirmation", 0)
        again = self.server.recall(command, sequence, now_us, confirmation=confirmation)
        if again is not None:
            self._finish(again)
        if command.id in LOCAL:
            self._local(command, sequence, now_us, is_copy=again is not None)
        elif again is None:
            outcome = self.server.take_up(command, sequence, self._channel.context(), now_us)
            self._ask(outcome, command, (message.get_msgId(), message.get_payload()))

    def _ask(self, outcome: CommandOutcome, command: Command, words: Packed) -> None:
        """Ask the vessel what a command means. ``words``: the message that it crosses a radio in."""
        self._finish(outcome)
        if outcome.body is not None:
            origin = Origin(*words, command.sender, self._channel.config.has_home_item)
            self._channel.ask(outcome.body, command.sender[0], partial(self.server.asked, outcome.case), origin)

    def _local(self, command: Command, sequence: int, now_us: int, *, is_copy: bool) -> None:
        """Commands without effect on the vessel may run again for a copy, whose first answer was lost."""
        done = answer(self._channel, command)
        if not is_copy:
            self._channel.answer(self.server.settle(command, sequence, done.result, now_us), urgent=True)
            if done.reason:
                self._channel.explain(done.reason)
        self._channel.answer_packed(done.messages)

    def _on_set_mode(self, message: Any, now_us: int) -> None:
        """An order like DO_SET_MODE, with the same memory: it may be that command, asked again in its older form."""
        command, sequence = Command.of_set_mode(message), message.get_seq()
        again = self.server.recall(command, sequence, now_us, told=AnswerForm.IN_WORDS)
        if again is not None:
            self._finish(again)
            return
        outcome = self.server.take_up(command, sequence, self._channel.context(), now_us, told=AnswerForm.IN_WORDS)
        as_long = dialect.MAVLink_command_long_message(
            target_system=self._channel.config.system_id,
            target_component=self._channel.config.component_id,
            command=command.id,
            confirmation=0,
            **{f"param{number}": value for number, value in enumerate((*command.params, 0.0, 0.0, 0.0), start=1)},
        )
        self._ask(outcome, command, packed(as_long))
