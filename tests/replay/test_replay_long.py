"""A long voyage in which everything goes wrong now and then, replayed bit for bit: four minutes here, two hours in soak."""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest

import config as shipped
from companion.replay import replay, summary
from companion.report.from_run import read_run
from companion.report.page import make_page
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, SetParameter, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.conftest import PYPY, require

FAULTS = ("gnss_silent", "heading_silent", "depth_silent", "no_fix", "frozen", "rate_silent", "depth_no_bottom")
SHARES = ("cut_share", "flip_share", "loss_share")


def triangle() -> LoadPlan:
    corners = ((411853500, -87060500), (411855000, -87056000), (411851500, -87055500))
    items = [PlanItem(178, 2, 1, 1.5, -1, 0, 0, 0, 0.0)]
    items += [PlanItem(16, 6, 0, 0, 0, 0, lat, lon, 0.0) for lat, lon in corners]
    items += [PlanItem(18, 6, 0.5, 0, 12.0, 1, *corners[0], 0.0), PlanItem(177, 2, 1, -1, 0, 0, 0, 0, 0.0)]
    plan = load_plan(PlanKind.MISSION, items)
    assert isinstance(plan, LoadPlan)
    return plan


class Trouble:
    """A world, a talking ground station, and a random source that breaks things and mends them again."""

    def __init__(self, run_dir: Path, seed: int) -> None:
        settings = load(shipped.path("sim.toml"), (), SimSettings)
        self.world = World(settings, seed, run_dir=run_dir)
        self.rng = random.Random(seed)
        self.station = self.world.ground("gcs")
        self.second = self.world.ground("tcp")
        self.codec = Codec(255, 190)
        self.broken: list[tuple[int, str]] = []

    def sail(self, seconds: float) -> None:
        for second in range(round(seconds)):
            self._talk(second)
            self._break(second)
            if second % 60 == 5:
                for order in (triangle(), Arm(True), StartPlan()):
                    self.world.app.submit(order)
            if second % 45 == 20:
                self.world.app.submit(SetParameter("CRUISE_SPEED", self.rng.uniform(1.0, 2.0)))
            for tick in range(20):
                if tick % 7 == 3:
                    self.world.loop_app.pump(self.world.now_us + 20_000)
                self.world.step()
            self.station.poll(self.world.now_us)
            self.second.poll(self.world.now_us)
        self.world.shutdown(self.world.now_us)

    def _talk(self, second: int) -> None:
        wanted = [dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)]
        if second % 30 == 10:
            wanted.append(dialect.MAVLink_param_request_list_message(1, 1))
        if second % 50 == 25:
            wanted.append(dialect.MAVLink_mission_request_list_message(1, 1, 0))
        if second % 7 == 3:
            wanted.append(dialect.MAVLink_timesync_message(0, second))
        for message in wanted:
            self.station.write(0, self.codec.encode(message))
        self.second.write(0, self.rng.randbytes(self.rng.randrange(60)))

    def _break(self, second: int) -> None:
        faults = self.world.surroundings.plant.sensors.faults
        for until, name in [item for item in self.broken if item[0] <= second]:
            self.broken.remove((until, name))
            if name == "link":
                self.station.plug()
            else:
                faults.set(name, 0.0 if name in SHARES else False)
        if self.rng.random() < 0.06:
            name = self.rng.choice((*FAULTS, *SHARES, "link", "reset"))
            if name == "link":
                self.station.unplug("pulled")
            elif name == "reset":
                self.world.surroundings.plant.board.reset(self.world.now_us, 1_000_000)
                return
            else:
                faults.set(name, self.rng.uniform(0.05, 0.6) if name in SHARES else True)
            self.broken.append((second + self.rng.randrange(1, 15), name))


def check(run_dir: Path, minutes: float) -> tuple[float, float]:
    """Sail and replay; return (processor seconds of the replay, share of ticks under way)."""
    Trouble(run_dir, 9).sail(60 * minutes)
    began = time.process_time()
    outcome = replay(run_dir)
    spent_s = time.process_time() - began
    assert outcome.identical, summary(outcome, spent_s)
    assert outcome.ticks == outcome.rows_compared == round(60 * minutes * 20)
    text = (run_dir / "events.jsonl").read_text()
    kinds = {json.loads(line)["event"] for line in text.splitlines()}
    assert {"mode", "armed", "action", "causes", "text", "reached", "output"} <= kinds
    return spent_s, outcome.duration_s / spent_s


WATCH = """<!doctype html><body><script>
const began = performance.now(), frame = document.createElement("iframe");
frame.style = "width:1100px;height:6000px";
frame.onload = () => { frame.getBoundingClientRect(); document.title = "opened in " + (performance.now() - began); };
frame.src = "REPORT";
document.body.appendChild(frame);
</script></body>"""


def opening_s(report: Path) -> float:
    """How long a browser takes to open a page, without its own start."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    require(browser is not None, "chromium")
    watch = report.with_name("watch.html")
    watch.write_text(WATCH.replace("REPORT", report.name))
    words = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={report.parent}/profile", "--dump-dom"]
    done = subprocess.run([browser, *words, watch.as_uri()], capture_output=True, text=True, timeout=60, check=True)
    found = re.search(r"opened in ([\d.]+)", done.stdout)
    assert found, "the page was not opened"
    return float(found[1]) / 1000.0


def test_four_minutes_of_trouble_replay_bit_for_bit(tmp_path):
    _, speed = check(tmp_path, 4)
    print(f"replayed at {speed:.0f} times real time")


@pytest.mark.soak
def test_two_hours_of_trouble_replay_bit_for_bit_and_report(tmp_path):
    _, speed = check(tmp_path, 120)
    began = time.process_time()
    page = make_page(read_run(tmp_path))
    report_s = time.process_time() - began
    print(f"replayed at {speed:.0f} times real time; report {len(page) / 1e6:.2f} MB, made in {report_s:.1f} s")
    if target := os.environ.get("KEEP_REPORT"):
        Path(target).write_text(page)
    assert len(page) < 5_000_000
    report = tmp_path / "report.html"
    report.write_text(page)
    assert opening_s(report) < 2.0
    require(PYPY.exists(), "PyPy (make pypy)")
    done = subprocess.run([PYPY, "replay", tmp_path, "--json"], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert (found["identical"], found["ticks"]) == (True, 144_000)
    speed = found["duration_s"] / found["wall_s"]
    print(f"replayed by PyPy at {speed:.0f} times real time")
    assert speed >= 500
