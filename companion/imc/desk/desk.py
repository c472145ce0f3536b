"""The desk that consoles come to with plans and orders: every request once, to whoever may, answered to whoever asked.

It is one service among others of the IMC node, and stands before one vehicle. It knows who commands, keeps what has to outlive a
restart, and says in words who ordered what. Sans-I/O.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker, Outgoing
from mavlink_bridge.mavlink.client import VehicleClient
from mavlink_bridge.mavlink.persona import ParamTable

from ..desk_config import DeskConfig
from ..view import PlanView
from .authority import Authority, Console
from .control import Control
from .engine import Engine
from .entities import ParamSections
from .foresight import Foresight
from .limits import restored
from .limits_desk import LimitsDesk
from .orders import Helm
from .params_desk import ParamsDesk
from .plan_db import PlanDatabase
from .remote import ACTIONS
from .repeats import Repeats
from .shelf import Shelf

DATABASE: Final = "Plan Database"
ENGINE: Final = "Plan Engine"
REMOTE: Final = "Remote Control"
LIMITS: Final = "Operational Limits"
_MOST_EVENTS: Final = 64
_NOTICE: Final = 5
"""MAV_SEVERITY_NOTICE."""


class Desk:
    """``saved`` and ``save``: one text that outlives the process. ``utc_s``: the wall clock at ``now_us``."""

    def __init__(
        self,
        config: DeskConfig,
        client: VehicleClient,
        params: ParamTable | None = None,
        *,
        foresight: Foresight | None = None,
        saved: str = "",
        save: Callable[[str], None] = lambda text: None,
        utc_s: Callable[[int], float] = lambda now_us: now_us * 1e-6,
    ) -> None:
        kept = _read(saved)
        self._config = config
        self._client = client
        self._save = save
        self._utc_s = utc_s
        self._events: list[tuple[int, str]] = []
        self._out: list[Outgoing] = []
        self._now_us = 0
        self.authority = Authority(config.console_timeout_s, config.commander_ids, _console(kept.get("commander")))
        self._repeats = Repeats(kept.get("orders"))
        self._shelf = Shelf(config.max_plans, kept.get("plans"))
        self._helm = helm = Helm(client, answer_s=config.answer_s, may_arm=config.may_arm)
        self._params = ParamsDesk(client, helm, ParamSections(params), self._answer, self.say)
        self._limits = LimitsDesk(
            client, helm, self._params, restored(kept.get("limits")), answer=self._answer, say=self.say, keep=self.keep
        )
        self.engine = Engine(
            client,
            helm,
            values=self._params.values_of,
            say=self.say,
            stick_hold_us=round(config.stick_hold_s * 1e6),
        )
        self.control = Control(config, client, self.engine, self._limits, self._params, foresight=foresight)
        self._database = PlanDatabase(self._shelf, self.control.judge, self.keep)
        self.control.find = self._database.find
        self.control.restore(kept.get("running"), kept.get("aborted"))

    # ---- what the node calls ------------------------------------------------------------------------------------

    def entities(self) -> Sequence[str]:
        """Labels of the parts that answer here."""
        return DATABASE, ENGINE, REMOTE, LIMITS, *self._params.sections

    def heard(self, asker: Asker, now_us: int) -> None:
        """A console gave a sign of life. Only the one that commands counts for the vessel."""
        commands = self.authority.heard(_console_of(asker), now_us)
        if commands and not self._config.read_only and not self._helm.is_loading:
            self._client.present()

    def met(self, asker: Asker, now_us: int) -> None:
        """A console is new: it asks for what it wants to know."""

    def receive(self, message: imc.Message, asker: Asker, now_us: int) -> bool:
        """Take a message; True when it is this desk's."""
        self._now_us = now_us
        handler = _HANDLERS.get(type(message))
        if handler is None:
            return False
        handler(self, message, asker)
        return True

    def take(self, now_us: int) -> list[Outgoing]:
        """What is to be sent; serves the timers."""
        self._now_us = now_us
        self.engine.poll(now_us, is_present=not self.authority.is_silent(now_us))
        if self.engine.sticks is not None and self.engine.sticks.has_ended:
            self.engine.stop(lambda outcome: None, now_us, success=True)
        out, self._out = self._out, []
        return out

    def view(self, now_us: int) -> PlanView:
        """What the state messages tell of the plan."""
        self._now_us = now_us
        return self.engine.view()

    def drain_texts(self) -> list[tuple[int, str]]:
        """(MAV_SEVERITY, text) for logs and log book since the last call."""
        events, self._events = self._events, []
        return events

    def say(self, severity: int, text: str) -> None:
        """Tell the operators something."""
        if len(self._events) < _MOST_EVENTS:
            self._events.append((severity, text))

    def keep(self) -> None:
        """Store what must outlive the process."""
        who = self.authority.commander
        state = {
            "version": 1,
            "plans": self._shelf.export(),
            "limits": self._limits.limits.export(),
            "orders": self._repeats.export(),
            "commander": [who.imc_id, who.host, who.name] if who is not None else None,
            "running": self.control.running,
            "aborted": self.engine.aborted.words if self.engine.aborted is not None else "",
        }
        self._save(json.dumps(state, separators=(",", ":")))

    # ---- requests -----------------------------------------------------------------------------------------------

    def _plan_db(self, request: imc.PlanDB, asker: Asker) -> None:
        if request.type != imc.ReplyType.REQUEST or self._is_again(request, asker):
            return
        self._repeats.open(asker.imc_id, request, asker.sent_utc_s, is_order=False)
        answer = self._database.answer(request, asker.imc_id, asker.name, self._utc_s(self._now_us))
        if request.op in (imc.PlanDBOp.SET, imc.PlanDBOp.DEL, imc.PlanDBOp.CLEAR):
            self.say(_NOTICE, f"{asker}: {imc.PlanDBOp(request.op).name} {request.plan_id or 'plans'}: {answer.info}")
        self._finish(request, answer, asker, DATABASE)

    def _plan_control(self, request: imc.PlanControl, asker: Asker) -> None:
        if request.type != imc.ReplyType.REQUEST or self._is_again(request, asker):
            return
        is_order = request.op in (imc.PlanControlOp.START, imc.PlanControlOp.LOAD)
        refusal = self._refusal(asker, imc.PlanControl) if is_order else ""
        if request.op == imc.PlanControlOp.STOP and self._config.read_only:
            refusal = READ_ONLY
        self._repeats.open(asker.imc_id, request, asker.sent_utc_s, is_order=is_order and not refusal)

        def answered(kind: imc.ReplyType, info: str, arg: imc.Message | None = None) -> None:
            reply = imc.PlanControl(
                type=int(kind),
                op=request.op,
                request_id=request.request_id,
                plan_id=request.plan_id,
                flags=request.flags,
                arg=arg,
                info=info,
            )
            self._tell(request, asker, kind, info)
            self._finish(request, reply, asker, ENGINE)
            self.keep()

        if refusal:
            answered(imc.ReplyType.FAILURE, refusal)
            return
        if is_order:
            self._take_command(asker)
        self._database.unkept = self.control.obey(request, answered, self._now_us) or self._database.unkept
        if is_order:
            self.keep()

    def _abort(self, message: imc.Abort, asker: Asker) -> None:
        if not asker.direct:
            return
        if self._config.read_only:
            self.say(_NOTICE, f"{asker}: Abort not passed on: {READ_ONLY}")
            return
        words = f"aborted by {asker}: STOP lifts it"
        self.say(1, words)
        self.engine.abort(words, self._now_us)
        self.keep()

    def _teleoperation_done(self, message: imc.TeleoperationDone, asker: Asker) -> None:
        if self.engine.sticks is not None and self.authority.commander == _console_of(asker):
            self.say(_NOTICE, f"{asker}: teleoperation done")
            self.engine.stop(lambda outcome: self.keep(), self._now_us, success=True)

    def _remote_actions(self, message: imc.RemoteActions, asker: Asker) -> None:
        if self.engine.sticks is not None and self.authority.commander == _console_of(asker):
            self.engine.sticks.take(message.actions, self._now_us)

    def _remote_request(self, message: imc.RemoteActionsRequest, asker: Asker) -> None:
        if message.op == imc.RemoteActionsOp.QUERY:
            report = imc.RemoteActionsRequest(op=int(imc.RemoteActionsOp.REPORT), actions=ACTIONS)
            self._answer(report, asker, REMOTE)

    def _get_limits(self, message: imc.GetOperationalLimits, asker: Asker) -> None:
        self._limits.tell(asker, LIMITS)

    def _set_limits(self, message: imc.OperationalLimits, asker: Asker) -> None:
        refusal = self._refusal(asker, imc.OperationalLimits)
        if refusal:
            self.say(4, f"{asker}: limits refused: {refusal}")
            self._limits.tell(asker, LIMITS)
            return
        self._take_command(asker)
        self._limits.set(message, asker, LIMITS, self._now_us)
        self.keep()

    def _query(self, message: imc.QueryEntityParameters, asker: Asker) -> None:
        self._params.query(message.name, asker, self._now_us)

    def _set_parameters(self, message: imc.SetEntityParameters, asker: Asker) -> None:
        refusal = self._refusal(asker, imc.SetEntityParameters)
        if refusal:
            self.say(4, f"{asker}: {message.name} not set: {refusal}")
            self._params.query(message.name, asker, self._now_us)
            return
        if self._params.set(message, asker, self._now_us):
            self._take_command(asker)
            self.keep()

    def _save_parameters(self, message: imc.SaveEntityParameters, asker: Asker) -> None:
        """Parameters are stored when they are set: nothing is left to do, and consoles wait for no answer."""

    def _text(self, message: imc.TextMessage, asker: Asker) -> None:
        self.say(6, f"{asker}: {message.text[:200]}")

    # ---- inside -------------------------------------------------------------------------------------------------

    def _refusal(self, asker: Asker, order: type) -> str:
        """Why a console may not give an order of this kind now, or ""."""
        if self._config.read_only:
            return READ_ONLY
        if asker.age_s is not None and asker.age_s > OLD_S:
            return f"the order is {asker.age_s:.0f} s old: order again (in a minute at most, if its clock was set back)"
        if self._repeats.is_late(asker.imc_id, asker.sent_utc_s):
            return "a newer order of this console was taken already"
        return self.authority.refusal(_console_of(asker), order, self._now_us)

    def _take_command(self, asker: Asker) -> None:
        console = _console_of(asker)
        before = self.authority.take(console, self._now_us)
        if before is not None:
            self.say(4, f"{console} commands now, not {before}")

    def _is_again(self, request: imc.PlanDB | imc.PlanControl, asker: Asker) -> bool:
        """Whether a request was taken before; a repeat gets its answer again. What stops is obeyed each time."""
        case = self._repeats.seen(asker.imc_id, request, asker.sent_utc_s)
        if case is None:
            return False
        if case.sent_s == asker.sent_utc_s:
            return True
        if isinstance(request, imc.PlanControl) and request.op == imc.PlanControlOp.STOP:
            return False
        if case.answer is not None:
            self._answer(case.answer, asker, DATABASE if isinstance(request, imc.PlanDB) else ENGINE)
        elif case.is_restored and isinstance(request, imc.PlanControl):
            lost = replace(request, type=int(imc.ReplyType.FAILURE), arg=None, info=RESTARTED)
            self._finish(request, lost, asker, ENGINE)
        return True

    def _finish(
        self, request: imc.PlanDB | imc.PlanControl, answer: imc.PlanDB | imc.PlanControl, asker: Asker, label: str
    ) -> None:
        self._repeats.close(asker.imc_id, request, answer)
        self._answer(answer, asker, label)

    def _answer(self, message: imc.Message, asker: Asker, label: str) -> None:
        self._out.append(Outgoing(message, asker, label))

    def _tell(self, request: imc.PlanControl, asker: Asker, kind: imc.ReplyType, info: str) -> None:
        if request.op == imc.PlanControlOp.GET:
            return
        name = imc.PlanControlOp(request.op).name if request.op in _OPERATIONS else f"operation {request.op}"
        severity = _NOTICE if kind is imc.ReplyType.SUCCESS else 4
        self.say(severity, f"{asker}: {name} {request.plan_id}: {info}".replace(" :", ":"))


