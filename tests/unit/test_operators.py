"""Who commands, whose silence counts, who may order what: by a table of stations, without a vessel."""

from __future__ import annotations

import pytest

from companion.core.vehicle.config import OperatorConfig
from companion.core.vehicle.operators import Operators
from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.leading import leads
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.stations import ONE_VOICE, Heard, Station

QGC = Station(255, 190, "gcs", "10.0.0.2")
PROXY = Station(255, 230, "gcs", "10.0.0.2")
VIEWER = Station(77, 190, "gcs", "10.0.0.3")
TWIN = Station(255, 190, "gcs", "10.0.0.3")
SDK = Station(245, 190, "sdk", "10.0.0.2")
GATEWAY = Station(*ONE_VOICE, "radio", "", radio=True)
GO, HOLD, ARM = ask.SetMode(Mode.AUTO), ask.SetMode(Mode.HOLD), ask.Arm(True)
S = 1_000_000


def heard(**stamps_s: float) -> list[Heard]:
    stations = {"qgc": QGC, "proxy": PROXY, "viewer": VIEWER, "twin": TWIN, "sdk": SDK, "gateway": GATEWAY}
    return [Heard(stations[name], round(stamp_s * S)) for name, stamp_s in stamps_s.items()]


def gcs_s(operators: Operators, now_s: float, **stamps_s: float) -> float | None:
    return operators.ages(heard(**stamps_s), round(now_s * S)).gcs_s


def texts(operators: Operators) -> list[str]:
    return [text for _, text in operators.drain_texts()]


def test_before_anybody_commands_anybody_counts():
    operators = Operators()
    assert gcs_s(operators, 1.0) is None
    assert not operators.hears([])
    assert operators.hears(heard(viewer=9.0))
    assert gcs_s(operators, 10.0, viewer=9.0) == pytest.approx(1.0)
    assert operators.hears([])


@pytest.mark.parametrize("other", ["proxy", "viewer", "twin", "sdk", "gateway"])
def test_who_armed_commands_and_nobody_else_keeps_the_failsafe_asleep(other):
    operators = Operators()
    operators.obeyed(ARM, QGC, 5 * S, manual=False)
    gcs_s(operators, 10.0, qgc=10.0)
    ages = operators.ages(heard(qgc=10.0, **{other: 59.0}), 60 * S)
    assert ages.gcs_s == pytest.approx(50.0)
    assert ages.radio_s is None
    assert texts(operators) == []


def test_an_observer_that_orders_commands_and_both_are_told():
    operators = Operators()
    operators.obeyed(ARM, QGC, 0, manual=False)
    assert operators.refusal(VIEWER, 1 * S) == ""
    operators.obeyed(GO, VIEWER, 1 * S, manual=False)
    assert texts(operators) == ["Station 77 over gcs commands now, not station 255 over gcs"]
    assert gcs_s(operators, 9.0, qgc=9.0, viewer=2.0) == pytest.approx(7.0)


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (PROXY, "Station 255/230 over gcs commands now, not station 255/190 over gcs"),
        (TWIN, "Station 255 over gcs at 10.0.0.3 commands now, not station 255 over gcs at 10.0.0.2"),
        (SDK, "Station 245 over sdk commands now, not station 255 over gcs"),
    ],
)
def test_two_stations_of_one_number_are_told_apart(other, told):
    operators = Operators()
    operators.obeyed(ARM, QGC, 0, manual=False)
    operators.obeyed(GO, other, 1 * S, manual=False)
    assert texts(operators) == [told]


@pytest.mark.parametrize("body", [HOLD, ask.SetMode(Mode.RTL), ask.Arm(False), ask.PausePlan(True), ask.Terminate()])
def test_what_stops_or_leads_home_passes_no_command_while_the_commander_is_there(body):
    operators = Operators()
    operators.obeyed(ARM, QGC, 0, manual=False)
    gcs_s(operators, 4.0, qgc=4.0)
    operators.obeyed(body, VIEWER, 5 * S, manual=False)
    assert operators.commander == QGC
    operators.obeyed(body, VIEWER, 10 * S, manual=False)
    assert operators.commander == VIEWER, "at once when he is silent"


def test_an_order_restarts_the_timer_by_the_link_it_came_over():
    operators = Operators()
    operators.obeyed(GO, GATEWAY, 10 * S, manual=False)
    ages = operators.ages([], 14 * S)
    assert (ages.gcs_s, ages.radio_s) == (None, pytest.approx(4.0))
    assert not operators.silent(70 * S)
    assert operators.silent(75 * S)
    operators.obeyed(GO, QGC, 100 * S, manual=False)
    assert operators.ages(heard(gateway=101.0), 103 * S).gcs_s == pytest.approx(3.0)
    assert operators.silent(105 * S)


