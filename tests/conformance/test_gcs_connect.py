"""What ground stations expect when they connect (checks 1 to 11)."""

import itertools
import struct

import pytest

from mavlink_bridge.mavlink.files.ftp import crc32
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import TICK_US, Bench, FakeVessel, Station
from tests.ftp_client import FtpClient

GCS_HEARTBEAT = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def test_check_01_heartbeat_within_a_second_and_then_every_second(bench):
    bench.gcs.clear()
    bench.send(GCS_HEARTBEAT)
    started_us = bench.vessel.now_us
    bench.run(20)
    beats = [(at, m) for at, m in zip(bench.gcs.times_us, bench.gcs.inbox, strict=True) if m.get_type() == "HEARTBEAT"]
    assert beats[0][0] - started_us <= 1_000_000
    gaps = [(later[0] - sooner[0]) * 1e-6 for sooner, later in itertools.pairwise(beats)]
    assert all(0.8 <= gap <= 1.2 for gap in gaps)
    for _, beat in beats:
        assert (beat.get_srcComponent(), beat.type, beat.mavlink_version) == (1, 11, 3)
        assert beat.autopilot == (3 if bench.config.persona == "ardurover" else 0)


def test_check_01_a_change_is_told_at_once_and_the_beat_goes_on(bench):
    bench.run(2.35)
    bench.long(400, 1)
    bench.tick()
    bench.run(10)
    times = [at for at, m in zip(bench.gcs.times_us, bench.gcs.inbox, strict=True) if m.get_type() == "HEARTBEAT"]
    assert max(later - sooner for sooner, later in itertools.pairwise(times)) <= 1_200_000


def test_check_02_no_tick_no_heartbeat(bench):
    """The control loop is wedged: the pump still runs, but no tick comes."""
    bench.run(3)
    bench.gcs.clear()
    for _ in range(100):
        bench.vessel.now_us += TICK_US
        bench.send(dialect.MAVLink_ping_message(1, 1, 0, 0))
    assert bench.gcs.all("PING")
    assert not bench.gcs.all("HEARTBEAT")


def test_check_03_autopilot_version_follows_its_acknowledgement(bench):
    bench.gcs.clear()
    bench.long(512, 148)
    kinds = [message.get_type() for message in bench.gcs.inbox]
    assert kinds == ["COMMAND_ACK", "AUTOPILOT_VERSION"]
    ack = bench.gcs.inbox[0]
    assert (ack.result, ack.target_system, ack.target_component) == (0, 255, 190)
    version = bench.gcs.inbox[1]
    assert version.uid == 0x1234
    assert version.vendor_id
    assert version.flight_sw_version & 0xFF == 0, "version type DEV"


def test_check_04_capability_bits_are_served(bench):
    bench.long(512, 148)
    bits = bench.gcs.last("AUTOPILOT_VERSION").capabilities
    assert bits & 8192, "MAVLink 2"
    assert bits & 4, "MISSION_INT"
    for kind, bit in ((0, 4), (1, 16384), (2, 32768)):
        assert bits & bit
        bench.send(dialect.MAVLink_mission_request_list_message(1, 1, kind))
        assert bench.gcs.last("MISSION_COUNT").mission_type == kind
    assert bits & 8, "COMMAND_INT"
    bench.int(192, -1, 1, 0, float("nan"), frame=0, x=413_000_000, y=-87_000_000)
    bench.tick()
    assert bench.acked(192) == [0]
    assert bits & 32, "FTP"
    assert FtpClient(bench).open("general.json") is not None
    assert bits & 2048, "flight termination"
    bench.long(185, 1)
    bench.tick()
    assert bench.acked(185) == [0]
    assert bits & 256, "SET_POSITION_TARGET_GLOBAL_INT"
    bench.send(
        dialect.MAVLink_set_position_target_global_int_message(
            0, 1, 1, 6, 0xDF8, 413_000_000, -87_000_000, 0, 0, 0, 0, 0, 0, 0, 0, 0
        )
    )
    bench.tick()
    assert type(bench.vessel.handled[-1].body).__name__ == "GuidedTarget"
    assert bits & 64, "SET_ATTITUDE_TARGET"
    bench.send(dialect.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0, 0, 0, 0.5))
    bench.tick()
    assert type(bench.vessel.handled[-1].body).__name__ == "GuidedHeading"


def test_check_04_clear_bits_are_refused(bench):
    bench.long(512, 148)
    bits = bench.gcs.last("AUTOPILOT_VERSION").capabilities
    for bit, command in ((4096, 42424), (512, 43001)):
        assert not bits & bit
        bench.long(command)
        assert bench.acked(command) == [3]


@pytest.mark.parametrize("number", [280, 395, 259, 299, 65535, 4_000_000])
def test_check_05_unknown_messages_are_refused_at_once(bench, number):
    bench.gcs.clear()
    bench.long(512, number)
    assert bench.acked(512) == [3]
    assert [message.get_type() for message in bench.gcs.inbox] == ["COMMAND_ACK"]


