"""The parameter protocol as ground stations use it (checks 34 to 39)."""

import math
import struct

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.requests import Reply, Result
from mavlink_bridge.mavlink.persona.config import Budget, EndpointConfig
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench
from tests.world_station import Helm


def set_param(bench, name, value, kind=9):
    bench.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
    bench.tick()


def f32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


@pytest.mark.parametrize("component", [0, 1])
def test_check_34_the_list_is_complete_once(bench, component):
    bench.gcs.clear()
    bench.send(dialect.MAVLink_param_request_list_message(1, component))
    bench.tick()
    values = bench.gcs.all("PARAM_VALUE")
    assert [value.param_index for value in values] == list(range(values[0].param_count))
    assert len(values) >= 100
    assert all(len(value.param_id.encode()) <= 16 for value in values)
    assert len({value.param_id for value in values}) == len(values)


def test_check_34_other_streams_keep_flowing(persona):
    bench = Bench(config=EndpointConfig(persona=persona, budget=Budget(2000, 400)))
    bench.run(5)
    bench.gcs.clear()
    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    bench.run(10)
    assert len(bench.gcs.all("ATTITUDE")) >= 35
    assert len(bench.gcs.all("HEARTBEAT")) >= 9
    assert (
        len({value.param_index for value in bench.gcs.all("PARAM_VALUE")}) == bench.gcs.last("PARAM_VALUE").param_count
    )


def test_check_34_a_flood_of_requests_costs_one_pass_at_a_time(persona):
    bench = Bench(config=EndpointConfig(persona=persona, budget=Budget(5000, 600)))
    bench.run(1)
    for _ in range(100):
        bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    bench.run(1)
    assert sum(len(bytes(m.get_msgbuf())) for m in bench.gcs.inbox) < 5000 * 2 + 600
    assert len(bench.gcs.all("HEARTBEAT")) >= 2


def test_check_35_every_value_is_real32_and_exact(bench):
    for value in (0.1, 1e9, -0.0, 123456.789):
        set_param(bench, "TEST_005", value)
        echoed = bench.gcs.last("PARAM_VALUE")
        assert echoed.param_type == 9
        assert struct.pack("<f", echoed.param_value) == struct.pack("<f", value)


def test_check_36_reading_by_name_and_index(bench):
    bench.send(dialect.MAVLink_param_request_read_message(1, 1, b"TEST_007", -1))
    assert (bench.gcs.last("PARAM_VALUE").param_index, bench.gcs.last("PARAM_VALUE").param_value) == (7, 7.0)
    bench.send(dialect.MAVLink_param_request_read_message(1, 1, b"", 8))
    assert bench.gcs.last("PARAM_VALUE").param_id == "TEST_008"


@pytest.mark.parametrize(
    ("name", "index"),
    [(b"NO_SUCH", -1), (b"_HASH_CHECK", -1), (b"", 32767), (b"ABCDEFGHIJKLMNOP", -1), (b"\xff\xfe", -1), (b"", -1)],
)
def test_check_36_unknown_parameters_are_refused(bench, name, index):
    bench.gcs.clear()
    bench.send(dialect.MAVLink_param_request_read_message(1, 1, name, index))
    (error,) = bench.gcs.all("PARAM_ERROR")
    assert (error.error, error.target_system) == (1, 255)


def test_check_37_a_set_is_echoed(bench):
    bench.gcs.clear()
    set_param(bench, "TEST_003", 3.25)
    (value,) = bench.gcs.all("PARAM_VALUE")
    assert (value.param_id, value.param_value, value.param_index) == ("TEST_003", 3.25, 3)
    assert not bench.gcs.all("PARAM_ERROR")


@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        ("TEST_003", 1e30, 9, 2),
        ("TEST_003", math.nan, 9, 2),
        ("TEST_003", math.inf, 9, 2),
        ("READ_ONLY", 1.0, 9, 5),
        ("TEST_003", 1.0, 6, 7),
    ],
)
def test_check_37_a_refusal_says_why_and_repeats_the_old_value(bench, name, value, kind, error):
    bench.gcs.clear()
    set_param(bench, name, value, kind)
    assert [m.error for m in bench.gcs.all("PARAM_ERROR")] == [error]
    assert bench.gcs.last("PARAM_VALUE").param_value == bench.vessel.params.get(name).value
    assert not bench.vessel.handled


