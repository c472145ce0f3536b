"""The command protocol: every command is carried out and answered, with the reason when it is refused. ACCEPTED means done.

Stations repeat what was not answered, with and without counting the confirmation field up (gcs.md §1.2), and people press
again what did not help; both look the same. What makes the boat stop is therefore carried out each time it comes. Any other
command is answered from memory for 3 s after its answer, and so not carried out twice, but only while its answer is still
true. When another station, another link, a failsafe or the vessel itself has changed mode or arming meanwhile, or what the
command had settled (way, speed, home, fence, who commands: ``Deeds``), a copy is refused with the reason:
a station that lost our answer does not start the boat a second time after somebody stopped it. An
operator who changes his mind is obeyed at once: a command counts as new after a contrary one of the same sender, answered or
not, and the one before it gets no acknowledgement any more when its number is the same: a station would take it for the newer's.
A copy that another way delivers late, behind a newer command of its sender, changes nothing. Copies do not lengthen the 3 s. A
command that was refused had no effect: asked again after 0.3 s, or once a plan or anything else that stands was changed, it is judged anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from ...language.deeds import Deeds
from ...language.messages import Mode
from ...language.nature import Aim, takes_back
from ...language.requests import Reply, RequestBody, Result
from ..wire.cmd import Cmd
from ..wire.codec import dialect
from ..wire.framing import COPY_WINDOW_US
from .command import ACCEPTED, DENIED, FAILED, IN_PROGRESS, REJECTED_NOW, UNSUPPORTED, Command, Refused
from .table import MEANINGS, NO_PROGRESS, Context

COPY_US: Final = 3_000_000
RETRY_US: Final = 1_000_000
REJUDGE_US: Final = 300_000
SEEN_US: Final = 1_000_000
"""So long what a command brings may take to show, as over a radio."""
LATE_US: Final = 500_000
"""What is numbered before a command so much younger is a late copy. Later the number says nothing: it goes round in 1.3 s at
100 messages a second, and begins anew with each program that a station starts."""
AT_ONCE_US: Final = 100_000
"""Two ticks: a burst of one number is answered as it came, all together. What is answered later came over a radio, and apart."""
PROGRESS_AFTER_US: Final = 300_000
PROGRESS_EVERY_US: Final = 800_000
_QGC: Final = 255
"""QGroundControl's system id: it waits 1.2 s for a start, and longer only after IN_PROGRESS. For a mode it looks at the HEARTBEAT."""
MAX_REMEMBERED: Final = 64

_RESULT: Final = {
    Result.ACCEPTED: ACCEPTED,
    Result.REJECTED_NOW: REJECTED_NOW,
    Result.DENIED: DENIED,
    Result.UNSUPPORTED: UNSUPPORTED,
    Result.FAILED: FAILED,
}
_MEANT: Final = {number: result for result, number in _RESULT.items()}
_NO_AIM: Final[Aim] = (None, None)
_UNDONE: Final = "overruled since: send it again in 3 s to insist"


class AnswerForm(Enum):
    """How a station hears what became of its order."""

    BY_ACK = "by a COMMAND_ACK"
    IN_WORDS = "by a text when it is refused: SET_MODE has no acknowledgement"
    ELSEWHERE = "by the service that it asked"


@dataclass(slots=True)
class _Case:
    """One command and what became of it."""

    command: Command
    taken_us: int
    sequence: int
    order: int
    """Counts the commands that were taken up."""
    body: RequestBody | None = None
    told: AnswerForm = AnswerForm.BY_ACK
    result: int | None = None
    answered_us: int = 0
    is_taken_back: bool = False
    """Whether its sender has ordered the contrary since."""
    is_overtaken: bool = False
    """Whether its sender has used the same number since: an acknowledgement would be taken for the newer command's."""
    seen: bool = False
    """Whether the vessel has been in the state that this command brings, since its answer."""
    deed: int | None = None
    """Number of what the vessel has done for it (``Deeds``)."""
    settings: int = 0
    """How often what stands had been changed when it was answered."""
    request_id: int | None = None
    progress_due_us: int = 0
    give_up_us: int = 0

    @property
    def aim(self) -> Aim:
        """What it brings, as far as it is understood."""
        return _NO_AIM if self.body is None else self.body.nature.aim


@dataclass(frozen=True, slots=True)
class CommandOutcome:
    """What follows from one message: acknowledgements, and what to ask of the vessel."""

    messages: list[Any]
    body: RequestBody | None = None
    reason: str = ""
    """Why it was refused, for the operator."""
    case: Any = None
    reply: Reply | None = None
    """To a copy of what has ended: how."""


