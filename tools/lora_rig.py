"""Both ends of the compact link over the simulated air, with a vessel that only keeps books: for tests and benchmarks, in virtual time."""

from __future__ import annotations

import math
import random
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import config
from companion.core.guard.gate import Gate, GateConfig
from mavlink_bridge.language.deeds import Deeds
from mavlink_bridge.language.messages import EstimatedState, FixType, Mode, PlanState, SupplyVoltage
from mavlink_bridge.language.requests import (
    Arm,
    LoadPlan,
    Origin,
    PausePlan,
    PlanKind,
    Reply,
    Request,
    RequestBody,
    Result,
    SetMode,
    SetParameter,
    Terminate,
)
from mavlink_bridge.language.snapshot import Health, Progress, Snapshot
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.mavlink.persona import Identity, ParamInfo
from mavlink_bridge.mavlink.persona.port import LogShelf
from mavlink_bridge.radio.aboard import VesselRadio
from mavlink_bridge.radio.air import RadioProfile
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.codec.wire import TAG_BYTES
from mavlink_bridge.radio.session import NONCE_BYTES, Pairing, RadioDirection
from mavlink_bridge.radio.shore import ShoreTwin
from mavlink_bridge.radio.shore.view import CachedPlans
from sitl.radio import RadioConfig, RadioEnd, RadioPair

KEY = bytes(range(1, 33))
TICK_US = 50_000
STORE_US = 20_000


def profile(name: str, **changes: object) -> RadioProfile:
    """Load a shipped profile, with fields changed; ``link`` takes a dict of its own."""
    data = tomllib.loads(config.path("radio", f"{name}.toml").read_text("utf-8"))
    link = {**data.get("link", {}), **dict(changes.pop("link", {}))}  # type: ignore[call-overload]
    return RadioProfile.model_validate({**data, **changes, "link": link})


def acquainted(
    *, key: bytes = KEY, system_id: int = 1, seed: int = 0, tag_bytes: int = TAG_BYTES, now_us: int = 0
) -> dict[RadioDirection, Pairing]:
    """Both ends of a link that have greeted each other, by the direction in which they speak."""
    rng = random.Random(f"{seed}/acquainted")
    air = profile("o-10")
    ends = {way: Pairing(key, system_id, way, rng.randbytes(NONCE_BYTES), air) for way in RadioDirection}
    vessel, shore = ends[RadioDirection.TO_SHORE], ends[RadioDirection.TO_VESSEL]
    for speaker, listener, proof in ((shore, vessel, False), (vessel, shore, True), (shore, vessel, True)):
        body, proven = speaker.hello(now_us, please=False, proof=proof)
        frame = Sealer(speaker, tag_bytes=tag_bytes).hello(body, proven)
        Opener(listener, tag_bytes=tag_bytes).receive(frame, now_us)
    return ends


class Table:
    """A small parameter table."""

    def __init__(self, **values: float) -> None:
        self.infos = [ParamInfo(name, value, default=value) for name, value in sorted(values.items())]

    def __len__(self) -> int:
        return len(self.infos)

    def index(self, name: str) -> int | None:
        return next((number for number, info in enumerate(self.infos) if info.name == name), None)

    def get(self, name: str) -> ParamInfo | None:
        return next((info for info in self.infos if info.name == name), None)

    def at(self, index: int) -> ParamInfo | None:
        return self.infos[index] if 0 <= index < len(self.infos) else None

    def set(self, name: str, value: float) -> None:
        self.infos = [replace(info, value=value) if info.name == name else info for info in self.infos]


def table() -> Table:
    return Table(SPEED_MAX=2.0, DEPTH_MIN=4.0, LOIT_RADIUS=20.0)


