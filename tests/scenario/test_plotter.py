"""NMEA sent on to a plotter: every good sentence, nothing else, and off unless asked for."""

from __future__ import annotations

import config
from companion.core.nmea.line import LineReader
from companion.io.links.link import Received
from companion.settings.schema import load
from sitl.world.settings import SimSettings
from sitl.world.world import World


def heard(*overrides: str, flip_share: float = 0.0) -> tuple[World, bytes]:
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false", *overrides], SimSettings)
    world = World(settings, 1)
    world.surroundings.plant.sensors.faults.set("flip_share", flip_share)
    end = world.ground("plotter")
    data = b""
    for _ in range(200):
        world.step()
        data += b"".join(event.data for event in end.poll(world.now_us) if isinstance(event, Received))
    return world, data


def test_a_plotter_hears_every_good_sentence() -> None:
    world, data = heard('plotter="udp://127.0.0.1:10110"')
    reader = LineReader()
    bodies = reader.receive(data)
    counters = world.app.sensors[0].reader.counters
    assert len(bodies) == counters["sentences"] > 400
    assert reader.counters.bad_checksum == reader.counters.noise_bytes == 0
    assert {body[:5] for body in bodies} == {"GPZDA", "GPGGA", "GPRMC", "GPVTG", "GPHDT", "GPROT", "SDDPT"}


def test_damaged_sentences_are_not_sent_on() -> None:
    world, data = heard('plotter="udp://127.0.0.1:10110"', flip_share=0.3)
    reader = LineReader()
    assert len(reader.receive(data)) == world.app.sensors[0].reader.counters["sentences"]
    assert reader.counters.bad_checksum == 0


def test_it_is_off_by_default() -> None:
    settings = load(config.path("sim.toml"), [], SimSettings)
    world = World(settings, 1)
    world.run(1.0)
    assert world.app.plotter is None
    assert world.app.sensors[0].reader.take_relay() == b""
