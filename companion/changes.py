"""Changes that a station asks for, judged before they are stored: who may ask, a parameter's value, and what a new plan ends."""

from __future__ import annotations

from mavlink_bridge.language.requests import (
    ACCEPTED,
    EraseLogs,
    LoadPlan,
    PlanKind,
    Reboot,
    Reply,
    Request,
    Result,
    SetParameter,
)
from mavlink_bridge.mavlink.missions.plan_rules import plan_id

from .audit import ABOARD
from .core.hull import VesselConfig
from .core.steer import gains_problem
from .core.vehicle.controls import Controls
from .core.vehicle.plan_reach import FAR_OK, plan_number
from .facade import Facade
from .io.keeping import StoreOp
from .io.keeping.content import SaveParam, SavePlan, Together
from .judge.live import change_mistakes, left_to_mend
from .lasting import Answer
from .logs import Logs


def setting_refusal(controls: Controls, request: Request, now_us: int) -> str:
    """Return why the sender may not change a plan or a parameter, erase logs, or end the program; or an empty string."""
    if not isinstance(request.body, LoadPlan | SetParameter | EraseLogs | Reboot):
        return ""
    return controls.parts.operators.objection(request.body, request.station, now_us, manual=False)


def erase_logs(controls: Controls, logs: Logs | None, request: Request) -> Reply:
    """Have the logs of earlier runs deleted; what came of it is told with who ordered it."""
    if controls.armed:
        return Reply(Result.REJECTED_NOW, "logs are not erased while armed")
    if logs is None:
        return Reply(Result.DENIED, "there are no logs: nothing is recorded")
    logs.erase(ABOARD if request.station is None else str(request.station))
    return ACCEPTED


def telling(controls: Controls, request: Request, answer: Answer) -> Answer:
    """Return ``answer`` so that the commander hears of a change that was made."""

    def told(reply: Reply) -> None:
        if reply.result is Result.ACCEPTED:
            controls.parts.operators.has_set(request.body, request.station, armed=controls.armed)
        answer(reply)

    return told


def parameter_problem(facade: Facade, vessel: VesselConfig, body: SetParameter) -> str:
    """Return why a parameter cannot have the value, or an empty string."""
    number = plan_number(facade.plans.ids[0])
    if body.name == FAR_OK and body.value not in (0.0, number):
        return f"{FAR_OK}: the plan in force has the number {number}"
    old = facade.params.get(body.name)
    try:
        wanted = facade.params.change(body.name, body.value)
        same = wanted if old is None else facade.params.change(body.name, old.value)
    except ValueError as error:
        return str(error)
    if wanted.steering != facade.params.settings.steering and (problem := gains_problem(wanted.steering, vessel)):
        return problem
    key = f"{facade.params.key(body.name)} = "
    for mistake in change_mistakes(same, wanted, vessel, key):
        said = mistake.partition(": ")[2] if mistake.startswith(key) else mistake
        return f"{body.name} = {body.value:g}: {said}"
    return ""


def parameter_aftermath(facade: Facade, vessel: VesselConfig, body: SetParameter) -> list[str]:
    """Return what a parameter that may have the value makes wrong of other settings, for people."""
    before = facade.params.settings
    after = facade.params.change(body.name, body.value)
    return left_to_mend(before, after, vessel, f"{facade.params.key(body.name)} = ")


def ends_far_word(facade: Facade, body: LoadPlan) -> bool:
    """Whether a plan replaces the one of which a person has accepted how far away it lies."""
    word = facade.params.settings.mission.far_plan
    return body.kind is PlanKind.MISSION and word not in (0, plan_number(plan_id(body.items)))


def saving(facade: Facade, body: LoadPlan) -> StoreOp:
    """Return what stores a plan, and with it the end of a word given for the plan before."""
    save = SavePlan(body.kind, body.items)
    return Together((save, SaveParam(FAR_OK, 0.0))) if ends_far_word(facade, body) else save
