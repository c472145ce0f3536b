"""What a console may change of the vessel's limits and parameters, and what it is told of it; what is refused changes nothing."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge import imc
from tests.imc_rig import Rig, plan

BOX = {"width_m": 400.0, "length_m": 400.0, "orientation_rad": 0.0}
AREA, MIN_ALT, MAX_SPEED = imc.LimitsMask.AREA, imc.LimitsMask.MIN_ALT, imc.LimitsMask.MAX_SPEED


def ok(answer) -> bool:
    return answer.type == imc.ReplyType.SUCCESS


def fenced() -> Rig:
    """The vessel sails 150 m by a console's plan, inside a console's area."""
    rig = Rig()
    rig.console.send(imc.OperationalLimits(mask=int(AREA), **rig.place(0.0, 0.0), **BOX))
    rig.run(3.0)
    assert ok(rig.console.sail(plan("p1", rig.goto(150.0, 0.0))))
    rig.run(1.0)
    assert rig.world.app.controls.parts.fence.enabled
    return rig


@pytest.mark.parametrize(
    "refused",
    [
        imc.OperationalLimits(mask=int(MIN_ALT), min_altitude_m=-5.0),
        imc.OperationalLimits(mask=int(MIN_ALT), min_altitude_m=math.nan),
        imc.OperationalLimits(mask=int(MIN_ALT | MAX_SPEED), min_altitude_m=2.0, max_speed_mps=math.nan),
        imc.OperationalLimits(mask=int(MIN_ALT | AREA), min_altitude_m=2.0, width_m=0.0),
    ],
    ids=["altitude out of range", "altitude nan", "speed nan", "no area"],
)
def test_refused_limits_change_nothing(refused: imc.OperationalLimits) -> None:
    rig = fenced()
    rig.console.send(refused)
    rig.run(3.0)
    assert rig.console.all(imc.OperationalLimits)[-1].mask & AREA
    assert rig.world.app.controls.parts.fence.enabled
    assert rig.world.app.settings.depth.min_altitude_m == 4.0
    assert any("limits refused" in text for _, _, text in rig.events)


def test_a_fence_that_is_refused_leaves_the_altitude_as_it_was() -> None:
    """The parameter was taken by then: it is put back."""
    rig = Rig()
    nowhere = imc.OperationalLimits(
        mask=int(MIN_ALT | AREA), min_altitude_m=2.0, lat_rad=1e-12, lon_rad=1e-12, width_m=1e-3, length_m=1e-3
    )
    rig.console.send(nowhere)
    rig.run(3.0)
    assert any("limits refused" in text for _, _, text in rig.events)
    assert rig.world.app.settings.depth.min_altitude_m == 4.0


def test_what_limits_change_is_told_by_name_and_what_is_taken_away_is_a_warning() -> None:
    rig = fenced()
    before = len(rig.events)
    rig.console.send(imc.OperationalLimits(mask=int(MIN_ALT), min_altitude_m=2.0))
    rig.run(3.0)
    assert not rig.world.app.controls.parts.fence.enabled, "limits count as a whole"
    told = [(severity, text) for _, severity, text in rig.events[before:] if "ccu-test (0x4001): limits:" in text]
    assert [severity for severity, _ in told] == [4]
    assert "area REMOVED" in told[0][1]
    assert "DEPTH_MIN 4 -> 2 m" in told[0][1]


def test_only_who_commands_sets_limits_and_parameters_and_who_insists_commands() -> None:
    rig = fenced()
    other = rig.add(imc_id=0x4002, host="10.77.0.9", name="ccu-other")
    off = imc.SetEntityParameters(name="Depth", params=(imc.EntityParameter("DEPTH_ENABLE", "0"),))
    limits = imc.OperationalLimits(mask=int(MIN_ALT), min_altitude_m=1.0)
    assert not ok(other.start("p1"))
    rig.run(7.0)
    for order in (off, limits):
        other.send(order)
        rig.run(2.0)
    assert rig.world.app.settings.depth.enabled, "a START that was refused is not the order before this one"
    assert rig.world.app.controls.parts.fence.enabled
    assert ok(rig.console.start("p1"))
    other.send(off)
    rig.run(4.5)
    other.send(off)
    rig.run(1.0)
    assert not rig.world.app.settings.depth.enabled
    assert any("ccu-other (0x4002) commands now, not" in text for _, _, text in rig.events)
    assert "ccu-other (0x4002) commands" in rig.console.start("p1").info


def test_a_plan_cannot_lower_the_depth_limit() -> None:
    """It had done so without a word, and for ever."""
    rig = Rig()
    shallow = imc.SetEntityParameters(name="Depth", params=(imc.EntityParameter("DEPTH_MIN", "0.5"),))
    node = imc.PlanManeuver(maneuver_id="a", data=rig.goto(25.0, 0.0), start_actions=(shallow,))
    saved = rig.console.save(imc.PlanSpecification(plan_id="acts", start_man_id="a", maneuvers=(node,)))
    assert ok(saved), "it is kept: what it is refused for is said"
    assert "START will refuse it: a: a plan may not set DEPTH_MIN (Depth)" in saved.info
    assert "a plan may not set DEPTH_MIN" in rig.console.start("acts").info
    rig.run(3.0)
    assert rig.world.app.settings.depth.min_altitude_m == 4.0
    assert not rig.snapshot.armed


def told(rig: Rig) -> dict[str, str]:
    return {each.name: each.value for each in rig.console.all(imc.EntityParameters)[-1].params}


def test_a_part_is_told_whole_after_one_of_its_parameters_was_set() -> None:
    rig = Rig()
    rig.console.send(imc.SetEntityParameters(name="Depth", params=(imc.EntityParameter("DEPTH_MIN", "3.5"),)))
    rig.run(2.0)
    rig.console.send(imc.QueryEntityParameters(name="Depth", visibility="user", scope="global"))
    rig.run(3.0)
    assert told(rig)["DEPTH_MIN"] == "3.5"
    assert {"DEPTH_ENABLE", "SNDR_MIN"} <= told(rig).keys()


def test_of_several_parameters_those_before_a_refused_one_are_told_as_they_are_then() -> None:
    rig = Rig()
    rig.console.send(imc.QueryEntityParameters(name="Depth", visibility="user", scope="global"))
    rig.run(3.0)
    wanted = (imc.EntityParameter("DEPTH_MIN", "3.5"), imc.EntityParameter("SNDR_MIN", "9e6"))
    rig.console.send(imc.SetEntityParameters(name="Depth", params=wanted))
    rig.run(3.0)
    assert told(rig) == {"DEPTH_MIN": "3.5", "SNDR_MIN": "0.3"}
    assert rig.world.app.settings.depth.min_altitude_m == 3.5
