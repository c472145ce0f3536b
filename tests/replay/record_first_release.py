"""Makes ``tests/data/first_release``: every file that the first release leaves on a disk, for the upgrade tests.

Run it in a checkout of commit 16c6ddc, the first release: ``python -m tests.replay.record_first_release [NAME ...]``. With today's program
it would make today's files and prove nothing; so it is kept to show how the fixtures came to be. ``home`` is a boat's
own files (store, gateway's store, one run) out of virtual time; the others are live runs with real ground stations.
"""

from __future__ import annotations

import contextlib
import json
import lzma
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import config as shipped
from companion.commands.run import describe
from companion.gateway import Gateway, GatewaySettings
from companion.io.keeping.keys import write_key
from companion.io.keeping.store import Store
from companion.io.links.mem import pair
from companion.report.from_tlog import find_vehicle
from companion.settings.schema import EndpointSettings, load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import dialect
from sitl.gateway import simulation_key, with_gateway
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.e2e.sim import BIN, CLIENTS, LAT_DEG, LON_DEG, REPO, Sim
from tests.scenario.test_signed_links import HEARTBEAT, Station

DATA = Path(__file__).resolve().parents[1] / "data" / "first_release"
STARTED_UTC_US = 1_767_225_600_000_000
X, Y = 411_852_000, -87_060_000
SPEED = PlanItem(178, 2, 1, 1.5, -1, 0, 0, 0, 0.0)
PLANS = {
    PlanKind.MISSION: [
        SPEED,
        PlanItem(16, 6, 0, 2.0, 0, 0, X - 1000, Y - 1500, 0.0),
        PlanItem(18, 6, 1.0, 0, 15.0, 1, X, Y, 0.0),
    ],
    PlanKind.FENCE: [
        PlanItem(5001, 0, 4, 0, 0, 0, X + a, Y + b, 0.0)
        for a, b in ((-40_000, -40_000), (-40_000, 40_000), (40_000, 40_000), (40_000, -40_000))
    ],
    PlanKind.RALLY: [
        PlanItem(5100, 3, 0, 0, 0, 0, X + 1000, Y + 1000, 0.0),
        PlanItem(5100, 3, 0, 0, 0, 0, X - 1000, Y - 1000, 0.0),
    ],
}
KEPT = (0, 73, 77, 253)
"""HEARTBEAT, MISSION_ITEM_INT, COMMAND_ACK, STATUSTEXT."""
PARAMETERS = {"DEPTH_MIN": 1.75, "CRUISE_SPEED": 1.25, "FS_GCS_TIMEOUT": 45.0}


def keep(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_name(f"{path.name}.xz").write_bytes(lzma.compress(data, preset=9 | lzma.PRESET_EXTREME))


def keep_store(path: Path, name: str) -> None:
    """One file, as after a clean end: SQLite's journals played in."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    keep(DATA / "home" / name, path.read_bytes())


def keep_run(run_dir: Path, name: str, *, frames_of_the_vessel: bool) -> None:
    """A run folder; of the telemetry log, where it is not wanted whole, what the stations said and one of the vessel's frames in 50."""
    for path in sorted(run_dir.iterdir()):
        if path.is_file() and path.suffix in (".json", ".bin", ".csv", ".jsonl", ".tlog"):
            data = path.read_bytes()
            if path.suffix == ".tlog" and not frames_of_the_vessel:
                data = cut(data)
            if path.suffix == ".csv" and not frames_of_the_vessel:
                continue
            keep(DATA / name / path.name, data)


def cut(log: bytes) -> bytes:
    records = list(tlog.iterate(log))
    vehicle = find_vehicle(records)
    assert vehicle is not None
    out = bytearray()
    for number, record in enumerate(records):
        if record.frame.system != vehicle[0] or number % 50 == 0 or record.frame.message_id in KEPT:
            out += tlog.pack(record.t_us, record.link, record.frame.raw)
    return bytes(out)


def home() -> None:
    """A boat with plan, fence, rally points, parameters, sounded water, a signed station and the radio; its shore side too."""
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder)
        write_key(base / "signing.key", bytes(range(32)))
        found = load(
            shipped.path("sim.toml"),
            ["operator.gcs_required=false", f"security.key_file={base / 'signing.key'}"],
            SimSettings,
        )
        endpoints = tuple(
            item.model_copy(update={"link_class": "signed" if item.name == "gcs" else "trusted"})
            for item in found.endpoints
        )
        settings = with_gateway(found.model_copy(update={"endpoints": endpoints}), base)
        run_dir = base / "run"
        world = World(
            settings, 5, run_dir=run_dir, store=Store(base / "companion.db"), about=describe(settings, seed=5)
        )
        near, _ = pair("gcs")
        gateway = Gateway(
            GatewaySettings(
                profile=settings.radio.profile,
                key_file=str(simulation_key(base)),
                endpoints=(EndpointSettings(name="gcs", url="mem:gcs"),),
            ),
            modem=world.ground("shore"),
            make_link=lambda name, url: near,
            store=Store(base / "gateway.db"),
            rng=random.Random(5),
            started_utc_us=STARTED_UTC_US,
        )

        def run(seconds: float) -> None:
            for _ in range(round(seconds * 20)):
                world.step()
                gateway.tick(world.now_us)
                time.sleep(0.0005)  # the writer thread is real

        run(5.0)
        station = Station(world, "gcs")
        station.send(HEARTBEAT)
        for name, value in PARAMETERS.items():
            station.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, 9))
            station.tick()
        for kind, items in PLANS.items():
            plan = load_plan(kind, items)
            assert isinstance(plan, LoadPlan), plan
            world.app.submit(plan)
            run(1.0)
        run(40.0)
        gateway.twin.submit("operator", Arm(True), world.now_us)
        run(10.0)
        gateway.twin.submit("operator", StartPlan(), world.now_us)
        run(50.0)
        world.shutdown(world.now_us)
        gateway.shutdown(world.now_us)
        content = Store(base / "companion.db").snapshot()
        print(
            {
                name: len(getattr(content, name))
                for name in ("plans", "params", "ledger", "stamps", "counters", "values", "depth")
            }
        )
        print(sorted(content.values), sorted(Store(base / "gateway.db").snapshot().values))
        keep_store(base / "companion.db", "companion.db")
        keep_store(base / "gateway.db", "gateway.db")
        keep_run(run_dir, "home/run", frames_of_the_vessel=True)


