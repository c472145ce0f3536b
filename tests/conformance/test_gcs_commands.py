"""Commands and modes as ground stations send them (checks 40 to 53)."""

import math

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.figures import Circle, FigureEight
from mavlink_bridge.language.messages import LoiterDirection, Mode
from mavlink_bridge.language.requests import Reply, Result
from mavlink_bridge.mavlink.commands.local import LOCAL
from mavlink_bridge.mavlink.commands.table import MEANINGS
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import LAT_RAD, Bench

NAN = math.nan
LAT_E7, LON_E7 = 411_840_000, -87_050_000
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = range(6)


def bodies(bench, kind):
    return [request.body for request in bench.vessel.handled if isinstance(request.body, kind)]


@pytest.mark.parametrize("command", sorted({*MEANINGS, *LOCAL, 16, 21, 22, 183, 187, 30, 31999, 65535}))
@pytest.mark.parametrize("as_int", [False, True])
def test_check_40_every_command_gets_one_final_answer(bench, command, as_int):
    bench.gcs.clear()
    (bench.int if as_int else bench.long)(command)
    bench.run(1.0)
    finals = [result for result in bench.acked(command) if result != IN_PROGRESS]
    assert len(finals) == 1
    ack = bench.gcs.all("COMMAND_ACK")[-1]
    assert (ack.target_system, ack.target_component) == (255, 190)


def test_check_40_a_late_answer_is_announced(bench):
    bench.vessel.answers = False
    bench.long(400, 1)
    bench.run(0.5)
    assert bench.acked(400) == [IN_PROGRESS]
    bench.run(1.6)
    assert bench.acked(400) == [IN_PROGRESS] * 3
    assert len(bench.vessel.handled) == 0


def test_check_40_an_answer_that_never_comes_is_a_failure(bench):
    bench.vessel.answers = False
    bench.long(400, 1)
    bench.run(40)
    assert bench.acked(400)[-1] == FAILED
    assert bench.acked(400).count(FAILED) == 1


@pytest.mark.parametrize("asked", [30, 0, 60000])
def test_check_47_message_interval_can_be_asked_for_as_a_message(bench, asked):
    """REQUEST_MESSAGE(MESSAGE_INTERVAL, id): the same as GET_MESSAGE_INTERVAL, which is on its way out."""
    bench.long(510, asked)
    (wanted,) = bench.gcs.all("MESSAGE_INTERVAL")
    bench.gcs.clear()
    bench.long(512, 244, asked)
    assert bench.acked(512) == [ACCEPTED]
    (told,) = bench.gcs.all("MESSAGE_INTERVAL")
    assert (told.message_id, told.interval_us) == (wanted.message_id, wanted.interval_us)


def test_a_mode_without_its_flag_is_refused_by_the_flags_name(bench):
    bench.long(176, 0, 10)
    bench.run(1.1)
    assert bench.acked(176) == [DENIED]
    bench.send(dialect.MAVLink_set_mode_message(1, 0, 10))
    bench.tick()
    assert not bench.vessel.handled
    text = "No mode set: flag 1 (MAV_MODE_FLAG_CUSTOM_MODE_ENABLED) is missing"
    assert bench.texts().replace("\n", "").count(text) == 2


@pytest.mark.parametrize("confirmations", [(0, 0, 0, 0), (0, 1, 2, 3)])
def test_check_41_resends_execute_once_and_are_each_answered(bench, confirmations):
    for confirmation in confirmations:
        bench.long(400, 1, confirmation=confirmation)
        bench.run(0.5)
    assert len(bodies(bench, ask.Arm)) == 1
    assert bench.acked(400) == [ACCEPTED] * 4


def test_check_41_copies_of_a_pending_command_are_not_asked_twice(bench):
    bench.vessel.answers = False
    requests = []
    for _ in range(4):
        bench.long(300)
        requests += bench.endpoint.requests()
        bench.vessel.now_us += 500_000
    bench.vessel.plans.stored[ask.PlanKind.MISSION] = ()
    assert len([request for request in requests if isinstance(request.body, ask.StartPlan)]) <= 1


def test_check_41_the_same_after_three_seconds_is_a_new_command(bench):
    bench.long(400, 1)
    bench.run(3.2)
    bench.long(400, 1)
    bench.tick()
    assert len(bodies(bench, ask.Arm)) == 2