@dataclass
class BookVessel:
    """Carries out every request at a tick, after ``STORE_US`` for what is stored, and writes down what it did."""

    params: Table = field(default_factory=table)
    plans: CachedPlans = field(default_factory=CachedPlans)
    identity: Identity = field(default_factory=Identity)
    deeds: Deeds = field(default_factory=Deeds)
    logs: LogShelf | None = None
    armed: bool = True
    mode: Mode = Mode.AUTO
    speed_mps: float = 1.5
    north_m: float = 0.0
    east_m: float = 0.0
    executed: list[tuple[int, RequestBody]] = field(default_factory=list)
    origins: list[Origin | None] = field(default_factory=list)
    """The commands that these came in, as rebuilt here."""
    neutral_us: int | None = None
    refuse: str = ""

    def under_way_again(self) -> None:
        """Forget that it was stopped."""
        self.neutral_us = None

    def handle(self, request: Request, now_us: int) -> Reply:
        body = request.body
        self.executed.append((now_us, body))
        self.origins.append(request.origin)
        if self.refuse:
            return Reply(Result.DENIED, self.refuse)
        if isinstance(body, LoadPlan):
            self.plans.put(body.kind, body.items)
        elif isinstance(body, SetParameter):
            self.params.set(body.name, body.value)
        elif isinstance(body, SetMode):
            self.mode = body.mode
        elif isinstance(body, PausePlan):
            self.mode = Mode.HOLD if body.pause else Mode.AUTO
        elif isinstance(body, Terminate):
            self.armed = False
        elif isinstance(body, Arm):
            self.armed = body.arm
            self.neutral_us = None if body.arm else now_us
        return Reply(Result.ACCEPTED)

    def snapshot(self, now_us: int, tick: int) -> Snapshot:
        """A boat on a circle of 40 m."""
        angle = now_us * 1e-6 * self.speed_mps / 40.0
        self.north_m, self.east_m = 40.0 * math.sin(angle), 40.0 * math.cos(angle)
        lat = math.radians(41.1850123 + self.north_m / 111_132.0)
        lon = math.radians(-8.7062154 + self.east_m / 83_800.0)
        state = EstimatedState(
            now_us,
            lat_rad=lat,
            lon_rad=lon,
            psi_rad=(angle + math.pi) % math.tau - math.pi,
            sog_mps=self.speed_mps,
            alt_m=8.0 + math.sin(now_us * 1e-6 / 60.0),
            phi_rad=0.02,
            theta_rad=0.01,
            fix_type=FixType.RTK_FIXED,
        )
        items = self.plans.items(PlanKind.MISSION)
        progress = Progress(
            state=PlanState.ACTIVE if items else PlanState.NO_MISSION,
            total=len(items),
            mission_id=plan_id(items) if items else 0,
        )
        return Snapshot(
            now_us,
            tick,
            state=state,
            mode=self.mode,
            armed=self.armed,
            output=Gate(GateConfig(), 0.0, 50_000).neutral(now_us, "rig"),
            progress=progress,
            health=Health(gps=True, heading=True, actuators=True, prearm_ok=True),
            supply=SupplyVoltage(now_us, None, remaining=0.8),
        )


