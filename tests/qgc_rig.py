"""A QGroundControl stand-in on a link of the simulated vessel, in its virtual time: what an operator at that screen sees and does."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import config
from companion.io.links.link import Received
from companion.settings.schema import load
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.anew import RebootingWorld
from tests.qgc_buttons import Generation
from tests.qgc_client import QgcClient

LINKS = {"ardurover": "gcs", "generic": "sdk"}


class Screen:
    """One world, one station; ``run`` steps until a script has ended."""

    def __init__(
        self,
        *overrides: str,
        persona: str = "ardurover",
        generation: Generation = Generation.V5,
        seed: int = 1,
        world: World | None = None,
        link: str = "",
        client: QgcClient | None = None,
    ) -> None:
        if world is None:
            world = RebootingWorld(load(config.path("sim.toml"), list(overrides), SimSettings), seed)
        self.world = world
        self.link = world.ground(link or LINKS[persona])
        self.client = client or QgcClient(generation=generation)
        self.present = True
        """False: frozen, as a program is that the system has stopped."""

    @property
    def popups(self) -> list[str]:
        return self.client.report.popups

    @property
    def truth(self) -> Any:
        return self.world.surroundings.truth

    def texts(self, severity: int | None = None) -> list[str]:
        return [text for _, level, text in self.client.report.texts if severity in (None, level)]

    def turn(self) -> None:
        self.world.step()
        for _ in range(40):
            if not self._talk():
                break

    def _talk(self) -> bool:
        now_us = self.world.now_us
        self.world.pump(now_us)
        heard = [event.data for event in self.link.poll(now_us) if isinstance(event, Received)]
        if not self.present:
            return False
        for data in heard:
            self.client.receive(data, now_us)
        said = self.client.take(now_us)
        if said:
            self.link.write(0, said)
        return bool(heard or said)

    def wait(self, seconds: float) -> None:
        end_us = self.world.now_us + round(seconds * 1e6)
        while self.world.now_us < end_us:
            self.turn()

    def until(self, holds: Callable[[], bool], limit_s: float) -> float:
        began_us = self.world.now_us
        while not holds():
            assert self.world.now_us - began_us < limit_s * 1e6, (self.client.report.failures, self.texts()[-5:])
            self.turn()
        return (self.world.now_us - began_us) * 1e-6

    def run(self, script: Any = None, limit_s: float = 60.0) -> Any:
        if script is not None:
            self.client.start(script)
        self.until(lambda: self.client.idle, limit_s)
        return self.client.result

    def at(self, north_m: float, east_m: float) -> tuple[int, int]:
        lat_rad, lon_rad = self.world.surroundings.plant.frame.to_geodetic(north_m, east_m)
        return round(math.degrees(lat_rad) * 1e7), round(math.degrees(lon_rad) * 1e7)

    def plan(self, *points: tuple[float, float], speed_mps: float = 1.5) -> list[Any]:
        """A plan as QGroundControl sends it: home, a speed by its own default kind, waypoints."""
        return [
            (0, 16, 0.0, 0.0, 0.0, 0.0, *self.at(0.0, 0.0), 0.0),
            (2, 178, 0.0, speed_mps, 0.0, 0.0, 0, 0, 0.0),
            *[(3, 16, 0.0, 0.0, 0.0, math.nan, *self.at(*point), 50.0) for point in points],
        ]
