"""A ground station on the simulated vessel's memory link, in lock-step: for checks that only a whole vessel can show."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import config
from companion.io.links.link import Received
from companion.settings.schema import load
from mavlink_bridge.mavlink.wire.codec import dialect
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.fake_vessel import Station

LINKS = {"ardurover": "gcs", "generic": "sdk"}
GCS_HEARTBEAT = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


class Helm:
    """A world, and a station that sends its HEARTBEAT once a second unless ``present`` is False."""

    def __init__(self, persona: str, *overrides: str, seed: int = 1, **options: Any) -> None:
        settings = load(config.path("sim.toml"), list(overrides), SimSettings)
        self.world = World(settings, seed, **options)
        self.persona = persona
        self.shift = 1 if persona == "ardurover" else 0
        self.link = self.world.ground(LINKS[persona])
        self.link.poll(0)
        self.gcs = Station()
        self.present = True
        self._beat_us = 0
        self.run(3.0)

    @property
    def now_s(self) -> float:
        return self.world.now_us * 1e-6

    @property
    def truth(self) -> Any:
        return self.world.surroundings.truth

    @property
    def pulses_us(self) -> Any:
        return self.world.surroundings.plant.board.pulses_us

    def send(self, message: Any) -> None:
        """Send a message and let the pump answer."""
        self.link.write(0, self.gcs.codec.encode(message))
        self.world.pump(self.world.now_us)
        self.listen()

    def listen(self) -> None:
        for event in self.link.poll(self.world.now_us):
            if isinstance(event, Received):
                self.gcs.receive(event.data, self.world.now_us)

    def step(self) -> None:
        if self.present and self.world.now_us >= self._beat_us:
            self._beat_us = self.world.now_us + 1_000_000
            self.link.write(0, self.gcs.codec.encode(GCS_HEARTBEAT))
        self.world.step()
        self.listen()

    def run(self, seconds: float) -> None:
        end_us = self.world.now_us + round(seconds * 1e6)
        while self.world.now_us < end_us:
            self.step()

    def until(self, holds: Callable[[], bool], limit_s: float) -> float:
        began = self.now_s
        while not holds():
            assert self.now_s - began < limit_s, f"not within {limit_s} s: {self.texts()[-400:]}"
            self.step()
        return self.now_s - began

    def command(self, number: int, *params: float) -> int:
        """Send a COMMAND_LONG and return its final result."""
        before = len(self.gcs.inbox)
        values = [*params, *([0.0] * (7 - len(params)))]
        self.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *values))

        def finals() -> list[int]:
            acks = [m for m in self.gcs.inbox[before:] if m.get_type() == "COMMAND_ACK" and m.command == number]
            return [ack.result for ack in acks if ack.result != 5]

        self.until(lambda: bool(finals()), 2.0)
        return finals()[0]

    def at(self, north_m: float, east_m: float) -> tuple[int, int]:
        import math

        lat, lon = self.world.surroundings.plant.frame.to_geodetic(north_m, east_m)
        return round(math.degrees(lat) * 1e7), round(math.degrees(lon) * 1e7)

    def upload(self, items: list[tuple[Any, ...]], kind: int = 0) -> int:
        """Upload (frame, command, p1..p4, x, y, z) tuples; home is put first where the face wants one."""
        content = (
            [(0, 16, 0.0, 0.0, 0.0, 0.0, *self.at(0, 0), 0.0), *items] if self.shift and kind == 0 else list(items)
        )
        self.gcs.clear()
        self.send(dialect.MAVLink_mission_count_message(1, 1, len(content), kind))
        sent: set[int] = set()
        while not self.gcs.all("MISSION_ACK"):
            asked = [m.seq for m in self.gcs.all("MISSION_REQUEST_INT") if m.seq not in sent]
            if asked:
                sent.add(asked[0])
                f, c, p1, p2, p3, p4, x, y, z = content[asked[0]]
                self.send(
                    dialect.MAVLink_mission_item_int_message(1, 1, asked[0], f, c, 0, 1, p1, p2, p3, p4, x, y, z, kind)
                )
            else:
                self.step()
        return int(self.gcs.last("MISSION_ACK").type)

    def param(self, name: str, value: float) -> float:
        """Set a parameter and return the value that comes back."""
        self.gcs.clear()
        self.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, 9))
        self.until(lambda: bool(self.gcs.all("PARAM_VALUE")), 2.0)
        return float(self.gcs.last("PARAM_VALUE").param_value)

    def texts(self) -> str:
        return "\n".join(m.text for m in self.gcs.all("STATUSTEXT"))
