"""The radio port in the whole simulated vessel: the original's JSON, and the compact link with its gateway."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import pytest

import config
from companion.commands.status import StatusView
from companion.io.links.link import Received
from companion.io.links.mem import pair
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.radio.codec.wire import OVERHEAD, Kind
from sitl.gateway import with_gateway
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.gateways import gateway_beside
from tests.plans import LAT_DEG, LON_DEG, SEED_LOITER

MEMORY = ('sensors=[{url="mem:nmea"}]', "actuators.url=mem:ard", "endpoints=[]", "radio.url=mem:radio")


def world(*overrides: str, seed: int = 1) -> World:
    settings = load(config.path("sim.toml"), [*MEMORY, *overrides], SimSettings)
    return World(settings, seed)


def lines_of(shore, now_us, buffer):
    """Whole JSON lines that the shore modem has brought."""
    for event in shore.poll(now_us):
        if isinstance(event, Received):
            buffer += event.data
    *lines, rest = bytes(buffer).split(b"\n")
    buffer[:] = rest
    return [json.loads(line) for line in lines]


def radius_error_m(truth, sim):
    lat, lon = math.degrees(truth.lat_rad), math.degrees(truth.lon_rad)
    north, east = (lat - LAT_DEG) * 111_132.0, (lon - LON_DEG) * 111_320.0 * math.cos(math.radians(LAT_DEG))
    return abs(math.hypot(north, east) - 20.0)


@pytest.mark.parametrize("ending", [b"\n", b""], ids=["line", "bare"])
def test_a_json_plan_is_acknowledged_sailed_and_eleven_fields_come_back(ending):
    sim = world("radio.protocol=json", "radio.profile=o-10", "failsafe.radio_timeout_s=900")
    shore, buffer, heard = sim.ground("shore"), bytearray(), []
    sim.run(8.0)
    heard += lines_of(shore, sim.now_us, buffer)
    shore.write(0, json.dumps(SEED_LOITER).encode() + ending)
    errors = []
    while sim.now_us < 95e6:
        sim.run(1.0)
        heard += lines_of(shore, sim.now_us, buffer)
        if sim.snapshot.path.on_path and sim.snapshot.mode is Mode.AUTO:
            errors.append(radius_error_m(sim.surroundings.truth, sim))
    answers = [line for line in heard if "ack" in line]
    states = [line for line in heard if "latitude" in line]
    assert [(line["ack"], line["result"]) for line in answers] == [("loiter-1", "accepted")]
    fields = {
        "id",
        "maneuver_id",
        "location",
        "latitude",
        "longitude",
        "z",
        "speed_kn",
        "yaw_deg",
        "pitch_deg",
        "roll_deg",
        "datetime",
    }
    assert all(set(line) == fields for line in states)
    assert "loiter-1" in {line["maneuver_id"] for line in states}
    sailing = next(line for line in states if line["maneuver_id"] == "loiter-1" and line["location"])
    assert sailing["location"]["lat"] == pytest.approx(LAT_DEG, abs=1e-5)
    assert len(errors) > 30
    assert max(errors[10:]) < 2.0


def test_after_the_radios_time_out_the_sender_of_a_json_plan_is_missed():
    """Nothing but the shipped configuration; bytes that are no order keep nobody present."""
    sim = world("radio.protocol=json", "radio.profile=o-10")
    shore = sim.ground("shore")
    sim.run(8.0)
    shore.poll(sim.now_us)
    shore.write(0, json.dumps(SEED_LOITER).encode())
    sim.run(50.0)
    assert (sim.snapshot.mode, sim.snapshot.armed) == (Mode.AUTO, True)
    shore.write(0, json.dumps({**SEED_LOITER, "Loiter type": "Spiral"}).encode() + bytes(range(128, 160)))
    sim.run(20.0)
    assert sim.snapshot.mode is Mode.HOLD
    assert "radio_lost" in sim.snapshot.causes


def test_row_54_a_bad_json_plan_is_refused_with_a_reason():
    sim = world("radio.protocol=json", "radio.profile=o-10")
    shore, buffer = sim.ground("shore"), bytearray()
    sim.run(8.0)
    lines_of(shore, sim.now_us, buffer)
    shore.write(0, json.dumps({**SEED_LOITER, "Loiter type": "Spiral"}).encode() + b"\n\x81\xfe\xff\n")
    status = io.StringIO()
    view = StatusView(status)
    while sim.now_us < 28e6:
        sim.step()
        view.update(sim.snapshot)
    view.close()
    assert "Spiral" in status.getvalue(), "people aboard see what was refused"
    assert "no JSON in what comes" in status.getvalue()
    answers = [line for line in lines_of(shore, sim.now_us, buffer) if "ack" in line]
    assert [(line["result"], "Spiral" in line["reason"]) for line in answers] == [("denied", True)]
    assert sim.snapshot.mode is Mode.HOLD


class Shore:
    """A gateway at the simulated shore modem, and a ground station at its only endpoint, in virtual time."""

    def __init__(self, tmp_path: Path, *overrides: str, persona: str = "ardurover") -> None:
        settings = load(config.path("sim.toml"), [*MEMORY, "radio.profile=o-10", *overrides], SimSettings)
        settings = with_gateway(settings, tmp_path)
        self.sim = World(settings, 1)
        near, self.far = pair("gcs")
        self.gateway = gateway_beside(self.sim, tmp_path, near, seed=1, persona=persona)
        self.codec, self.deframer = Codec(255, 190), Deframer()
        self.messages = []
        self._beat_us = 0
        self.far.poll(0)

    def send(self, message) -> None:
        self.far.write(0, self.codec.encode(message))

    def run(self, seconds: float, until=None) -> None:
        end_us = self.sim.now_us + seconds * 1e6
        while self.sim.now_us < end_us and not (until is not None and until()):
            self.sim.step()
            now_us = self.sim.now_us
            if now_us - self._beat_us >= 1e6:
                self._beat_us = now_us
                self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
            self.gateway.tick(now_us)
            for event in self.far.poll(now_us):
                if isinstance(event, Received):
                    self.messages += [(now_us, decode(frame)) for frame in self.deframer.receive(event.data, now_us)]

    def of(self, name):
        return [(at_us, message) for at_us, message in self.messages if message.get_type() == name]


@pytest.fixture
def shore(tmp_path):
    found = Shore(tmp_path)
    found.run(60.0)
    return found


def test_stations_see_the_vessel_and_connecting_costs_no_air(shore):
    assert shore.of("HEARTBEAT")
    position = shore.of("GLOBAL_POSITION_INT")[-1][1]
    truth = shore.sim.surroundings.truth
    assert position.lat == pytest.approx(math.degrees(truth.lat_rad) * 1e7, abs=200)
    air = shore.sim.surroundings.radio.air
    before = air.bytes_sent("shore")
    count = len(shore.messages)
    began_us = shore.sim.now_us
    for message in (
        dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0),
        dialect.MAVLink_param_request_list_message(1, 1),
        dialect.MAVLink_mission_request_list_message(1, 1, 0),
        dialect.MAVLink_mission_request_list_message(1, 1, 1),
        dialect.MAVLink_mission_request_list_message(1, 1, 2),
    ):
        shore.send(message)
    shore.run(0.95)
    seen = [message.get_type() for _, message in shore.messages[count:]]
    params = [message for _, message in shore.messages[count:] if message.get_type() == "PARAM_VALUE"]
    assert seen.count("MISSION_COUNT") == 3
    assert "AUTOPILOT_VERSION" in seen
    assert len({message.param_id for message in params}) == params[0].param_count
    assert shore.sim.now_us - began_us < 1_000_000
    shore.run(60.0)
    # one beacon each 30 s, and one more that names a new key state, so that differences go on: 12 bytes less each
    beacon_bytes = OVERHEAD + 1 + 2
    since = [item.data for item in air.log if item.origin == "shore" and item.start_us >= began_us]
    assert {data[0] >> 4 for data in since} == {Kind.BEACON}
    assert 2 <= len(since) <= 3
    assert air.bytes_sent("shore") - before == sum(map(len, since)) <= 3 * beacon_bytes


def test_a_command_is_in_progress_then_what_the_vessel_said(shore):
    shore.send(dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    shore.run(5.0)
    acks = [message.result for _, message in shore.of("COMMAND_ACK") if message.command == 400]
    assert acks[-1] == 0
    assert set(acks[:-1]) <= {5}
    assert shore.sim.snapshot.armed


@pytest.mark.parametrize("persona", ["ardurover", "generic"])
def test_check_68_an_unplugged_vessel_falls_silent_stays_readable_and_accepts_nothing(tmp_path, persona):
    shore = Shore(tmp_path, persona=persona)
    shore.run(60.0)
    shore.sim.surroundings.radio.air.jammed = True
    cut_us = shore.sim.now_us
    stale_us = shore.gateway.profile.link.stale_after_s * 1e6
    shore.run(30.0)
    assert shore.of("HEARTBEAT")[-1][0] <= cut_us + stale_us + 100_000
    shore.send(dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    shore.run(20.0)
    results = [message.result for _, message in shore.of("COMMAND_ACK") if message.command == 400]
    assert results[-1] == 4
    assert 0 not in results
    shore.send(dialect.MAVLink_param_request_list_message(1, 1))
    shore.send(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    shore.run(1.0)
    params = [message for _, message in shore.of("PARAM_VALUE")]
    assert len({message.param_id for message in params}) == params[0].param_count > 60
    assert shore.of("MISSION_COUNT")
    assert any("nothing from the vessel" in message.text for _, message in shore.of("STATUSTEXT"))
    assert not shore.sim.snapshot.armed


def test_row_51_the_vessel_notices_a_lost_gateway(tmp_path):
    shore = Shore(tmp_path)
    shore.run(60.0)
    shore.send(dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    shore.run(5.0)
    assert shore.sim.snapshot.armed
    shore.sim.surroundings.radio.air.jammed = True
    shore.run(120.0)
    assert shore.sim.snapshot.causes
