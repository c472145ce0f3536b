"""A console that commands the simulated vessel by IMC: what it is answered and when, and what the boat does on the water."""

from __future__ import annotations

import dataclasses
import math

import pytest

from companion.imc.desk import DeskConfig
from mavlink_bridge import imc
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Station
from tests.imc_rig import Rig, distance_m, plan
from tests.world_station import Helm

CALM = "depth.enabled=false"
EXECUTING, READY, BLOCKED = imc.PlanState.EXECUTING, imc.PlanState.READY, imc.PlanState.BLOCKED
BY_HAND = imc.PlanControl(
    op=imc.PlanControlOp.START, plan_id="teleoperation-mode", arg=imc.Teleoperation(custom="src=16385")
)


def far(rig: Rig, name: str = "p1") -> imc.PlanSpecification:
    return plan(name, rig.goto(400.0, 0.0))


def ok(answer) -> bool:
    return answer.type == imc.ReplyType.SUCCESS


def test_start_is_answered_within_a_second_and_shown_within_two() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.save(far(rig)))
    began = rig.now_s
    answer = rig.console.start("p1")
    assert ok(answer)
    assert "armed by this order" in answer.info
    assert rig.now_s - began <= 1.0
    rig.until(lambda: rig.view().state is EXECUTING, 2.0 - (rig.now_s - began))
    view = rig.view()
    assert (view.plan_id, view.maneuver_id, view.maneuver_type) == ("p1", "Goto1", imc.Goto.NUMBER)
    assert view.operation is imc.OpMode.MANEUVER
    assert len(rig.console.all(imc.PlanControl)) == 1
    assert any("IMC, 10.77.0.1:6001, ccu-test (0x4001): START p1" in text for _, _, text in rig.events)

    answer = rig.console.stop()
    assert ok(answer)
    assert (rig.view().state, rig.view().last_outcome) == (READY, imc.Outcome.FAILURE)
    rig.run(12.0)
    assert abs(rig.truth.u_mps) < 0.3
    assert rig.console.start("nosuch").info == "undefined plan"


def test_a_plan_is_sailed_to_its_end_and_told_so() -> None:
    rig = Rig(CALM)
    spec = plan("p1", rig.goto(15.0, 0.0), imc.StationKeeping(**rig.place(25.0, 8.0), duration_s=5, speed=1.2))
    assert ok(rig.console.sail(spec))
    names = []

    def over() -> bool:
        names.append(rig.view().maneuver_id)
        return rig.view().state is READY

    rig.until(over, 90.0)
    assert list(dict.fromkeys(names)) == ["Goto1", "StationKeeping2", ""]
    assert rig.view().last_outcome is imc.Outcome.SUCCESS
    assert rig.view().plan_id == "p1"
    assert distance_m(rig, 25.0, 8.0) < 2.0
    assert len(rig.console.all(imc.PlanControl)) == 1


def test_an_abort_stays_until_a_separate_act_lifts_it() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    rig.run(5.0)
    rig.console.send(imc.Abort(), direct=False)
    rig.run(1.0)
    assert rig.snapshot.armed, "an Abort that names nobody is not ours"
    rig.console.abort()
    rig.until(lambda: not rig.snapshot.armed, 0.5)
    assert (rig.view().state, rig.view().operation) == (BLOCKED, imc.OpMode.ERROR)
    assert ok(rig.console.stop()), "a STOP that belongs to the Abort"
    for _ in range(3):
        refused = rig.console.start("p1")
        assert not ok(refused)
        assert "aborted by IMC" in refused.info
        rig.run(1.0)
    rig.begin()
    rig.run(2.0)
    assert rig.view().state is BLOCKED, "a restart lifts nothing"
    assert ok(rig.console.stop())
    assert rig.view().state is READY
    assert not rig.snapshot.armed
    assert ok(rig.console.start("p1"))


def test_an_abort_that_is_lifted_is_no_error_any_more() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    rig.run(3.0)
    rig.console.abort()
    rig.run(2.0)
    assert "aborted by IMC" in rig.view().last_error
    assert ok(rig.console.stop())
    assert (rig.view().last_error, rig.view().last_error_us) == ("", None)
    assert ok(rig.console.start("p1"))
    assert rig.view().last_error == ""


def test_a_start_soon_after_a_lifted_abort_sails_on() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    rig.run(3.0)
    rig.console.abort()
    rig.run(1.1)
    assert not rig.snapshot.armed
    assert "the abort is lifted" in rig.console.stop().info
    assert ok(rig.console.start("p1"))
    rig.run(3.0)
    assert rig.snapshot.armed
    assert rig.view().state is EXECUTING


