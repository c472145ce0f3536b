"""The systems that are heard: who they are, where they listen, how their clocks go, and how long they have been silent."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Final

from .messages import Announce, SystemType
from .packet import Packet
from .services import where_to
from .system import Asker, Place, Tcp, Udp

MAX_PEERS: Final = 24
"""Consoles and vehicles at once. Beyond them whoever has been silent for longest makes room, if he was silent at all."""
SILENT_US: Final = 30_000_000
"""A system that was not heard for so long gets nothing any more (DUNE's rule)."""
BACK_US: Final = 10_000_000
"""One that comes back after this has shown us as gone, and wants to be told everything again."""
CONSOLE_PORT: Final = 6001
"""Where Neptus and imcpy listen, unless it is taken."""
_REMEMBERED: Final = 128
"""Packets of a system that are known again; a console sends some 3 a second."""
_CLOCK_WINDOW_US: Final = 30_000_000
SET_BACK_S: Final = 60.0
"""What looks older than this is not late: no network holds packets for so long, the clock that stamped it was set back."""
_AGREED_S: Final = 1.0
"""Packets that were held up come ever less late; those of a clock that was set back agree within a network's jitter."""
_AGREED_US: Final = 3_000_000
_AGREED: Final = 4
"""So many packets over that time: a console's Heartbeat alone brings them, and a burst of held up ones does not take so long."""


@dataclass
class PeerClock:
    """How far a system's clock is ahead of our monotonic one: the least delayed of its packets tells."""

    since_us: int = 0
    best_s: float | None = None
    before_s: float | None = None
    _back_s: float | None = None
    """The lead on which the newest packets agree, when it is one of a clock that was set back."""
    _back_us: int = 0
    """Since when."""
    _backs: int = 0

    def heard(self, utc_s: float, now_us: int) -> None:
        """Take in the time of a packet's header."""
        if not math.isfinite(utc_s) or abs(utc_s) > 1e11:
            return
        lead_s = utc_s - now_us * 1e-6
        if self._was_set_back(lead_s, now_us):
            self.best_s = self.before_s = None
        if self.best_s is None or now_us - self.since_us >= _CLOCK_WINDOW_US:
            self.before_s, self.best_s, self.since_us = self.best_s, lead_s, now_us
        self.best_s = max(self.best_s, lead_s)

    def _was_set_back(self, lead_s: float, now_us: int) -> bool:
        """Whether packets in a row, for a while, agree on a clock that goes behind the one before."""
        ahead_s = self.ahead_s
        if ahead_s is None or ahead_s - lead_s <= SET_BACK_S:
            self._back_s = None
            return False
        if self._back_s is None or abs(lead_s - self._back_s) > _AGREED_S:
            self._back_s, self._back_us, self._backs = lead_s, now_us, 0
        self._backs += 1
        return self._backs >= _AGREED and now_us - self._back_us >= _AGREED_US

    @property
    def ahead_s(self) -> float | None:
        """What must be added to our monotonic time to have its UTC; None before it has told any."""
        known = [value for value in (self.best_s, self.before_s) if value is not None]
        return max(known) if known else None

    def age_s(self, utc_s: float, now_us: int) -> float | None:
        """How long ago a packet of that time was sent."""
        ahead_s = self.ahead_s
        if ahead_s is None or not math.isfinite(utc_s):
            return None
        return max(0.0, ahead_s + now_us * 1e-6 - utc_s)


@dataclass
class Peer:
    """One system, on one host."""

    imc_id: int
    host: str
    name: str = ""
    is_console: bool = False
    udp: Udp | None = None
    """Where it wants its datagrams, from its Announce; else where it sent from."""
    announced: bool = False
    roams: bool = False
    """It has not announced itself and sends from one port after another: where it sends from it does not listen."""
    tcp: Tcp | None = None
    """Its newest connection."""
    heard_us: int = 0
    met_us: int | None = None
    """When it was last told everything."""
    clock: PeerClock = field(default_factory=PeerClock)
    skew_told: bool = False
    _seen: OrderedDict[int, None] = field(default_factory=OrderedDict)

    def is_copy(self, packet: Packet) -> bool:
        """Whether the very same packet was heard before: on the other transport, or doubled by the network."""
        mark = hash((packet.header, packet.message))
        if mark in self._seen:
            return True
        self._seen[mark] = None
        if len(self._seen) > _REMEMBERED:
            self._seen.popitem(last=False)
        return False

    def places(self) -> list[Place]:
        """Where what nobody asked for goes: datagrams if it takes them.

        A system that has not announced itself may send from another port than it listens on: the usual one is tried too.
        """
        if self.udp is None:
            return [] if self.tcp is None else [self.tcp]
        usual = Udp(self.host, CONSOLE_PORT)
        return [self.udp] if self.announced or self.udp == usual else [self.udp, usual]

    def asker(self, packet: Packet, source: Place, own_id: int, now_us: int) -> Asker:
        """Who asks, for the parts. Datagrams are answered where the system listens, which need not be where it sends from."""
        place = source
        if isinstance(source, Udp) and self.udp is not None:
            place = Udp(self.host, CONSOLE_PORT) if self.roams and not self.announced else self.udp
        return Asker(
            imc_id=self.imc_id,
            entity=packet.header.source_entity,
            name=self.name or f"0x{self.imc_id:04X}",
            place=place,
            direct=packet.header.destination == own_id,
            sent_utc_s=packet.header.utc_s,
            age_s=self.clock.age_s(packet.header.utc_s, now_us),
        )


class Peers:
    """All of them, bounded. Two systems with one id on two hosts are two: consoles come with one id from the factory."""

    def __init__(self) -> None:
        self._all: dict[tuple[int, str], Peer] = {}
        self.refused = 0
        """Packets of systems for which there was no room."""

    def heard(self, packet: Packet, source: Place, now_us: int) -> Peer | None:
        """Note that a system speaks; None when there is no room for it."""
        key = (packet.header.source, source.host)
        peer = self._all.get(key)
        if peer is None:
            if not self._make_room(now_us):
                self.refused += 1
                return None
            peer = self._all[key] = Peer(*key)
        self._note_place(peer, packet, source)
        peer.clock.heard(packet.header.utc_s, now_us)
        return peer

    def _make_room(self, now_us: int) -> bool:
        if len(self._all) < MAX_PEERS:
            return True
        key, oldest = min(self._all.items(), key=lambda item: item[1].heard_us)
        if now_us - oldest.heard_us < BACK_US:
            return False
        del self._all[key]
        return True

    def _note_place(self, peer: Peer, packet: Packet, source: Place) -> None:
        if isinstance(source, Tcp):
            peer.tcp = source
        message = packet.message
        if isinstance(message, Announce):
            peer.name = message.sys_name[:64]
            peer.is_console = peer.is_console or message.sys_type == SystemType.CCU
            told = where_to(message.services, source.host)
            if told is not None:
                peer.udp, peer.announced = told, True
        elif isinstance(source, Udp) and not peer.announced:
            peer.roams = peer.roams or peer.udp not in (None, source)
            peer.udp = source

    def gone(self, connection: Tcp) -> None:
        """A connection was closed."""
        for peer in self._all.values():
            if peer.tcp == connection:
                peer.tcp = None

    def prune(self, now_us: int) -> list[Peer]:
        """Forget whoever has been silent for long, and tell who that was."""
        silent = [key for key, peer in self._all.items() if now_us - peer.heard_us > SILENT_US]
        return [self._all.pop(key) for key in silent]

    def consoles(self) -> list[Peer]:
        """Whom our state is sent to."""
        return [peer for peer in self._all.values() if peer.is_console]
