"""An IMC system among others: it announces itself, beats, names its entities, and lets its parts answer consoles.

Sans-I/O: ``receive(data, source, now_us)`` for each datagram and each piece of a stream, ``take(now_us)`` for what is to be
sent. A console is spoken to as soon as one packet of it is heard, each request is answered once on the transport it came by,
and what is addressed to others is passed over. Nothing here is proven: who may order what is for the parts to say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from .fields import Message
from .messages import Announce, EntityList, EntityListOp, Heartbeat, SystemType
from .packet import (
    ANNOUNCED,
    BROADCAST,
    ENTITY_SYSTEM,
    ENTITY_UNKNOWN,
    NOBODY,
    Header,
    Packet,
    PacketCounters,
    PacketReader,
    encode,
)
from .peers import BACK_US, Peer, Peers
from .services import services_text
from .system import Asker, Destination, Discovery, Place, SystemPart, Tcp, Udp

ANNOUNCE_US: Final = 10_000_000
HEARTBEAT_US: Final = 1_000_000
SKEW_S: Final = 5.0
"""A console shows our values as old when our clock is further than this behind its own."""
MAX_QUEUE: Final = 512
"""Packets that wait to be taken; the oldest goes first."""
MAX_STREAMS: Final = 16
MAX_ASKED: Final = 256
"""Questions that wait for a system which is still being built; it takes a second, and a console asks some ten a second."""
_NOTICE: Final = 5
_WARNING: Final = 4


@dataclass(frozen=True)
class NodeConfig:
    """Who we are among IMC systems."""

    imc_id: int
    name: str
    system_type: int = SystemType.USV
    uid: int = 0
    """Tells one start of the process from the next."""


@dataclass(frozen=True)
class Position:
    """Where the vessel is, for the Announce."""

    lat_rad: float = 0.0
    lon_rad: float = 0.0
    height_m: float = 0.0


@dataclass(frozen=True)
class _Asked:
    """What a console said before all parts stood."""

    message: Message
    asker: Asker
    is_new: bool


class Node:
    """The system. Its parts are given in the order in which they are asked.

    With ``opening`` it greets who comes and keeps their questions until ``open`` says that all parts stand."""

    def __init__(self, config: NodeConfig, parts: Sequence[SystemPart] = (), *, opening: bool = False) -> None:
        self.config = config
        self.parts = list(parts)
        self.peers = Peers()
        self.counters = PacketCounters()
        self.position = Position()
        self.utc_ahead_us: int | None = None
        """What must be added to ``now_us`` to have UTC; None while the computer does not know it."""
        self.udp: tuple[Udp, ...] = ()
        self.tcp: tuple[Udp, ...] = ()
        """The addresses at which we are reached."""
        self.not_ours = 0
        """Packets for somebody else."""
        self.copies = 0
        self.unsendable = 0
        self._datagrams = PacketReader(datagrams=True, counters=self.counters)
        self._streams: dict[Tcp, PacketReader] = {}
        self._queue: list[tuple[Destination, bytes]] = []
        self._entities = self._numbered()
        self._announce_us: int | None = None
        self._beat_us: int | None = None
        self._texts: list[tuple[int, str]] = []
        self._conflict_told = False
        self._asked: list[_Asked] | None = [] if opening else None

    def add(self, part: SystemPart) -> None:
        """Take a part in: a process may announce itself before all of it stands."""
        self.parts.append(part)
        self._entities = self._numbered()

    def open(self, now_us: int) -> None:
        """All parts stand: who came before meets them, and is answered."""
        asked, self._asked = self._asked or [], None
        for one in asked:
            self._meet(one, now_us)
        self._collect(now_us)

    def _numbered(self) -> dict[str, int]:
        labels = dict.fromkeys(label for part in self.parts for label in part.entities())
        return {"Daemon": ENTITY_SYSTEM, **{label: number for number, label in enumerate(labels, start=1)}}

    # ---- in -----------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, source: Place, now_us: int) -> None:
        """A datagram, or what came on a connection. Never raises."""
        for packet in self._reader(source).receive(data, now_us):
            self._take_in(packet, source, now_us)

    def closed(self, connection: Tcp) -> None:
        """A connection is gone."""
        self._streams.pop(connection, None)
        self.peers.gone(connection)

    def _reader(self, source: Place) -> PacketReader:
        if isinstance(source, Udp):
            return self._datagrams
        if source not in self._streams and len(self._streams) >= MAX_STREAMS:
            del self._streams[next(iter(self._streams))]
        return self._streams.setdefault(source, PacketReader(counters=self.counters))

    def _take_in(self, packet: Packet, source: Place, now_us: int) -> None:
        header = packet.header
        if header.source == self.config.imc_id:
            self._own_id(packet, source)
            return
        announced = isinstance(packet.message, Announce)
        if not announced and header.destination not in (self.config.imc_id, NOBODY, BROADCAST):
            self.not_ours += 1
            return
        peer = self.peers.heard(packet, source, now_us)
        if peer is None:
            return
        if peer.is_copy(packet):
            self.copies += 1
            return
        self._heard(peer, packet, source, now_us)

    def _heard(self, peer: Peer, packet: Packet, source: Place, now_us: int) -> None:
        silent_us = now_us - peer.heard_us
        peer.heard_us = now_us
        peer.is_console = peer.is_console or packet.header.destination == self.config.imc_id
        if not peer.is_console:
            return
        is_new = peer.met_us is None or silent_us > BACK_US
        asked = _Asked(packet.message, peer.asker(packet, source, self.config.imc_id, now_us), is_new)
        if is_new:
            self._greet(peer, asked.asker, now_us)
        self._note_skew(peer, now_us)
        if self._asked is None:
            self._meet(asked, now_us)
            self._collect(now_us)
        elif len(self._asked) < MAX_ASKED:
            self._asked.append(asked)

    def _meet(self, asked: _Asked, now_us: int) -> None:
        for part in self.parts:
            part.heard(asked.asker, now_us)
        if asked.is_new:
            for part in self.parts:
                part.met(asked.asker, now_us)
        self._serve(asked.message, asked.asker, now_us)

    def _greet(self, peer: Peer, asker: Asker, now_us: int) -> None:
        """Speak at once: a console shows a system as connected only after some packets."""
        back = peer.met_us is not None
        peer.met_us = now_us
        self._texts.append((_NOTICE, f"{asker} is {'back' if back else 'here'}"))
        for place in peer.places():
            self._put(place, self._announcement(), now_us, ANNOUNCED)
            self._put(place, Heartbeat(), now_us, peer.imc_id)

    def _serve(self, message: Message, asker: Asker, now_us: int) -> None:
        match message:
            case Announce() | Heartbeat():
                return
            case EntityList(op=EntityListOp.QUERY):
                report = ";".join(f"{label}={number}" for label, number in self._entities.items())
                self._put(asker.place, EntityList(EntityListOp.REPORT, report), now_us, asker.imc_id, asker.entity)
            case _:
                for part in self.parts:
                    if part.receive(message, asker, now_us):
                        return

    def _own_id(self, packet: Packet, source: Place) -> None:
        """Our own announcements come back to us; another system of our id is a mistake that somebody must mend."""
        message = packet.message
        if not isinstance(message, Announce) or self._conflict_told or f"/uid/{self.config.uid}" in message.services:
            return
        self._conflict_told = True
        text = f"another system has our id 0x{self.config.imc_id:04X}: {message.sys_name[:64]} at {source}; give one of them another"
        self._texts.append((_WARNING, text))

    def _note_skew(self, peer: Peer, now_us: int) -> None:
        skew_s = self.skew_s(peer)
        skewed = skew_s is not None and abs(skew_s) > SKEW_S
        if skewed != peer.skew_told:
            peer.skew_told = skewed
            self._texts.append(
                (_WARNING if skewed else _NOTICE, f"{peer.name or hex(peer.imc_id)}: {self._skew_words(skew_s)}")
            )

    def _skew_words(self, skew_s: float | None) -> str:
        if skew_s is None or abs(skew_s) <= SKEW_S:
            return "its clock goes with ours again"
        ahead = "ahead of" if skew_s > 0 else "behind"
        return (
            f"its clock is {abs(skew_s):.0f} s {ahead} ours; it shows our values as that old. Set one of the two clocks"
        )

    def skew_s(self, peer: Peer) -> float | None:
        """How far a system's clock is ahead of our UTC; None while either is not known."""
        ahead_s = peer.clock.ahead_s
        return None if ahead_s is None or self.utc_ahead_us is None else ahead_s - self.utc_ahead_us * 1e-6

    def skews(self) -> list[str]:
        """Consoles whose clock is not ours, in words."""
        found = [(peer, self.skew_s(peer)) for peer in self.peers.consoles()]
        return [
            f"{peer.name or hex(peer.imc_id)}: {self._skew_words(skew_s)}"
            for peer, skew_s in found
            if skew_s is not None and abs(skew_s) > SKEW_S
        ]

    # ---- out ----------------------------------------------------------------------------------------------------

    def take(self, now_us: int) -> list[tuple[Destination, bytes]]:
        """What is to be sent now."""
        for peer in self.peers.prune(now_us):
            if peer.is_console:
                self._texts.append((_NOTICE, f"IMC, {peer.name or hex(peer.imc_id)} is silent"))
        if self._announce_us is None or now_us - self._announce_us >= ANNOUNCE_US:
            self._announce_us = now_us
            self._put(Discovery(), self._announcement(), now_us, ANNOUNCED)
        if self._beat_us is None or now_us - self._beat_us >= HEARTBEAT_US:
            self._beat_us = now_us
            self._to_consoles(Heartbeat(), now_us, ENTITY_SYSTEM)
        self._collect(now_us)
        queue, self._queue = self._queue, []
        return queue

    def drain_texts(self) -> list[tuple[int, str]]:
        """What operators should know: (severity 0...7, text)."""
        texts, self._texts = self._texts[-64:], []
        return texts

    @property
    def entities(self) -> dict[str, int]:
        """Labels and numbers of our entities."""
        return dict(self._entities)

    def _announcement(self) -> Announce:
        config, position = self.config, self.position
        return Announce(
            sys_name=config.name,
            sys_type=config.system_type,
            lat_rad=position.lat_rad,
            lon_rad=position.lon_rad,
            height_m=position.height_m,
            services=services_text(config.uid, self.udp, self.tcp),
        )

    def _collect(self, now_us: int) -> None:
        for part in self.parts:
            for out in part.take(now_us):
                entity = self._entities.get(out.label, ENTITY_SYSTEM) if out.label else ENTITY_SYSTEM
                at_us = now_us - round(out.age_s * 1e6)
                if out.to is None:
                    self._to_consoles(out.message, at_us, entity)
                else:
                    header = self._header(at_us, out.to.imc_id, entity, out.to.entity)
                    self._queue_packet([out.to.place], Packet(header, out.message))

    def _to_consoles(self, message: Message, now_us: int, entity: int) -> None:
        places = dict.fromkeys(place for peer in self.peers.consoles() for place in peer.places())
        self._queue_packet([*places], Packet(self._header(now_us, NOBODY, entity), message))

    def _put(
        self, place: Destination, message: Message, now_us: int, destination: int, entity: int = ENTITY_UNKNOWN
    ) -> None:
        self._queue_packet([place], Packet(self._header(now_us, destination, ENTITY_SYSTEM, entity), message))

    def _header(self, now_us: int, destination: int, entity: int, to_entity: int = ENTITY_UNKNOWN) -> Header:
        return Header(
            source=self.config.imc_id,
            destination=destination,
            utc_s=self.utc_s(now_us),
            source_entity=entity,
            destination_entity=to_entity,
        )

    def utc_s(self, now_us: int) -> float:
        """Our clock; a computer that does not know the time takes a console's, and 1970 before it has heard one."""
        if self.utc_ahead_us is not None:
            return (now_us + self.utc_ahead_us) * 1e-6
        known = [peer.clock.ahead_s for peer in self.peers.consoles() if peer.clock.ahead_s is not None]
        return known[0] + now_us * 1e-6 if known else 0.0

    def _queue_packet(self, places: Sequence[Destination], packet: Packet) -> None:
        if not places:
            return
        try:
            data = encode(packet)
        except ValueError:
            self.unsendable += 1
            return
        self._queue += [(place, data) for place in places]
        del self._queue[:-MAX_QUEUE]
