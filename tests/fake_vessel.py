"""A stand-in for the vessel behind endpoints: holds state, obeys requests at the next tick, and lets tests look at the wire."""

from __future__ import annotations

import dataclasses
import zlib
from dataclasses import dataclass, field
from typing import Any

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.deeds import Deeds
from mavlink_bridge.language.messages import (
    ActuatorOutput,
    ActuatorStatus,
    Distance,
    EstimatedState,
    FixType,
    GpsFix,
    LogText,
    Mode,
    PlanState,
    Severity,
    SupplyVoltage,
)
from mavlink_bridge.language.requests import ACCEPTED, PlanItem, PlanKind, Reply, Request, Result
from mavlink_bridge.language.snapshot import Health, Progress, Snapshot
from mavlink_bridge.mavlink.endpoint.endpoint import Endpoint
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.persona.port import Identity, LogShelf, ParamInfo
from mavlink_bridge.mavlink.telemetry.streams import Composer
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer

TICK_US = 50_000
LAT_RAD, LON_RAD = 0.7188, -0.1518


class FakeParams:
    """A table of parameters in memory."""

    def __init__(self, infos: list[ParamInfo]) -> None:
        self.infos = infos

    def __len__(self) -> int:
        return len(self.infos)

    def get(self, name: str) -> ParamInfo | None:
        return next((info for info in self.infos if info.name == name), None)

    def index(self, name: str) -> int | None:
        return next((number for number, info in enumerate(self.infos) if info.name == name), None)

    def at(self, index: int) -> ParamInfo | None:
        return self.infos[index] if 0 <= index < len(self.infos) else None

    def set(self, name: str, value: float) -> None:
        number = self.index(name)
        assert number is not None
        self.infos[number] = dataclasses.replace(self.infos[number], value=value)


class FakePlans:
    """Plans in memory."""

    def __init__(self) -> None:
        self.stored: dict[PlanKind, tuple[PlanItem, ...]] = dict.fromkeys(PlanKind, ())
        self.home: tuple[float, float] | None = (LAT_RAD, LON_RAD)

    def items(self, kind: PlanKind) -> tuple[PlanItem, ...]:
        return self.stored[kind]

    def plan_id(self, kind: PlanKind) -> int:
        items = self.stored[kind]
        return zlib.crc32(repr(items).encode()) or 1 if items else 0


def many_params(count: int = 100) -> list[ParamInfo]:
    return [
        ParamInfo(f"TEST_{number:03}", float(number), -1e10, 1e10, "m", f"Test {number}", default=0.0)
        for number in range(count - 1)
    ] + [ParamInfo("READ_ONLY", 7.0, read_only=True, text="May not be set")]


@dataclass
class FakeVessel:
    """State that a test sets directly, or that requests change at the next tick."""

    params: FakeParams = field(default_factory=lambda: FakeParams(many_params()))
    plans: FakePlans = field(default_factory=FakePlans)
    identity: Identity = field(default_factory=lambda: Identity(uid=0x1234, version=(0, 1, 0), git_hash="0123456789ab"))
    deeds: Deeds = field(default_factory=Deeds)
    logs: LogShelf | None = None
    now_us: int = 1_000_000
    mode: Mode = Mode.HOLD
    armed: bool = False
    handled: list[Request] = field(default_factory=list)
    refuse: dict[type, Reply] = field(default_factory=dict)
    answers: bool = True
    texts: list[tuple[Severity, str]] = field(default_factory=list)
    changes: dict[str, Any] = field(default_factory=dict)
    """Fields of the snapshot that a test sets."""
    reached: list[int] = field(default_factory=list)
    seq: int = 0
    plan_state: PlanState = PlanState.NOT_STARTED
    position: bool = True
    _text_number: int = 0

    def snapshot(self) -> Snapshot:
        now = self.now_us
        logs = []
        for severity, text in self.texts:
            self._text_number += 1
            logs.append(LogText(self._text_number, now, severity, text))
        self.texts.clear()
        reached, self.reached = tuple(self.reached), []
        total = len(self.plans.items(PlanKind.MISSION))
        known = {"lat_rad": LAT_RAD, "lon_rad": LON_RAD, "x_m": 1.0, "y_m": 2.0} if self.position else {}
        return dataclasses.replace(
            Snapshot(
                t_us=now,
                tick=now // TICK_US,
                state=EstimatedState(
                    now,
                    height_msl_m=0.5,
                    psi_rad=0.5,
                    r_radps=0.01,
                    vx_mps=1.0,
                    vy_mps=0.5,
                    sog_mps=1.1,
                    alt_m=4.0,
                    **known,
                ),
                mode=self.mode,
                armed=self.armed,
                output=ActuatorOutput(now, 0.0, 0.0, 0.0, 0.0, "demand"),
                fix=GpsFix(now, FixType.FIX_3D, LAT_RAD, LON_RAD, 0.5, 50.0, satellites=12, hdop=0.8, hacc_m=0.5)
                if self.position
                else None,
                distance=Distance(now, 4.5),
                health=Health(
                    gps=self.position, heading=True, attitude=True, depth=True, actuators=True, prearm_ok=True
                ),
                supply=SupplyVoltage(now, 12.4),
                actuator=ActuatorStatus(now, connected=True, applied_us=(1500, 1500, 1500, 1500)),
                home_lat_rad=LAT_RAD if self.plans.home else None,
                home_lon_rad=LON_RAD if self.plans.home else None,
                utc_us=1_750_000_000_000_000 + now,
                texts=tuple(logs),
                progress=Progress(
                    self.plan_state if total else PlanState.NO_MISSION,
                    self.seq,
                    total,
                    self.plans.plan_id(PlanKind.MISSION),
                    self.plans.plan_id(PlanKind.FENCE),
                    self.plans.plan_id(PlanKind.RALLY),
                    reached,
                ),
            ),
            **self.changes,
        )

    def handle(self, request: Request) -> Reply:
        self.handled.append(request)
        body = request.body
        refusal = self.refuse.get(type(body))
        if refusal is not None:
            return refusal
        if isinstance(body, ask.Arm):
            self.armed = body.arm
        elif isinstance(body, ask.SetMode):
            self.mode = body.mode
        elif isinstance(body, ask.StartPlan):
            self.mode = Mode.AUTO
        elif isinstance(body, ask.PausePlan):
            self.mode = Mode.HOLD if body.pause else Mode.AUTO
        elif isinstance(body, ask.SetCurrent):
            self.seq = body.seq
        elif isinstance(body, ask.Reposition):
            if not body.change_mode and self.mode is not Mode.GUIDED:
                return Reply(Result.REJECTED_NOW, "not in guided mode")
            self.mode = Mode.GUIDED
        elif isinstance(body, ask.LoadPlan):
            self.plans.stored[body.kind] = body.items
        elif isinstance(body, ask.SetParameter):
            self.params.set(body.name, body.value)
        elif isinstance(body, ask.Reboot) and self.armed:
            return Reply(Result.REJECTED_NOW, "disarm first")
        return ACCEPTED


