"""A run over the compact radio replays without its key: nonces, tags sent and verdicts are in the recording, the key is not."""

from __future__ import annotations

from pathlib import Path

import config as shipped
from companion.io.links.mem import pair
from companion.replay import replay
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, SetMode
from mavlink_bridge.radio.codec.wire import Kind
from sitl.gateway import simulation_key, with_gateway
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.gateways import gateway_beside


def test_a_run_over_the_compact_radio_replays_without_its_key(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    settings = with_gateway(load(shipped.path("sim.toml"), ["radio.profile=o-10"], SimSettings), tmp_path)
    world = World(settings, 1, run_dir=folder)
    near, _ = pair("gcs")
    gateway = gateway_beside(world, tmp_path, near, seed=2)
    for number in range(40 * 20):
        world.step()
        if number in (400, 480):
            gateway.twin.submit(number, SetMode(Mode.HOLD) if number == 400 else Arm(False), world.now_us)
        gateway.tick(world.now_us)
    world.shutdown(world.now_us)
    answers = [
        item for item in world.surroundings.radio.air.log if item.data[0] >> 4 == Kind.REPLY and item.origin == "vessel"
    ]
    assert len(answers) >= 2
    key = simulation_key(tmp_path)
    secret = key.read_bytes()
    key.unlink()
    outcome = replay(folder)
    assert outcome.identical
    assert outcome.unproven > 10
    found = [path.name for path in folder.iterdir() if path.is_file() and secret in path.read_bytes()]
    assert found == []
