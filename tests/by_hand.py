"""A simulated boat that is armed and driven straight ahead by the sticks."""

from __future__ import annotations

import config
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, ManualInput, SetMode
from sitl.world.settings import SimSettings
from sitl.world.world import World


def driven(*words: str) -> World:
    """For a second and a half. ``words``: what its settings have besides."""
    world = World(load(config.path("sim.toml"), ["operator.gcs_required=false", *words], SimSettings), 1)
    world.run(3.0)
    world.app.submit(SetMode(Mode.MANUAL))
    world.app.submit(Arm(arm=True))
    for _ in range(30):
        world.app.submit(ManualInput(1.0, 0.0, 255))
        world.step()
    return world
