"""The bridge's process: IMC sockets on one side, the vehicle's MAVLink link on the other, driven by the loop like every process here."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from mavlink_bridge.imc import Node, Position
from mavlink_bridge.mavlink.client import VehicleClient

from ..io.imc_sockets import ImcSockets
from ..io.links import Link, Received
from ..io.loop import Waited
from .announcing import hear, refresh
from .desk import Desk
from .logbook import LogBook
from .motion import estimated_state
from .others import Others
from .picture import ImcPicture

log = logging.getLogger(__name__)

PERIOD_US: Final = 50_000
_CHUNK: Final = 4096
_LEVELS: Final = {0: 50, 1: 50, 2: 50, 3: 40, 4: 30}
"""MAV_SEVERITY to the log's levels; the rest is information."""


class Closing(Protocol):
    """What is closed last."""

    def close(self) -> None: ...


@dataclass
class Bridge:
    """What ``companion imc`` runs."""

    sockets: ImcSockets
    node: Node
    link: Link
    client: VehicleClient
    desk: Desk
    picture: ImcPicture
    others: Others
    book: LogBook
    utc_us: Callable[[], int | None]
    store: Closing
    beside: int | None = None
    """The process that started the bridge and with which it ends, killed or not; None when it lives by itself."""
    _channel: int = 0
    _rest: bytes = b""

    @property
    def links(self) -> Sequence[Waited]:
        return (self.sockets, self.link)

    @property
    def stop_wanted(self) -> bool:
        """The process beside which it runs is gone: whoever is orphaned gets another parent (POSIX)."""
        return self.beside is not None and os.getppid() != self.beside

    def pump(self, now_us: int) -> None:
        """Serve vehicle and consoles."""
        self._hear_vehicle(now_us)
        hear(self.node, self.sockets, now_us)
        self._tell(now_us)
        self.sockets.send(self.node.take(now_us))
        self._to_vehicle(now_us)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        """The same on the clock, with the time and the addresses of now."""
        refresh(self.node, self.sockets, now_us, self.utc_us())
        state = estimated_state(self.picture, now_us)
        if state is not None:
            self.node.position = Position(state.lat_rad, state.lon_rad, state.height_m)
        self.pump(now_us)
        return self

    def shutdown(self, now_us: int) -> None:
        self.sockets.close()
        self.link.close()
        self.store.close()

    # ---- inside -------------------------------------------------------------------------------------------------

    def _hear_vehicle(self, now_us: int) -> None:
        for event in self.link.poll(now_us):
            if not isinstance(event, Received):
                continue
            messages = self.client.receive(event.data, now_us)
            if messages:
                self._channel = event.channel
            for message in messages:
                self.picture.hear(message, now_us)
                self.others.hear(message, now_us)

    def _tell(self, now_us: int) -> None:
        """Everything that people should know goes into the log book and the log."""
        for severity, text in self.client.drain_texts():
            self.book.note(severity, "vehicle", text, now_us)
        for severity, text in (*self.desk.drain_texts(), *self.node.drain_texts()):
            self.book.note(severity, "bridge", text, now_us)
            log.log(_LEVELS.get(severity, 20), "%s", text)

    def _to_vehicle(self, now_us: int) -> None:
        data = self._rest + self.client.take(now_us, _CHUNK - len(self._rest))
        taken = self.link.write(self._channel, data) if data else 0
        self._rest = data[taken:] if taken else b""
