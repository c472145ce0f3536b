"""Sails simulated vessels and kills each with SIGKILL at a random moment; leaves what a power-off would leave.

python kill_runs.py FOLDER COUNT SEED. Each run directory gets a file ``progress`` with the microseconds that had been
sailed, written at every step straight into the page cache, so that a test can tell how much was lost.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from pathlib import Path

import config as shipped
from companion.io.keeping.store import Store
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, PlanItem, PlanKind, SetParameter, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World


def plan(number: int):
    items = tuple(PlanItem(16, 6, 0, 0, 0, 0, 411853000 + 100 * number, -87061000 + 900 * k, 0) for k in range(20))
    return load_plan(PlanKind.MISSION, items)


def sail(folder: Path, seed: int) -> None:
    settings = load(shipped.path("sim.toml"), ("operator.gcs_required=false",), SimSettings)
    world = World(settings, seed, run_dir=folder, store=Store(folder / "store.db"))
    progress = os.open(folder / "progress", os.O_WRONLY | os.O_CREAT)
    for number in range(1_000_000):
        if number == 90:
            world.app.submit(Arm(True))
            world.app.submit(StartPlan())
        if number % 40 == 20:
            world.app.submit(plan(number // 40))
            world.app.submit(SetParameter("DEPTH_MIN", 3.0 + (number // 40) % 5))
        world.step()
        os.pwrite(progress, world.now_us.to_bytes(8, "little"), 0)


def main(base: Path, count: int, seed: int) -> None:
    rng = random.Random(seed)
    for number in range(count):
        folder = base / f"run-{number:03d}"
        folder.mkdir(parents=True)
        child = os.fork()
        if child == 0:
            try:
                sail(folder, number)
            finally:
                os._exit(1)
        while not (folder / "progress").exists() or (folder / "progress").stat().st_size < 8:
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, 1.5))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
