"""PlanControl's requests: from a plan's name, or what comes with the request, to an order of the engine, and its one answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol

from mavlink_bridge import imc
from mavlink_bridge.mavlink.client import Autopilot, JobOutcome, VehicleClient

from ..desk_config import DeskConfig
from .engine import DeskPhase, Engine, StandingAbort
from .foresight import Foresight
from .limits_desk import LimitsDesk
from .maneuvers import Means
from .params_desk import ParamsDesk
from .plan import Plan, compiled
from .refusal import ConsoleRefusedError

_NOT_HEARD: Final = "the vessel is not heard"


class AnswerTaker(Protocol):
    """Takes the one answer to a request."""

    def __call__(self, kind: imc.ReplyType, info: str, arg: imc.Message | None = None) -> None: ...


class Control:
    """``find`` looks a plan up by its name."""

    def __init__(
        self,
        config: DeskConfig,
        client: VehicleClient,
        engine: Engine,
        limits: LimitsDesk,
        params: ParamsDesk,
        *,
        foresight: Foresight | None = None,
    ) -> None:
        self._config = config
        self._client = client
        self._engine = engine
        self._limits = limits
        self._params = params
        self._foresight = foresight
        self.find: Callable[[str], imc.PlanSpecification | None] = lambda name: None

    @property
    def running(self) -> str:
        """Name of the plan that sails, or did last, for the store."""
        return self._engine.plan.name if self._engine.plan is not None else ""

    def restore(self, running: Any, aborted: Any) -> None:
        """Take up what was before a restart: a plan that sails on is known again, an Abort stands."""
        spec = self.find(running) if isinstance(running, str) and running else None
        if spec is not None:
            try:
                self._engine.plan = self._compiled(spec)
                self._engine.plan_name = spec.plan_id
            except ConsoleRefusedError:
                pass
        if isinstance(aborted, str) and aborted:
            self._engine.aborted = StandingAbort(aborted, 0)

    def judge(self, spec: imc.PlanSpecification) -> str:
        """What of a plan is passed over or the vessel will refuse, in words. Raises ConsoleRefusedError for what is refused here."""
        return "" if self._is_by_hand(spec) else self._foretold(self._compiled(spec))

    def _foretold(self, plan: Plan) -> str:
        """What a person should know of a plan before its START."""
        vehicle = self._client.vehicle
        if self._foresight is None or vehicle is None or vehicle.kind is not Autopilot.OURS:
            return plan.remark
        refusal = self._foresight.of(plan, self._params.value)
        return "; ".join(filter(None, (f"from here START will refuse it: {refusal}" if refusal else "", plan.remark)))

    def obey(self, request: imc.PlanControl, answered: AnswerTaker, now_us: int) -> imc.PlanSpecification | None:
        """Carry a request out; returns the plan that came with it, when one did."""
        match request.op:
            case imc.PlanControlOp.START:
                return self._begin(request, answered, now_us, sail=True)
            case imc.PlanControlOp.LOAD:
                return self._begin(request, answered, now_us, sail=False)
            case imc.PlanControlOp.STOP:
                self._stop(answered, now_us)
            case imc.PlanControlOp.GET:
                plan = self._engine.plan
                if plan is None or self._engine.phase is DeskPhase.IDLE:
                    answered(imc.ReplyType.FAILURE, "no plan is running")
                else:
                    answered(imc.ReplyType.SUCCESS, "OK", plan.spec)
            case _:
                answered(imc.ReplyType.FAILURE, f"operation {request.op} is not known")
        return None

    # ---- inside -------------------------------------------------------------------------------------------------

    def _begin(
        self, request: imc.PlanControl, answered: AnswerTaker, now_us: int, *, sail: bool
    ) -> imc.PlanSpecification | None:
        refusal = self._standing(request)
        spec = self._spec(request)
        if spec is None:
            refusal = refusal or "undefined plan"
        if refusal or spec is None:
            answered(imc.ReplyType.FAILURE, refusal)
            return None
        given = spec if request.arg is not None else None
        if self._is_by_hand(spec):
            self._by_hand(request, answered, now_us, sail=sail)
            return given
        try:
            plan = self._compiled(spec)
        except ConsoleRefusedError as error:
            answered(imc.ReplyType.FAILURE, str(error))
            return given
        if sail:
            begun = f"{plan.stages[0].name}: executing maneuver"
            self._engine.start(plan, self._once(answered, begun, plan.remark), now_us)
        else:
            self._engine.load(plan, self._once(answered, "plan loaded", self._foretold(plan)), now_us)
        return given

    def _by_hand(self, request: imc.PlanControl, answered: AnswerTaker, now_us: int, *, sail: bool) -> None:
        vehicle = self._client.vehicle
        if vehicle is not None and vehicle.by_radio:
            answered(imc.ReplyType.FAILURE, "sticks do not cross the radio: teleoperation needs a direct link")
        elif sail:
            name = request.plan_id or "teleoperation-mode"
            self._engine.steer_by_hand(name, self._once(answered, "teleoperation: the sticks steer", ""), now_us)
        else:
            answered(imc.ReplyType.FAILURE, "teleoperation is started, not loaded")

    def _stop(self, answered: AnswerTaker, now_us: int) -> None:
        engine, vehicle = self._engine, self._client.vehicle
        if engine.aborted is not None:
            if engine.lift(now_us):
                answered(imc.ReplyType.SUCCESS, "the abort is lifted; START sails again")
            else:
                answered(imc.ReplyType.SUCCESS, "stopped by the abort before; STOP again lifts it")
        elif vehicle is None or not self._client.is_heard(now_us):
            answered(imc.ReplyType.FAILURE, _NOT_HEARD)
        elif engine.phase is DeskPhase.IDLE and not vehicle.armed:
            answered(imc.ReplyType.FAILURE, "no plan is running, request ignored")
        else:
            engine.stop(self._once(answered, "OK: it keeps station", ""), now_us)

    def _standing(self, request: imc.PlanControl) -> str:
        """What forbids any start just now, or ""."""
        if self._engine.aborted is not None:
            return self._engine.aborted.words
        if request.flags & imc.PlanFlags.IGNORE_ERRORS:
            return "errors are not ignored by IMC: the vessel's checks hold; start without IGNORE_ERRORS"
        return "" if self._client.vehicle is not None else _NOT_HEARD

    def _spec(self, request: imc.PlanControl) -> imc.PlanSpecification | None:
        """The plan that is meant: the one in the request, or the one of that name."""
        arg = request.arg
        if arg is None:
            return self.find(request.plan_id)
        if isinstance(arg, imc.PlanSpecification):
            return arg
        node = imc.PlanManeuver(maneuver_id=imc.name_of(_number(arg)), data=arg)
        return imc.PlanSpecification(plan_id=request.plan_id, start_man_id=node.maneuver_id, maneuvers=(node,))

    @staticmethod
    def _is_by_hand(spec: imc.PlanSpecification) -> bool:
        return len(spec.maneuvers) == 1 and isinstance(spec.maneuvers[0].data, imc.Teleoperation)

    def _compiled(self, spec: imc.PlanSpecification) -> Plan:
        vehicle = self._client.vehicle
        return compiled(
            spec,
            Means(self._config.full_speed_mps),
            vehicle.kind if vehicle is not None else Autopilot.OURS,
            self._limits.limits.max_speed_mps,
            self._params.sections,
        )

    def _once(self, answered: AnswerTaker, info: str, remark: str) -> Callable[[JobOutcome], None]:
        vehicle = self._client.vehicle
        was_armed = vehicle is not None and vehicle.armed

        def done(outcome: JobOutcome) -> None:
            if not outcome.ok:
                answered(imc.ReplyType.FAILURE, outcome.reason)
                return
            now = self._client.vehicle
            arms = not was_armed and now is not None and now.armed
            answered(
                imc.ReplyType.SUCCESS,
                info + ("; armed by this order" if arms else "") + (f"; {remark}" if remark else ""),
            )

        return done


def _number(message: imc.Message) -> int:
    return message.number if isinstance(message, imc.UnknownMessage) else message.NUMBER
