"""A voyage in the simulated world: plans, orders and faults in a line each, measured at the actuator board's pins."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from pathlib import Path

import pytest

import config
from companion.io.keeping.store import AnyStore
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, Reply, RequestBody, SetMode, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World

CHANGE_SPEED, WAYPOINT, LOITER_UNLIMITED, JUMP = 178, 16, 17, 177
FENCE_IN, FENCE_CIRCLE_IN, FENCE_CIRCLE_OUT = 5001, 5003, 5004
NEUTRAL_US = 1500.0
MEASURED = Path("build/faults")


class Voyage:
    """A world with shorthand."""

    def __init__(self, *overrides: str, seed: int = 1, store: AnyStore | None = None) -> None:
        settings = load(config.path("sim.toml"), ["operator.gcs_required=false", *overrides], SimSettings)
        self.world = World(settings, seed, store=store)
        self.texts: list[str] = []
        self.run(2.0)

    # ---- the world

    @property
    def now_s(self) -> float:
        return self.world.now_us / 1e6

    @property
    def truth(self):
        return self.world.surroundings.truth

    @property
    def snapshot(self):
        return self.world.snapshot

    @property
    def faults(self):
        return self.world.surroundings.plant.sensors.faults

    @property
    def board(self):
        return self.world.surroundings.plant.board

    def step(self) -> None:
        self.world.step()
        self.texts += [item.text for item in self.world.snapshot.texts]

    def run(self, seconds: float) -> None:
        end_us = self.world.now_us + round(seconds * 1e6)
        while self.world.now_us < end_us:
            self.step()

    def until(self, holds: Callable[[], bool], limit_s: float) -> float:
        """Step until something holds; return the seconds that it took, or fail."""
        began_s = self.now_s
        while not holds():
            assert self.now_s - began_s < limit_s, f"not within {limit_s} s; last texts: {self.texts[-5:]}"
            self.step()
        return self.now_s - began_s

    # ---- orders

    def ask(self, body: RequestBody) -> Reply:
        replies: list[Reply] = []
        self.world.app.submit(body, replies.append)
        self.until(lambda: bool(replies), 1.0)
        return replies[0]

    def at(self, north_m: float, east_m: float) -> tuple[int, int]:
        lat_rad, lon_rad = self.world.surroundings.plant.frame.to_geodetic(north_m, east_m)
        return round(math.degrees(lat_rad) * 1e7), round(math.degrees(lon_rad) * 1e7)

    def plan(self, speed_mps: float, *points: tuple[float, float]) -> Reply:
        items = [PlanItem(CHANGE_SPEED, 2, 1.0, speed_mps, -1.0, 0.0, 0, 0, 0.0)]
        items += [PlanItem(WAYPOINT, 3, 0.0, 0.0, 0.0, 0.0, *self.at(*point), 0.0) for point in points]
        return self.upload(PlanKind.MISSION, items)

    def upload(self, kind: PlanKind, items: list[PlanItem]) -> Reply:
        plan = load_plan(kind, items)
        assert isinstance(plan, LoadPlan), plan
        return self.ask(plan)

    def circle_fence(self, radius_m: float, north_m: float = 0.0, east_m: float = 0.0, inclusion: bool = True) -> Reply:
        command = FENCE_CIRCLE_IN if inclusion else FENCE_CIRCLE_OUT
        return self.upload(
            PlanKind.FENCE, [PlanItem(command, 0, radius_m, 0.0, 0.0, 0.0, *self.at(north_m, east_m), 0.0)]
        )

    def sail(self, speed_mps: float, *points: tuple[float, float], after_s: float = 0.0) -> None:
        """Upload, arm, start, and let it run for a while."""
        for reply in (self.plan(speed_mps, *points), self.ask(Arm(arm=True)), self.ask(StartPlan(0))):
            assert reply.reason == ""
        self.run(after_s)

    def mode(self, mode: Mode) -> Reply:
        return self.ask(SetMode(mode))

    # ---- what the pins say

    @property
    def neutral(self) -> bool:
        """Thrusters stopped and rudders centred, at the pins."""
        return all(abs(pulse - NEUTRAL_US) < 10.0 for pulse in self.board.pulses_us)

    @property
    def distance_m(self) -> float:
        return math.hypot(self.truth.north_m, self.truth.east_m)


@pytest.fixture
def voyage() -> Callable[..., Voyage]:
    """Make a voyage: ``voyage("world.water.wind_mps=8", seed=2)``."""
    return Voyage


@pytest.fixture
def measured() -> Callable[[int, str], None]:
    """Note what a row of the fault matrix took; ``make faults`` puts it into docs/FAULTS.md."""

    def note(row: int, text: str) -> None:
        if os.environ.get("MEASURE_FAULTS"):
            MEASURED.mkdir(parents=True, exist_ok=True)
            (MEASURED / f"{row:02d}.json").write_text(json.dumps({"row": row, "measured": text}), "utf-8")

    return note