class CommandServer:
    """The vehicle commands of one endpoint."""

    def __init__(self, give_up_s: float, deeds: Deeds) -> None:
        """``deeds``: the vessel's, over all its links."""
        self._deeds = deeds
        self._give_up_us = round(give_up_s * 1e6)
        self._cases: list[_Case] = []
        self._unseen: list[_Case] = []
        self._state: tuple[Mode, bool] | None = None
        self._order = 0
        self.waiting = 0
        """How many commands have no final answer yet."""
        self.copies = 0

    def see(self, mode: Mode, armed: bool, now_us: int) -> None:
        """Take note of the vessel's state after a tick."""
        self._state = mode, armed
        if self._unseen:
            for case in self._unseen:
                case.seen = _holds(case.aim, self._state)
            self._unseen = [case for case in self._unseen if not case.seen and now_us - case.answered_us < SEEN_US]

    def recall(
        self,
        command: Command,
        sequence: int,
        now_us: int,
        *,
        confirmation: int = 0,
        told: AnswerForm = AnswerForm.BY_ACK,
    ) -> CommandOutcome | None:
        """Answer a copy of a command that was taken up before; None for one that is to be carried out.

        ``confirmation``: above 0 the station itself says that it repeats; what makes the boat stop is obeyed even so. ``told``: how
        the copy's sender hears of it; one that waits for an acknowledgement gets it, however the first one came.
        """
        self._cases = [case for case in self._cases if case.result is None or now_us - case.answered_us < COPY_US]
        case = next((case for case in reversed(self._cases) if case.command == command), None)
        if case is None:
            return None
        later = [other for other in self._cases if other.order > case.order]
        if self._is_new(case, later, sequence, now_us, is_repeat=confirmation > 0):
            return None
        self.copies += 1
        if case.result is None:
            case.told = told if case.told is AnswerForm.IN_WORDS else case.told
            is_told = _bears_progress(command) and not case.is_overtaken
            return CommandOutcome(_acks(command, IN_PROGRESS, told) if is_told else [])
        is_undone = case.result == ACCEPTED and self._is_undone(case, later, now_us)
        result, reason = (REJECTED_NOW, _UNDONE) if is_undone else (case.result, "")
        return CommandOutcome(_acks(command, result, told), reason=reason, reply=Reply(_MEANT[result], reason))

    def _is_new(self, case: _Case, later: list[_Case], sequence: int, now_us: int, *, is_repeat: bool) -> bool:
        own = [other for other in later if other.command.sender == case.command.sender]
        ahead = any((sequence - other.sequence) & 0xFF >= 0x80 and now_us - other.taken_us < LATE_US for other in own)
        if ahead:
            return False
        stops = case.body is not None and case.body.nature.stops
        if is_repeat and case.is_taken_back and not stops:
            return False
        if case.result not in (None, ACCEPTED):
            is_outdated = case.settings != self._deeds.settings
            return case.is_taken_back or is_outdated or now_us - case.answered_us >= REJUDGE_US
        if stops:
            return not self._stands(case, later, sequence, now_us)
        if case.is_taken_back or case.result is None or is_repeat:
            return case.is_taken_back and not is_repeat
        return bool(own) and case.aim == _NO_AIM and now_us - case.answered_us >= RETRY_US

    def _stands(self, case: _Case, later: list[_Case], sequence: int, now_us: int) -> bool:
        """Whether this is the very frame that stopped the vessel, a moment ago, and nobody has asked for anything since: a copy that the
        network made, or a script that presses again. Whatever has happened since, it is a stop that is carried out.
        """
        is_same = sequence == case.sequence and now_us - case.taken_us <= COPY_WINDOW_US
        if case.result is None:
            return is_same and not later
        is_last = case.deed == self._deeds.count and case.aim != _NO_AIM
        return is_same and is_last and self._state is not None and _holds(case.aim, self._state)

    def _is_undone(self, case: _Case, later: list[_Case], now_us: int) -> bool:
        """Whether ACCEPTED would be an untruth by now: somebody else, or the vessel itself, decided otherwise since."""
        alike = [other for other in later if type(other.body) is type(case.body) and other.result == ACCEPTED]
        if case.body is not None and alike and alike[-1].body != case.body:
            return True
        if case.body is not None and case.deed is not None:
            own = {each.deed for each in later if each.deed is not None and each.command.sender == case.command.sender}
            if self._deeds.undone(case.body, case.deed, own):
                return True
        shows = case.seen or now_us - case.answered_us >= SEEN_US
        return shows and self._state is not None and not _holds(case.aim, self._state)

    def take_up(
        self, command: Command, sequence: int, context: Context, now_us: int, *, told: AnswerForm = AnswerForm.BY_ACK
    ) -> CommandOutcome:
        """Understand a new vehicle command: what to ask of the vessel, or the answer at once."""
        case = self._open(command, sequence, now_us)
        case.told = told
        try:
            meaning = MEANINGS.get(command.id)
            if meaning is None:
                raise Refused(UNSUPPORTED, "")
            body = meaning(command, context)
        except Refused as refusal:
            self._close(case, refusal.result, now_us)
            return CommandOutcome(_acks(command, refusal.result, told), reason=refusal.reason)
        case.body = body
        self._overtakes(case)
        if body is None:
            self._close(case, ACCEPTED, now_us)
            return CommandOutcome(_acks(command, ACCEPTED, told))
        return CommandOutcome([], body, case=case)

    def begin(self, command: Command, sequence: int, body: RequestBody, now_us: int) -> Any:
        """Take up an order that another service has understood, and answers. Returns the case (``asked``)."""
        case = self._open(command, sequence, now_us)
        case.body, case.told = body, AnswerForm.ELSEWHERE
        self._overtakes(case)
        return case

    def settle(self, command: Command, sequence: int, result: int, now_us: int) -> list[Any]:
        """Record the answer to a command that the endpoint itself carried out."""
        case = self._open(command, sequence, now_us)
        self._overtakes(case)
        self._close(case, result, now_us)
        return [ack(command, result)]

    def _overtakes(self, case: _Case) -> None:
        """Mark what its sender ordered before and now wants no more, and whose answer he would take for this one's."""
        for older in self._cases:
            if older is case or older.command.sender != case.command.sender:
                continue
            is_alike = older.command.id == case.command.id
            older.is_overtaken |= is_alike
            older.is_taken_back |= (is_alike and older.command != case.command) or _takes_back(case, older)

    def _open(self, command: Command, sequence: int, now_us: int) -> _Case:
        self._order += 1
        case = _Case(command, now_us, sequence, self._order, give_up_us=now_us + self._give_up_us)
        case.progress_due_us = now_us + PROGRESS_AFTER_US
        self._cases.append(case)
        self.waiting += 1
        if len(self._cases) > MAX_REMEMBERED:
            self._close(self._cases.pop(0), FAILED, now_us)
        return case

    def _close(self, case: _Case, result: int, now_us: int) -> None:
        if case.result is None:
            case.result, case.answered_us, case.settings = result, now_us, self._deeds.settings
            self.waiting -= 1
            if result == ACCEPTED and case.aim != _NO_AIM:
                self._unseen.append(case)

    @staticmethod
    def asked(case: Any, request_id: int) -> None:
        """Remember under which number the vessel was asked."""
        case.request_id = request_id

    def reply(self, request_id: int, reply: Reply, now_us: int) -> CommandOutcome | None:
        """The vessel's answer; None for a request that was not a command, or that another service answers."""
        case = next((case for case in self._cases if case.request_id == request_id and case.result is None), None)
        if case is None:
            return None
        result = _RESULT[reply.result]
        if result == ACCEPTED:
            case.deed = self._deeds.count
        self._close(case, result, now_us)
        if case.told is AnswerForm.ELSEWHERE:
            return None
        if case.is_overtaken and (result != ACCEPTED or now_us - case.taken_us > AT_ONCE_US):
            return CommandOutcome([])
        return CommandOutcome(_acks(case.command, result, case.told), reason="" if result == ACCEPTED else reply.reason)

    def poll(self, now_us: int) -> list[Any]:
        """Say IN_PROGRESS of commands whose answer is late, and FAILED of those whose answer never came."""
        messages = []
        for case in self._cases:
            if case.result is not None or now_us < case.progress_due_us:
                continue
            case.progress_due_us = now_us + PROGRESS_EVERY_US
            if now_us >= case.give_up_us:
                self._close(case, FAILED, now_us)
            elif not _bears_progress(case.command):
                continue
            if case.is_overtaken or case.told is not AnswerForm.BY_ACK:
                continue
            messages.append(ack(case.command, IN_PROGRESS if case.result is None else case.result))
        return messages


def _holds(wanted: Aim, state: tuple[Mode, bool]) -> bool:
    mode, armed = wanted
    return mode in (None, state[0]) and armed in (None, state[1])


def _takes_back(later: _Case, case: _Case) -> bool:
    return later.body is not None and case.body is not None and takes_back(later.body, case.body)


def _bears_progress(command: Command) -> bool:
    return command.id not in NO_PROGRESS or (command.id == Cmd.MISSION_START and command.sender[0] == _QGC)


def _acks(command: Command, result: int, told: AnswerForm) -> list[Any]:
    return [ack(command, result)] if told is AnswerForm.BY_ACK else []


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