def test_check_41_an_operator_who_changes_his_mind_is_obeyed(bench):
    """Pause, start, pause within three seconds: the second pause counts, and so does arm, disarm, arm."""
    for _ in range(2):
        bench.long(193, 0)
        bench.tick(2)
        bench.long(193, 1)
        bench.tick(2)
    bench.long(193, 0)
    bench.tick()
    assert [body.pause for body in bodies(bench, ask.PausePlan)] == [True, False, True, False, True]
    for arm in (1, 0, 1):
        bench.long(400, arm)
        bench.tick()
    assert [body.arm for body in bodies(bench, ask.Arm)] == [True, False, True]


def test_check_41_a_late_copy_does_not_undo_a_stop(bench):
    """Arm, then disarm; a copy of arm with an older sequence number comes last, by another way."""
    frame = bench.gcs.codec.encode(dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    copy = bench.gcs.codec.encode(dialect.MAVLink_command_long_message(1, 1, 400, 1, 1, 0, 0, 0, 0, 0, 0))
    bench.endpoint.receive(frame, bench.vessel.now_us)
    bench.tick()
    bench.long(400, 0)
    bench.tick()
    bench.endpoint.receive(copy, bench.vessel.now_us)
    bench.tick()
    assert not bench.vessel.armed


@pytest.mark.parametrize(
    ("command", "params"),
    [
        (400, (7,)),
        (176, (1, 77)),
        (193, (5,)),
        (224, (9999,)),
        (178, (1, -7)),
        (115, (999,)),
        (43002, (1, -5)),
        (207, (3,)),
        (185, (0,)),
        (262, (NAN, 3)),
    ],
)
def test_check_42_bad_parameters_are_denied_with_a_reason(bench, command, params):
    bench.gcs.clear()
    bench.long(command, *params)
    bench.run(0.2)
    expected = FAILED if command == 262 else DENIED
    assert bench.acked(command) == [expected]
    assert bench.texts()
    assert not bench.vessel.handled


def test_check_42_not_now_is_a_temporary_refusal(bench):
    bench.vessel.refuse[ask.Arm] = Reply(Result.REJECTED_NOW, "no position yet")
    bench.long(400, 1)
    bench.tick()
    assert bench.acked(400) == [REJECTED]
    assert "No position yet" in bench.texts()


@pytest.mark.parametrize("bad", [math.inf, -math.inf, 1e38, 1e-40])
@pytest.mark.parametrize("command", sorted(MEANINGS))
def test_check_42_absurd_numbers_never_pass(bench, command, bad):
    bench.long(command, bad, bad, bad, bad, bad, bad, bad)
    bench.run(0.3)
    assert len(bench.acked(command)) == 1
    for request in bench.vessel.handled:
        for name in request.body.__dataclass_fields__:
            value = getattr(request.body, name)
            assert not isinstance(value, float) or abs(value) < 2e4


@pytest.mark.parametrize("unset", [0.0, NAN])
def test_check_43_unset_is_nan_or_zero(bench, unset):
    bench.long(34, unset, unset, unset, unset, unset, unset, unset)
    bench.tick()
    (orbit,) = bodies(bench, ask.Orbit)
    assert (orbit.lat_rad, orbit.figure.radius_m, orbit.speed_mps, orbit.turns) == (None, None, None, None)
    bench.int(192, unset, 1, unset, unset, frame=6, x=LAT_E7, y=LON_E7)
    bench.tick()
    (target,) = bodies(bench, ask.Reposition)
    assert (target.speed_mps, target.radius_m) == (None, None)


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_check_44_go_to_in_every_frame(bench, frame):
    bench.int(192, -1, 1, 0, NAN, frame=frame, x=LAT_E7, y=LON_E7, z=50.0)
    bench.tick()
    assert bench.acked(192) == [ACCEPTED]
    (body,) = bodies(bench, ask.Reposition)
    assert math.degrees(body.lat_rad) == pytest.approx(41.184, abs=1e-7)
    assert math.degrees(body.lon_rad) == pytest.approx(-8.705, abs=1e-7)
    assert bench.gcs.last("HEARTBEAT").custom_mode == (15 if bench.config.persona == "ardurover" else 0x00060000)


def test_check_44_go_to_as_command_long_and_hold_here(bench):
    bench.long(192, -1, 1, 12.5, NAN, 41.184, -8.705, 0)
    bench.tick()
    bench.long(192, -1, 1, 0, NAN, NAN, NAN, NAN)
    bench.tick()
    there, here = bodies(bench, ask.Reposition)
    assert there.radius_m == 12.5
    assert there.lat_rad == pytest.approx(math.radians(41.184), abs=1e-7)
    assert here.lat_rad is None
    assert here.lon_rad is None


def test_check_44_without_the_mode_flag_only_in_guided(bench):
    bench.int(192, -1, 0, 0, NAN, frame=3, x=LAT_E7, y=LON_E7)
    bench.tick()
    assert bench.acked(192) == [REJECTED]


@pytest.mark.parametrize(("x", "y"), [(0, 0), (910_000_000, 0), (0, 1_810_000_000)])
def test_check_44_no_go_to_off_the_globe(bench, x, y):
    bench.int(192, -1, 1, 0, NAN, frame=3, x=x, y=y)
    bench.int(192, -1, 1, 0, NAN, frame=1, x=LAT_E7, y=LON_E7)
    bench.tick()
    assert bench.acked(192) == [DENIED, DENIED]


@pytest.mark.parametrize("frame", [0, 3])
@pytest.mark.parametrize("radius", [25.0, -25.0])
def test_check_45_orbit_with_signed_radius(bench, frame, radius):
    bench.int(34, radius, 1.5, 0, NAN, frame=frame, x=LAT_E7, y=LON_E7)
    bench.tick()
    (body,) = bodies(bench, ask.Orbit)
    way = LoiterDirection.CW if radius > 0 else LoiterDirection.CCW
    assert (body.figure, body.speed_mps) == (Circle(25.0, way), 1.5)


def test_check_45_orbit_here_and_its_turns(bench):
    unset = -(2**31)
    bench.int(34, NAN, NAN, NAN, 4 * math.pi, frame=3, x=unset, y=unset)
    bench.tick()
    (body,) = bodies(bench, ask.Orbit)
    assert body.lat_rad is None
    assert body.turns == pytest.approx(2.0, abs=1e-6)


def test_check_45_orbit_status_while_circling_only(bench):
    from mavlink_bridge.language.messages import PathControlState

    bench.run(3)
    assert not bench.gcs.all("ORBIT_EXECUTION_STATUS")
    bench.vessel.changes["path"] = PathControlState(orbit_radius_m=-20.0, orbit_lat_rad=LAT_RAD, orbit_lon_rad=-0.15)
    bench.run(2)
    assert bench.gcs.last("ORBIT_EXECUTION_STATUS").radius == -20.0


def test_check_45_figure_eight(bench):
    bench.int(35, 60, 20, 1.0, 0.5, frame=6, x=LAT_E7, y=LON_E7)
    bench.tick()
    (body,) = bodies(bench, ask.Orbit)
    figure = body.figure
    assert isinstance(figure, FigureEight)
    assert (figure.radius_m, figure.length_m, figure.bearing_rad) == (20.0, 80.0, 0.5)
    assert body.speed_mps is None, "parameter 3 is reserved, and in a plan it is no speed either"


@pytest.mark.parametrize("component", [1, 0])
def test_check_46_arming_shows_and_force_disarm_works(bench, component):
    bench.long(400, 1, component=component)
    bench.tick()
    assert bench.gcs.last("HEARTBEAT").base_mode & 128
    bench.long(400, 0, 21196, component=component)
    bench.tick()
    assert not bench.gcs.last("HEARTBEAT").base_mode & 128
    assert bodies(bench, ask.Arm)[-1].force


def test_check_46_a_refusal_says_why(bench):
    bench.vessel.refuse[ask.Arm] = Reply(Result.REJECTED_NOW, "no heading from the compass")
    bench.long(400, 1)
    bench.tick()
    assert bench.acked(400) == [REJECTED]
    assert "No heading from the compass" in bench.texts()


def test_check_47_message_rates(bench):
    bench.long(511, 30, 100_000)
    bench.gcs.clear()
    bench.run(10)
    assert 95 <= len(bench.gcs.all("ATTITUDE")) <= 105
    bench.long(510, 30)
    assert bench.gcs.last("MESSAGE_INTERVAL").interval_us == 100_000
    bench.long(511, 30, -1)
    bench.gcs.clear()
    bench.run(2)
    assert not bench.gcs.all("ATTITUDE")
    bench.long(511, 30, 0)
    bench.gcs.clear()
    bench.run(2)
    assert len(bench.gcs.all("ATTITUDE")) == 8


@pytest.mark.parametrize(("profile", "period_us"), [("lan", 1_000_000), ("lora", 2_500_000)])
def test_check_47_the_heartbeats_period_is_told_as_it_is(profile, period_us):
    bench = Bench(config=EndpointConfig(profile=profile))
    bench.long(510, 0)
    bench.run(30)
    assert bench.gcs.last("MESSAGE_INTERVAL").interval_us == period_us
    times_us = [
        t for t, message in zip(bench.gcs.times_us, bench.gcs.inbox, strict=True) if message.get_type() == "HEARTBEAT"
    ]
    assert times_us[-1] - times_us[-3] == pytest.approx(2 * period_us, abs=100_000)


@pytest.mark.parametrize("interval", [1.0, -5.0, 1e30, NAN, 2.0**31])
def test_check_47_a_rate_out_of_reach_is_denied(bench, interval):
    bench.long(511, 30, interval)
    assert bench.acked(511) == [DENIED]
    bench.long(511, 60000, 100_000)
    assert bench.acked(511) == [DENIED, UNSUPPORTED]


def test_check_47_data_streams_are_tolerated(bench):
    for stream in (0, 1, 2, 3, 6, 10, 11, 12, 99):
        bench.send(dialect.MAVLink_request_data_stream_message(1, 1, stream, 5, 1))
    bench.gcs.clear()
    bench.run(4)
    assert len(bench.gcs.all("ATTITUDE")) == 20
    bench.send(dialect.MAVLink_request_data_stream_message(1, 1, 10, 5, 0))
    bench.gcs.clear()
    bench.run(2)
    assert not bench.gcs.all("ATTITUDE")


def test_check_48_reboot_and_old_requests(bench):
    bench.long(400, 1)
    bench.tick()
    bench.long(246, 1)
    bench.tick()
    assert bench.acked(246) == [REJECTED]
    bench.gcs.clear()
    bench.long(520, 1)
    assert [message.get_type() for message in bench.gcs.inbox] == ["COMMAND_ACK", "AUTOPILOT_VERSION"]
    bench.gcs.clear()
    bench.long(410, component=0)
    assert [message.get_type() for message in bench.gcs.inbox] == ["COMMAND_ACK", "HOME_POSITION"]


def test_check_49_available_modes(bench):
    bench.gcs.clear()
    bench.long(512, 435, 0)
    modes = bench.gcs.all("AVAILABLE_MODES")
    count = modes[0].number_modes
    assert [mode.mode_index for mode in modes] == list(range(1, count + 1))
    names = [mode.mode_name for mode in modes]
    assert len(set(names)) == count
    assert all(0 < len(name) <= 34 for name in names)
    assert len({mode.custom_mode for mode in modes}) == count
    bench.gcs.clear()
    bench.long(512, 435, 2)
    assert bench.gcs.last("AVAILABLE_MODES").mode_index == 2
    bench.long(512, 435, count + 1)
    assert bench.acked(512)[-1] == DENIED


def test_check_50_current_mode(bench):
    bench.gcs.clear()
    bench.run(10)
    assert len(bench.gcs.all("CURRENT_MODE")) >= 5
    bench.gcs.clear()
    bench.long(176, 1, 10, 0)
    bench.tick()
    shown = bench.gcs.last("CURRENT_MODE")
    assert shown.custom_mode == bench.gcs.last("HEARTBEAT").custom_mode
    assert shown.intended_custom_mode


ROVER = {Mode.MANUAL: 0, Mode.HOLD: 4, Mode.AUTO: 10, Mode.RTL: 11, Mode.GUIDED: 15, Mode.CIRCLE: 9, Mode.LOITER: 5}
PX4 = {Mode.MANUAL: (1, 0), Mode.HOLD: (4, 3), Mode.AUTO: (4, 4), Mode.RTL: (4, 5), Mode.GUIDED: (6, 0)}


@pytest.mark.parametrize(("mode", "number"), ROVER.items())
def test_check_51_rover_numbers(bench, mode, number):
    bench.vessel.mode = Mode.MANUAL if mode is not Mode.MANUAL else Mode.HOLD
    bench.long(176, 1, number, 0)
    bench.tick()
    assert bench.acked(176) == [ACCEPTED]
    assert bench.vessel.mode is mode
    bench.vessel.mode = Mode.MANUAL
    bench.run(3.1)  # before, it would be a repeat of what somebody has overruled
    bench.send(dialect.MAVLink_set_mode_message(1, 1, number))
    bench.tick()
    assert bench.vessel.mode is mode


@pytest.mark.parametrize(("mode", "numbers"), PX4.items())
def test_check_51_px4_numbers_as_mavsdk_and_qgc_send_them(bench, mode, numbers):
    main, sub = numbers
    bench.vessel.mode = Mode.CIRCLE
    bench.long(176, 209, main, sub, NAN, NAN, NAN, NAN)
    bench.tick()
    assert bench.vessel.mode is mode
    bench.vessel.mode = Mode.CIRCLE
    bench.send(dialect.MAVLink_set_mode_message(1, 209, main << 16 | sub << 24))
    bench.tick()
    assert bench.vessel.mode is mode


def test_check_51_standard_modes(bench):
    bench.long(262, 5)
    bench.tick()
    assert bench.vessel.mode is Mode.RTL
    bench.long(262, 6)
    bench.tick()
    assert bench.vessel.mode is Mode.AUTO
    bench.long(262, 7)
    bench.tick()
    assert bench.acked(262) == [ACCEPTED, ACCEPTED, FAILED]
    assert bench.vessel.mode is Mode.AUTO


def test_check_52_the_new_mode_is_shown_at_once(bench):
    bench.run(0.3)
    bench.gcs.clear()
    bench.long(176, 1, 11, 0)
    bench.tick()
    shown = [message.get_type() for message in bench.gcs.inbox]
    assert shown.index("COMMAND_ACK") < shown.index("HEARTBEAT")
    assert bench.gcs.last("HEARTBEAT").custom_mode == (11 if bench.config.persona == "ardurover" else 0x05040000)


def test_check_53_return_without_home_says_why(bench):
    bench.vessel.refuse[ask.SetMode] = Reply(Result.REJECTED_NOW, "return: no home and no rally point")
    bench.long(20)
    bench.tick()
    assert bench.acked(20) == [REJECTED]
    assert "no home" in bench.texts()


def test_check_53_the_guard_shows_as_critical(bench):
    from mavlink_bridge.language.messages import Action, Severity

    bench.long(400, 1)
    bench.tick()
    bench.vessel.changes["action"] = Action.HOLD
    bench.vessel.texts.append((Severity.CRITICAL, "Water 1.2 m, less than 2.0 m: stopped"))
    bench.tick()
    assert bench.gcs.last("HEARTBEAT").system_status == 5
    assert bench.gcs.last("STATUSTEXT").severity == 2


def test_mission_set_current_and_set_mode_refusals_are_told(bench):
    bench.send(dialect.MAVLink_set_mode_message(1, 1, 777))
    bench.tick()
    assert "777" in bench.texts()


def test_speed_and_heading_commands(bench):
    bench.long(178, 0, 2.5, 0)
    bench.long(178, 1, -2, -1)
    bench.long(178, 1, -1, 40)
    bench.long(178, 1, -1, -1)
    bench.long(43002, 1, 90)
    bench.long(43002, 0, 180)
    bench.long(115, 10, 0, 1, 1)
    bench.long(43000, 1, 3.0)
    bench.tick()
    speeds = [(body.speed_mps, body.throttle) for body in bodies(bench, ask.SetSpeed)]
    assert speeds == [(2.5, None), (None, None), (None, pytest.approx(0.4)), (3.0, None)]
    first, second, third = bodies(bench, ask.GuidedHeading)
    assert (first.psi_rad, first.course) == (pytest.approx(math.pi / 2), False)
    assert second.course
    assert third.psi_rad == pytest.approx(0.5 + math.radians(10))
    assert bench.acked(178) == [ACCEPTED] * 4


@pytest.mark.parametrize(
    ("parameters", "radius_m", "answer"),
    [({}, 20.0, ACCEPTED), ({"p1": 12.0}, 12.0, ACCEPTED), ({"p1": 21.0}, None, DENIED), ({"p1": -1.0}, None, DENIED)],
)
def test_user_2_forgets_depths_within_20_metres_at_most(bench, parameters, radius_m, answer):
    bench.long(31011, parameters.get("p1", 0.0))
    bench.run(0.5)
    assert bench.acked(31011) == [answer]
    assert bodies(bench, ask.ForgetDepth) == ([] if radius_m is None else [ask.ForgetDepth(None, None, radius_m)])
