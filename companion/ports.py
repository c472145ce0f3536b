"""What hangs on each link: a port turns a link's bytes into measurements, actuator lines or requests, and back.

Ports do no I/O of their own; they ask their link. Ground ports keep one endpoint per channel and hold back what a slow
peer has not taken, within bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

from mavlink_bridge.language.messages import ActuatorOutput, Measurement
from mavlink_bridge.language.requests import Reply, Request
from mavlink_bridge.language.snapshot import LinkHealth, Snapshot
from mavlink_bridge.language.stations import ONE_VOICE, Heard, Station
from mavlink_bridge.mavlink.endpoint.doorstep import Doorstep

from .core.ais.receiver import AisWord, ReceivedReport as AisReport
from .core.board import Arduino, BoardPhase
from .core.nmea import NmeaReader
from .io.links import Closed, Link, LinkEvent, Opened, Received
from .io.links.link import GuardedLink, Listening

MTU_BYTES = 1200
"""Largest datagram that no common network splits."""


class Port(Protocol):
    """What the app does with every link."""

    link: Link

    def read(self, now_us: int) -> None: ...
    def health(self, now_us: int) -> LinkHealth: ...


class _Counted:
    """A link with its traffic counted."""

    def __init__(self, link: Link, kind: str) -> None:
        self.link = link
        self.name = link.name
        self.kind = kind
        self.bytes_in = 0
        self.bytes_out = 0
        self.open_channels: dict[int, str] = {}
        self.last_rx_us: int | None = None

    def events(self, now_us: int) -> list[LinkEvent]:
        events = self.link.poll(now_us)
        if not events:
            return events
        for event in events:
            if isinstance(event, Received):
                self.bytes_in += len(event.data)
                self.last_rx_us = now_us
            elif isinstance(event, Opened):
                self.open_channels[event.channel] = event.peer
            else:
                self.open_channels.pop(event.channel, None)
        return events

    def send(self, channel: int, data: bytes) -> int:
        accepted = self.link.write(channel, data)
        self.bytes_out += accepted
        return accepted

    def summary(self, now_us: int, bad_frames: int, text: str) -> LinkHealth:
        age_s = None if self.last_rx_us is None else (now_us - self.last_rx_us) * 1e-6
        peers = len(self.open_channels)
        return LinkHealth(
            name=self.name,
            kind=self.kind,
            is_open=peers > 0,
            is_listening=not isinstance(self.link, Listening) or self.link.is_listening,
            peers=peers,
            bytes_in=self.bytes_in,
            bytes_out=self.bytes_out,
            bad_frames=bad_frames,
            last_rx_age_s=age_s,
            text=text,
        )


class NmeaPort(_Counted):
    """A sensor link."""

    def __init__(self, link: Link, reader: NmeaReader) -> None:
        super().__init__(link, "nmea")
        self.reader = reader
        self.measurements: list[Measurement] = []
        self.brings_ais = False
        """Whether AIS has come over this link."""
        self._ais_bytes = 0

    def read(self, now_us: int) -> None:
        reader, found = self.reader, self.measurements
        for event in self.events(now_us):
            if isinstance(event, Received):
                found += reader.receive(event.data, now_us)
            elif isinstance(event, Closed) and not self.open_channels:
                reader.closed(event.reason, now_us)
        found += reader.poll(now_us)

    def take(self) -> list[Measurement]:
        taken, self.measurements = self.measurements, []
        return taken

    def take_ais(self) -> list[AisReport | AisWord]:
        found = self.reader.ais_found
        if not found:
            return found
        self.brings_ais = True
        return self.reader.take_ais()

    def ais_alive(self) -> bool:
        """Whether this link carries AIS and has brought anything since the last call."""
        before, self._ais_bytes = self._ais_bytes, self.bytes_in
        return self.brings_ais and before != self.bytes_in

    def health(self, now_us: int) -> LinkHealth:
        return self.summary(now_us, self.reader.damaged, self.link.describe())


class PlotterPort(_Counted):
    """The vessel's NMEA sent on, for a plotter on board. Nothing is read from it."""

    def __init__(self, link: Link) -> None:
        super().__init__(link, "plotter")

    def read(self, now_us: int) -> None:
        self.events(now_us)

    def send_on(self, sentences: bytes) -> None:
        """Send whole sentences to every peer, as many per write as a datagram holds; what a peer does not take is lost."""
        lines = sentences.splitlines(keepends=True)
        while lines:
            piece = b""
            while lines and len(piece) + len(lines[0]) <= MTU_BYTES:
                piece += lines.pop(0)
            for channel in self.open_channels:
                self.send(channel, piece)

    def health(self, now_us: int) -> LinkHealth:
        return self.summary(now_us, 0, self.link.describe())


class ArduinoPort(_Counted):
    """The link to the actuator board."""

    def __init__(self, link: Link, board: Arduino) -> None:
        super().__init__(link, "actuators")
        self.board = board

    def read(self, now_us: int) -> None:
        for event in self.events(now_us):
            if isinstance(event, Received):
                self.board.receive(event.data, now_us)
            elif isinstance(event, Opened):
                self.board.opened(now_us)
            else:
                self.board.closed(now_us)

    @property
    def is_away(self) -> bool:
        """Whether nobody can be spoken to: the port is closed, or the board has not woken since it opened."""
        told = self.board.status
        return not told.connected or told.state == BoardPhase.STARTING.value

    def write(self, output: ActuatorOutput, now_us: int) -> bool:
        """Send this tick's frame; True when the board's port took all of it."""
        data = self.board.encode(output, now_us)
        if not data:
            return False
        accepted = self.send(0, data)
        self.board.note_written(accepted, len(data), now_us)
        return accepted == len(data)

    def health(self, now_us: int) -> LinkHealth:
        return self.summary(now_us, self.board.damaged, self.link.describe())


