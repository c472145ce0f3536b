"""The ground stations heard on one link: who, when last, and what is said to them once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

_GCS: Final = 6
"""MAV_TYPE_GCS."""
_MAX_PEERS: Final = 32


@dataclass(slots=True)
class PeerStation:
    """A station heard on this link."""

    system_id: int
    last_heartbeat_us: int


class Stations:
    """Keeps the table. ``welcome`` is called with the system id of each new station, ``complain`` with a reason."""

    def __init__(self, own_id: int, welcome: Callable[[int], None], complain: Callable[[str], None]) -> None:
        self._own_id = own_id
        self._welcome = welcome
        self._complain = complain
        self.peers: dict[int, PeerStation] = {}
        self.heard: dict[tuple[int, int], int] = {}
        """Newest HEARTBEAT of each station by system and component: a forwarder has often the ids of whom it forwards, but for one."""

    def heartbeat(self, message: Any, now_us: int) -> None:
        """Take a HEARTBEAT; only ground stations count, and none with the vessel's own id."""
        system = message.get_srcSystem()
        if message.type != _GCS:
            return
        if system == self._own_id:
            self._complain(f"a ground station uses this vessel's system id {system}")
            return
        self._note((system, message.get_srcComponent()), now_us)
        peer = self.peers.get(system)
        if peer is not None:
            peer.last_heartbeat_us = now_us
            return
        if len(self.peers) >= _MAX_PEERS:
            self.peers.pop(min(self.peers.values(), key=lambda other: other.last_heartbeat_us).system_id)
        self.peers[system] = PeerStation(system, now_us)
        self._welcome(system)

    def _note(self, who: tuple[int, int], now_us: int) -> None:
        heard = self.heard
        if who not in heard and len(heard) >= _MAX_PEERS:
            del heard[min(heard, key=lambda other: heard[other])]
        heard[who] = now_us