def test_who_arms_after_an_abort_has_the_vessel_to_himself() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    rig.run(3.0)
    rig.console.abort()
    rig.run(0.3)
    assert not rig.snapshot.armed
    arm = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1.0, *([0.0] * 6))
    rig.world.ground("sdk").write(0, Station().codec.encode(arm))
    rig.until(lambda: rig.snapshot.armed, 0.5)
    rig.run(5.0)
    assert rig.snapshot.armed
    assert rig.view().state is BLOCKED, "the Abort stands for consoles all the same"


def test_an_abort_that_does_not_get_through_is_ordered_again_though_it_is_lifted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    rig.run(3.0)
    with monkeypatch.context() as lost:
        lost.setattr(rig.link, "write", lambda channel, data: len(data))
        rig.console.abort()
        rig.run(1.5)
        assert "the abort is lifted" in rig.console.stop().info
        rig.run(6.0)
        assert rig.snapshot.armed, "it has not heard"
    rig.until(lambda: not rig.snapshot.armed, 2.5)


def test_an_abort_answers_the_start_that_it_ends() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.save(far(rig)))
    request = imc.PlanControl(op=imc.PlanControlOp.START, request_id=99, plan_id="p1")
    rig.console.send(request)
    rig.console.abort()
    rig.run(3.0)
    answers = [each for each in rig.console.all(imc.PlanControl) if each.request_id == 99]
    assert [each.type for each in answers] == [imc.ReplyType.FAILURE]
    assert "aborted by" in answers[0].info
    assert not rig.snapshot.armed


def test_sticks_steer_and_are_neutral_when_they_are_silent() -> None:
    rig = Rig(CALM)
    answer = rig.console.ask(BY_HAND)
    assert ok(answer)
    assert (rig.view().maneuver_type, rig.view().maneuver_id) == (imc.Teleoperation.NUMBER, "Teleoperation")
    before = rig.truth.north_m, rig.truth.east_m
    for _ in range(50):
        rig.console.send(imc.RemoteActions(actions="Thrust=127;Heading=0"))
        rig.run(0.1)
    assert math.dist(before, (rig.truth.north_m, rig.truth.east_m)) > 3.0
    turned = rig.truth.psi_rad
    for _ in range(20):
        rig.console.send(imc.RemoteActions(actions="Thrust=40;Heading=80"))
        rig.run(0.1)
    assert abs(math.remainder(rig.truth.psi_rad - turned, math.tau)) > 0.2
    silence = rig.until(lambda: rig.snapshot.output.thruster_port == 0.0, 3.0)
    assert silence <= 1.3
    rig.console.send(imc.RemoteActions(actions="Exit=1"))
    rig.run(0.5)
    assert rig.snapshot.mode is Mode.HOLD
    assert (rig.view().state, rig.view().last_outcome) == (READY, imc.Outcome.SUCCESS)
    assert ok(rig.console.ask(BY_HAND))
    rig.console.send(imc.TeleoperationDone())
    rig.run(0.5)
    assert rig.snapshot.mode is Mode.HOLD


@pytest.mark.parametrize("abort", [False, True])
def test_the_sticks_that_are_taken_again_are_not_lost_before_the_first(abort: bool) -> None:
    rig = Rig(CALM)
    assert ok(rig.console.ask(BY_HAND))
    rig.run(2.0)
    if abort:
        rig.console.abort()
        rig.run(1.5)
    assert ok(rig.console.stop())
    rig.run(3.0)
    start = dataclasses.replace(BY_HAND, request_id=99)
    rig.console.send(start)
    causes: set[str] = set()
    for _ in range(40):
        rig.step()
        causes.update(rig.snapshot.causes)
    assert rig.view().maneuver_type == imc.Teleoperation.NUMBER
    assert rig.snapshot.armed
    assert "manual_lost" not in causes


