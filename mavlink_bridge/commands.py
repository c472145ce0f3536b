"""The command protocol: every command is carried out once and answered, with the reason when it is refused.

De-duplication is by content and time, because stations repeat with and without counting the confirmation field up
(gcs.md §1.2). A copy within 3 s gets the same answer again. It counts as new when another command has been carried out since
and the copy either makes the boat stop, or its kind was overruled meanwhile, or comes 1 s or more after the last one: an
operator who changes his mind is obeyed, a station that lost our answer does not start the boat a second time. A command
that was refused had no effect: asked again after 0.3 s it is judged anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.codec import dialect
from mavlink_bridge.command import ACCEPTED, DENIED, FAILED, IN_PROGRESS, REJECTED_NOW, UNSUPPORTED, Command, Refused
from mavlink_bridge.command_table import MEANINGS, Context, makes_it_stop
from mavlink_bridge.requests import Reply, RequestBody, Result

COPY_US: Final = 3_000_000
RETRY_US: Final = 1_000_000
REJUDGE_US: Final = 300_000
PROGRESS_AFTER_US: Final = 300_000
PROGRESS_EVERY_US: Final = 800_000
NO_PROGRESS: Final = frozenset((176, 300))
"""DO_SET_MODE and MISSION_START: MAVSDK 4.1's start_mission takes IN_PROGRESS for the final answer and ends its process at the real one."""
_QGC: Final = 255
"""QGroundControl's system id: it waits 1.2 s, and longer only after IN_PROGRESS."""
MAX_REMEMBERED: Final = 64

_RESULT: Final = {
    Result.ACCEPTED: ACCEPTED,
    Result.REJECTED_NOW: REJECTED_NOW,
    Result.DENIED: DENIED,
    Result.UNSUPPORTED: UNSUPPORTED,
    Result.FAILED: FAILED,
}


@dataclass(slots=True)
class _Case:
    """One command and what became of it."""

    command: Command
    last_copy_us: int
    sequence: int
    order: int
    """Counts the commands that were taken up."""
    result: int | None = None
    request_id: int | None = None
    progress_due_us: int = 0
    give_up_us: int = 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """What follows from one message: acknowledgements, and what to ask of the vessel."""

    messages: list[Any]
    body: RequestBody | None = None
    reason: str = ""
    """Why it was refused, for the operator."""
    case: Any = None


class CommandServer:
    """The vehicle commands of one endpoint."""

    def __init__(self, give_up_s: float) -> None:
        self._give_up_us = round(give_up_s * 1e6)
        self._cases: list[_Case] = []
        self._order = 0
        self.waiting = 0
        """How many commands have no final answer yet."""
        self.copies = 0

    def recall(self, command: Command, sequence: int, now_us: int) -> list[Any] | None:
        """Answer a copy of a command that was taken up before; None for a new command."""
        self._cases = [case for case in self._cases if case.result is None or now_us - case.last_copy_us < COPY_US]
        case = next((case for case in reversed(self._cases) if case.command == command), None)
        if case is None or self._is_new(case, sequence, now_us):
            return None
        self.copies += 1
        case.last_copy_us = now_us
        if case.result is None:
            return [ack(command, IN_PROGRESS)] if _bears_progress(command) else []
        return [ack(command, case.result)]

    def _is_new(self, case: _Case, sequence: int, now_us: int) -> bool:
        if case.result is None:
            return False
        if case.result != ACCEPTED:
            return now_us - case.last_copy_us >= REJUDGE_US
        later = [
            other for other in self._cases if other.order > case.order and other.command.sender == case.command.sender
        ]
        overtaken = any((sequence - other.sequence) & 0xFF >= 0x80 for other in later)
        if not later or overtaken:
            return False
        same_kind = any(other.command.id == case.command.id for other in later)
        return makes_it_stop(case.command) or same_kind or now_us - case.last_copy_us >= RETRY_US

    def take_up(self, command: Command, sequence: int, context: Context, now_us: int) -> Outcome:
        """Understand a new vehicle command: what to ask of the vessel, or the answer at once."""
        case = self._open(command, sequence, now_us)
        try:
            meaning = MEANINGS.get(command.id)
            if meaning is None:
                raise Refused(UNSUPPORTED, "")
            body = meaning(command, context)
        except Refused as refusal:
            self._close(case, refusal.result)
            return Outcome([ack(command, refusal.result)], reason=refusal.reason)
        if body is None:
            self._close(case, ACCEPTED)
            return Outcome([ack(command, ACCEPTED)])
        return Outcome([], body, case=case)

    def settle(self, command: Command, sequence: int, result: int, now_us: int) -> list[Any]:
        """Record the answer to a command that the endpoint itself carried out."""
        self._close(self._open(command, sequence, now_us), result)
        return [ack(command, result)]

    def _open(self, command: Command, sequence: int, now_us: int) -> _Case:
        self._order += 1
        case = _Case(command, now_us, sequence, self._order, give_up_us=now_us + self._give_up_us)
        case.progress_due_us = now_us + PROGRESS_AFTER_US
        self._cases.append(case)
        self.waiting += 1
        if len(self._cases) > MAX_REMEMBERED:
            self._close(self._cases.pop(0), FAILED)
        return case

    def _close(self, case: _Case, result: int) -> None:
        if case.result is None:
            case.result = result
            self.waiting -= 1

    @staticmethod
    def asked(case: Any, request_id: int) -> None:
        """Remember under which number the vessel was asked."""
        case.request_id = request_id

    def reply(self, request_id: int, reply: Reply) -> Outcome | None:
        """The vessel's answer; None for a request that was not a command."""
        case = next((case for case in self._cases if case.request_id == request_id and case.result is None), None)
        if case is None:
            return None
        result = _RESULT[reply.result]
        self._close(case, result)
        return Outcome([ack(case.command, result)], reason="" if result == ACCEPTED else reply.reason)

    def poll(self, now_us: int) -> list[Any]:
        """Say IN_PROGRESS of commands whose answer is late, and FAILED of those whose answer never came."""
        messages = []
        for case in self._cases:
            if case.result is not None or now_us < case.progress_due_us:
                continue
            case.progress_due_us = now_us + PROGRESS_EVERY_US
            if now_us >= case.give_up_us:
                self._close(case, FAILED)
            elif not _bears_progress(case.command):
                continue
            messages.append(ack(case.command, IN_PROGRESS if case.result is None else case.result))
        return messages


def _bears_progress(command: Command) -> bool:
    return command.id not in NO_PROGRESS or command.sender[0] == _QGC


def ack(command: Command, result: int) -> Any:
    """COMMAND_ACK to whoever asked."""
    return dialect.MAVLink_command_ack_message(
        command=command.id,
        result=result,
        progress=255,
        result_param2=0,
        target_system=command.sender[0],
        target_component=command.sender[1],
    )
