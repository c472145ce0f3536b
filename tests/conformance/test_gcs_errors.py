"""Hostile and broken input (checks 63 to 67); check 68, the LoRa gateway's, is in tests/scenario/test_radio_protocols.py."""

import random

import pytest

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState
from tests.fake_vessel import Bench, Station

GCS_HEARTBEAT = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
KEY = bytes(range(32))
UTC_US = 1_750_000_000_000_000


def random_frame(dice, station):
    """A frame with a right checksum and random content, of any kind that the vessel knows or does not."""
    number = dice.choice(sorted(dialect.mavlink_map))
    body = dice.randbytes(dice.randint(1, 255))
    if dice.random() < 0.7:
        targets = {"target_system", "target_component"} & set(dialect.mavlink_map[number].fieldnames)
        if targets:
            body = body.replace(bytes([body[0]]), b"\1")
    return station.codec.seal(number, body)


@pytest.mark.parametrize("seed", range(4))
def test_check_63_random_frames_do_no_harm(bench, seed):
    dice = random.Random(seed)
    station = Station()
    for _ in range(100):
        for _ in range(20):
            frame = random_frame(dice, station)
            kind = dice.random()
            if kind < 0.2:
                frame = frame[: dice.randint(0, len(frame))]
            elif kind < 0.4:
                at = dice.randrange(len(frame))
                frame = frame[:at] + bytes([dice.randrange(256)]) + frame[at + 1 :]
            bench.endpoint.receive(frame, bench.vessel.now_us)
        bench.endpoint.receive(dice.randbytes(dice.randint(0, 300)), bench.vessel.now_us)
        bench.tick()
    bench.gcs.clear()
    bench.run(5)
    assert len(bench.gcs.all("HEARTBEAT")) >= 4


def test_check_63_every_truncation_of_every_message(bench):
    station = Station()
    for number in dialect.mavlink_map:
        bench.endpoint.receive(station.codec.seal(number, b"\xff"), bench.vessel.now_us)
        bench.endpoint.receive(station.codec.seal(number, b"\xff" * 255), bench.vessel.now_us)
        bench.endpoint.receive(station.codec.seal(number, b"\1" * 40), bench.vessel.now_us)
        bench.vessel.now_us += 10_000
    bench.run(2)
    bench.gcs.clear()
    bench.run(2)
    assert bench.gcs.all("HEARTBEAT")


def test_check_63_a_flood_does_not_silence_us(persona):
    bench = Bench(config=EndpointConfig(persona=persona))
    bench.run(1)
    noise = Station(99).codec
    bench.gcs.clear()
    for _ in range(40):
        for _ in range(500):
            bench.endpoint.receive(noise.encode(dialect.MAVLink_param_request_list_message(1, 1)), bench.vessel.now_us)
        bench.tick()
    assert bench.endpoint.counters.flood_bytes > 0
    assert len(bench.gcs.all("HEARTBEAT")) >= 2


@pytest.mark.parametrize("noise", [b"\xfe" * 20, b"\xfd\xff\x00", bytes(range(0xF0, 0x100)) * 4])
def test_check_63_a_disarm_behind_line_noise_is_obeyed_though_nothing_follows(bench, noise):
    bench.vessel.armed = True
    disarm = bench.gcs.codec.encode(dialect.MAVLink_command_long_message(1, 1, 400, 0, *[0.0] * 7))
    bench.endpoint.receive(noise + disarm, bench.vessel.now_us)
    bench.run(0.65)
    assert not bench.vessel.armed
    assert bench.acked(400) == [0]


def test_check_64_silence_of_all_stations_can_be_seen(bench):
    assert not bench.endpoint.heard
    bench.send(GCS_HEARTBEAT)
    heard_us = bench.vessel.now_us
    bench.run(10)
    assert max(bench.endpoint.heard.values()) == heard_us
    bench.send(dialect.MAVLink_heartbeat_message(1, 3, 0, 0, 4, 3))
    assert max(bench.endpoint.heard.values()) == heard_us, "another vehicle is no ground station"


def test_check_65_a_station_with_our_system_id_is_reported(bench):
    twin = Station(1, 190)
    bench.send(GCS_HEARTBEAT, twin)
    bench.tick()
    assert "system id 1" in bench.texts()
    before = bench.texts().count("system id 1")
    bench.send(GCS_HEARTBEAT, twin)
    bench.tick()
    assert bench.texts().count("system id 1") == before


def test_check_65_our_own_frames_coming_back_are_dropped(bench):
    echo = Station(1, 1)
    bench.send(dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), echo)
    bench.tick()
    assert not bench.vessel.handled
    assert bench.endpoint.counters.own == 1


@pytest.mark.parametrize("component", [0, 190])
def test_system_0_is_no_station(bench, component):
    """It addresses everybody: a sender with it would be one with whom no configuration can deal."""
    nobody = Station(0, component)
    bench.send(GCS_HEARTBEAT, nobody)
    bench.send(dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), nobody)
    bench.send(dialect.MAVLink_param_set_message(1, 1, b"TEST_001", 5.0, 9), nobody)
    bench.tick()
    assert not bench.endpoint.heard
    assert not bench.vessel.handled
    assert bench.endpoint.counters.nobody == 3
    assert bench.endpoint.bad_frames == 3