def test_check_05_a_message_with_nothing_in_it_is_never_accepted(bench):
    bench.vessel.plans.home = None
    bench.tick()
    bench.gcs.clear()
    for number in (242, 360):
        bench.long(512, number)
    assert bench.acked(512) == [1, 1]
    assert not bench.gcs.all("HOME_POSITION")


def test_check_07_two_stations_at_once_each_get_their_own(bench):
    second = Station(245, 190)
    bench.stations.append(second)
    request = dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    bench.send(request)
    bench.send(request, second)
    acks = [(ack.target_system, ack.result) for ack in second.all("COMMAND_ACK")]
    assert sorted(acks) == [(245, 0), (255, 0)]
    bench.send(dialect.MAVLink_mission_request_list_message(1, 1, 1), second)
    assert second.last("MISSION_COUNT").target_system == 245


@pytest.mark.parametrize(
    ("system", "component", "ours"),
    [(2, 1, False), (1, 50, False), (2, 0, False), (0, 0, True), (1, 0, True), (1, 1, True)],
)
def test_check_08_only_what_is_addressed_to_us_counts(bench, system, component, ours):
    bench.gcs.clear()
    bench.long(400, 1, system=system, component=component)
    bench.send(dialect.MAVLink_param_request_read_message(system, component, b"TEST_001", -1))
    bench.tick()
    assert bench.vessel.armed is ours
    assert bool(bench.gcs.all("COMMAND_ACK")) is ours
    assert bool(bench.gcs.all("PARAM_VALUE")) is ours


def test_check_09_version_1_frames_are_answered_in_version_2(bench):
    from pymavlink.dialects.v10 import common as v1

    packer = v1.MAVLink(None, srcSystem=255, srcComponent=190)
    frame = v1.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0).pack(packer)
    bench.gcs.clear()
    bench.endpoint.receive(frame, bench.vessel.now_us)
    bench.tick()
    assert bench.acked(400) == [0]
    assert all(bytes(message.get_msgbuf())[0] == 0xFD for message in bench.gcs.inbox)


def test_check_09_unknown_ids_and_bad_checksums_are_counted(bench):
    before = bench.endpoint.bad_frames
    good = bench.gcs.codec.encode(GCS_HEARTBEAT)
    bench.endpoint.receive(good[:-1] + bytes([good[-1] ^ 1]), bench.vessel.now_us)
    unknown = bytes((0xFD, 1, 0, 0, 1, 255, 190)) + struct.pack("<I", 0xABCDEF)[:3] + b"\1\0\0"
    bench.endpoint.receive(unknown, bench.vessel.now_us)
    bench.run(1)
    bench.send(GCS_HEARTBEAT)
    assert bench.endpoint.bad_frames > before
    assert max(bench.endpoint.heard.values()) == bench.vessel.now_us


def test_check_10_ping_is_answered_once(bench):
    bench.gcs.clear()
    bench.send(dialect.MAVLink_ping_message(77, 5, 0, 0))
    (answer,) = bench.gcs.all("PING")
    assert (answer.time_usec, answer.seq, answer.target_system, answer.target_component) == (77, 5, 255, 190)
    bench.send(dialect.MAVLink_ping_message(78, 6, 1, 1))
    assert len(bench.gcs.all("PING")) == 1


def test_check_11_metadata_names_the_bytes_that_ftp_delivers(bench):
    bench.long(512, 397)
    metadata = bench.gcs.last("COMPONENT_METADATA")
    assert metadata.uri.startswith("mftp:///")
    client = FtpClient(bench)
    general = client.download(metadata.uri.removeprefix("mftp://"))
    assert metadata.file_crc == crc32(general)
    import json

    entry = json.loads(general)["metadataTypes"][0]
    parameters = client.download(entry["uri"].removeprefix("mftp://"))
    assert entry["fileCrc"] == crc32(parameters)
    names = {item["name"] for item in json.loads(parameters)["parameters"]}
    assert {"TEST_000", "READ_ONLY"} <= names


@pytest.mark.parametrize("ask", [(512, 300), (519, 1)])
def test_mavlink_2_is_said_to_who_asks(bench, ask):
    bench.long(*ask)
    version = bench.gcs.last("PROTOCOL_VERSION")
    assert (version.min_version, version.max_version) == (100, 200)
    assert type(version).crc_extra == 217, "as in MAVLink's own definition"


def test_check_01_says_what_it_really_is(bench):
    bench.send(GCS_HEARTBEAT)
    bench.tick()
    bench.send(GCS_HEARTBEAT)
    bench.tick()
    assert bench.texts().count("usv-companion") == 1
    assert ("not ArduPilot" in bench.texts()) is (bench.config.persona == "ardurover")


def test_check_07_a_station_on_both_faces_is_reported():
    seen = []
    vessel = FakeVessel()
    for persona in ("ardurover", "generic"):
        bench = Bench(
            config=EndpointConfig(persona=persona),
            vessel=vessel,
            on_station=lambda system, face: seen.append((system, face)),
        )
        bench.send(GCS_HEARTBEAT)
        bench.send(GCS_HEARTBEAT)
    assert seen == [(255, "ardurover"), (255, "generic")]
