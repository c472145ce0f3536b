"""Who is there: ground stations by their HEARTBEAT, and what each is told once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...language.snapshot import Snapshot
from .channel import Channel
from .greeter import Greeter
from .service import Handler, Service
from .stations import Stations


class Presence(Service):
    """``on_station`` is told of each station's first HEARTBEAT here (system id, persona)."""

    def __init__(self, channel: Channel, on_station: Callable[[int, str], None] | None) -> None:
        config = channel.config
        self._greeter = Greeter(config, lambda: channel.vehicle.identity, channel.say, on_station)
        self.stations = Stations(config.system_id, self._greeter.welcome, channel.explain)
        self.hears = self._greeter.hears
        """Is shown every message, whoever serves it."""

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {"HEARTBEAT": self._on_heartbeat}

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        self._greeter.tick(now_us, snapshot)

    def _on_heartbeat(self, message: Any, now_us: int) -> None:
        self.stations.heartbeat(message, now_us)