@pytest.mark.parametrize("length", [0, 1, 49, 50, 51, 99, 100, 101, 230])
def test_check_66_long_texts_are_chunked(bench, length):
    text = ("The depth guard stopped the boat: " * 9)[:length]
    bench.gcs.clear()
    bench.vessel.texts.append((Severity.CRITICAL, text))
    bench.tick()
    chunks = bench.gcs.all("STATUSTEXT")
    if length <= 50:
        assert [(chunk.text, chunk.id) for chunk in chunks] == [(text, 0)]
    else:
        assert len({chunk.id for chunk in chunks}) == 1
        assert chunks[0].id
        assert [chunk.chunk_seq for chunk in chunks] == list(range(len(chunks)))
        assert "".join(chunk.text for chunk in chunks) == text
        assert len(chunks[-1].text) < 50, "the last chunk ends with a zero"


def test_check_66_texts_do_not_mix(bench):
    bench.gcs.clear()
    for letter in "ab":
        bench.vessel.texts.append((Severity.INFO, letter * 120))
    bench.tick()
    joined = {}
    for chunk in bench.gcs.all("STATUSTEXT"):
        joined[chunk.id] = joined.get(chunk.id, "") + chunk.text
    assert sorted(joined.values()) == ["a" * 120, "b" * 120]


def signed_bench(persona, **options):
    state = SigningState(key=KEY)
    state.advance(UTC_US)
    bench = Bench(config=EndpointConfig(persona=persona, link_class="signed"), signing=state, link_id=2, **options)
    bench.tick()
    theirs = SigningState(key=KEY)
    theirs.advance(UTC_US + 1_000_000)
    bench.gcs.codec.signer = Signer(theirs, 5)
    return bench


def arm():
    return dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)


def test_check_67_a_signed_link_takes_signed_frames_only(persona):
    bench = signed_bench(persona)
    stranger = Station(255, 190)
    bench.send(arm(), stranger)
    wrong = SigningState(key=bytes(32))
    wrong.advance(UTC_US + 2_000_000)
    stranger.codec.signer = Signer(wrong, 5)
    bench.send(arm(), stranger)
    bench.tick()
    assert not bench.vessel.handled
    assert bench.endpoint.counters.refused == 2
    bench.send(arm())
    bench.tick()
    assert bench.vessel.armed
    assert bench.gcs.last("HEARTBEAT").get_signed()


def test_check_67_replays_are_refused(persona):
    bench = signed_bench(persona)
    frame = bench.gcs.codec.encode(arm())
    bench.endpoint.receive(frame, bench.vessel.now_us)
    bench.tick()
    bench.long(400, 0)
    bench.run(5)
    bench.endpoint.receive(frame, bench.vessel.now_us)
    bench.tick()
    assert not bench.vessel.armed


def test_check_67_a_copy_made_by_the_network_is_no_replay(persona):
    bench = signed_bench(persona)
    for _ in range(5):
        frame = bench.gcs.codec.encode(GCS_HEARTBEAT)
        for later_us in (0, 2_000, 400_000):
            bench.endpoint.receive(frame, bench.vessel.now_us + later_us)
        bench.run(1.0)
    assert (bench.endpoint.counters.refused, bench.endpoint.bad_frames) == (0, 0)
    assert "refused" not in bench.texts()
    assert bench.endpoint.counters.messages == 5


def test_check_67_what_was_refused_is_not_remembered(persona):
    """Forged frames must not push out the memory of true ones, nor pass for copies of them."""
    bench = signed_bench(persona)
    stranger = Station(255, 190)
    for _ in range(3):
        stranger.codec = Codec(255, 190)
        bench.send(arm(), stranger)
    assert bench.endpoint.counters.refused == 3
    assert bench.endpoint.counters.copies == 0


def test_check_67_radio_status_needs_no_signature(persona):
    bench = signed_bench(persona)
    bench.send(dialect.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7), Station(51, 68))
    assert bench.endpoint.counters.refused == 0


def test_check_67_a_telemetry_link_listens_to_nobody(persona):
    bench = Bench(config=EndpointConfig(persona=persona, link_class="telemetry"))
    bench.send(arm())
    bench.send(GCS_HEARTBEAT)
    bench.run(3)
    assert not bench.vessel.handled
    assert not bench.endpoint.heard
    assert bench.gcs.all("HEARTBEAT")


def test_check_67_keys_are_not_set_by_strangers(persona):
    keys = []
    bench = Bench(persona, on_key=keys.append)
    bench.tick()
    bench.send(dialect.MAVLink_setup_signing_message(1, 1, list(KEY), 0))
    bench.tick()
    assert not keys
    assert "key" in bench.texts()


def test_check_67_a_new_key_must_be_signed_by_the_old(persona):
    keys = []
    bench = signed_bench(persona, on_key=keys.append)
    bench.send(dialect.MAVLink_setup_signing_message(1, 1, list(KEY[::-1]), 0))
    assert keys == [KEY[::-1]]
