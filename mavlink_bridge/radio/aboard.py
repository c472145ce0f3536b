"""The vessel's end of the compact link, with the interface of an endpoint: requests out of the air, replies and states
onto it.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

from ..language.messages import Severity
from ..language.requests import (
    Origin,
    PlanKind,
    Reply,
    Request,
    RequestBody,
    Result,
)
from ..language.snapshot import Snapshot
from ..language.stations import ONE_VOICE, Proof
from ..language.units import rad_to_e7
from ..language.witness import Witness
from ..mavlink.commands.table import Context
from ..mavlink.missions.plan_mapping import load_plan
from ..mavlink.missions.plan_rules import PlanError
from ..mavlink.persona import VehiclePort
from .air import Ledger, RadioProfile
from .codec.bits import BitsError
from .codec.brief import brief_plan, encode_standing
from .codec.command import decode_command, is_command
from .codec.frames import RadioFrame
from .codec.old_format import GAP_US, HEARD, TELL, OldEar, OldVoice, counter_in, with_counter
from .codec.plan import PlanCodecError, decode_plan
from .codec.request import OVERRULED, RequestCodecError, decode_request, name_codes
from .codec.state_fields import RadioState
from .codec.wire import BEACON_COMMANDED, BEACON_NAMES_KEY, SAFE_STOPS, VERSION, Kind
from .link import MAX_OUTGOING, CompactLink
from .orders import meaning_of
from .presence import GatewayPresence
from .reporter import CHAT_GAP_US, Reporter
from .session import Pairing, RadioDirection
from .telling import Telling
from .transfer import BRIEF_NUMBERS, WholeMessage

GATEWAY_SENDER: Final = 255
_FOREIGN: Final = "Radio: the gateway speaks format {}, this boat {}: only Hold and Disarm cross; update the older one"
_NAMESAKE: Final = "Radio: another boat has this key and number {}: give each its own system.system_id"
_TWO: Final = "Radio: two gateways speak: without LBT in all modules a stop may be lost: order through one"
"""A start that speaks again after another one was no restart of it."""
_STOPPED: Final = Reply(Result.REJECTED_NOW, "stopped from another gateway: again")
"""Short enough for the air: what is refused once is obeyed when it is ordered again."""
_TAKEN: Final = "Radio: another gateway commands now; the silence of its station holds the boat"


class VesselRadio:
    """The ``compact`` protocol of the radio port."""

    def __init__(
        self,
        profile: RadioProfile,
        key: bytes,
        vehicle: VehiclePort,
        rng: random.Random,
        *,
        nonce: bytes,
        memory: str = "",
        save: Callable[[str], None] | None = None,
        now_us: int = 0,
        system_id: int = 1,
        ledger: Ledger | None = None,
        say: Callable[[Severity, str], None] = lambda severity, text: None,
        witness: Witness | None = None,
    ) -> None:
        """``nonce``: six bytes that no earlier start had. ``say``: for the people aboard. ``witness``: through whom the key is used."""
        self.profile = profile
        self._say = say
        self._address = (system_id, 1)
        self.vehicle = vehicle
        witness = witness or Witness()
        pairing = Pairing(key, system_id, RadioDirection.TO_SHORE, nonce, profile, witness=witness)
        self._ear = OldEar(key, RadioDirection.TO_VESSEL, witness)
        counter = counter_in(memory)
        self._old_voice = None if counter is None else OldVoice(key, RadioDirection.TO_SHORE, counter, witness)
        self._to_old: list[bytes] = []
        keep = save or (lambda text: None)
        self.link = CompactLink(
            profile,
            pairing,
            rng,
            memory=memory,
            save=lambda text: keep(with_counter(text, self._old_voice)),
            now_us=now_us,
            ledger=ledger,
        )
        self.link.standing = self._standing
        self._reporter = Reporter(profile, self.link)
        self.link.voice.shows = self._shows
        self._names = name_codes(_names(vehicle))
        self._snapshot: Snapshot | None = None
        self.asked: list[Request] = []
        """What is asked of the vessel since the last ``requests``, oldest first."""
        self._next_id = 1
        self._asked: dict[int, tuple[int, RequestBody, bytes]] = {}
        """Number, what is asked, and through which start of a gateway."""
        self._presence = GatewayPresence(profile.link)
        self._held: list[tuple[int, bytes, Reply]] = []
        """Answers that wait for the picture of the tick that they belong to."""
        self._stop: tuple[int, bytes, int] | None = None
        """Number and gateway of the last stop, and when it came;"""
        self._overruled: deque[tuple[bytes, RequestBody]] = deque(maxlen=MAX_OUTGOING)
        """what other gateways have ordered since, and was refused."""
        self._shore: bytes | None = None
        self._shore_before: bytes | None = None
        self._telling = Telling(self.link, vehicle, self._home_e7)
        self._warned_us: dict[str, int] = {}
        """When each text was last told."""

    # ---- the interface of an endpoint ---------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes as read. Never raises on input."""
        namesakes = self.link.opener.namesakes
        items = self.link.receive(data, now_us)
        if self.link.opener.namesakes > namesakes:
            self._warn(_NAMESAKE.format(self._address[0]), now_us)
        if self.link.pairing.is_foreign:
            self._warn(_FOREIGN.format(self.link.pairing.version, VERSION), now_us)
        if self.link.pairing.other != self._shore:
            if self.link.pairing.other == self._shore_before and not self.profile.lbt:
                self._warn(_TWO, now_us)
            # a gateway that has just started is told what the vessel keeps without being asked
            self._shore, self._shore_before = self.link.pairing.other, self._shore
            self._telling.forget()
            self._reporter.another()
            self._reporter.met(now_us)
        before = self._ear.hellos
        self._ear.receive(data)
        if self._ear.hellos > before and self._warn(HEARD, now_us) and self._old_voice is not None:
            self._to_old = list(self._old_voice.say(Severity.WARNING, TELL))
        for item in items:
            if isinstance(item, WholeMessage):
                self._on_message(item, now_us)
            else:
                self._on_frame(item, now_us)
        current = self.link.pairing.current
        if current is not None and current.heard_us == now_us:
            self._presence.spoke(current.other, now_us)

    def _warn(self, text: str, now_us: int) -> bool:
        """Tell the people aboard, now and then, why nothing that they expect comes over the radio. Returns whether it was told."""
        if now_us - self._warned_us.get(text, -GAP_US) < GAP_US:
            return False
        self._warned_us[text] = now_us
        self._say(Severity.WARNING, text)
        return True

    def _standing(self, order: bytes | None) -> bytes:
        state = RadioState() if self._snapshot is None else RadioState.of(self._snapshot)
        if order is None:
            return encode_standing(state)
        told = self._reporter.told
        plan = brief_plan(told, order, state) if order and told is not None else None
        self._reporter.answered(state)
        return encode_standing(state) if plan is None else bytes((plan,))

    def _shows(self) -> bytes:
        """What a HELLO brings along: where states go in batches the shore would wait long for the first."""
        if self._snapshot is None or self.profile.link.batch == 1 or self.link.pairing.is_foreign:
            return b""
        return self._reporter.shown(RadioState.of(self._snapshot), self.link.tick_us)

    def requests(self) -> list[Request]:
        requests = self.asked.copy()
        self.asked.clear()
        return requests

    def reply(self, request_id: int, reply: Reply, now_us: int) -> None:
        """Send the vessel's answer back. An unknown id is ignored."""
        found = self._asked.pop(request_id, None)
        if found is None:
            return
        number, body, gateway = found
        if reply.result is Result.ACCEPTED:
            if self._presence.obeyed(gateway, body, now_us):
                self._say(Severity.WARNING, _TAKEN)
            self._telling.shore_knows(body)
            self._reporter.shore_ordered(now_us)
        self._held.append((number, gateway, reply))

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue what is due from this picture of the vessel."""
        self._snapshot, self.link.tick_us = snapshot, now_us
        for number, gateway, reply in self._held:
            self.link.answer(number, reply, now_us, gateway)
        self._held.clear()
        self._reporter.step(now_us, snapshot)
        for outcome in self.link.outcomes():
            self._telling.ended(outcome)
        if self._telling.step(now_us, self._reporter.chat_us):
            self._reporter.chat_us = now_us + CHAT_GAP_US

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return the next frame when the air is free; frames are not cut."""
        frame = self.link.take(now_us)
        if not frame and self._to_old:
            frame = self.link.voice.foreign(self._to_old[0], now_us)
            del self._to_old[: bool(frame)]
        return frame

    def param_changed(self, name: str) -> None:
        """Look again at once at what the shore should be told."""
        self._telling.look_again()

    @property
    def ledger(self) -> Ledger:
        """Airtime of the last hour."""
        return self.link.ledger

    @property
    def bad_frames(self) -> int:
        return self.link.opener.strange_bytes

    @property
    def last_heartbeat_us(self) -> int | None:
        """When a gateway that counts last said that a ground station is there. Without beacons in the profile its silence means nothing."""
        if self.profile.link.beacon_s == 0.0 and self.link.heard_us is not None and self._snapshot is not None:
            return self._snapshot.t_us
        return self._presence.heard_us

    @property
    def heard(self) -> Mapping[tuple[int, int], int]:
        """The gateway that commands speaks for its own commanding station, whoever that is ashore."""
        stamp_us = self.last_heartbeat_us
        return {} if stamp_us is None else {ONE_VOICE: stamp_us}

    @property
    def _gateway(self) -> bytes:
        """The start of a gateway that has just spoken."""
        return self.link.pairing.other or b""

    # ---- what comes ---------------------------------------------------------------------------------------------

    def _on_frame(self, frame: RadioFrame, now_us: int) -> None:
        if frame.kind is not Kind.BEACON or not frame.body:
            return
        self._presence.beacon(self._gateway, now_us, has_station=bool(frame.body[0] & BEACON_COMMANDED))
        if frame.body[0] & BEACON_NAMES_KEY:
            self._reporter.acknowledged(int.from_bytes(frame.body[1:3], "big"))
        elif self.profile.link.batch == 1:
            self._reporter.want_key()
        else:
            self._reporter.met(now_us)

    def _on_message(self, message: WholeMessage, now_us: int) -> None:
        if message.kind is Kind.INFO:
            self.link.answer(message.id, self._telling.wanted(message.payload, now_us), now_us)
            return
        origin, sender = None, GATEWAY_SENDER
        try:
            if message.kind is Kind.SAFE and len(message.payload) > 1:
                sender = message.payload[1]
            if message.kind in (Kind.ORDER, Kind.STOP) and is_command(message.payload):
                origin = decode_command(message.payload, self._address)
            body = self._request_in(message) if origin is None else self._meaning_of(origin)
        except (PlanCodecError, RequestCodecError, BitsError) as error:
            self.link.answer(message.id, Reply(Result.FAILED, str(error)), now_us)
            return
        if isinstance(body, PlanError):
            body = Reply(Result.DENIED, f"item {body.seq}: {body.reason}")
        if not isinstance(body, Reply):
            body = self._overruling(message, body, now_us) or body
        if isinstance(body, Reply):
            self.link.answer(message.id, body, now_us)
            return
        # who orders is there, whatever the beacons said
        self._presence.is_there(self._gateway, now_us)
        self._asked[self._next_id] = (message.id, body, self._gateway)
        sender = sender if origin is None else origin.source[0]
        self.asked.append(Request(self._next_id, body, sender, origin=origin, proof=Proof.RADIO_KEY))
        self._next_id += 1

    def _overruling(self, message: WholeMessage, body: RequestBody, now_us: int) -> Reply | None:
        """The answer to an order that was given before the last stop. Numbers come round again, so only while the sender may still
        repeat it.
        """
        if body.nature.stops:
            self._stop = message.id, self._gateway, now_us
            self._overruled.clear()
        if self._stop is None or not body.nature.yields:
            return None
        number, session, at_us = self._stop
        if now_us - at_us > self.profile.link.command_s * 1e6:
            return None
        if session != self._gateway:
            # when it was given nobody knows; the same that comes again, under another number, was given after it
            is_again = any(each == (self._gateway, body) for each in self._overruled)
            self._overruled.append((self._gateway, body))
            return None if is_again else _STOPPED
        cycle = 256 if max(message.id, number) < BRIEF_NUMBERS else 32
        return OVERRULED if 0 < (number - message.id) % cycle <= MAX_OUTGOING else None

    def _request_in(self, message: WholeMessage) -> RequestBody | PlanError:
        if message.kind is Kind.PLAN:
            kind, items = decode_plan(message.payload, self._near_e7())
            return load_plan(kind, items)
        if message.kind in (Kind.ORDER, Kind.STOP):
            return decode_request(message.payload, self._names.get)
        if message.kind is Kind.SAFE and message.payload[:1] and message.payload[0] in SAFE_STOPS:
            return SAFE_STOPS[message.payload[0]]
        raise RequestCodecError("this version does not know such a message")

    def _meaning_of(self, origin: Origin) -> RequestBody | Reply:
        snapshot = self._snapshot
        context = Context(
            home_item=origin.home_item,
            plan_length=len(self.vehicle.plans.items(PlanKind.MISSION)),
            plan_seq=snapshot.progress.seq if snapshot else 0,
            psi_rad=snapshot.state.psi_rad if snapshot else None,
        )
        return meaning_of(origin, context, self._address)

    def _near_e7(self) -> tuple[int, int] | None:
        state = self._snapshot.state if self._snapshot else None
        if state is None or state.lat_rad is None or state.lon_rad is None:
            return None
        return rad_to_e7(state.lat_rad), rad_to_e7(state.lon_rad)

    def _home_e7(self) -> tuple[int, int] | None:
        snapshot = self._snapshot
        if snapshot is None or snapshot.home_lat_rad is None or snapshot.home_lon_rad is None:
            return None
        return rad_to_e7(snapshot.home_lat_rad), rad_to_e7(snapshot.home_lon_rad)


def _names(vehicle: VehiclePort) -> list[str]:
    infos = (vehicle.params.at(index) for index in range(len(vehicle.params)))
    return [info.name for info in infos if info is not None]