def test_a_commander_whose_link_was_closed_has_been_heard_all_the_same():
    operators = Operators()
    operators.obeyed(ARM, QGC, 0, manual=False)
    gcs_s(operators, 50.0, qgc=50.0)
    assert gcs_s(operators, 52.0) == pytest.approx(2.0)


def test_the_vessels_own_people_restart_the_timer_and_do_not_end_it():
    operators = Operators()
    operators.obeyed(GO, None, 10 * S, manual=False)
    assert operators.commander is None
    assert gcs_s(operators, 12.0) == pytest.approx(2.0)
    assert gcs_s(operators, 30.0) == pytest.approx(20.0)
    assert operators.refusal(None, 0) == ""


def test_sticks_command_while_they_steer():
    sticks = ask.ManualInput(0.0, 0.0, 77)
    assert leads(sticks, manual=True)
    assert not leads(sticks, manual=False), "a viewer's joystick in another mode is nothing"
    operators = Operators()
    operators.obeyed(ARM, QGC, 0, manual=False)
    operators.obeyed(sticks, VIEWER, 1 * S, manual=False)
    assert operators.commander == QGC


@pytest.mark.parametrize(
    "body",
    [
        GO,
        ARM,
        ask.SetMode(Mode.MANUAL),
        ask.StartPlan(),
        ask.Reposition(0.7, 0.1),
        ask.SetSpeed(1.0),
        ask.UnlockGuard(),
    ],
)
def test_only_operators_set_the_boat_going(body):
    assert leads(body, manual=False)


@pytest.mark.parametrize(
    "body", [HOLD, ask.SetMode(Mode.LOITER), ask.SetMode(Mode.RTL), ask.Arm(False), ask.Reposition(None, None)]
)
def test_anybody_stops_it_and_sends_it_home(body):
    assert not leads(body, manual=False)


def test_with_ids_others_are_refused_by_name_and_their_silence_does_not_matter():
    operators = Operators(["255/190", "245"])
    assert (
        operators.refusal(VIEWER, 0)
        == "station 77 over gcs is no operator here (operator.ids): it may hold, return, disarm"
    )
    assert operators.refusal(PROXY, 0) != "", "the forwarder shares the system, not the component"
    assert gcs_s(operators, 10.0, viewer=9.0, proxy=9.0) is None
    assert not operators.hears(heard(viewer=9.0))
    assert gcs_s(operators, 10.0, qgc=9.0) == pytest.approx(1.0)
    assert operators.refusal(GATEWAY, 0) == "", "the gateway has ids of its own"


def test_nobody_is_the_gateway_by_the_number_that_its_frames_carry():
    operators = Operators(["255/190"])
    assert "station 0 over gcs is no operator here" in operators.refusal(Station(0, 0, "gcs"), 0)
    assert gcs_s(operators, 10.0) is None
    assert operators.ages([Heard(Station(0, 0, "gcs"), 9 * S)], 10 * S).gcs_s is None


SETS = [
    ask.LoadPlan(ask.PlanKind.MISSION, ()),
    ask.LoadPlan(ask.PlanKind.FENCE, ()),
    ask.LoadPlan(ask.PlanKind.RALLY, ()),
    ask.SetHomePosition(0.7, 0.1),
    ask.EnableFence(False),
    ask.SetParameter("FENCE_ENABLE", 0.0),
]
GOES_DARK = [ask.Reboot(), ask.Reboot(shutdown=True), ask.EraseLogs()]


@pytest.mark.parametrize("body", SETS + GOES_DARK, ids=repr)
def test_only_operators_set_where_the_boat_may_go(body):
    operators = Operators(["255/190", "245"])
    why = "station 77 over gcs is no operator here (operator.ids): it may hold, return, disarm"
    assert operators.objection(body, VIEWER, 0, manual=False) == why
    operators.obeyed(ARM, QGC, 0, manual=False)
    for allowed in (QGC, SDK, GATEWAY, None):
        assert operators.objection(body, allowed, 0, manual=False) == "", (
            "a setting needs no command, only the right to it"
        )
    assert Operators().objection(body, VIEWER, 0, manual=False) == ""


