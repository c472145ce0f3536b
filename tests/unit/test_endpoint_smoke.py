"""The endpoint as a whole: it says what it is, streams by itself, and turns commands into requests."""

import pytest

from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench


@pytest.fixture(params=["ardurover", "generic"])
def bench(request):
    made = Bench(request.param)
    made.tick()
    return made


def test_heartbeats_flow_once_a_second(bench):
    bench.run(10)
    assert 10 <= len(bench.gcs.all("HEARTBEAT")) <= 11
    assert bench.gcs.last("HEARTBEAT").type == 11


def test_arming_is_acknowledged_and_shown(bench):
    bench.long(400, 1)
    bench.tick()
    assert bench.acked(400) == [0]
    assert bench.gcs.last("HEARTBEAT").base_mode & 128


def test_parameters_come_whole(bench):
    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    values = bench.gcs.all("PARAM_VALUE")
    assert [value.param_index for value in values] == list(range(values[0].param_count))


def test_empty_mission_is_said_at_once(bench):
    bench.send(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    assert bench.gcs.last("MISSION_COUNT").count in (0, 1)


def test_unknown_command_is_unsupported(bench):
    bench.long(31999)
    assert bench.acked(31999) == [3]
