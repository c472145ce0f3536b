"""What a console is told of a plan before its START: what the vessel will refuse it for, by the names of its manoeuvres."""

from __future__ import annotations

import pytest

from mavlink_bridge import imc
from tests.imc_rig import Rig, plan

CALM = "depth.enabled=false"


def load(rig: Rig, name: str) -> imc.PlanControl:
    answer = rig.console.ask(imc.PlanControl(op=imc.PlanControlOp.LOAD, plan_id=name))
    assert isinstance(answer, imc.PlanControl)
    return answer


def test_a_speed_beyond_the_hulls_is_told_when_the_plan_is_saved() -> None:
    rig = Rig(CALM)
    saved = rig.console.save(plan("fast", rig.goto(10.0, 0.0), rig.goto(20.0, 0.0, 50.0)))
    assert saved.type == imc.ReplyType.SUCCESS
    assert "START will refuse it: Goto2: 50.0 m/s is more than the vessel's 3.1 m/s" in saved.info
    assert "50.0 m/s is more than the vessel's 3.1 m/s" in rig.console.start("fast").info, "as the vessel does"


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (((500_000.0, 0.0),), "Goto1 is away 500 km, limit 1000 m (MIS_DIST_1WP)"),
        (((20.0, 0.0), (20_000.0, 0.0)), "leg to Goto2 is 20 km, limit 5000 m (MIS_DIST_WPS)"),
    ],
)
def test_a_plan_of_another_place_is_told_when_it_is_saved_and_when_it_is_loaded(points, words: str) -> None:
    rig = Rig(CALM)
    saved = rig.console.save(plan("far", *(rig.goto(*point) for point in points)))
    for answer in (saved, load(rig, "far")):
        assert answer.type == imc.ReplyType.SUCCESS
        assert "from here START will refuse it: Plan too far; PLAN_FAR_OK=" in answer.info
        assert words in answer.info
    assert "Plan too far" in rig.console.start("far").info, "as the vessel does"


def test_a_plan_that_sails_is_told_nothing_of_and_one_that_a_person_accepted_neither() -> None:
    rig = Rig(CALM)
    assert rig.console.save(plan("near", rig.goto(20.0, 0.0))).info == "OK (new entry)"
    spec = plan("far", rig.goto(3000.0, 0.0))
    number = rig.console.save(spec).info.partition("PLAN_FAR_OK=")[2].partition(" ")[0]
    load(rig, "far")
    word = imc.SetEntityParameters(name="Mission", params=(imc.EntityParameter("PLAN_FAR_OK", number),))
    rig.console.send(word)
    rig.run(2.0)
    assert rig.console.save(spec).info == "OK (updated)"
    assert rig.console.start("far").type == imc.ReplyType.SUCCESS


def test_a_limit_that_was_changed_aboard_counts_as_it_is_now() -> None:
    rig = Rig(CALM)
    farther = imc.SetEntityParameters(name="Mission", params=(imc.EntityParameter("MIS_DIST_1WP", "4000"),))
    rig.console.send(farther)
    rig.run(2.0)
    assert rig.console.save(plan("far", rig.goto(3000.0, 0.0))).info == "OK (new entry)"
