"""A recorded NMEA log instead of the simulator: a ground station sees the ship where the log says."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

import config
from companion.build import build_app
from companion.io.links.link import Link
from companion.io.links.mem import MemLink
from companion.io.links.table import open_link
from companion.settings.schema import Settings, load
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.mavlink.wire.codec import Codec
from mavlink_bridge.mavlink.wire.framing import Deframer

PERIOD_US = 50_000


def play(url: str, until_s: float) -> tuple[list[EstimatedState], list[object]]:
    """Run the app on a recording; return its states and the messages that a ground station receives."""
    settings = load(config.path("replay-nmea.toml"), [f'sensors.0.url="{url}"'], Settings)
    far: dict[str, MemLink] = {}

    def make_link(name: str, url: str, **options: object) -> Link:
        if url.startswith("file:"):
            return open_link(name, url, **options)
        near, far[name] = MemLink(name, datagrams=True), MemLink(f"{name}-far", datagrams=True)
        near.connect(far[name])
        return near

    app = build_app(settings, make_link=make_link, reproducible=True)
    states: list[EstimatedState] = []
    deframer, codec, messages = Deframer(), Codec(255, 190), []
    for tick in range(round(until_s * 1e6 / PERIOD_US)):
        app.tick(tick * PERIOD_US)
        assert app.snapshot is not None
        states.append(app.snapshot.state)
        for event in far["gcs"].poll(tick * PERIOD_US):
            frames = deframer.receive(getattr(event, "data", b""), tick * PERIOD_US)
            messages += [codec.decode(frame) for frame in frames]
    app.shutdown(round(until_s * 1e6))
    return states, messages


def test_the_shipped_recording_shows_the_loiter() -> None:
    log = config.path("nmea", "sim-loiter.nmea")
    states, messages = play(f"file:{log}?speed=1", 45.0)
    known = [state for state in states[100:] if state.position_valid and state.heading_valid]
    assert len(known) > 0.9 * len(states[100:])
    centre = (math.radians(41.1852), math.radians(-8.7060))
    radii = [
        math.hypot((state.lat_rad - centre[0]) * 6.363e6, (state.lon_rad - centre[1]) * 6.388e6 * math.cos(centre[0]))
        for state in known
    ]
    assert all(abs(radius - 20.0) < 1.0 for radius in radii)
    assert all(abs(state.sog_mps - 1.5) < 0.3 for state in known)
    positions = [
        message for message in messages if message.get_type() == "GLOBAL_POSITION_INT" and message.hdg != 65535
    ]
    assert len(positions) > 100
    assert all(abs(message.lat * 1e-7 - 41.1852) < 3e-4 for message in positions)


def test_a_research_ship_in_antarctic_waters(shared_data: Path) -> None:
    log = shared_data / "nmea" / "vessel" / "nbp1406_seap.log"
    if not log.is_file():
        pytest.skip("nbp1406_seap.log is not there")
    states, _ = play(f"file:{log}?speed=1", 120.0)
    known = [state for state in states if state.position_valid]
    assert len(known) > 0.8 * len(states)
    fix = re.search(rb"\$..GGA,[\d.]+,(\d\d)([\d.]+),([NS]),(\d{3})([\d.]+),([EW])", log.read_bytes())
    assert fix is not None
    latitude = (float(fix[1]) + float(fix[2]) / 60) * (-1 if fix[3] == b"S" else 1)
    longitude = (float(fix[4]) + float(fix[5]) / 60) * (-1 if fix[6] == b"W" else 1)
    assert abs(math.degrees(known[0].lat_rad) - latitude) < 0.01
    assert abs(math.degrees(known[0].lon_rad) - longitude) < 0.01
    assert any(state.heading_valid for state in known)
