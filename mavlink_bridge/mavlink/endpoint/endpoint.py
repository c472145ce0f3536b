"""One MAVLink conversation: the vessel as one link's ground stations see it. Bytes in, requests out; replies and snapshots in, bytes out.

Services are separate files; this one joins them. Protocol answers are made inside ``receive``, so that a transfer does
not wait for ticks; everything that changes the vessel is a Request, answered by ``reply`` at the next tick.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final

from ...language import requests as ask
from ...language.messages import Severity
from ...language.requests import Origin, PlanKind, Reply, Request, RequestBody, Result
from ...language.snapshot import Snapshot
from ..commands.command import Command, Refused
from ..commands.local import LOCAL, answer
from ..commands.service import CommandServer, Outcome
from ..commands.table import Context, canonical_seq
from ..files import metadata
from ..files.ftp import FileServer
from ..files.logs import LogServer
from ..files.params import EndpointParams, ParamServer
from ..files.stub_params import COMMON_STUBS, ROVER_STUBS
from ..missions.service import MissionServer, MissionTiming, UploadLocks
from ..persona import EndpointConfig, VehiclePort
from ..persona.modes import foreign_name, from_custom_mode
from ..telemetry.numbering import stations_numbers
from ..telemetry.outbox import MakeOutbox, Outbox
from ..telemetry.speaker import Speaker
from ..telemetry.streams import Composer, Streams
from ..wire.codec import Codec
from ..wire.framing import SIGNATURE_LEN
from ..wire.payload import Packed, message_id, packed
from ..wire.signing import POLICIES, Signer, SigningState, Verifier, setup_refusal
from . import foreign, rtcm, timesync
from .asking import FULL, Asking, is_stream
from .greeter import Greeter
from .guided import attitude_target, local_target, position_target
from .inbound import Counters, Inbound
from .manual import RcOverride, manual_control
from .sensor_input import distance
from .stations import Peer, Stations

_MISSION_CURRENT: Final = message_id("MISSION_CURRENT")


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
        self.vehicle = vehicle
        self._signing = signing or SigningState()
        signs = config.link_class == "signed" and self._signing.key is not None
        self.codec = Codec(
            config.system_id, config.component_id, link_id, Signer(self._signing, link_id) if signs else None
        )
        self._verifier = Verifier(self._signing, POLICIES[config.link_class])
        self._on_key = on_key
        self._inbound = Inbound(config, self._verifier)
        self._outbox = make_outbox(config.limits, self.codec.seal_all, 12 + (SIGNATURE_LEN if signs else 0))
        self.streams = Streams(config)
        self._speaker = Speaker(config, self._outbox, self.streams, composer or Composer())
        self._commands = CommandServer(config.give_up_s)
        stubs = ROVER_STUBS if config.persona == "ardurover" else COMMON_STUBS
        self._table = EndpointParams(vehicle.params, stubs)
        self._params = ParamServer(self._table, self._explain)
        self._files = FileServer(metadata.files(self._table))
        shelf = vehicle.logs if config.profile == "lan" else None
        self._logs = LogServer(shelf, 1 if config.has_home_item else 0, self._explain)
        self._missions = MissionServer(
            vehicle.plans,
            home_item=config.has_home_item,
            system_id=config.system_id,
            component_id=config.component_id,
            locks=locks,
            timing=timing,
        )
        self._rtcm, self._rc = rtcm.RtcmAssembler(self._explain), RcOverride()
        self.high_latency_on = False
        self._greeter = Greeter(config, lambda: vehicle.identity, self._speaker.say, on_station)
        self._stations = Stations(config.system_id, self._greeter.welcome, self._explain)
        self.heard = self._stations.heard
        """Ground stations heard here, by system and component, each with the time of its newest HEARTBEAT."""
        self._asking = Asking()
        self.asked = self._asking.asked
        """What the stations ask of the vessel since the last ``requests``, oldest first."""
        self._plan_handles: dict[int, tuple[int, PlanKind]] = {}
        self._wants_current: set[int] = set()
        self._now_us = 0
        # on a slow link a plan's dialogue must not queue behind texts and values: the station's timers run
        self._is_slow, self._is_summary = config.profile == "lora", config.profile == "high_latency"
        self.has_timers = False
        """Whether a service may have something under way; only what is received or replied can begin it."""
        self._handlers = self._make_handlers()

    def _make_handlers(self) -> dict[int, Callable[[Any, int], None]]:
        handlers: dict[int, Callable[[Any, int], None]] = {
            message_id(name): self._on_mission for name in self._missions.handles
        }
        handlers |= {message_id(name): self._on_log for name in self._logs.handles}
        handlers |= foreign.handlers(lambda why: self._speaker.explain(why, self._now_us, rarely=True))
        named: dict[str, Callable[[Any, int], None]] = {
            "HEARTBEAT": self._on_heartbeat,
            "COMMAND_LONG": self._on_command,
            "COMMAND_INT": self._on_command,
            "SET_MODE": self._on_set_mode,
            "MISSION_SET_CURRENT": self._on_set_current,
            "PARAM_REQUEST_LIST": self._on_param_list,
            "PARAM_REQUEST_READ": lambda message, now_us: self._answer(self._params.request_read(message)),
            "PARAM_SET": self._on_param_set,
            "REQUEST_DATA_STREAM": self._on_data_stream,
            "FILE_TRANSFER_PROTOCOL": self._on_file_transfer,
            "PING": lambda message, now_us: self._answer(timesync.ping(message)),
            "TIMESYNC": lambda message, now_us: self._answer(timesync.timesync(message, now_us)),
            "MANUAL_CONTROL": lambda message, now_us: self._steer(message, manual_control(message)),
            "RC_CHANNELS_OVERRIDE": lambda message, now_us: self._steer(message, self._rc.take(message, now_us)),
            "SET_POSITION_TARGET_GLOBAL_INT": lambda message, now_us: self._steer(message, position_target(message)),
            "SET_POSITION_TARGET_LOCAL_NED": lambda message, now_us: self._steer(message, local_target(message)),
            "SET_ATTITUDE_TARGET": lambda message, now_us: self._steer(message, attitude_target(message)),
            "DISTANCE_SENSOR": self._on_distance,
            "SETUP_SIGNING": self._on_setup_signing,
            "GPS_RTCM_DATA": lambda message, now_us: self._steer(message, self._rtcm.receive(message)),
        }
        return handlers | {message_id(name): handler for name, handler in named.items()}

    # What the app calls

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes as read. Answers that need no decision of the vessel can be taken at once. Never raises on input."""
        self._now_us = now_us
        self.has_timers = True
        for message in self._inbound.receive(data, now_us):
            self._greeter.hears(message, now_us)
            handler = self._handlers.get(message.get_msgId())
            if handler is not None:
                self._asking.serve(message)
                handler(message, now_us)
        for text in self._verifier.texts():
            self._speaker.say(Severity.WARNING, text)

    def requests(self) -> list[Request]:
        """Take over ``asked``."""
        return self._asking.take()

    def reply(self, request_id: int, reply: Reply, now_us: int) -> None:
        """Pass on the vessel's answer to a request. An unknown id is ignored."""
        self._now_us = now_us
        self.has_timers = True
        reply = stations_numbers(reply, self.config)
        outcome = self._commands.reply(request_id, reply, now_us)
        if outcome is not None:
            self._finish(outcome)
            return
        if request_id in self._plan_handles:
            handle, kind = self._plan_handles.pop(request_id)
            self._answer(self._missions.finish(handle, reply, self.vehicle.plans.plan_id(kind), now_us), urgent=True)
            self._after_missions()
            return
        self._answer(self._params.reply(request_id, reply))
        if request_id in self._wants_current:
            self._wants_current.discard(request_id)
            self._speaker.wanted.add(_MISSION_CURRENT)
        if reply.result is not Result.ACCEPTED and reply.reason:
            self._speaker.explain(reply.reason, now_us, rarely=is_stream(request_id))

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue what the vessel says by itself at this tick. Not called = no HEARTBEAT."""
        self._now_us = now_us
        self._commands.see(snapshot.mode, snapshot.armed, now_us)
        if self._is_summary:
            self._speaker.summary(now_us, snapshot, is_on=self.high_latency_on)
            return
        if self._is_slow:
            self._speaker.is_quiet = self._missions.busy
        self._greeter.tick(now_us, snapshot)
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
        self._now_us = now_us
        if self._commands.waiting:
            self._answer(self._commands.poll(now_us), urgent=True)
        if self._missions.busy:
            self._answer(self._missions.poll(now_us), urgent=self._is_slow)
            self._after_missions()
        if self._logs.busy:
            self._outbox.bulk(self._logs.next)
        self.has_timers = bool(self._commands.waiting) or self._missions.busy or self._logs.busy

    def param_changed(self, name: str) -> None:
        """Tell this link's stations of a parameter that somebody else changed."""
        self._answer(self._params.changed(name))

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
        return self._inbound.bad_frames + self._rtcm.refused

    @property
    def peers(self) -> dict[int, Peer]:
        """Stations heard here, by system id."""
        return self._stations.peers

    # What the services use

    def compose(self, number: int) -> Packed | None:
        """The message of this id from the newest snapshot."""
        return self._speaker.compose(number)

    def component_metadata(self) -> Any:
        """COMPONENT_METADATA with the CRC of what FTP serves here; None on a slow link, which must not carry files."""
        return None if self._is_slow else metadata.component_metadata(self._table, self._now_us)

    def _answer(self, messages: list[Any], urgent: bool = False) -> None:
        for message in messages:
            if urgent:
                self._outbox.urgent(packed(message))
            else:
                self._outbox.answer(packed(message))

    def _ask(
        self, body: RequestBody, sender: int, note: Callable[[int], object] | None = None, origin: Origin | None = None
    ) -> None:
        """Ask the vessel. ``note`` is told the number of the request, under which the answer comes."""
        request_id = self._asking.number()
        if note is not None:
            note(request_id)
        if not self._asking.order(request_id, body, sender, origin):
            self.reply(request_id, FULL, self._now_us)

    def _explain(self, reason: str) -> None:
        self._speaker.explain(reason, self._now_us)

    def _finish(self, outcome: Outcome) -> None:
        self._answer(outcome.messages, urgent=True)
        if outcome.reason:
            self._explain(outcome.reason)

    # Messages

    def _on_heartbeat(self, message: Any, now_us: int) -> None:
        self._stations.heartbeat(message, now_us)

    def _context(self) -> Context:
        snapshot = self._speaker.snapshot
        return Context(
            home_item=self.config.has_home_item,
            plan_length=len(self.vehicle.plans.items(PlanKind.MISSION)),
            plan_seq=snapshot.progress.seq if snapshot else 0,
            psi_rad=snapshot.state.psi_rad if snapshot else None,
        )

    def _on_command(self, message: Any, now_us: int) -> None:
        command, sequence = Command.from_message(message), message.get_seq()
        confirmation = getattr(message, "confirmation", 0)
        again = self._commands.recall(command, sequence, now_us, confirmation=confirmation)
        if again is not None:
            self._finish(again)
            if command.id not in LOCAL:
                return
        if command.id in LOCAL:
            self._local(command, sequence, now_us, is_copy=again is not None)
        else:
            outcome = self._commands.take_up(command, sequence, self._context(), now_us)
            self._finish(outcome)
            if outcome.body is not None:
                origin = Origin(message.get_msgId(), message.get_payload(), command.sender, self.config.has_home_item)
                self._ask(outcome.body, command.sender[0], partial(self._commands.asked, outcome.case), origin)

    def _local(self, command: Command, sequence: int, now_us: int, *, is_copy: bool) -> None:
        """Commands without effect on the vessel may run again for a copy, whose first answer was lost."""
        done = answer(self, command)
        if not is_copy:
            self._answer(self._commands.settle(command, sequence, done.result, now_us), urgent=True)
            if done.reason:
                self._explain(done.reason)
        for message in done.messages:
            self._outbox.answer(message)

    def _on_set_mode(self, message: Any, now_us: int) -> None:
        mode = from_custom_mode(message.custom_mode) if message.base_mode & 1 else None
        if mode is None:
            self._explain(f"{foreign_name(message.custom_mode, 0.0)} is not one of this boat's modes")
        else:
            self._ask(ask.SetMode(mode), message.get_srcSystem())

    def _on_set_current(self, message: Any, now_us: int) -> None:
        try:
            seq = canonical_seq(message.seq, self._context())
        except Refused as refusal:
            self._explain(str(refusal))
            return
        self._ask(ask.SetCurrent(seq), message.get_srcSystem(), self._wants_current.add)

    def _on_param_set(self, message: Any, now_us: int) -> None:
        messages, body = self._params.set(message)
        self._answer(messages)
        if body is not None:
            self._ask(body, message.get_srcSystem(), lambda number: self._params.asked(number, message))

    def _on_param_list(self, message: Any, now_us: int) -> None:
        self._params.request_list()
        self._outbox.bulk(self._params.next)

    def _on_file_transfer(self, message: Any, now_us: int) -> None:
        self._answer(self._files.handle(message))
        self._outbox.bulk(self._files.next)

    def _on_log(self, message: Any, now_us: int) -> None:
        snapshot = self._speaker.snapshot
        self._logs.handle(message, now_us, armed=snapshot is None or snapshot.armed)

    def _on_data_stream(self, message: Any, now_us: int) -> None:
        if self.config.profile == "lan":
            self.streams.set_group(message.req_stream_id, message.req_message_rate, message.start_stop == 1)

    def _steer(self, message: Any, body: RequestBody | None) -> None:
        """Set-points and data streams: nobody waits for an answer."""
        if body is not None:
            self._asking.stream(body, message.get_srcSystem())

    def _on_distance(self, message: Any, now_us: int) -> None:
        if message.get_srcSystem() == self.config.system_id:
            self._steer(message, distance(message))

    def _on_setup_signing(self, message: Any, now_us: int) -> None:
        snapshot = self._speaker.snapshot
        refusal = setup_refusal(
            self._signing,
            message.verdict,
            key=bytes(message.secret_key),
            version=1 if message.get_msgbuf()[:1] == b"\xfe" else 2,
            armed=snapshot is None or snapshot.armed,
            radio=self.config.profile != "lan",
        )
        if refusal or self._on_key is None:
            self._explain(refusal or "keys are set on the vessel, not over MAVLink")
        else:
            self._on_key(bytes(message.secret_key))

    def _on_mission(self, message: Any, now_us: int) -> None:
        self._answer(self._missions.handle(message, now_us), urgent=self._is_slow)
        self._after_missions()

    def _after_missions(self) -> None:
        """Pass on what a mission message led to: a whole plan, a go-to, texts."""
        for handle, load in self._missions.loads():
            self._hand_over(handle, load, load.kind, 0)
        for handle, target, sender in self._missions.targets():
            self._hand_over(handle, target, PlanKind.MISSION, sender)
        for severity, text in self._missions.texts():
            if text:
                self._speaker.say(severity, text)

    def _hand_over(self, handle: int, body: RequestBody, kind: PlanKind, sender: int) -> None:
        def note(number: int) -> None:
            self._plan_handles[number] = handle, kind

        self._ask(body, sender, note)