def test_what_another_sets_under_way_passes_no_command_and_is_told():
    operators = Operators()
    for body in SETS:
        operators.has_set(body, VIEWER, armed=True)
    assert texts(operators) == [], "nobody commands who should know"
    operators.obeyed(ARM, QGC, 0, manual=False)
    for body in SETS:
        operators.obeyed(body, VIEWER, 1 * S, manual=False)
        for station, armed in ((VIEWER, True), (VIEWER, False), (QGC, True), (None, True)):
            operators.has_set(body, station, armed=armed)
    assert operators.commander == QGC
    assert texts(operators) == [
        "Station 77 over gcs cleared the plan",
        "Station 77 over gcs cleared the fence",
        "Station 77 over gcs cleared the rally points",
        "Station 77 over gcs set home",
        "Station 77 over gcs switched the fence off",
        "Station 77 over gcs set FENCE_ENABLE to 0",
    ]


@pytest.mark.parametrize("body", [HOLD, ask.SetMode(Mode.RTL), ask.Arm(False), ask.Terminate()], ids=repr)
def test_nothing_that_stops_or_leads_home_meets_an_objection(body):
    assert Operators(["255/190"]).objection(body, VIEWER, 0, manual=False) == ""


def test_with_ids_command_passes_by_one_request_told_to_both():
    operators = Operators(["255/190", "245"])
    operators.obeyed(ARM, QGC, 0, manual=False)
    gcs_s(operators, 10.0, qgc=10.0)
    refusal = "station 255 over gcs commands: order again in 4 s to take command"
    assert operators.refusal(SDK, 11 * S) == refusal
    assert operators.refusal(SDK, 13 * S) == refusal, "a program's own repeat"
    assert texts(operators) == ["Station 245 over sdk asks for command, station 255 over gcs has it"]
    assert operators.refusal(SDK, 14 * S) == refusal
    gcs_s(operators, 15.0, qgc=15.0)
    assert operators.refusal(SDK, 15 * S) == ""
    operators.obeyed(GO, SDK, 15 * S, manual=False)
    assert texts(operators) == ["Station 245 over sdk commands now, not station 255 over gcs"]


def test_with_ids_a_wish_is_forgotten_and_a_silent_commander_is_no_hindrance():
    operators = Operators(["255", "245"])
    operators.obeyed(ARM, QGC, 0, manual=False)
    for now_s in range(0, 120, 40):
        gcs_s(operators, now_s, qgc=now_s)
        assert operators.refusal(SDK, now_s * S) != ""
    assert operators.refusal(SDK, 86 * S) == ""


def test_with_ids_the_same_operator_counts_on_whatever_link():
    operators = Operators(["255/190"])
    operators.obeyed(ARM, QGC, 0, manual=False)
    assert gcs_s(operators, 10.0, twin=9.0) == pytest.approx(1.0)


def test_the_explicit_request_moves_nothing_and_can_be_given_back():
    operators = Operators()
    operators.obeyed(ARM, QGC, 0, manual=False)
    assert operators.asked(ask.TakeCommand(), VIEWER, 1 * S) == ask.ACCEPTED
    assert operators.commander == VIEWER
    assert operators.asked(ask.TakeCommand(), VIEWER, 2 * S) == ask.ACCEPTED
    assert operators.asked(ask.TakeCommand(take=False), QGC, 3 * S) == ask.ACCEPTED
    assert operators.commander == VIEWER, "only who has it gives it up"
    assert operators.asked(ask.TakeCommand(take=False), VIEWER, 3 * S) == ask.ACCEPTED
    assert operators.commander is None
    assert gcs_s(operators, 10.0, qgc=9.0) == pytest.approx(1.0), "whoever is there counts"
    assert texts(operators) == [
        "Station 77 over gcs commands now, not station 255 over gcs",
        "Station 77 over gcs has given up command",
    ]
    assert operators.asked(ask.TakeCommand(), None, 0).result is ask.Result.DENIED
    assert (
        Operators(["255"]).asked(ask.TakeCommand(), VIEWER, 0).reason
        == "station 77 over gcs is no operator here (operator.ids)"
    )


def test_who_gives_up_command_and_closes_the_link_is_missed_after_the_time_out_and_not_at_once():
    operators = Operators()
    operators.obeyed(ARM, SDK, 0, manual=False)
    assert gcs_s(operators, 10.0, sdk=9.9) == pytest.approx(0.1)
    assert operators.asked(ask.TakeCommand(take=False), SDK, 10 * S) == ask.ACCEPTED
    assert gcs_s(operators, 10.1) == pytest.approx(0.1), "its link is closed, and no longer in any table"
    assert gcs_s(operators, 12.0, qgc=11.5) == pytest.approx(0.5)
    assert gcs_s(operators, 16.0) == pytest.approx(4.5)


def test_the_ids_of_the_settings():
    assert OperatorConfig(ids=[255, "254/190"]).ids == ("255", "254/190")
    for wrong in ("qgc", "0", "256", "255/190/1", "255/"):
        with pytest.raises(ValueError, match="is no station"):
            OperatorConfig(ids=[wrong])