class Station:
    """A ground station's end of a link: sends messages, keeps what comes back."""

    def __init__(self, system: int = 255, component: int = 190) -> None:
        self.system, self.component = system, component
        self.codec = Codec(system, component)
        self.deframer = Deframer()
        self.inbox: list[Any] = []
        self.times_us: list[int] = []

    def receive(self, data: bytes, now_us: int) -> None:
        for frame in self.deframer.receive(data, now_us):
            self.inbox.append(decode(frame))
            self.times_us.append(now_us)

    def all(self, name: str) -> list[Any]:
        return [message for message in self.inbox if message.get_type() == name]

    def last(self, name: str) -> Any:
        found = self.all(name)
        assert found, f"no {name} among {sorted({message.get_type() for message in self.inbox})}"
        return found[-1]

    def clear(self) -> None:
        self.inbox.clear()
        self.times_us.clear()


class Bench:
    """A fake vessel with one endpoint and any number of stations on its link, in virtual time."""

    def __init__(
        self,
        persona: str = "ardurover",
        *,
        vessel: FakeVessel | None = None,
        config: EndpointConfig | None = None,
        **options: Any,
    ) -> None:
        self.vessel = vessel or FakeVessel()
        self.config = config or EndpointConfig(persona=persona)  # type: ignore[arg-type]
        self.endpoint = Endpoint(self.config, self.vessel, composer=Composer(), **options)
        self.gcs = Station()
        self.stations = [self.gcs]

    @property
    def shift(self) -> int:
        """How much higher item numbers are on the wire than inside."""
        return 1 if self.config.has_home_item else 0

    def pump(self) -> None:
        """Deliver everything that can be sent now."""
        while data := self.endpoint.take(self.vessel.now_us, 1200):
            for station in self.stations:
                station.receive(data, self.vessel.now_us)

    def tick(self, count: int = 1) -> None:
        for _ in range(count):
            self.vessel.now_us += TICK_US
            for request in self.endpoint.requests():
                if not self.vessel.answers:
                    continue
                reply = self.vessel.handle(request)
                if reply.result is Result.ACCEPTED:
                    self.vessel.deeds.note(request.body)
                if request.reply or reply.result is not Result.ACCEPTED:
                    self.endpoint.reply(request.id, reply, self.vessel.now_us)
            self.endpoint.tick(self.vessel.now_us, self.vessel.snapshot())
            self.pump()

    def run(self, seconds: float) -> None:
        self.tick(round(seconds * 1e6 / TICK_US))

    def send(self, message: Any, station: Station | None = None) -> None:
        """Send one message and let what can be answered at once be answered."""
        self.endpoint.receive((station or self.gcs).codec.encode(message), self.vessel.now_us)
        self.pump()

    def long(self, command: int, *params: float, confirmation: int = 0, system: int = 1, component: int = 1) -> None:
        """Send a COMMAND_LONG; missing parameters are 0."""
        values = [*params, *([0.0] * (7 - len(params)))]
        self.send(dialect.MAVLink_command_long_message(system, component, command, confirmation, *values))

    def int(self, command: int, *params: float, frame: int = 3, x: int = 0, y: int = 0, z: float = 0.0) -> None:
        values = [*params, *([0.0] * (4 - len(params)))]
        self.send(dialect.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *values, x, y, z))

    def acked(self, command: int) -> list[int]:
        """Results of the acknowledgements of a command, oldest first."""
        return [message.result for message in self.gcs.all("COMMAND_ACK") if message.command == command]

    def texts(self) -> str:
        return "\n".join(message.text for message in self.gcs.all("STATUSTEXT"))
