"""Makes the pictures of README and docs with the report's own code: sails a loiter in the simulator and draws it."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import config as shipped
from companion.report import plots
from companion.report.from_run import read_run
from companion.report.map_plot import draw_map
from companion.settings import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, RequestBody, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world import SimSettings, World

REPO = Path(__file__).resolve().parents[1]
NAN = float("nan")
PLAN = (
    PlanItem(178, 2, 1, 1.5, -1, 0, 0, 0, 0.0),
    PlanItem(16, 6, 0, 0, 0, NAN, 411855200, -87060500, 0.0),
    PlanItem(19, 6, 150, 0, 20, 1, 411853200, -87055200, 0.0),
    PlanItem(16, 6, 0, 0, 0, NAN, 411850200, -87060800, 0.0),
)
FENCE = tuple(
    PlanItem(5001, 0, 4, 0, 0, 0, lat, lon, 0.0)
    for lat, lon in ((411857500, -87064500), (411857500, -87050500), (411848500, -87050500), (411848500, -87064500))
)
SETTINGS = ("operator.gcs_required=false",)


def sail(run_dir: Path, seconds: float = 330.0) -> None:
    """A loiter with a leg before and after it, inside a fence."""
    world = World(load(shipped.path("sim.toml"), SETTINGS, SimSettings), 11, run_dir=run_dir)
    orders: list[RequestBody] = []
    for kind, items in ((PlanKind.FENCE, FENCE), (PlanKind.MISSION, PLAN)):
        plan = load_plan(kind, items)
        if not isinstance(plan, LoadPlan):
            raise SystemExit(f"the plan is refused: {plan.reason}")
        orders.append(plan)
    for order in orders:
        world.app.submit(order)
    world.run(5.0)
    world.app.submit(Arm(True))
    world.app.submit(StartPlan())
    world.run(seconds)
    world.shutdown(world.now_us)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description="make the pictures of README and docs")
    parser.add_argument("-o", "--output", type=Path, default=REPO / "docs" / "images")
    arguments = parser.parse_args(argv)
    arguments.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        sail(Path(folder) / "run")
        flight = read_run(Path(folder) / "run")
    for name, draw in (("loiter", draw_map),):
        made = draw(flight)
        if made is None:
            print(f"nothing to draw for {name}", file=sys.stderr)
            return 1
        path = arguments.output / f"{name}.png"
        path.write_bytes(plots.as_png(made))
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
