"""A gateway at the shore modem of a world in memory, in its virtual time."""

from __future__ import annotations

import random
from pathlib import Path

from companion.gateway import Gateway, GatewaySettings
from companion.io.links.mem import MemLink
from companion.settings.schema import EndpointSettings
from sitl.gateway import simulation_key
from sitl.world.world import World


def gateway_beside(world: World, folder: Path, station: MemLink, *, seed: int, persona: str = "ardurover") -> Gateway:
    """Make it with one endpoint, whose link is ``station``; the key is that of ``folder`` (``with_gateway``)."""
    settings = GatewaySettings(
        profile=world.settings.radio.profile,
        key_file=str(simulation_key(folder)),
        endpoints=(EndpointSettings(name="gcs", url="mem:gcs", persona=persona),),
    )
    modem = world.ground("shore")
    return Gateway(settings, modem=modem, make_link=lambda name, url: station, rng=random.Random(seed))