@contextlib.contextmanager
def client(*words: object) -> Iterator[subprocess.Popen[bytes]]:
    environment = {**os.environ, "PYTHONPATH": f"{REPO}:{CLIENTS}"}
    process = subprocess.Popen([sys.executable, *map(str, words)], cwd=REPO, env=environment)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_for(run_dir: Path, text: str, limit_s: float) -> None:
    path = run_dir / "events.jsonl"
    deadline = time.monotonic() + limit_s
    while time.monotonic() < deadline:
        if path.exists() and text in path.read_text():
            return
        time.sleep(0.5)
    raise SystemExit(f"never saw {text!r}: {path.read_text()[-2000:]}")


def live(
    name: str,
    instance: int,
    words: Callable[[Sim, Path], list[object]],
    *arguments: str,
    speed: float = 2.0,
    until: str = "plan complete",
) -> None:
    """A live run with one ground station."""
    with tempfile.TemporaryDirectory() as folder:
        run_dir = Path(folder) / "run"
        (Path(folder) / "client").mkdir()
        options = ("--set", "operator.gcs_required=false", "--set", f"store={folder}/state.db", *arguments)
        with Sim(run_dir, instance, speed, options) as sim, client(*words(sim, Path(folder) / "client")):
            wait_for(run_dir, until, 240.0)
            time.sleep(2.0)
        keep_run(run_dir, name, frames_of_the_vessel=False)
        print(name, json.loads((run_dir / "run.json").read_text()).get("version"))


PLACE = (LAT_DEG, LON_DEG)
LOITER_S = 15.0
SHOAL = (41.1860932, LON_DEG)


RUNS: dict[str, Callable[[], None]] = {
    "home": home,
    "mavsdk-generic": lambda: live(
        "mavsdk-generic",
        61,
        lambda sim, _: [CLIENTS / "mavsdk_loiter.py", f"udpin://0.0.0.0:{sim.port(14540)}", *PLACE, LOITER_S],
    ),
    "mavsdk-ardurover": lambda: live(
        "mavsdk-ardurover",
        62,
        lambda sim, _: [
            CLIENTS / "mavsdk_loiter.py",
            f"udpin://0.0.0.0:{sim.port(14550)}",
            *PLACE,
            LOITER_S,
            "ardurover",
        ],
    ),
    "mavproxy-ardurover": lambda: live(
        "mavproxy-ardurover",
        63,
        lambda sim, folder: [
            CLIENTS / "mavproxy_loiter.py",
            f"tcp:127.0.0.1:{sim.port(5760)}",
            *PLACE,
            LOITER_S,
            folder,
        ],
    ),
    "mavproxy-generic": lambda: live(
        "mavproxy-generic",
        64,
        lambda sim, folder: [
            CLIENTS / "mavproxy_loiter.py",
            f"udpin:127.0.0.1:{sim.port(14540)}",
            *PLACE,
            LOITER_S,
            folder,
            "generic",
        ],
    ),
    "qgc-ardurover": lambda: live(
        "qgc-ardurover", 65, lambda sim, _: [CLIENTS / "qgc_loiter.py", sim.port(14550), *PLACE, LOITER_S, 90]
    ),
    "qgc-generic": lambda: live(
        "qgc-generic", 66, lambda sim, _: [CLIENTS / "qgc_loiter.py", sim.port(14540), *PLACE, LOITER_S, 90]
    ),
    "guard-stop": lambda: live(
        "guard-stop",
        67,
        lambda sim, _: [CLIENTS / "mavsdk_loiter.py", f"udpin://0.0.0.0:{sim.port(14540)}", *SHOAL, LOITER_S],
        until='"action", "value": "STOP"',
    ),
    "gateway": lambda: live(
        "gateway",
        68,
        lambda sim, _: [
            CLIENTS / "mavsdk_loiter.py",
            f"udpin://0.0.0.0:{sim.port(14560)}",
            *PLACE,
            LOITER_S,
            "ardurover",
        ],
        "--gateway",
        speed=1.0,
    ),
    "radio": lambda: live(
        "radio",
        69,
        lambda sim, _: [
            CLIENTS / "mavsdk_loiter.py",
            f"serial://{sim.run_dir}/lora:9600",
            *PLACE,
            LOITER_S,
            "ardurover",
        ],
        speed=1.0,
    ),
}


def main() -> None:
    """Record all, or those named."""
    assert BIN.is_dir()
    for name in sys.argv[1:] or RUNS:
        RUNS[name]()


if __name__ == "__main__":
    main()
