"""A part of a plan that is changed over the radio: the rest comes from the shore's copy, which may not be the plan aboard any more."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind, Reply, Result
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.radio.codec.info import Kept
from sitl.radio import RadioConfig
from tools.benches.lora import compiled, settled, survey_items
from tools.lora_rig import Rig

OLD, NEW = survey_items(4), survey_items(6)


def changed(items: tuple[PlanItem, ...]) -> LoadPlan:
    """What MISSION_WRITE_PARTIAL_LIST of the last item makes of these."""
    moved = replace(items[-1], x=items[-1].x + 500)
    return replace(compiled((*items[:-1], moved)), base_id=plan_id(items))


def aboard(rig: Rig) -> int:
    return rig.vessel.plans.plan_id(PlanKind.MISSION)


def ready(seed: int = 0) -> Rig:
    rig = settled(seed=seed)
    assert rig.ask(compiled(OLD))[1].result is Result.ACCEPTED
    rig.run(6.0)
    return rig


def deaf(modem: Any) -> Any:
    """Nothing is heard there until its ``read`` is put back."""
    heard = modem.read
    modem.read = lambda: heard() and b""
    return heard


def reply_to(rig: Rig, owner: object) -> list[Reply]:
    return [reply for _, whose, reply in rig.replies if whose is owner]


def test_a_part_of_the_plan_that_is_aboard_is_changed() -> None:
    rig = ready()
    edit = changed(OLD)
    assert rig.ask(edit)[1].result is Result.ACCEPTED
    assert aboard(rig) == plan_id(edit.items) == rig.twin.plans.plan_id(PlanKind.MISSION)


@pytest.mark.parametrize("loss", [0.0, 0.4])
def test_a_part_of_a_plan_that_is_not_aboard_any_more_is_refused(loss: float) -> None:
    """Somebody has just put another plan aboard over another link, and no state has told of it yet."""
    for seed in range(1 if loss == 0.0 else 5):
        rig = ready(seed)
        rig.vessel.plans.put(PlanKind.MISSION, NEW)
        rig.pair.air.configure(RadioConfig(loss=loss))
        _, reply = rig.ask(changed(OLD))
        assert reply.result in ((Result.DENIED,) if loss == 0.0 else (Result.DENIED, Result.FAILED))
        assert "another" in reply.reason or reply.result is Result.FAILED
        rig.run(20.0)
        assert aboard(rig) == plan_id(NEW)


def told_from_now_on(rig: Rig) -> list[Kept]:
    """What the shore hears of what the vessel keeps."""
    told: list[Kept] = []
    take = rig.twin._on_kept

    def note(kept: Kept, now_us: int) -> None:
        told.append(kept)
        take(kept, now_us)

    rig.twin._on_kept = note  # type: ignore[method-assign]
    return told


def test_news_that_are_still_being_repeated_are_called_back_when_something_else_is_so() -> None:
    """The shore has not heard of a fence yet when the plan is replaced: that news names the plan of before."""
    rig = ready()
    heard = deaf(rig.pair.shore)
    rig.vessel.plans.put(PlanKind.FENCE, survey_items(3))
    rig.run(14.0)
    rig.vessel.plans.put(PlanKind.MISSION, NEW)
    rig.pair.shore.read = heard  # type: ignore[method-assign]
    told = told_from_now_on(rig)
    assert rig.ask(changed(OLD))[1].result is Result.DENIED
    assert {kept.mission_id for kept in told} == {plan_id(NEW)}
    rig.run(20.0)
    assert aboard(rig) == plan_id(NEW)


def test_a_vessel_that_does_not_say_which_plan_she_has_keeps_it() -> None:
    rig = ready()
    rig.pair.air.jammed = True
    assert rig.ask(changed(OLD))[1].result is Result.FAILED
    rig.pair.air.jammed = False
    rig.run(30.0)
    assert aboard(rig) == plan_id(OLD)


def test_a_change_never_comes_after_the_whole_plan_that_followed_it() -> None:
    rig, whole = ready(), compiled(NEW)
    rig.pair.air.jammed = True
    rig.twin.submit(edit := object(), changed(OLD), rig.now_us)
    rig.run(1.0)
    rig.pair.air.jammed = False
    assert rig.ask(whole)[1].result is Result.ACCEPTED
    rig.run(30.0)
    assert [reply.result for reply in reply_to(rig, edit)] == [Result.REJECTED_NOW]
    assert aboard(rig) == plan_id(NEW)


def test_a_change_on_the_air_is_called_back_when_a_state_tells_of_another_plan() -> None:
    """The vessel has said that the plan is hers, and it was replaced while the packets of the change were being lost."""
    rig = ready()
    rig.twin.submit(edit := object(), changed(OLD), rig.now_us)
    while not rig.twin._pending.is_on_its_way(PlanKind.MISSION):
        rig.step()
    rig.vessel.plans.put(PlanKind.MISSION, NEW)
    heard = deaf(rig.pair.vessel)
    rig.run(12.0)
    rig.pair.vessel.read = heard  # type: ignore[method-assign]
    rig.run(60.0)
    assert [reply.result for reply in reply_to(rig, edit)] == [Result.DENIED]
    assert aboard(rig) == plan_id(NEW)
