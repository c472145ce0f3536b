"""The mission protocol, vehicle side: upload, download and clear of missions, fences and rally points on one link.

Sans-I/O: messages in by ``handle``, time by ``poll``, messages out as return values. A finished upload is compiled and
handed over by ``loads``; the MISSION_ACK goes out only when ``finish`` says that the vessel has stored it, so an acknowledged
plan is a plan that survives. Until then, and after every failure, the old plan stays. Transfers are keyed by (system,
component, kind); only one upload of a kind runs at a time over all links that share ``UploadLocks``. Source: MAVLink
mission protocol; client timers in gcs §4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from ...language.messages import Severity
from ...language.requests import LoadPlan, PlanKind, Reply, Result
from ..persona.port import PlanStore
from ..wire.codec import dialect
from .acks import Acks
from .download import Downloads
from .going import GoTos
from .plan_mapping import item_error, load_plan
from .plan_rules import DEFAULT_LIMITS, MISSION_RESULT, MissionResult, PlanError, PlanLimits, unheeded
from .store import ANOTHER_ABOARD, MissionTiming, Pending, Sender, UploadLocks, UploadSession
from .wire import ALL_KINDS, describe, item_from_message, kind_of, without_home

__all__ = ["MissionServer", "MissionTiming", "PlanStore", "UploadLocks"]

Messages = list[Any]

_MAX_TEXTS: Final = 20


class MissionServer:
    """One per endpoint channel. ``home_item``: this link shows ArduPilot's home item at 0."""

    def __init__(
        self,
        store: PlanStore,
        *,
        home_item: bool = False,
        system_id: int = 1,
        component_id: int = 1,
        limits: PlanLimits = DEFAULT_LIMITS,
        timing: MissionTiming | None = None,
        locks: UploadLocks | None = None,
    ) -> None:
        self.store = store
        self.home_item = home_item
        self.limits = limits
        self.timing = timing or MissionTiming()
        self._ids = (system_id, component_id)
        self._locks = locks or UploadLocks()
        self._uploads: dict[tuple[Sender, PlanKind], UploadSession] = {}
        self._downloads = Downloads(store, home_item=home_item)
        self._acks = Acks()
        self._stores: dict[int, Pending] = {}
        self._next_handle = 1
        self._loads: list[tuple[int, LoadPlan]] = []
        self.go_tos = GoTos(self._acks, self.limits, self._say)
        self._texts: list[tuple[Severity, str]] = []
        self._handlers: dict[str, Any] = {
            "MISSION_COUNT": self._on_count,
            "MISSION_WRITE_PARTIAL_LIST": self._on_write_partial,
            "MISSION_ITEM_INT": self._on_item,
            "MISSION_ITEM": self._on_item,
            "MISSION_REQUEST_LIST": self._on_list,
            "MISSION_REQUEST_PARTIAL_LIST": self._on_list_partial,
            "MISSION_REQUEST": self._on_request,
            "MISSION_REQUEST_INT": self._on_request,
            "MISSION_CLEAR_ALL": self._on_clear,
            "MISSION_ACK": self._on_ack,
        }

    # What the endpoint calls

    @property
    def offset(self) -> int:
        """How much higher item numbers are on this link than inside."""
        return int(self.home_item)

    @property
    def handles(self) -> frozenset[str]:
        """Names of the messages that ``handle`` serves."""
        return frozenset(self._handlers)

    def handle(self, message: Any, now_us: int) -> Messages:
        """Take one decoded message; return the messages to send. Others' messages and unknown ones are ignored."""
        handler = self._handlers.get(message.get_type())
        if handler is None or not self._is_for_us(message):
            return []
        sender = (message.get_srcSystem(), message.get_srcComponent())
        answer: Messages = handler(message, sender, now_us)
        return answer

    def poll(self, now_us: int) -> Messages:
        """Serve the timers: repeats, giving up, holding."""
        out: Messages = []
        for session in list(self._uploads.values()):
            if session.storing_us is None:
                out += self._poll_receiving(session, now_us)
            else:
                out += self._poll_storing(session, now_us)
        return out

    def loads(self) -> list[tuple[int, LoadPlan]]:
        """Complete, compiled uploads since the last call; answer each by ``finish`` with its handle."""
        loads, self._loads = self._loads, []
        return loads

    def finish(self, handle: int, reply: Reply, plan_id: int = 0, now_us: int = 0) -> Messages:
        """The vessel has stored a plan, or refused it: send the MISSION_ACK that the station waits for.

        ``plan_id``: the stored plan's id, 0 when empty. Unknown handles are ignored.
        """
        if handle < 0:
            return self.go_tos.finish(handle, reply, now_us)
        pending = self._stores.get(handle)
        if pending is None:
            return []
        pending.waiting -= 1
        if reply.result is not Result.ACCEPTED:
            pending.failed = pending.failed or reply
        del self._stores[handle]
        if pending.waiting:
            return []
        session, failed = pending.session, pending.failed
        if session is not None and (not self._drop(session) or session.given_up):
            name = _NAMES[pending.kind]
            self._say(
                Severity.WARNING if failed else Severity.INFO,
                f"{name} refused: {failed.reason}" if failed else f"{name} now stored on the vessel",
            )
            return []
        outcome = failed or reply
        if outcome.reason:
            self._say(Severity.WARNING, f"{_NAMES[pending.kind]} refused: {outcome.reason}")
        final = self._ack(pending.sender, pending.mission_type, MISSION_RESULT[outcome.result], now_us, plan_id)
        return [*self._last_again(session), final]

    def _last_again(self, session: UploadSession | None) -> Messages:
        """After holding, a station that believes itself at the last item but one calls an acknowledgement a mistake (MAVSDK)."""
        if session is None or session.held_us in (0, session.storing_us):
            return []
        last = session.upload.first + session.upload.count - 1
        return [] if session.held_seq == last else self._ask(session, [last])

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Texts for the operator since the last call."""
        texts, self._texts = self._texts, []
        return texts

    @property
    def busy(self) -> bool:
        """True while an upload is under way or waits for the vessel."""
        return bool(self._uploads or self._stores)

    # Uploads

    def _on_count(self, message: Any, sender: Sender, now_us: int) -> Messages:
        kind = kind_of(message.mission_type)
        if kind is None:
            return [self._ack(sender, message.mission_type, MissionResult.UNSUPPORTED, now_us)]
        most = min(self.limits.max_items, self.timing.most_items) + (self.offset if kind is PlanKind.MISSION else 0)
        if message.count > most:
            self._say(Severity.WARNING, f"{_NAMES[kind]} refused: {message.count} items, {most} fit")
            return [self._ack(sender, message.mission_type, MissionResult.NO_SPACE, now_us)]
        return self._open(
            message, sender, UploadSession(sender, kind, self.timing.collect(0, message.count, now_us)), now_us
        )

    def _on_write_partial(self, message: Any, sender: Sender, now_us: int) -> Messages:
        kind = kind_of(message.mission_type)
        if kind is None:
            return [self._ack(sender, message.mission_type, MissionResult.UNSUPPORTED, now_us)]
        base = self._downloads.shown(kind)
        if not 0 <= message.start_index <= message.end_index < len(base):
            return [self._ack(sender, message.mission_type, MissionResult.INVALID_SEQUENCE, now_us)]
        upload = self.timing.collect(message.start_index, message.end_index - message.start_index + 1, now_us)
        session = UploadSession(sender, kind, upload, base, self.store.plan_id(kind))
        return self._open(message, sender, session, now_us)

    def _open(self, message: Any, sender: Sender, session: UploadSession, now_us: int) -> Messages:
        kind, upload = session.kind, session.upload
        old = self._uploads.get((sender, kind))
        if old is not None and old.storing_us is not None:
            if old.clears and upload.count == 0:
                old.given_up = False  # what is stored now is all that it asks for: it waits for the ACK again
                return []
            if old.is_copy(message, upload):
                return []  # of the request that began it: the ACK is on its way
            old.given_up = True
            self._say(
                Severity.WARNING, f"{_NAMES[kind]} not taken: the one before is on its way; wait until it is stored"
            )
            return [self._ack(sender, kind.value, MissionResult.DENIED, now_us)]
        if old is not None:
            self._drop(old)
        if not self._locks.claim(kind, session, now_us, 2 * self.timing.retry_us):
            self._say(Severity.WARNING, f"{_NAMES[kind]} from {sender[0]} denied: another upload is under way")
            return [self._ack(sender, kind.value, MissionResult.DENIED, now_us)]
        self._acks.forget(sender, kind.value)
        self._uploads[sender, kind] = session
        session.heard(message)
        if upload.count == 0:
            return self._complete(session, now_us)
        return self._ask(session, upload.begin(now_us))

    def _on_item(self, message: Any, sender: Sender, now_us: int) -> Messages:
        if message.current == 2 and message.mission_type == 0:
            return self.go_tos.take(message, sender, now_us)
        kind = kind_of(message.mission_type)
        session = self._uploads.get((sender, kind)) if kind is not None else None
        if kind is None or session is None:
            return self._acks.repeat(sender, message.mission_type, now_us)
        session.heard(message)
        if session.storing_us is not None:
            return []
        if not self._locks.claim(kind, session, now_us, 2 * self.timing.retry_us):
            return self._fail(session, MissionResult.DENIED, "another upload took over", now_us)
        item = item_from_message(message)
        more = session.upload.take(message.seq, item, now_us)
        if more is None:
            return self._ask(session, session.upload.again(message.seq, now_us))
        error = item_error(kind, message.seq, item, self.limits, self.offset)
        if error is not None:
            return self._refuse(session, error, now_us)
        if session.upload.complete:
            return self._complete(session, now_us)
        return self._ask(session, more)

    def _complete(self, session: UploadSession, now_us: int) -> Messages:
        received = [session.upload.items[seq] for seq in sorted(session.upload.items)]
        first = session.upload.first
        items = (*session.base[:first], *received, *session.base[first + len(received) :])
        kind = session.kind
        if session.base_id not in (None, self.store.plan_id(kind)):
            return self._fail(session, MissionResult.DENIED, ANOTHER_ABOARD, now_us)
        if kind is PlanKind.MISSION and self.home_item:
            items = without_home(items)
        load = load_plan(kind, items, self.limits)
        if isinstance(load, PlanError):
            return self._refuse(session, load, now_us)
        session.storing_us = session.held_us = now_us
        self._say(Severity.WARNING, unheeded(kind, items, self.offset))
        load = replace(load, base_id=session.base_id)
        self._hand_over(load, Pending(session.sender, kind.value, session=session, kind=kind))
        return []

    def _refuse(self, session: UploadSession, error: PlanError, now_us: int) -> Messages:
        shift = self.offset if session.kind is PlanKind.MISSION else 0
        item = session.upload.items.get(error.seq + shift)
        return self._fail(session, error.result, describe(error, item, shift), now_us)

    def _fail(self, session: UploadSession, result: MissionResult, reason: str, now_us: int) -> Messages:
        self._drop(session)
        self._say(Severity.WARNING, f"{_NAMES[session.kind]} refused: {reason}")
        return [self._ack(session.sender, session.kind.value, result, now_us)]

    def _hand_over(self, load: LoadPlan, pending: Pending) -> None:
        self._stores[self._next_handle] = pending
        self._loads.append((self._next_handle, load))
        self._next_handle += 1

    def _drop(self, session: UploadSession) -> bool:
        """End a session; False when it had ended before."""
        self._locks.release(session.kind, session)
        if self._uploads.get((session.sender, session.kind)) is not session:
            return False
        del self._uploads[session.sender, session.kind]
        return True

    def _poll_receiving(self, session: UploadSession, now_us: int) -> Messages:
        if not self._locks.held(session.kind, session):
            return self._fail(session, MissionResult.DENIED, "another upload took over", now_us)
        late = session.upload.overdue(now_us)
        if late is None:
            got = len(session.upload.items)
            reason = f"{got} of {session.upload.count} items came, then nothing; the old plan stays"
            return self._fail(session, MissionResult.OPERATION_CANCELLED, reason, now_us)
        return self._ask(session, late)

    def _poll_storing(self, session: UploadSession, now_us: int) -> Messages:
        assert session.storing_us is not None
        self._locks.claim(session.kind, session, now_us, 2 * self.timing.retry_us)
        waited_us = now_us - session.storing_us
        hold_us = self.timing.hold_us
        limit_us = self.timing.store_us
        is_single = session.upload.count == 1 and session.base_id is None
        if hold_us is not None and is_single and not session.given_up:
            limit_us = min(limit_us or self.timing.hold_single_us, self.timing.hold_single_us)
        if limit_us is not None and waited_us >= limit_us and session.given_up:
            self._drop(session)  # a text will say how it ended
            return []
        if limit_us is not None and waited_us >= limit_us:
            return self._fail(session, MissionResult.ERROR, "not confirmed in time; a text will say when it is", now_us)
        if hold_us is None or session.given_up or not session.upload.count or now_us - session.held_us < hold_us:
            return []
        session.held_us = now_us
        last = session.upload.first + session.upload.count - 1
        asked = last if session.held_seq != last or last == session.upload.first else last - 1
        session.held_seq = asked
        return self._ask(session, [asked])

    def _ask(self, session: UploadSession, numbers: Sequence[int]) -> Messages:
        system, component = session.sender
        return [
            dialect.MAVLink_mission_request_int_message(system, component, seq, session.kind.value) for seq in numbers
        ]

    # Downloads

    def _on_list(self, message: Any, sender: Sender, now_us: int) -> Messages:
        kind = kind_of(message.mission_type)
        if kind is None:
            return [self._ack(sender, message.mission_type, MissionResult.UNSUPPORTED, now_us)]
        return [self._downloads.begin(sender, kind, now_us)]

    def _on_list_partial(self, message: Any, sender: Sender, now_us: int) -> Messages:
        return [self._ack(sender, message.mission_type, MissionResult.UNSUPPORTED, now_us)]

    def _on_request(self, message: Any, sender: Sender, now_us: int) -> Messages:
        kind = kind_of(message.mission_type)
        if kind is None:
            return [self._ack(sender, message.mission_type, MissionResult.UNSUPPORTED, now_us)]
        item = self._downloads.item(sender, kind, message.seq, now_us)
        return [self._ack(sender, kind.value, MissionResult.INVALID_SEQUENCE, now_us) if item is None else item]

    # Clear, cancel, acknowledge

    def _on_clear(self, message: Any, sender: Sender, now_us: int) -> Messages:
        kind = kind_of(message.mission_type)
        if kind is None and message.mission_type != ALL_KINDS:
            return [self._ack(sender, message.mission_type, MissionResult.UNSUPPORTED, now_us)]
        kinds = (*PlanKind,) if kind is None else (kind,)
        own = [session for session in self._uploads.values() if session.kind in kinds and session.sender == sender]
        busy = [session.kind for session in own if session.storing_us is not None]
        busy += [
            each for each in kinds if self._locks.holder(each, now_us, 2 * self.timing.retry_us) not in (None, *own)
        ]
        busy += [each.kind for each in self._uploads.values() if each.kind in kinds and each.sender != sender]
        if busy:
            self._say(Severity.WARNING, f"{_NAMES[busy[0]]} not cleared: an upload is under way")
            return [self._ack(sender, message.mission_type, MissionResult.DENIED, now_us)]
        for session in own:
            self._drop(session)
        pending = Pending(sender, message.mission_type, waiting=len(kinds), kind=kinds[0])
        for each in kinds:
            self._acks.forget(sender, each.value)
            self._hand_over(LoadPlan(each, ()), pending)
        return []

    def _on_ack(self, message: Any, sender: Sender, now_us: int) -> Messages:
        """The station has its download, or gives up what it began."""
        kind = kind_of(message.mission_type)
        if kind is None:
            return []
        self._downloads.end(sender, kind)
        session = self._uploads.get((sender, kind))
        if session is None or message.type == MissionResult.ACCEPTED:
            return []
        if session.storing_us is None:
            self._drop(session)
            self._say(Severity.INFO, f"{_NAMES[kind]} upload cancelled by {sender[0]}; the old plan stays")
        elif not session.given_up:
            session.given_up = True
            self._say(
                Severity.WARNING, f"{_NAMES[kind]} not cancelled: it is on its way; a text says when it is stored"
            )
        return []

    def _ack(self, sender: Sender, mission_type: int, result: MissionResult, now_us: int, plan_id: int = 0) -> Any:
        return self._acks.make(sender, mission_type, result, now_us, plan_id)

    def _is_for_us(self, message: Any) -> bool:
        system, component = self._ids
        return message.target_system in (0, system) and message.target_component in (0, component)

    def _say(self, severity: Severity, text: str) -> None:
        if text and len(self._texts) < _MAX_TEXTS:
            self._texts.append((severity, text))


_NAMES: Final = {PlanKind.MISSION: "Plan", PlanKind.FENCE: "Fence", PlanKind.RALLY: "Rally points"}
