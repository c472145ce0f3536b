"""One station's end of a link to one vehicle: bytes in and out, presence, and the jobs that its user starts.

It beats as a ground station only when its user was present since the last beat, so that who stands behind it counts and not this
program: when he falls silent, so does it, and the vehicle's own failsafe acts as if he had been there himself. Without a user
nothing is sent at all but one question at the first meeting.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from ..persona.identity import VENDOR_ID
from ..wire.codec import Codec, decode, dialect
from ..wire.framing import Deframer, DuplicateFilter, Frame
from ..wire.signing import SIGNED, TRUSTED, Signer, SigningState, Verifier
from . import orders
from .exchange import Exchange, Job, JobOutcome
from .texts import Texts
from .vehicle import HeardVehicle, hear

BEAT_US: Final = 950_000
"""A user who beats once a second, with the network's jitter, is passed on beat for beat."""
HEARD_US: Final = 5_000_000
"""Without a HEARTBEAT for so long the vehicle counts as gone."""
WHO_TRIES: Final = 6
WHO_US: Final = 10_000_000
"""A vehicle that does not say who it is, is asked again this often and so many times."""
_GCS: Final = 6
_NO_AUTOPILOT: Final = 8
_AUTOPILOT_VERSION: Final = 148
_QUEUE: Final = 256


@dataclass(frozen=True, slots=True)
class ClientConfig:
    """Who this station is, and what it expects of the link."""

    system_id: int = 254
    """Not 255, which QGroundControl takes."""
    component_id: int = 190
    vehicle_id: int = 0
    """System id of the vehicle; 0 = the first that is heard."""
    answer_s: float = 30.0
    """How long a vehicle may take to answer an order: behind a radio it takes seconds."""
    unsigned: bool = True
    """Whether a vehicle that does not sign is believed, once there is a key."""
    streams_hz: Mapping[str, float] = field(default_factory=dict)
    """Messages that are asked of an autopilot which streams nothing by itself."""


class VehicleClient:
    """The station. ``signing``: the key that vehicle and station share; None = unsigned."""

    def __init__(
        self, config: ClientConfig | None = None, signing: SigningState | None = None, *, link_id: int = 0
    ) -> None:
        self.config = config or ClientConfig()
        self.vehicle: HeardVehicle | None = None
        self.texts_heard = Texts()
        self.now_us = 0
        """Of the newest call."""
        signer = Signer(signing, link_id) if signing is not None and signing.key is not None else None
        self._codec = Codec(self.config.system_id, self.config.component_id, link_id, signer)
        policy = TRUSTED if self.config.unsigned or signer is None else SIGNED
        self._verifier = Verifier(signing or SigningState(), policy)
        self._deframer = Deframer()
        self._copies = DuplicateFilter()
        self._exchange = Exchange()
        self._queue: list[Any] = []
        self._out = bytearray()
        self._heard_us: int | None = None
        self._beat_us: int | None = None
        self._is_present = False
        self._asked_often = 0
        self._ask_us = 0
        self._has_asked_streams = False

    # ---- bytes --------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> list[Any]:
        """Return the vehicle's messages in ``data`` that may be believed, oldest first."""
        self.now_us = now_us
        messages = []
        for frame in self._deframer.receive(data, now_us):
            message = self._believe(frame, now_us)
            if message is not None:
                self._take_in(message, now_us)
                messages.append(message)
        return messages

    def take(self, now_us: int, limit: int = 1 << 16) -> bytes:
        """Return at most ``limit`` bytes to send, serving the timers."""
        self.now_us = now_us
        self._serve(now_us)
        messages, self._queue = self._queue, []
        for message in messages:
            self._out += self._codec.encode(message)
        data = bytes(self._out[:limit])
        del self._out[:limit]
        return data

    def heard_us(self) -> int | None:
        """When the vehicle's newest HEARTBEAT came."""
        return self._heard_us

    def is_heard(self, now_us: int) -> bool:
        return self._heard_us is not None and now_us - self._heard_us < HEARD_US

    def drain_texts(self) -> list[tuple[int, str]]:
        """(MAV_SEVERITY, text) of the vehicle since the last call."""
        return self.texts_heard.drain_texts()

    # ---- what its user does -------------------------------------------------------------------------------------

    def present(self) -> None:
        """The user was just heard: one beat is his."""
        self._is_present = True

    def start(self, job: Job, done: Callable[[JobOutcome], None], now_us: int) -> None:
        """Begin a job of this room's; ``done`` gets what became of it."""
        self._exchange.start(job, done, now_us)

    def give_up(self, reason: str, job: Job | None = None) -> None:
        """End a job that runs, or all of them: they have failed for this reason."""
        self._exchange.drop(reason, job)

    def send(self, message: Any) -> None:
        """Send a message that nobody answers, sticks for one. Dropped when nothing has been taken for long."""
        if len(self._queue) < _QUEUE:
            self._queue.append(message)

    # ---- inside -------------------------------------------------------------------------------------------------

    def _believe(self, frame: Frame, now_us: int) -> Any | None:
        if self._copies.is_copy(frame, now_us) or not self._verifier.check(frame, now_us).ok:
            return None
        self._copies.remember(frame, now_us)
        message = decode(frame)
        if message is None or not self._is_vehicles(message) or not self._is_for_us(message):
            return None
        return message

    def _is_vehicles(self, message: Any) -> bool:
        system, component = message.get_srcSystem(), message.get_srcComponent()
        if self.vehicle is not None:
            return (system, component) == (self.vehicle.system, self.vehicle.component)
        if message.get_type() != "HEARTBEAT" or message.type == _GCS or message.autopilot == _NO_AUTOPILOT:
            return False
        return self.config.vehicle_id in (0, system)

    def _is_for_us(self, message: Any) -> bool:
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self.config.system_id) and component in (0, self.config.component_id)

    def _take_in(self, message: Any, now_us: int) -> None:
        if self.vehicle is None:
            self.vehicle = HeardVehicle(message.get_srcSystem(), message.get_srcComponent(), message.autopilot)
        self.vehicle = hear(self.vehicle, message)
        match message.get_type():
            case "HEARTBEAT":
                self._heard_us = now_us
            case "STATUSTEXT":
                self.texts_heard.hear(message)
        self._exchange.hear(message, now_us)

    def _serve(self, now_us: int) -> None:
        if self._is_present and (self._beat_us is None or now_us - self._beat_us >= BEAT_US):
            self._beat_us, self._is_present = now_us, False
            self._queue.insert(0, orders.heartbeat())
        if self.vehicle is not None:
            self._meet(self.vehicle, now_us)
        self._queue += self._exchange.poll(now_us)

    def _meet(self, vehicle: HeardVehicle, now_us: int) -> None:
        """Ask a new vehicle who it is, and one that streams nothing by itself for what is needed."""
        if vehicle.vendor is None and self._asked_often < WHO_TRIES and now_us >= self._ask_us:
            self._asked_often += 1
            self._ask_us = now_us + WHO_US
            self._ask(orders.request_message(vehicle, _AUTOPILOT_VERSION, texts=self.texts_heard, answer_s=3.0), now_us)
        foreign = vehicle.vendor is not None and vehicle.vendor != VENDOR_ID
        if foreign and self._beat_us is not None and not self._has_asked_streams:
            self._has_asked_streams = True
            for name, rate_hz in self.config.streams_hz.items():
                number = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
                self._ask(orders.set_interval(vehicle, number, rate_hz, texts=self.texts_heard, answer_s=3.0), now_us)

    def _ask(self, job: Job, now_us: int) -> None:
        self._exchange.start(job, lambda outcome: None, now_us)
