"""A stalled link hands over seconds of sticks and set-points at once: orders behind them count as ever."""

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench, Station
from tests.unit.test_rtcm import frame as rtcm_frame

ACCEPTED, REJECTED, IN_PROGRESS = 0, 1, 5


@pytest.fixture
def bench():
    made = Bench()
    made.run(1.0)
    made.vessel.handled.clear()
    return made


def stall(bench, count=300, station=None):
    codec = (station or bench.gcs).codec
    sticks = [dialect.MAVLink_manual_control_message(1, 0, number % 200, 100, 0, 0) for number in range(count)]
    points = [
        dialect.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0x1C7, 0, 0, 0, 1.0 + number / 1e3, *[0] * 7)
        for number in range(count)
    ]
    for some in (sticks, points):
        bench.endpoint.receive(b"".join(codec.encode(message) for message in some), bench.vessel.now_us)


def kinds(bench):
    return [type(request.body) for request in bench.vessel.handled]


def test_a_disarm_behind_a_stalled_stream_is_carried_out(bench):
    bench.vessel.armed = True
    stall(bench)
    bench.long(400, 0)
    bench.tick()
    assert not bench.vessel.armed
    assert bench.acked(400) == [ACCEPTED]


def test_of_a_stalled_stream_the_newest_of_each_kind_and_sender_counts(bench):
    stall(bench)
    stall(bench, 20, Station(254, 190))
    bench.tick()
    assert kinds(bench) == [ask.ManualInput, ask.GuidedHeading] * 2
    assert bench.vessel.handled[0].body.yaw == pytest.approx(0.099)
    assert bench.vessel.handled[1].body.speed_mps == pytest.approx(1.299, abs=1e-5)


def test_a_parameter_behind_a_stalled_stream_is_set(bench):
    stall(bench)
    for value in (42.0, 43.0, 42.0):
        bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_005", value, 9))
        bench.run(0.2)
        assert bench.vessel.params.get("TEST_005").value == value


def test_corrections_are_all_handed_on_in_their_order(bench):
    for number in range(10):
        frame = rtcm_frame(10, seed=number)
        bench.send(dialect.MAVLink_gps_rtcm_data_message(number << 3, len(frame), list(frame.ljust(180, b"\0"))))
    bench.tick()
    assert [request.body.data for request in bench.vessel.handled] == [rtcm_frame(10, seed=n) for n in range(10)]


def test_an_order_for_which_there_is_no_room_is_refused_at_once_and_can_be_asked_again(bench):
    for number in range(300):
        bench.send(dialect.MAVLink_set_mode_message(1, 1, (4, 10)[number % 2]))
    bench.gcs.clear()
    bench.long(400, 1)
    bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_005", 42.0, 9))
    bench.send(dialect.MAVLink_mission_clear_all_message(1, 1, 0))
    assert bench.acked(400) == [REJECTED]
    assert bench.gcs.last("PARAM_VALUE").param_value == 5.0
    assert bench.gcs.last("MISSION_ACK").type != ACCEPTED
    bench.run(0.4)
    bench.long(400, 1)
    bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_005", 42.0, 9))
    bench.tick()
    assert bench.vessel.armed
    assert bench.vessel.params.get("TEST_005").value == 42.0