@pytest.mark.parametrize("by_hand", [False, True])
def test_a_console_that_dies_leaves_the_failsafe_that_a_mavlink_station_leaves(by_hand: bool) -> None:
    """The bars: as by MAVLink, within a second."""
    rig = Rig(CALM)
    assert ok(rig.console.ask(BY_HAND) if by_hand else rig.console.sail(far(rig)))
    rig.run(6.4)
    rig.console.present = False
    ours = rig.until(lambda: rig.snapshot.action >= Action.HOLD or rig.snapshot.mode is Mode.HOLD, 12.0)
    if by_hand:
        assert ours <= 6.0
        return
    helm = Helm("ardurover", CALM)
    assert helm.upload([(3, 16, 0.0, 0.0, 0.0, math.nan, *helm.at(400.0, 0.0), 0.0)]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    helm.run(6.4)
    helm.present = False
    theirs = helm.until(lambda: helm.world.snapshot.action >= Action.HOLD, 12.0)
    assert abs(ours - theirs) <= 1.0


def test_a_console_that_was_silent_for_16_s_commands_again_at_once() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    rig.run(3.0)
    rig.console.present = False
    rig.run(16.0)
    assert rig.view().state is READY
    rig.console.present = True
    began = rig.now_s
    assert ok(rig.console.start("p1"))
    rig.until(lambda: rig.view().state is EXECUTING, 2.0)
    assert rig.now_s - began <= 2.0


def test_one_console_commands_and_every_console_stops() -> None:
    rig = Rig(CALM)
    other = rig.add(imc_id=0x4002, host="10.77.0.9", name="ccu-other")
    assert ok(rig.console.sail(far(rig)))
    refused = other.start("p1")
    assert not ok(refused)
    assert "ccu-test (0x4001) commands" in refused.info
    assert not ok(other.ask(BY_HAND))
    assert rig.view().state is EXECUTING
    assert ok(other.stop())
    assert rig.snapshot.mode is Mode.HOLD
    rig.run(4.5)
    assert ok(other.start("p1")), "who insists takes command"
    assert not ok(rig.console.start("p1"))
    assert any("ccu-other (0x4002) commands now" in text for _, _, text in rig.events)
    other.present = False
    rig.run(5.5)
    assert ok(rig.console.start("p1")), "a commander that is silent commands no longer"
    assert {each.request_id for each in other.all(imc.PlanControl)} == {1, 2, 3, 4}


def test_orders_that_come_again_or_late_are_not_carried_out() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.save(far(rig)))
    start = imc.PlanControl(op=imc.PlanControlOp.START, request_id=7, plan_id="p1")
    stop = imc.PlanControl(op=imc.PlanControlOp.STOP, request_id=8)
    sent = rig.utc_s
    rig.console.send(start, sent)
    rig.run(1.0)
    for again in (sent, sent + 0.7):
        rig.console.send(start, again)
        rig.run(0.3)
    answers = [each for each in rig.console.all(imc.PlanControl) if each.request_id == 7]
    assert len(answers) == 2, "one answer, and once more to the one who asked again"
    rig.console.send(stop)
    rig.run(1.0)
    rig.console.send(start, sent + 0.9)
    late = dataclasses.replace(start, request_id=9)
    rig.console.send(late, sent - 2.0)
    rig.run(1.0)
    assert rig.snapshot.mode is Mode.HOLD
    assert "newer order" in rig.console.all(imc.PlanControl)[-1].info
    old = rig.console.ask(dataclasses.replace(start), age_s=30.0)
    assert "30 s old" in old.info
    assert rig.snapshot.mode is Mode.HOLD


def test_a_bridge_that_starts_anew_under_way_goes_on_with_the_plan_and_the_console() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.sail(far(rig)))
    start_number = rig.console.number
    rig.run(3.0)
    rig.begin()
    repeat = imc.PlanControl(op=imc.PlanControlOp.START, request_id=start_number, plan_id="p1", flags=1)
    rig.run(2.0)
    assert (rig.view().state, rig.view().plan_id) == (EXECUTING, "p1")
    before = rig.snapshot.path
    rig.console.send(repeat)
    rig.run(6.0)
    assert rig.snapshot.mode is Mode.AUTO, "the console still commands: no failsafe"
    assert rig.view().state is EXECUTING
    assert before.distance_m > rig.snapshot.path.distance_m


def test_limits_of_a_console_are_the_vessels() -> None:
    rig = Rig()
    rig.console.send(imc.GetOperationalLimits())
    assert rig.console.all(imc.OperationalLimits)[-1].mask == 0
    mask = imc.LimitsMask.MIN_ALT | imc.LimitsMask.MAX_SPEED | imc.LimitsMask.AREA | imc.LimitsMask.MAX_DEPTH
    box = {"width_m": 60.0, "length_m": 120.0, "orientation_rad": 0.0}
    rig.console.send(
        imc.OperationalLimits(mask=int(mask), min_altitude_m=2.5, max_speed_mps=1.0, **rig.place(0.0, 0.0), **box)
    )
    rig.run(3.0)
    told = rig.console.all(imc.OperationalLimits)[-1]
    assert told.mask == mask & ~imc.LimitsMask.MAX_DEPTH
    assert (told.min_altitude_m, told.max_speed_mps, told.length_m) == (2.5, 1.0, 120.0)
    assert rig.world.app.settings.depth.min_altitude_m == 2.5
    assert any("max depth are not a surface vessel's" in text for _, _, text in rig.events)
    assert ok(rig.console.save(plan("fast", rig.goto(20.0, 0.0, 1.5))))
    assert "above the limit 1" in rig.console.start("fast").info
    assert ok(rig.console.save(plan("out", rig.goto(100.0, 0.0, 0.9))))
    outside = rig.console.start("out")
    assert not ok(outside)
    assert "fence" in outside.info.lower()
    assert not rig.snapshot.armed


