"""The composition root: builds the vessel from its settings, moves bytes between links and parts, keeps the order.

``pump`` serves protocol endpoints between ticks; ``tick`` runs the vessel. Both start by reading every link in one fixed
order, so a recording of what the links said replays the run. An exception in a tick gives neutral in the same tick; three in
a row end the process, neutral first.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final, Protocol

from mavlink_bridge.language.messages import ActuatorStatus, Severity
from mavlink_bridge.language.requests import (
    ACCEPTED,
    EraseLogs,
    ForgetDepth,
    LoadPlan,
    PlanKind,
    Reboot,
    Reply,
    Request,
    RequestBody,
    Result,
    RtcmData,
    SetParameter,
)
from mavlink_bridge.language.snapshot import LinkHealth, Snapshot
from mavlink_bridge.language.stations import Station
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from mavlink_bridge.mavlink.persona import Identity

from .audit import Audit, ordered_text, own_request, whom
from .changes import ends_far_word, erase_logs, parameter_aftermath, parameter_problem, saving, setting_refusal, telling
from .core.guard.failsafe_flags import ProcessFlags
from .core.hull import VesselConfig
from .core.steer import gains_problem
from .core.vehicle import TickInputs, Vehicle
from .core.vehicle.plan_reach import FAR_OK
from .core.vehicle.refusals import plan_refusal, shutdown_refusal
from .depth_keeper import DepthKeeper
from .facade import Facade, Shared
from .io.keeping import AnyStore
from .io.keeping.content import SaveParam
from .io.links import Link
from .lasting import Answer, Lasting, VoyageKeeper
from .ports import ArduinoPort, Conversation, GroundPort, NmeaPort, PlotterPort
from .security import Keeper
from .settings import Settings
from .store_watch import StoreWatch
from .strangers import Strangers
from .supervise import Supervisor


class AppFaultError(RuntimeError):
    """Three ticks in a row failed; neutral has been written."""


class TickRecorder(Protocol):
    """What the app tells the recorder of each tick, and what it hears back."""

    def tick(self, snapshot: Snapshot) -> None: ...
    def drain_texts(self) -> list[tuple[Severity, str]]: ...
    def order(self, t_us: int, fields: dict[str, Any]) -> None: ...


log = logging.getLogger(__name__)


_NO_BOARD: Final = ActuatorStatus(0)
_HEALTH_EVERY: Final = 10
"""Ticks between two looks at the links for the operator."""
FAULTS_IN_A_ROW: Final = 3
"""Failed ticks in a row after which the process gives up (and is restarted, disarmed)."""


class App:
    """The vessel's process. Ports are read in this order: sensors, actuators, ground stations."""

    def __init__(
        self,
        settings: Settings,
        vessel: VesselConfig,
        sensors: Sequence[NmeaPort],
        actuators: ArduinoPort | None,
        store: AnyStore,
        identity: Identity,
    ) -> None:
        self.settings = settings
        self.period_us = settings.system.period_us
        self.sensors = tuple(sensors)
        self.actuators = actuators
        self.grounds: list[GroundPort] = []
        self.plotter: PlotterPort | None = None
        self.store = store
        self.recorder: TickRecorder | None = None
        self.vehicle = Vehicle(settings, vessel, [item.name for item in settings.sensors])
        self.controls = self.vehicle.controls
        say = self.controls.voice.say
        self.facade = Facade(settings, self.vehicle.parts.mission, identity)
        self.shared = Shared(say)
        self.keeper: Keeper | None = None
        self.voyages: VoyageKeeper | None = None
        self.strangers = Strangers(say)
        self.audit = Audit()
        self._watched = Supervisor(say)
        self.snapshot: Snapshot | None = None
        self.actuator_fresh = actuators is None
        """Whether the last tick handed a frame to the actuator board, or there was none to hand it to; feeds systemd's watchdog."""
        self._own: list[tuple[Answer, RequestBody, Station | None]] = []
        self.on_submit: Callable[[RequestBody, Station | None], None] | None = None
        """Told of every ``submit``: these requests come over no link, and a recording needs them."""
        self._faults = 0
        self.storage = StoreWatch(say, self.store.snapshot(), required=settings.operator.store_required)
        self._lasting = Lasting(store, self.storage)
        memory, warn = self.vehicle.parts.guard.memory, partial(say, Severity.WARNING)
        self.depths = DepthKeeper(memory, settings.depth.memory, self._lasting.submit, warn)
        self._now_us = 0
        self._closed = False
        self._ticks = 0
        self._health: tuple[LinkHealth, ...] = ()
        self.stop_wanted = False
        """A ground station has asked for a shutdown or reboot while disarmed."""
        self.shutdown_wanted = False
        """What it asked for is a shutdown: the process must not come back by itself."""
        self._restore()

    # ---- the two calls ------------------------------------------------------------------------------------------

    def pump(self, now_us: int) -> None:
        """Serve protocol endpoints; what arrives for the vessel takes effect at the next tick. Fails as ``tick`` does."""
        try:
            self._read(now_us)
            self._flush(now_us)
        except Exception as error:
            self._fault(now_us, error)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> Snapshot | None:
        """Run one control period. ``late_s``: how late it comes; ``load``: share of the period that the last one took.

        Returns None after a failure. Raises AppFaultError after three in a row, with neutral written.
        """
        self._now_us = now_us
        try:
            snapshot = self._run(now_us, late_s, load)
        except Exception as error:
            self._fault(now_us, error)
            return None
        self._faults = 0
        return snapshot

    def shutdown(self, now_us: int) -> None:
        """Write neutral and let everything go; may be called twice."""
        if self._closed:
            return
        self._closed = True
        self._neutral(now_us, "shutdown")
        for port in self.ports:
            port.link.close()
        self.depths.close(now_us)
        if self.keeper is not None:
            self.keeper.close(now_us)
        self.store.close()

    def keep_voyage(self) -> None:
        """Remember in the store that a voyage is under way, and go on with one that is."""
        self.voyages = VoyageKeeper(self._lasting, self.controls, self.store.snapshot())

    @property
    def ports(self) -> tuple[NmeaPort | ArduinoPort | GroundPort | PlotterPort, ...]:
        """Every port in the order in which it is read."""
        actuators = () if self.actuators is None else (self.actuators,)
        plotter = () if self.plotter is None else (self.plotter,)
        return (*self.sensors, *actuators, *self.grounds, *plotter)

    @property
    def links(self) -> tuple[Link, ...]:
        return tuple(port.link for port in self.ports)

    @property
    def sensed_us(self) -> int | None:
        """When the first sensor, the one that steers the vessel, last spoke; None = never."""
        return self.sensors[0].last_rx_us if self.sensors else None

    def submit(self, body: RequestBody, answer: Answer = lambda reply: None, *, station: Station | None = None) -> None:
        """Queue a request of the vessel's own people (the command line, a scenario), or of the page. Answered at a coming tick."""
        if self.on_submit is not None:
            self.on_submit(body, station)
        self._own.append((answer, body, station))

    # ---- one tick -----------------------------------------------------------------------------------------------

    def _run(self, now_us: int, late_s: float, load: float) -> Snapshot:
        self._read(now_us)
        inputs = self._inputs(now_us, late_s, load)
        self.vehicle.bring(inputs)
        self._answer_requests(now_us)
        snapshot = self.vehicle.tick(now_us)
        self.snapshot = snapshot
        if self.actuators is not None:
            # A board that is not there gets no better by a restart, which takes telemetry from who must find a drifting boat.
            at_rest = self.actuators.is_away and not snapshot.armed
            self.actuator_fresh = self.actuators.write(snapshot.output, now_us) or at_rest
        if self.keeper is not None and self.keeper.tick(now_us, snapshot):
            for ground in self.grounds:
                ground.begin_anew()
        if self.voyages is not None:
            self.voyages.tick(now_us)
        if now_us >= self.depths.due_us:
            self.depths.save(now_us)
        self._watched.each(self.grounds, now_us, GroundPort.tell, now_us, snapshot)
        if self.recorder is not None:
            self._watched.call("recorder", now_us, self.recorder.tick, snapshot)
        return snapshot

    def _read(self, now_us: int) -> None:
        for port in self.sensors:
            port.read(now_us)
        if self.actuators is not None:
            self.actuators.read(now_us)
        self._watched.each(self.grounds, now_us, GroundPort.read, now_us)
        if self.plotter is not None:
            self._watched.call("plotter", now_us, self._send_on, self.plotter, now_us)
        self._lasting.collect()
        logs = self.facade.logs
        if logs is not None and logs.waiting:
            self._watched.call("logs", now_us, logs.collect)

    def _send_on(self, plotter: PlotterPort, now_us: int) -> None:
        plotter.read(now_us)
        for port in self.sensors:
            plotter.send_on(port.reader.take_relay())

    def _flush(self, now_us: int) -> None:
        self._watched.each(self.grounds, now_us, GroundPort.flush, now_us)

    def _inputs(self, now_us: int, late_s: float, load: float) -> TickInputs:
        for port in self.sensors:
            self.controls.voice.say_all(port.reader.drain_texts())
        if self.recorder is not None:
            self.controls.voice.say_all(self.recorder.drain_texts())
        self.storage.tick(now_us)
        if self._ticks % _HEALTH_EVERY == 0:
            self._health = tuple(port.health(now_us) for port in self.ports)
        self._ticks += 1
        board = None if self.actuators is None else self.actuators.board
        ready, reason = (False, "no actuator board is configured") if board is None else board.ready(now_us)
        if board is not None:
            self.controls.voice.say_all(board.drain_texts())
            self.depths.heed_board(board.version)
        return TickInputs(
            measurements=[(item, source) for source, port in enumerate(self.sensors) for item in port.take()],
            ais=[item for port in self.sensors for item in port.take_ais()],
            ais_alive=any(port.ais_alive() for port in self.sensors),
            actuator=_NO_BOARD if board is None else board.status,
            actuator_ready=ready,
            actuator_reason=reason,
            actuator_faults=() if board is None else board.faults(now_us),
            commanded_us=None if board is None else board.commanded_us,
            links=self._health,
            heard=[each for ground in self.grounds for each in ground.heard()],
            standing=self.storage.standing,
            process=ProcessFlags(self.storage.fault, self._watched.failing(now_us)),
            barred=self.storage.barred,
            late_s=late_s,
            load=load,
            plan_ids=self.facade.plans.ids,
        )

    def _fault(self, now_us: int, error: Exception) -> None:
        """Neutral first, then the trace, then (three in a row) give up."""
        self._neutral(now_us, f"fault: {type(error).__name__}")
        self._faults += 1
        log.error("tick failed (%d in a row), neutral is written", self._faults, exc_info=error)
        self.controls.disarm(f"internal fault: {type(error).__name__}")
        if self._faults >= FAULTS_IN_A_ROW:
            raise AppFaultError(f"{self._faults} ticks in a row failed: {error}") from error

    def _neutral(self, now_us: int, cause: str) -> None:
        output = self.vehicle.parts.gate.neutral(now_us, cause)
        if self.actuators is not None:
            self.actuators.write(output, now_us)

    # ---- requests -----------------------------------------------------------------------------------------------

    def _answer_requests(self, now_us: int) -> None:
        if self._own:
            own, self._own = self._own, []
            for answer, body, station in own:
                self._carry_out(own_request(body, station), answer, now_us, by_radio=False)
                if station is not None:
                    self.controls.voice.say(Severity.NOTICE, ordered_text(body, station))
        for ground in self.grounds:
            for channel, talk in ground.talks:
                if talk.asked:
                    by_radio = ground.kind == "radio"
                    for _, request in self._watched.call(ground.name, now_us, ground.requests_of, channel, talk) or ():
                        self._carry_out(request, self._replying(talk, request), now_us, by_radio=by_radio)

    def _replying(self, talk: Conversation, request: Request) -> Answer:
        def answer(reply: Reply) -> None:
            if request.reply or reply.result is not Result.ACCEPTED:
                now_us = self._now_us
                self._watched.call("replies", now_us, lambda: talk.reply(request.id, reply, now_us))

        return answer

    def _carry_out(self, request: Request, answer: Answer, now_us: int, *, by_radio: bool) -> None:
        answer = self.facade.noting(request.body, self.audit.noting(request, answer, now_us))
        body = request.body
        if refusal := setting_refusal(self.controls, request, now_us):
            answer(Reply(Result.REJECTED_NOW, refusal))
        elif isinstance(body, LoadPlan):
            self._load(body, telling(self.controls, request, answer))
        elif isinstance(body, SetParameter):
            self._set_parameter(body, telling(self.controls, request, answer))
        elif isinstance(body, EraseLogs):
            answer(erase_logs(self.controls, self.facade.logs, request))
        elif isinstance(body, RtcmData):
            for port in self.sensors[:1]:
                port.send(0, body.data)
            answer(ACCEPTED)
        elif isinstance(body, Reboot):
            reply = self._reboot(body, now_us, by_radio=by_radio)
            if reply.result is Result.ACCEPTED:
                log.warning("%s, ordered by %s", "shutdown" if body.shutdown else "restart", whom(request))
            answer(reply)
        else:
            answer(self.vehicle.handle(request, now_us))
            if isinstance(body, ForgetDepth):
                self.depths.due_us = now_us

    def _load(self, body: LoadPlan, answer: Answer) -> None:
        if refusal := plan_refusal(self.controls, body):
            answer(Reply(Result.DENIED, refusal))
            return
        self._lasting.submit(saving(self.facade, body), answer, lambda: self._adopt(body))

    def _adopt(self, body: LoadPlan) -> None:
        """Put a plan in force."""
        if ends_far_word(self.facade, body):
            self._reconfigure(FAR_OK, 0.0)
        self.facade.plans.put(body.kind, body.items)
        if body.kind is PlanKind.MISSION:
            self.controls.load_plan(body.plan)
        elif body.kind is PlanKind.FENCE:
            self.controls.load_fence(body.fence)
            self.storage.fence_adopted()
        else:
            self.controls.load_rally(body.rally_rad)

    def _set_parameter(self, body: SetParameter, answer: Answer) -> None:
        problem = parameter_problem(self.facade, self.vehicle.parts.vessel, body)
        if problem:
            answer(Reply(Result.DENIED, problem))
            return
        self._lasting.submit(SaveParam(body.name, body.value), answer, lambda: self._reconfigure(body.name, body.value))

    def _reconfigure(self, name: str, value: float) -> None:
        for text in parameter_aftermath(self.facade, self.vehicle.parts.vessel, SetParameter(name, value)):
            self.controls.voice.say(Severity.WARNING, f"{name} is set, but {text}")
        settings = self.facade.params.change(name, value)
        self.settings = self.facade.params.settings = settings
        self.controls.configure(settings)
        if self.actuators is not None:
            self.actuators.board.configure(settings.actuators.board)
        for ground in self.grounds:
            for talk in ground.conversations.values():
                talk.param_changed(name)

    def _reboot(self, body: Reboot, now_us: int, *, by_radio: bool) -> Reply:
        refusal = "armed: disarm first" if self.controls.armed else ""
        if body.shutdown:
            refusal = refusal or shutdown_refusal(self.controls, now_us, by_radio=by_radio)
        if refusal:
            return Reply(Result.REJECTED_NOW, refusal)
        self.shutdown_wanted = body.shutdown
        self.stop_wanted = True
        return ACCEPTED

    # ---- what must last -----------------------------------------------------------------------------------------

    def _restore(self) -> None:
        """Take back what the store kept: parameters, then plans. What no longer fits is told and left out."""
        content = self.store.snapshot()
        self.settings = self.storage.take_back(self.facade.params, content.params, self.store.warnings)
        self.controls.configure(self.settings)
        problem = gains_problem(self.settings.steering, self.vehicle.parts.vessel)
        if problem:
            self.controls.voice.say(Severity.CRITICAL, f"Steering: {problem}")
        for kind, items in content.plans.items():
            plan = load_plan(kind, items)
            if isinstance(plan, LoadPlan):
                self._adopt(plan)
            else:
                self.controls.voice.say(Severity.WARNING, f"stored {kind.name.lower()} left out: {plan.reason}")
        kept = self.depths.restore(content.depth, content.world)
        self.controls.voice.say_all([(Severity.INFO, text) for text in kept])