READ_ONLY: Final = "consoles command nothing here (read_only)"
OLD_S: Final = 10.0
"""An order that was on its way for so long may no longer be meant."""
RESTARTED: Final = "the bridge was restarted over it: look at the state, then order anew"
_OPERATIONS: Final = frozenset(each.value for each in imc.PlanControlOp)
_HANDLERS: Final[dict[type[imc.Message], Callable[[Desk, Any, Asker], None]]] = {
    imc.PlanDB: Desk._plan_db,
    imc.PlanControl: Desk._plan_control,
    imc.Abort: Desk._abort,
    imc.TeleoperationDone: Desk._teleoperation_done,
    imc.RemoteActions: Desk._remote_actions,
    imc.RemoteActionsRequest: Desk._remote_request,
    imc.GetOperationalLimits: Desk._get_limits,
    imc.OperationalLimits: Desk._set_limits,
    imc.QueryEntityParameters: Desk._query,
    imc.SetEntityParameters: Desk._set_parameters,
    imc.SaveEntityParameters: Desk._save_parameters,
    imc.TextMessage: Desk._text,
}


def _console_of(asker: Asker) -> Console:
    """UDP and TCP of one console are one: the host counts, not the port."""
    return Console(asker.imc_id, asker.place.host, asker.name)


def _console(saved: object) -> Console | None:
    try:
        row: list[Any] = list(saved)  # type: ignore[call-overload]
        return Console(int(row[0]), str(row[1]), str(row[2]))
    except (TypeError, ValueError, IndexError):
        return None


def _read(saved: str) -> dict[str, Any]:
    """What was kept; empty when there is nothing, or nothing that can be read."""
    try:
        kept = json.loads(saved) if saved else {}
    except ValueError:
        return {}
    return kept if isinstance(kept, dict) and kept.get("version") == 1 else {}
