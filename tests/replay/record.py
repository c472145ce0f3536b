"""Makes the recordings of ``test_process.py`` again: ``python -m tests.replay.record``. Needed only when their format changes."""

from __future__ import annotations

import tempfile
from pathlib import Path

import config as shipped
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.replay import process

SPEED = PlanItem(178, 2, 1, 1.5, -1, 0, 0, 0, 0.0)


def sail(
    name: str, items: list[PlanItem], seconds: float, trouble: dict[int, tuple[str, object]], *settings: str
) -> None:
    """Sail a plan of ``items``; ``trouble`` sets a sensor fault at a second."""
    loaded = load(shipped.path("sim.toml"), ("operator.gcs_required=false", *settings), SimSettings)
    with tempfile.TemporaryDirectory() as folder:
        world = World(loaded, 17, run_dir=Path(folder))
        plan = load_plan(PlanKind.MISSION, items)
        assert isinstance(plan, LoadPlan), plan
        world.app.submit(plan)
        world.run(3.0)
        world.app.submit(Arm(True))
        world.app.submit(StartPlan())
        for second in range(3, round(seconds)):
            if second in trouble:
                world.surroundings.plant.sensors.faults.set(*trouble[second])
            world.run(1.0)
        world.shutdown(world.now_us)
        process.keep(name, Path(folder))


def main() -> None:
    """Record all."""
    leg = PlanItem(16, 6, 0, 0, 0, 0, 411852000, -87061000, 0.0)
    loiter = PlanItem(19, 6, 30, 0, 10.0, 1, 411852500, -87059500, 0.0)
    sail("loiter", [SPEED, leg, loiter], 90, {})
    sail("position-lost", [SPEED, leg, loiter], 60, {30: ("gnss_silent", True), 40: ("gnss_silent", False)})
    sail(
        "depth-stop", [SPEED, PlanItem(16, 6, 0, 0, 0, 0, 411860000, -87061000, 0.0)], 60, {25: ("depth_bias_m", -16.2)}
    )


if __name__ == "__main__":
    main()
