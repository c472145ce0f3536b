"""One MAVLink conversation: the vessel as one link's ground stations see it. Bytes in, requests out; replies and snapshots in, bytes out.

A list of services, each with one kind of dialogue; this file joins them to one way in and one way out. Protocol answers are made
inside ``receive``, so that a transfer does not wait for ticks; everything that changes the vessel is a Request, answered by
``reply`` at the next tick.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from ...language.messages import Severity
from ...language.requests import Reply, Request, Result
from ...language.snapshot import Snapshot
from ..missions.service import MissionTiming, UploadLocks
from ..persona import EndpointConfig, VehiclePort
from ..services import (
    Brought,
    Channel,
    Keys,
    Library,
    Ordering,
    Parameters,
    Planning,
    Presence,
    Questions,
    Service,
    Steering,
)
from ..services.asking import is_stream
from ..services.service import Handler
from ..services.stations import PeerStation
from ..telemetry.numbering import stations_numbers
from ..telemetry.outbox import MakeOutbox, Outbox
from ..telemetry.speaker import Speaker
from ..telemetry.streams import Composer, Streams
from ..wire.codec import Codec
from ..wire.framing import SIGNATURE_LEN
from ..wire.payload import message_id, packed
from ..wire.signing import POLICIES, Signer, SigningState, Verifier
from .inbound import Counters, Inbound


class Endpoint:
    """The vessel on one channel of one link.

    ``composer``, ``locks`` and ``signing`` are shared by all endpoints of a vessel; ``timing`` is of uploads; ``link_id`` marks this
    link's signatures; ``on_key`` takes a new signing key that a station may set; ``on_station`` is told of each station's first
    heartbeat here (system id, persona); ``make_outbox``: a slow link has its own.
    """

    def __init__(
        self,
        config: EndpointConfig,
        vehicle: VehiclePort,
        *,
        composer: Composer | None = None,
        locks: UploadLocks | None = None,
        timing: MissionTiming | None = None,
        signing: SigningState | None = None,
        link_id: int = 0,
        on_key: Callable[[bytes], None] | None = None,
        on_station: Callable[[int, str], None] | None = None,
        make_outbox: MakeOutbox = Outbox,
    ) -> None:
        self.config = config
        signing = signing or SigningState()
        signs = config.link_class == "signed" and signing.key is not None
        self.codec = Codec(config.system_id, config.component_id, link_id, Signer(signing, link_id) if signs else None)
        self._verifier = Verifier(signing, POLICIES[config.link_class])
        self._inbound = Inbound(config, self._verifier)
        self._outbox = make_outbox(config.limits, self.codec.seal_all, 12 + (SIGNATURE_LEN if signs else 0))
        streams = Streams(config)
        self._speaker = Speaker(config, self._outbox, streams, composer or Composer())
        self._channel = channel = Channel(
            config, vehicle, outbox=self._outbox, speaker=self._speaker, streams=streams, refuse=self._refuse
        )
        self._presence, self._parameters, self._brought = (
            Presence(channel, on_station),
            Parameters(channel),
            Brought(channel),
        )
        ordering = Ordering(channel)
        self._engage(
            (
                ordering,
                Planning(channel, ordering.server, locks=locks, timing=timing),
                self._parameters,
                Library(channel),
                Steering(channel),
                self._brought,
                Keys(channel, signing, on_key),
                Questions(channel),
                self._presence,
            )
        )
        self.heard = self._presence.stations.heard
        """Ground stations heard here, by system and component, each with the time of its newest HEARTBEAT."""
        self.asked = channel.asking.asked
        """What the stations ask of the vessel since the last ``requests``, oldest first."""
        self.has_timers = False
        """Whether a service may have something under way; only what is received or replied can begin it."""
        self._is_summary = config.profile == "high_latency"

    def _engage(self, services: Iterable[Service]) -> None:
        """Enter each service where it has something to do."""
        self._services = tuple(services)
        self._handlers: dict[int, Handler] = {}
        for service in self._services:
            for name, handler in service.handles.items():
                if self._handlers.setdefault(message_id(name), handler) is not handler:
                    raise ValueError(f"{name} has two services")
        self._answered = tuple(each for each in self._services if type(each).reply is not Service.reply)
        self._timed = tuple(each for each in self._services if type(each).poll is not Service.poll)
        self._ticked = tuple(each for each in self._services if type(each).tick is not Service.tick)

    # What the app calls

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes as read. Answers that need no decision of the vessel can be taken at once. Never raises on input."""
        self._channel.now_us = now_us
        self.has_timers = True
        self._hear(data, now_us)

    def _hear(self, data: bytes, now_us: int) -> None:
        for message in self._inbound.receive(data, now_us):
            self._presence.hears(message, now_us)
            handler = self._handlers.get(message.get_msgId())
            if handler is not None:
                self._channel.asking.serve(message)
                handler(message, now_us)
        for text in self._verifier.drain_texts():
            self._speaker.say(Severity.WARNING, text)

    def requests(self) -> list[Request]:
        """Take over ``asked``."""
        return self._channel.asking.take()

    def reply(self, request_id: int, reply: Reply, now_us: int) -> None:
        """Pass on the vessel's answer to a request. An unknown id is ignored."""
        self._channel.now_us = now_us
        self.has_timers = True
        reply = stations_numbers(reply, self.config)
        for service in self._answered:
            if service.reply(request_id, reply, now_us):
                return
        if reply.result is not Result.ACCEPTED and reply.reason:
            self._channel.explain(reply.reason, rarely=is_stream(request_id))

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue what the vessel says by itself at this tick. Not called = no HEARTBEAT."""
        self._channel.now_us = now_us
        for service in self._ticked:
            service.tick(now_us, snapshot)
        if self._is_summary:
            self._speaker.summary(now_us, snapshot, is_on=self._channel.high_latency_on)
        else:
            self._speaker.tick(now_us, snapshot)

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return whole frames to write now, within the budget and ``limit_bytes``; b"" when nothing is due. Serves the timers.

        A single frame that is longer than the limit is handed out alone.
        """
        if self.has_timers:
            self.poll(now_us)
        return self._outbox.take(now_us, limit_bytes) if self._outbox.waits else b""

    def poll(self, now_us: int) -> None:
        """Serve the timers."""
        self._channel.now_us = now_us
        if self._inbound.pending:
            self._hear(b"", now_us)
        for service in self._timed:
            if service.busy:
                service.poll(now_us)
        self.has_timers = self._inbound.pending or any(service.busy for service in self._timed)

    def param_changed(self, name: str) -> None:
        """Tell this link's stations of a parameter that somebody else changed."""
        self._parameters.changed(name)

    def send(self, message: Any) -> None:
        """Send a message of somebody else's making on this link only."""
        self._outbox.answer(packed(message))

    def say(self, severity: int, text: str) -> None:
        """Send a text to this link's stations only."""
        self._speaker.say(severity, text)

    @property
    def counters(self) -> Counters:
        return self._inbound.counters

    @property
    def bad_frames(self) -> int:
        return self._inbound.bad_frames + self._brought.refused

    @property
    def peers(self) -> dict[int, PeerStation]:
        """Stations heard here, by system id."""
        return self._presence.stations.peers

    @property
    def handled(self) -> frozenset[int]:
        """Ids of the messages that a service serves."""
        return frozenset(self._handlers)

    def _refuse(self, request_id: int, reply: Reply) -> None:
        self.reply(request_id, reply, self._channel.now_us)
