"""Makes the pictures of README and docs with the report's own code: the seed's scenarios, and a loiter with its report."""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import config as shipped
from companion.report import plots
from companion.report.from_run import read_run
from companion.report.map_plot import draw_map
from companion.report.page import make_page
from companion.settings import load
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanKind, RequestBody, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.plant.bottom import BottomConfig, make_bottom
from sitl.world import SimSettings, World
from tools.plan_items import plan_item
from tools.seed_pictures import draw_all

REPO = Path(__file__).resolve().parents[1]
NAN = float("nan")
PLAN = (
    plan_item(178, (1, 1.5, -1, 0), frame=2),
    plan_item(16, (0, 0, 0, NAN), at_e7=(411855200, -87060500), frame=6),
    plan_item(19, (150, 0, 20, 1), at_e7=(411853200, -87055200), frame=6),
    plan_item(16, (0, 0, 0, NAN), at_e7=(411850200, -87060800), frame=6),
)
FENCE = tuple(
    plan_item(5001, (4, 0, 0, 0), at_e7=(lat, lon), frame=0)
    for lat, lon in ((411857500, -87064500), (411857500, -87050500), (411848500, -87050500), (411848500, -87064500))
)
SETTINGS = ("operator.gcs_required=false",)


def write_chart(path: Path) -> None:
    """The simulator's bottom around the plan as an owner's chart."""
    frame = LocalFrame(math.radians(41.1850), math.radians(-8.7062))
    bottom = make_bottom(BottomConfig(), frame)
    lines = []
    for north_m in range(-160, 260, 5):
        for east_m in range(-260, 400, 5):
            depth_m = bottom.depth_at(float(north_m), float(east_m))
            lat_rad, lon_rad = frame.to_geodetic(float(north_m), float(east_m))
            if depth_m is not None:
                lines.append(f"{math.degrees(lon_rad):.8f} {math.degrees(lat_rad):.8f} {depth_m:.2f}\n")
    path.write_text("".join(lines), encoding="utf-8")


def sail(run_dir: Path, chart: Path, seconds: float = 330.0) -> None:
    """A loiter with a leg before and after it, inside a fence, over a chart."""
    changes = (*SETTINGS, f'depth.map.file="{chart}"')
    settings = load(shipped.path("sim.toml"), changes, SimSettings)
    world = World(settings, 11, run_dir=run_dir, about={"settings": settings.model_dump(mode="json")})
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
    parser.add_argument("--seed-only", action="store_true", help="only those of docs/SEED.md, which need no browser")
    arguments = parser.parse_args(argv)
    arguments.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        draw_all(arguments.output, folder)
        if arguments.seed_only:
            return 0
        write_chart(folder / "harbour.xyz")
        sail(folder / "loiter", folder / "harbour.xyz")
        flight = read_run(folder / "loiter")
        made = draw_map(flight)
        (arguments.output / "loiter.png").write_bytes(plots.as_png(made))
        (folder / "report.html").write_text(make_page(flight), encoding="utf-8")
        for picture, width, height in (("report", 1280, 2300), ("report-phone", 390, 2000)):
            photograph(folder, arguments.output / f"{picture}.png", width, height)
    return 0


def photograph(folder: Path, out: Path, width: int, height: int) -> None:
    """The report in a window of that size, its time pointed at 2 min 30 s. The frame is there because a window is never so narrow."""
    act = "const s = f.contentDocument.querySelector('#time input'); s.value = 150; s.dispatchEvent(new Event('input'))"
    frame = f'<iframe style="border:0;width:{width}px;height:{height}px"></iframe>'
    script = f"const f = document.querySelector('iframe'); f.onload = () => {{ {act} }}; f.src = 'report.html'"
    page = f"<body style=margin:0>{frame}<script>{script}</script>"
    (folder / "frame.html").write_text(page, encoding="utf-8")
    words = [
        "chromium",
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--virtual-time-budget=3000",
    ]
    words += ["--allow-file-access-from-files", f"--user-data-dir={folder}/profile", f"--window-size={width},{height}"]
    subprocess.run([*words, f"--screenshot={out}", (folder / "frame.html").as_uri()], check=True, capture_output=True)
    print(out)


if __name__ == "__main__":
    sys.exit(main())