def test_check_37_the_vessel_may_refuse_too(bench):
    bench.vessel.refuse[ask.SetParameter] = Reply(Result.DENIED, "DEPTH_MIN must be below DEPTH_SLOW")
    set_param(bench, "TEST_003", 9.0)
    assert bench.gcs.all("PARAM_ERROR")
    assert bench.gcs.last("PARAM_VALUE").param_value == 3.0
    assert "DEPTH_MIN" in bench.texts()


def test_check_37_retries_while_pending_are_one_request(bench):
    for _ in range(3):
        bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_003", 5.0, 9))
    bench.tick()
    assert len(bench.vessel.handled) == 1


def test_the_last_of_three_values_is_kept_though_the_first_has_no_answer_yet(bench):
    for value in (5.0, 6.0, 5.0):
        bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_003", value, 9))
    bench.tick()
    assert bench.vessel.params.get("TEST_003").value == 5.0
    assert bench.gcs.last("PARAM_VALUE").param_value == 5.0


def test_the_refusal_of_a_value_is_not_taken_for_that_of_the_newer_one(bench):
    for value in (5.0, 6.0):
        bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_003", value, 9))
    older, newer = bench.endpoint.requests()
    bench.gcs.clear()
    bench.endpoint.reply(older.id, Reply(Result.REJECTED_NOW, "overruled by a newer order"), bench.vessel.now_us)
    bench.tick()
    assert not bench.gcs.all("PARAM_ERROR")
    assert not bench.gcs.all("PARAM_VALUE")
    assert "overruled" not in bench.texts().lower()
    bench.endpoint.reply(newer.id, Reply(Result.DENIED, "too deep"), bench.vessel.now_us)
    bench.tick()
    assert bench.gcs.all("PARAM_ERROR")


def test_check_37_a_change_is_told_once():
    """On a whole vessel, which tells all links of a change: the answer to who made it is the same words."""
    helm = Helm("ardurover", "depth.enabled=false")
    for value in (9.0, 9.0, 11.0):
        helm.gcs.clear()
        assert helm.param("LOIT_RADIUS", value) == value
        helm.run(1.0)
        assert [m.param_value for m in helm.gcs.all("PARAM_VALUE")] == [value]


def test_check_38_a_change_by_somebody_else_is_told(bench):
    bench.vessel.params.set("TEST_042", 17.0)
    bench.gcs.clear()
    bench.endpoint.param_changed("TEST_042")
    bench.tick()
    (value,) = bench.gcs.all("PARAM_VALUE")
    assert (value.param_index, value.param_value) == (42, 17.0)


def test_check_39_extended_parameters_are_ignored(bench):
    bench.gcs.clear()
    bench.send(dialect.MAVLink_param_ext_request_list_message(1, 1))
    bench.send(dialect.MAVLink_param_ext_request_read_message(1, 1, b"X", -1))
    bench.run(1)
    assert not bench.gcs.all("PARAM_EXT_VALUE")
    assert bench.gcs.all("HEARTBEAT")


def test_the_rover_face_has_what_stations_look_for(bench):
    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    names = {value.param_id for value in bench.gcs.all("PARAM_VALUE")}
    wanted = {"RCMAP_ROLL", "RC1_MIN", "RC3_TRIM", "COMPASS_DEV_ID", "COMPASS_OFS_X", "INS_ACCOFFS_X"}
    assert (wanted <= names) is (bench.config.persona == "ardurover")


def test_the_packed_list_holds_the_same_values(bench):
    from pymavlink.mavftp import MAVFTP

    from tests.ftp_client import FtpClient

    bench.send(dialect.MAVLink_param_request_list_message(1, 1))
    listed = {value.param_id: value.param_value for value in bench.gcs.all("PARAM_VALUE")}
    for query in ("", "?withdefaults=1"):
        data = FtpClient(bench).download(f"@PARAM/param.pck{query}")
        decoded = MAVFTP.ftp_param_decode(data)
        assert {name.decode(): f32(value) for name, value, _ in decoded.params} == listed