class Rig:
    """The whole link. ``step`` advances 10 ms (or ``step_us``); the vessel ticks at 20 Hz."""

    def __init__(
        self, radio_profile: RadioProfile, radio: RadioConfig | None = None, seed: int = 0, *, step_us: int = 10_000
    ) -> None:
        self.profile = radio_profile
        self.step_us = step_us
        self.now_us = 0
        self.pair = RadioPair(radio or RadioConfig(), random.Random(f"{seed}/air"))
        self.vessel = BookVessel()
        self.memory = {"vessel": "", "shore": ""}
        self.seed = seed
        self.replies: list[tuple[int, object, Reply]] = []
        self.station_present = True
        self.tick_count = 0
        self._work: list[tuple[int, Request]] = []
        self.starts = 0
        self.told: list[str] = []
        """What the vessel's end has said to the people aboard."""
        self.start_vessel()
        self.start_shore()

    def start_vessel(self) -> None:
        """(Re)start the vessel's end from its memory."""
        self.starts += 1
        self._work.clear()
        self.radio = VesselRadio(
            self.profile,
            KEY,
            self.vessel,
            random.Random(f"{self.seed}/vessel/{self.starts}"),
            nonce=random.Random(f"{self.seed}/vessel/{self.starts}/nonce").randbytes(NONCE_BYTES),
            memory=self.memory["vessel"],
            save=lambda text: self.memory.__setitem__("vessel", text),
            now_us=self.now_us,
            say=lambda severity, text: self.told.append(text),
        )

    def start_shore(self) -> None:
        """(Re)start the gateway from its memory."""
        self.twin = self._gateway("shore")

    def _gateway(self, name: str) -> ShoreTwin:
        self.starts += 1
        return ShoreTwin(
            self.profile,
            KEY,
            table(),
            Identity(),
            neutral=Gate(GateConfig(), 0.0, 50_000).neutral(0, "shore"),
            rng=random.Random(f"{self.seed}/shore/{self.starts}"),
            nonce=random.Random(f"{self.seed}/shore/{self.starts}/nonce").randbytes(NONCE_BYTES),
            memory=self.memory.setdefault(name, ""),
            save=lambda text: self.memory.__setitem__(name, text),
            now_us=self.now_us,
        )

    def step(self) -> None:
        self.now_us += self.step_us
        now_us = self.now_us
        self.pair.step(now_us)
        self._vessel(now_us)
        self._shore(now_us)

    def _vessel(self, now_us: int) -> None:
        data = self.pair.vessel.read()
        if data:
            self.radio.receive(data, now_us)
        if now_us // TICK_US != (now_us - self.step_us) // TICK_US:
            self.tick_count += 1
            self._work += [(now_us, request) for request in self.radio.requests()]
            for asked_us, request in list(self._work):
                if not isinstance(request.body, LoadPlan) or now_us - asked_us >= STORE_US:
                    self._work.remove((asked_us, request))
                    self.radio.reply(request.id, self.vessel.handle(request, now_us), now_us)
            self.radio.tick(now_us, self.vessel.snapshot(now_us, self.tick_count))
        frame = self.radio.take(now_us, 1200)
        if frame:
            self.pair.vessel.write(frame)

    def _shore(self, now_us: int) -> None:
        self._serve(self.twin, self.pair.shore, now_us, station_present=self.station_present)

    def _serve(self, twin: ShoreTwin, end: RadioEnd, now_us: int, *, station_present: bool) -> None:
        data = end.read()
        if data:
            twin.receive(data, now_us)
        if now_us // 100_000 != (now_us - self.step_us) // 100_000:
            twin.tick(now_us, station_present=station_present)
            twin.link.keep(now_us, at_once=False)
        frame = twin.take(now_us)
        if frame:
            end.write(frame)
        self.replies += [(now_us, owner, reply) for owner, reply in twin.replies()]

    def run(self, seconds: float) -> None:
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.step()

    def settle(self, limit_s: float = 120.0) -> None:
        """Run until both ends know each other and the shore has asked what it wants, then a quiet moment after."""
        end_us = self.now_us + round(limit_s * 1e6)
        while self.now_us < end_us and (self.twin.state is None or self.twin.link.heard_us is None):
            self.step()
        self.run(40.0)

    def ask(
        self, body: RequestBody, limit_s: float = 100.0, origin: Origin | None = None, *, twin: ShoreTwin | None = None
    ) -> tuple[float, Reply]:
        """Submit a request as a station would; return the seconds until its answer, and the answer. ``twin``: at another gateway."""
        owner = object()
        start_us = self.now_us
        (twin or self.twin).submit(owner, body, self.now_us, origin)
        while self.now_us - start_us < limit_s * 1e6:
            self.step()
            for at_us, whose, reply in self.replies:
                if whose is owner:
                    return (at_us - start_us) * 1e-6, reply
        raise AssertionError(f"{type(body).__name__} was never answered")

    def sent(self, since_us: int) -> Iterator[tuple[str, int]]:
        """Origin and size of what went on the air."""
        for item in self.pair.air.log:
            if item.start_us >= since_us:
                yield item.origin, len(item.data)