class Conversation(Protocol):
    """One ground station's side of a protocol: a MAVLink endpoint, the seed's JSON or the compact radio link."""

    asked: list[Request]
    """What ``requests`` is going to return; a look at it costs less."""

    def receive(self, data: bytes, now_us: int) -> None: ...
    def requests(self) -> list[Request]: ...
    def reply(self, request_id: int, reply: Reply, now_us: int) -> None: ...
    def tick(self, now_us: int, snapshot: Snapshot) -> None: ...
    def take(self, now_us: int, limit_bytes: int) -> bytes: ...
    def param_changed(self, name: str) -> None: ...
    @property
    def bad_frames(self) -> int: ...
    @property
    def heard(self) -> Mapping[tuple[int, int], int]: ...


class GroundPort(_Counted):
    """A link to ground stations: one conversation for each channel.

    ``doorstep`` (a signed link's) receives who comes; his conversation begins when he has proved that he may have one.
    """

    def __init__(
        self,
        link: Link,
        kind: str,
        converse: Callable[[int, str], Conversation],
        doorstep: Callable[[str, bool], Doorstep] | None = None,
    ) -> None:
        super().__init__(link, kind)
        self._doorstep = doorstep
        self.strangers: dict[int, Doorstep] = {}
        if doorstep is not None and isinstance(link, GuardedLink):
            link.guard()
        self.conversations: dict[int, Conversation] = {}
        self.talks: tuple[tuple[int, Conversation], ...] = ()
        """The same, to go through at each tick."""
        self._converse = converse
        self._backlog: dict[int, bytes] = {}
        self.dropped_bytes = 0

    def read(self, now_us: int) -> None:
        events = self.events(now_us)
        if not events:
            return
        for event in events:
            if isinstance(event, Opened):
                self._opened(event)
            elif isinstance(event, Closed):
                self.conversations.pop(event.channel, None)
                self.strangers.pop(event.channel, None)
                self._backlog.pop(event.channel, None)
            elif event.channel in self.conversations:
                self.conversations[event.channel].receive(event.data, now_us)
            elif event.channel in self.strangers:
                self._knock(event, now_us)
        self.talks = tuple(self.conversations.items())

    def _opened(self, event: Opened) -> None:
        if self._doorstep is None:
            self.conversations[event.channel] = self._converse(event.channel, event.peer)
            return
        self._welcome(event.channel, event.peer)

    def _welcome(self, channel: int, peer: str) -> None:
        if self._doorstep is not None:
            # a datagram's sender may be anybody; channel 0 is the peer that the owner wrote down
            self.strangers[channel] = self._doorstep(peer, channel == 0 or not self.link.datagrams)

    def _knock(self, event: Received, now_us: int) -> None:
        """Hear a stranger; with a right signature he is none any more."""
        proof = self.strangers[event.channel].receive(event.data, now_us)
        if proof:
            del self.strangers[event.channel]
            talk = self._converse(event.channel, self.open_channels.get(event.channel, ""))
            self.conversations[event.channel] = talk
            if isinstance(self.link, GuardedLink):
                self.link.trust(event.channel)
            talk.receive(proof, now_us)

    def begin_anew(self) -> None:
        """Receive everybody at the doorstep again: what proved him before counts no more."""
        if self._doorstep is None:
            return
        for channel in self.conversations:
            self._welcome(channel, self.open_channels.get(channel, ""))
        self.conversations, self.talks = {}, ()
        self._backlog.clear()

    def requests(self) -> list[tuple[Conversation, Request]]:
        """What all ask, each with who asks."""
        return [item for channel, talk in self.talks for item in self.requests_of(channel, talk)]

    def requests_of(self, channel: int, talk: Conversation) -> list[tuple[Conversation, Request]]:
        return [
            (talk, replace(request, station=self._station(channel, talk, request.sender, request.component)))
            for request in talk.requests()
        ]

    def heard(self) -> list[Heard]:
        """Every ground station heard on this link."""
        return [
            Heard(self._station(channel, talk, *who), t_us)
            for channel, talk in self.talks
            for who, t_us in talk.heard.items()
        ]

    def _station(self, channel: int, talk: Conversation, system: int, component: int) -> Station:
        if ONE_VOICE in talk.heard:
            system, component = ONE_VOICE
        host = self.open_channels.get(channel, "").rpartition(":")[0]
        return Station(system, component, self.name, host, self.kind == "radio")

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Let every conversation speak of this tick."""
        for _, talk in self.talks:
            talk.tick(now_us, snapshot)
        for channel, stranger in self.strangers.items():
            stranger.tick(now_us, snapshot)
            if due := stranger.take():
                self.send(channel, due)

    def tell(self, now_us: int, snapshot: Snapshot) -> None:
        """Let every conversation speak of this tick, and send what is due."""
        self.tick(now_us, snapshot)
        self.flush(now_us)

    def flush(self, now_us: int) -> None:
        """Send what is due. A stream peer that takes only part gets the rest first next time; a datagram is all or nothing."""
        for channel, talk in self.talks:
            waiting = b""
            if self._backlog and (waiting := self._backlog.pop(channel, b"")):
                waiting = waiting[self.send(channel, waiting) :]
            while not waiting and (data := talk.take(now_us, MTU_BYTES)):
                accepted = self.send(channel, data)
                if accepted < len(data) and self.link.datagrams:
                    self.dropped_bytes += len(data)
                    break
                waiting = data[accepted:]
            if waiting:
                self._backlog[channel] = waiting

    def health(self, now_us: int) -> LinkHealth:
        bad = sum([talk.bad_frames for _, talk in self.talks])
        return self.summary(now_us, bad, self.link.describe())
