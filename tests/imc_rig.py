"""Consoles at a desk before the simulated vessel, in its virtual time: packets as a console would send them, answers as it would get them.

The console writes and reads its packets with a codec of its own (``wire``), so that the desk is not judged by its own words.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import config
from companion.core.hull.statics import top_speed_mps
from companion.facade import SettingsParams
from companion.imc import motion
from companion.imc.desk import Desk, DeskConfig
from companion.imc.desk.foresight import Foresight
from companion.imc.picture import ImcPicture
from companion.io.links.link import Received
from companion.io.links.mem import pair
from companion.settings.schema import load, load_vessel
from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker, Udp
from mavlink_bridge.mavlink.client import ClientConfig, VehicleClient
from sitl.gateway import with_gateway
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.gateways import gateway_beside

UTC_S = 1_790_000_000.0
"""The consoles' clock at the world's start."""


@dataclass
class Console:
    """One console: its request counter, what it was answered."""

    rig: Rig
    imc_id: int = 0x4001
    host: str = "10.77.0.1"
    name: str = "ccu-test"
    present: bool = True
    beats: bool = True
    number: int = 0
    inbox: list[tuple[float, imc.Message]] = field(default_factory=list)

    def asker(self, sent_s: float | None = None, **options: Any) -> Asker:
        at = self.rig.utc_s if sent_s is None else sent_s
        return Asker(self.imc_id, 0xFF, self.name, Udp(self.host, 6001), sent_utc_s=at, **options)

    def send(self, message: imc.Message, sent_s: float | None = None, **options: Any) -> None:
        """One packet; it passes through bytes, as on the wire."""
        through = imc.decode(imc.encode(imc.Packet(imc.Header(self.imc_id), message))).message
        asker = self.asker(sent_s, **options)
        self.rig.desk.heard(asker, self.rig.now_us)
        self.rig.desk.receive(through, asker, self.rig.now_us)
        self.rig.talk()

    def ask(self, message: Any, limit_s: float = 8.0, **options: Any) -> Any:
        """A request under the next number, and its answer."""
        self.number += 1
        request = replace(message, request_id=self.number)
        before = len(self.inbox)
        self.send(request, **options)

        def answers() -> list[imc.Message]:
            return [
                each
                for _, each in self.inbox[before:]
                if type(each) is type(message) and each.request_id == self.number  # type: ignore[attr-defined]
            ]

        self.rig.until(lambda: bool(answers()), limit_s)
        return answers()[0]

    def save(self, spec: imc.PlanSpecification) -> Any:
        return self.ask(imc.PlanDB(op=imc.PlanDBOp.SET, plan_id=spec.plan_id, arg=spec))

    def start(self, plan: str, **fields: Any) -> Any:
        return self.ask(imc.PlanControl(op=imc.PlanControlOp.START, plan_id=plan, flags=1, **fields))

    def stop(self) -> Any:
        return self.ask(imc.PlanControl(op=imc.PlanControlOp.STOP, flags=1))

    def abort(self) -> None:
        self.send(imc.Abort())

    def sail(self, spec: imc.PlanSpecification) -> Any:
        assert self.save(spec).type == imc.ReplyType.SUCCESS
        return self.start(spec.plan_id)

    def all(self, wanted: type) -> list[Any]:
        return [message for _, message in self.inbox if isinstance(message, wanted)]


class Rig:
    """A world with one desk on one of its links. ``link``: ``gcs`` (ardurover face) or ``sdk`` (generic)."""

    def __init__(
        self,
        *overrides: str,
        link: str = "gcs",
        seed: int = 1,
        desk: DeskConfig | None = None,
        gateway_dir: Path | None = None,
    ) -> None:
        settings = load(config.path("sim.toml"), list(overrides), SimSettings)
        if gateway_dir is None:
            self.world, self.gateway = World(settings, seed), None
            self.link = self.world.ground(link)
        else:
            self.world = World(with_gateway(settings, gateway_dir), seed)
            near, self.link = pair("gcs")
            self.gateway = gateway_beside(self.world, gateway_dir, near, seed=2)
            self.link.poll(0)
        self.config = desk or DeskConfig(full_speed_mps=2.5)
        self.saved = ""
        self.consoles: list[Console] = []
        self.events: list[tuple[float, int, str]] = []
        self._beat_us = 0
        self.alive = True
        self.begin()
        self.console = self.add()
        self.run(3.0)

    def begin(self) -> None:
        """Start the bridge's program, anew."""
        self.client, self.picture = VehicleClient(ClientConfig()), ImcPicture()
        self.desk = Desk(
            self.config,
            self.client,
            SettingsParams(self.world.settings),
            foresight=Foresight(
                top_speed_mps(load_vessel(self.world.settings.vessel)),
                self.world.settings.mission,
                lambda: motion.here(self.picture, self.now_us),
                lambda: motion.home(self.picture),
            ),
            saved=self.saved,
            save=self._save,
            utc_s=lambda now_us: UTC_S + now_us * 1e-6,
        )

    def _save(self, text: str) -> None:
        self.saved = text

    def add(self, **fields: Any) -> Console:
        console = Console(self, **fields)
        self.consoles.append(console)
        return console

    @property
    def now_us(self) -> int:
        return self.world.now_us

    @property
    def now_s(self) -> float:
        return self.world.now_us * 1e-6

    @property
    def utc_s(self) -> float:
        return UTC_S + self.now_s

    @property
    def truth(self) -> Any:
        return self.world.surroundings.truth

    @property
    def snapshot(self) -> Any:
        return self.world.snapshot

    def view(self) -> Any:
        return self.desk.view(self.now_us)

    def talk(self) -> None:
        """Let desk, client and vessel answer each other without time passing."""
        for _ in range(40):
            self.world.pump(self.now_us)
            if self.gateway is not None:
                self.gateway.pump(self.now_us)
            heard = [event.data for event in self.link.poll(self.now_us) if isinstance(event, Received)]
            if not self.alive:
                return
            for data in heard:
                for message in self.client.receive(data, self.now_us):
                    self.picture.hear(message, self.now_us)
            for out in self.desk.take(self.now_us):
                for console in self.consoles:
                    if console.present and (out.to is None or out.to.imc_id == console.imc_id):
                        console.inbox.append((self.now_s, out.message))
            self.events += [(self.now_s, severity, text) for severity, text in self.desk.drain_texts()]
            said = self.client.take(self.now_us)
            if said:
                self.link.write(0, said)
            if not heard and not said:
                return

    def step(self) -> None:
        if self.now_us >= self._beat_us:
            self._beat_us = self.now_us + 1_000_000
            for console in self.consoles:
                if console.present and console.beats:
                    self.desk.heard(console.asker(), self.now_us)
        self.world.step()
        if self.gateway is not None:
            self.gateway.tick(self.now_us)
        self.talk()

    def run(self, seconds: float) -> None:
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.step()

    def until(self, holds: Callable[[], bool], limit_s: float) -> float:
        began = self.now_s
        while not holds():
            assert self.now_s - began < limit_s, f"not within {limit_s} s: {self.events[-10:]}"
            self.step()
        return self.now_s - began

    def place(self, north_m: float, east_m: float) -> dict[str, float]:
        lat_rad, lon_rad = self.world.surroundings.plant.frame.to_geodetic(north_m, east_m)
        return {"lat_rad": lat_rad, "lon_rad": lon_rad}

    def goto(self, north_m: float, east_m: float, speed: float = 1.2) -> imc.Goto:
        return imc.Goto(**self.place(north_m, east_m), z_units=imc.ZUnits.DEPTH, speed=speed)


def plan(name: str, *maneuvers: imc.Message, **fields: Any) -> imc.PlanSpecification:
    """A plan as a console sends it: manoeuvres one after the other, named by what they are."""
    nodes = tuple(
        imc.PlanManeuver(maneuver_id=f"{type(each).__name__}{number}", data=each)
        for number, each in enumerate(maneuvers, 1)
    )
    ways = tuple(
        imc.PlanTransition(source_man=one.maneuver_id, dest_man=other.maneuver_id, conditions="ManeuverIsDone")
        for one, other in itertools.pairwise(nodes)
    )
    start = nodes[0].maneuver_id if nodes else ""
    return imc.PlanSpecification(plan_id=name, start_man_id=start, maneuvers=nodes, transitions=ways, **fields)


def distance_m(rig: Rig, north_m: float, east_m: float) -> float:
    return math.dist((rig.truth.north_m, rig.truth.east_m), (north_m, east_m))