def test_parameters_are_told_and_set_by_part() -> None:
    rig = Rig()
    rig.console.send(imc.QueryEntityParameters(name="Depth", visibility="user", scope="global"))
    rig.run(3.0)
    told = {each.name: each.value for each in rig.console.all(imc.EntityParameters)[-1].params}
    assert told["DEPTH_MIN"] == "4"
    assert all(name.startswith(("DEPTH", "SNDR")) for name in told)
    wanted = (imc.EntityParameter("DEPTH_MIN", "3.5"), imc.EntityParameter("NO_SUCH", "1"))
    rig.console.send(imc.SetEntityParameters(name="Depth", params=wanted))
    rig.run(2.0)
    answer = rig.console.all(imc.EntityParameters)[-1]
    assert [(each.name, each.value) for each in answer.params] == [("DEPTH_MIN", "3.5")]
    assert rig.world.app.settings.depth.min_altitude_m == 3.5
    assert any("Depth has no parameter NO_SUCH" in text for _, _, text in rig.events)
    rig.console.send(imc.SetEntityParameters(name="Depth", params=(imc.EntityParameter("DEPTH_MIN", "9e6"),)))
    rig.run(2.0)
    assert rig.console.all(imc.EntityParameters)[-1].params[0].value == "3.5"
    assert any("DEPTH_MIN" in text and "outside" in text for _, _, text in rig.events)


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("DEPTH_MIN", "abc", 'DEPTH_MIN: "abc" is no number'),
        ("DEPTH_MIN", "nan", "a finite number is needed"),
        ("NO_SUCH", "1", "Depth has no parameter NO_SUCH"),
        ("DEPTH_MIN", "9e6", "outside"),
    ],
)
def test_a_parameter_that_is_refused_is_not_said_to_be_set(name: str, value: str, why: str) -> None:
    rig = Rig()
    rig.console.send(imc.SetEntityParameters(name="Depth", params=(imc.EntityParameter(name, value),)))
    rig.run(2.0)
    told = [text for _, _, text in rig.events if name in text]
    assert len(told) == 1
    assert why in told[0]
    assert told[0].startswith("IMC, 10.77.0.1:6001, ccu-test (0x4001): ")


def test_who_sets_no_parameter_does_not_take_command() -> None:
    rig = Rig(CALM)
    nothing = (imc.EntityParameter("DEPTH_MIN", "abc"), imc.EntityParameter("NO_SUCH", "1"))
    rig.console.send(imc.SetEntityParameters(name="Depth", params=nothing))
    rig.run(1.0)
    other = rig.add(imc_id=0x4002, host="10.77.0.9", name="ccu-other")
    assert ok(other.sail(far(rig))), "nobody commanded"


def test_what_is_set_is_said_by_name_without_what_is_refused() -> None:
    rig = Rig()
    wanted = (imc.EntityParameter("DEPTH_MIN", "3.5"), imc.EntityParameter("NO_SUCH", "1"))
    rig.console.send(imc.SetEntityParameters(name="Depth", params=wanted))
    rig.run(2.0)
    told = [text for _, severity, text in rig.events if severity == 5]
    assert told[-1].endswith("ccu-test (0x4001): Depth: DEPTH_MIN = 3.5")


def test_who_only_looks_moves_nothing_and_sends_nothing() -> None:
    rig = Rig(CALM, desk=DeskConfig(read_only=True))
    assert ok(rig.console.save(far(rig)))
    assert "read_only" in rig.console.start("p1").info
    rig.console.abort()
    assert not ok(rig.console.stop())
    rig.run(3.0)
    assert not rig.snapshot.armed
    assert "no ground station heard" in "; ".join(rig.snapshot.health.prearm_reasons)


def test_what_the_vessel_refuses_is_said_in_its_words_and_leaves_nothing_armed() -> None:
    rig = Rig(CALM)
    assert ok(rig.console.save(plan("p1", rig.goto(3000.0, 0.0))))
    refused = rig.console.start("p1")
    assert not ok(refused)
    assert "MIS_DIST_1WP" in refused.info or "away" in refused.info
    rig.run(1.0)
    assert not rig.snapshot.armed
    assert (rig.view().state, rig.view().last_outcome) == (READY, imc.Outcome.FAILURE)


def test_a_plan_that_is_started_in_the_tick_that_loads_it_is_held_against_the_fence() -> None:
    """Found here: load, arm and start in one go came before the vessel had looked at the new plan."""
    rig = Rig()
    area = imc.OperationalLimits(
        mask=int(imc.LimitsMask.AREA), width_m=60.0, length_m=120.0, orientation_rad=0.0, **rig.place(0.0, 0.0)
    )
    rig.console.send(area)
    rig.run(3.0)
    refused = rig.console.sail(plan("out", rig.goto(100.0, 0.0, 0.9)))
    assert not ok(refused)
    assert "outside the fence" in refused.info
    rig.run(1.0)
    assert not rig.snapshot.armed
