"""A station at a gateway, and the whole simulated vessel at the other end of the radio: what the boat does, in lock-step."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import config
from companion.io.keeping.store import AnyStore
from companion.io.links import Received
from companion.io.links.mem import pair
from companion.settings.schema import load
from mavlink_bridge.mavlink.wire.codec import dialect
from sitl.gateway import with_gateway
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.fake_vessel import Station
from tests.gateways import gateway_beside
from tests.world_station import GCS_HEARTBEAT

RADIO_ALONE = (
    'sensors=[{url="mem:nmea"}]',
    "actuators.url=mem:ard",
    "endpoints=[]",
    "radio.url=mem:radio",
    "radio.profile=o-10",
    "depth.enabled=false",
)


class Ashore:
    """An operator at the gateway, another station that only looks on (``observed``), and the boat under way by radio alone."""

    def __init__(
        self,
        folder: Path,
        *overrides: str,
        seed: int = 1,
        store: AnyStore | None = None,
        listens: bool = True,
        observed: bool = False,
    ) -> None:
        settings = load(config.path("sim.toml"), [*RADIO_ALONE, *overrides], SimSettings)
        self.world = World(with_gateway(settings, folder), seed, store=store)
        near, self.link = pair("gcs")
        self.gateway = gateway_beside(self.world, folder, near, seed=seed + 1) if listens else None
        self.link.poll(0)
        self.operator, self.observer = Station(255, 190), Station(77, 190)
        self.present, self.observed = True, observed

    def step(self) -> None:
        if self.world.now_us % 1_000_000 == 0:
            if self.observed:
                self.link.write(0, self.observer.codec.encode(GCS_HEARTBEAT))
            if self.present:
                self.link.write(0, self.operator.codec.encode(GCS_HEARTBEAT))
        self.world.step()
        if self.gateway is not None:
            self.gateway.tick(self.world.now_us)
        for event in self.link.poll(self.world.now_us):
            if isinstance(event, Received):
                self.operator.receive(event.data, self.world.now_us)

    def run(self, seconds: float) -> None:
        end_us = self.world.now_us + round(seconds * 1e6)
        while self.world.now_us < end_us:
            self.step()

    def until(self, holds: Callable[[], bool], limit_s: float) -> bool:
        end_us = self.world.now_us + round(limit_s * 1e6)
        while self.world.now_us < end_us and not holds():
            self.step()
        return holds()

    def give(self, number: int, *params: float) -> None:
        """Send a command."""
        values = [*params, *([0.0] * (7 - len(params)))]
        message = dialect.MAVLink_command_long_message(1, 1, number, 0, *values)
        self.link.write(0, self.operator.codec.encode(message))

    def order(self, number: int, *params: float) -> None:
        """Send a command, and let its time on the air pass."""
        self.give(number, *params)
        self.run(6.0)

    def texts(self) -> list[str]:
        return [message.text for message in self.operator.all("STATUSTEXT")]
