"""Benchmarks of the whole process: start-up, memory, processor share, latency, lateness, simulation and replay speed.

The vessel's process runs as a user starts it, beside a world of its own, with one ground station that talks.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from companion.io.links import Received
from companion.io.recording import InputReader
from companion.replay import replay
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.plans import PlanFile, write_plan
from tools.figures import row
from tools.plan_items import plan_item

REPO = Path(__file__).resolve().parents[2]
COMPANION = Path(sys.executable).parent / "companion"
PYPY = REPO / ".venv-pypy/bin/companion"
INSTANCE = 41
"""Ports 410 above the usual ones, so that nothing else is in the way."""
WATCH_S = 30.0
COMING_S = 4.0
"""Two watchers' programs start: that is their own work, on the same computer."""
SIM_S, LOITER_S = 1800.0, 100.0
UNDER_WAY_S = 600.0
LONG_S = 7200.0
"""PyPy needs some seconds to compile what it sees: it is for long runs."""
PERIOD_S = 0.05


def run() -> list[dict[str, Any]]:
    """All figures of the process."""
    with tempfile.TemporaryDirectory() as folder:
        return [
            *process_figures(Path(folder) / "live"),
            *simulation_figures(Path(folder) / "sim"),
            *pypy_figures(Path(folder) / "pypy"),
        ]


class Station:
    """A ground station that only says that it is there."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.settimeout(15.0)
        self._deframer = Deframer(datagrams=True)
        self._codec = Codec(255, 190)

    def wait_heartbeat(self) -> tuple[str, int]:
        """Wait for a vehicle's heartbeat; return its address."""
        while True:
            data, address = self.socket.recvfrom(2048)
            if any(frame.message_id == 0 for frame in self._deframer.receive(data, 0)):
                return str(address[0]), int(address[1])

    def talk(self, address: tuple[str, int], seconds: float) -> int:
        """Send a heartbeat each second and read what comes; return the bytes read."""
        end, due, size = time.monotonic() + seconds, 0.0, 0
        self.socket.settimeout(0.05)
        while (now := time.monotonic()) < end:
            if now >= due:
                due = now + 1.0
                self.socket.sendto(
                    self._codec.encode(
                        dialect.MAVLink_heartbeat_message(
                            type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=0, mavlink_version=3
                        )
                    ),
                    address,
                )
            with contextlib.suppress(TimeoutError):
                size += len(self.socket.recv(2048))
        return size


@contextlib.contextmanager
def started(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A companion process that is ended at the end."""
    with subprocess.Popen(
        [COMPANION, *words], cwd=REPO, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def process_figures(run_dir: Path) -> list[dict[str, Any]]:
    """Start-up, memory, processor share and latencies of ``companion run``."""
    offset = 10 * INSTANCE
    words = ["run", "config/sim.toml", "--run-dir", str(run_dir)]
    for key, url in (
        ("sensors.0.url", f"tcp://127.0.0.1:{3000 + offset}"),
        ("endpoints.0.url", f"udp://127.0.0.1:{14550 + offset}"),
        ("endpoints.1.url", f"udp://127.0.0.1:{14540 + offset}"),
        ("endpoints.2.url", f"tcp-listen://127.0.0.1:{5760 + offset}"),
    ):
        words += ["--set", f"{key}={url}"]
    station = Station(14550 + offset)
    with started("sim", "--world-only", f"--instance={INSTANCE}", f"--run-dir={run_dir}"):
        deadline = time.monotonic() + 20
        while not (run_dir / "arduino").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        began = time.monotonic()
        with started(*words) as vessel:
            address = station.wait_heartbeat()
            heartbeat_s, start_cpu_s = time.monotonic() - began, processor_s(vessel.pid)
            station.talk(address, 2.0)
            cpu_before, wall_before = processor_s(vessel.pid), time.monotonic()
            station.talk(address, WATCH_S)
            share = (processor_s(vessel.pid) - cpu_before) / (time.monotonic() - wall_before)
            memory = resident_mb(vessel.pid)
            with started("status", str(run_dir)), started("status", str(run_dir), "--json"):
                station.talk(address, COMING_S)
                station.talk(address, WATCH_S)
    station.socket.close()
    return [
        row("vessel: start to first heartbeat", heartbeat_s, "s", 0.7),
        row("vessel: processor time until the first heartbeat", start_cpu_s, "s"),
        row("vessel: resident memory", memory, "MB", 60.0),
        row("vessel: processor share, 20 Hz, one ground station", 100.0 * share, "% of a core", 5.0),
        *recorded_figures(run_dir),
    ]


def processor_s(pid: int) -> float:
    """User and system time of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mb(pid: int) -> float:
    """Resident memory of a process."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024.0
    return float("nan")


def recorded_figures(run_dir: Path) -> list[dict[str, Any]]:
    """From the recorded inputs: how late ticks came, and how long sensor bytes waited for the actuators' next frame.

    What came before the first frame waited for the board to start, which is no latency of steering. At the end two
    ``companion status`` watch; before they came nobody did.
    """
    reader = InputReader(run_dir / "inputs.bin")
    names = [entry["name"] for entry in reader.meta["links"]]
    sensor, actuators = 0, names.index("actuators")
    late, loads, waits, arrived = [], [], [], []
    running = False
    for step in reader.steps():
        if step.kind == "tick":
            late.append(step.late_s)
            loads.append(step.load)
        if any(isinstance(event, Received) for events in step.polls.get(sensor, {}).values() for event in events):
            arrived.append(step.now_us)
        if step.writes.get(actuators):
            waits += [(step.now_us - at) * 1e-6 for at in arrived if running]
            arrived.clear()
            running = True
    reader.close()
    watched = round(WATCH_S / PERIOD_S)
    alone = late[: -watched - round(COMING_S / PERIOD_S)][-watched:]
    alone_s, watched_s = share_of(alone, 0.99), share_of(late[-watched:], 0.99)
    wait_s = share_of(waits, 0.99) + share_of(loads, 0.99) * PERIOD_S
    return [
        row("vessel: NMEA byte to Arduino byte, 99 %", 1000.0 * wait_s, "ms", 1000.0 * PERIOD_S),
        row("vessel: tick lateness, 99 %", 1000.0 * share_of(late, 0.99), "ms", 5.0),
        row("vessel: tick lateness with two watchers over that with none, 99 %", watched_s / alone_s, "x", 1.1),
        row("vessel: processor time of a tick, median", 1000.0 * share_of(loads, 0.5) * PERIOD_S, "ms"),
    ]


def share_of(values: list[float], share: float) -> float:
    """The value below which ``share`` of the values lie."""
    ordered = sorted(values) or [float("nan")]
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def simulation_figures(run_dir: Path) -> list[dict[str, Any]]:
    """Simulation speed with recorder, truth and all endpoints; replay speed and that it is exact."""
    usual = sailed(COMPANION, run_dir.with_name("usual"), SIM_S, LOITER_S)["speed_up"]
    under_way = sailed(COMPANION, run_dir, UNDER_WAY_S, UNDER_WAY_S)["speed_up"]
    began = time.process_time()
    outcome = replay(run_dir)
    replay_s = time.process_time() - began
    return [
        row(
            "simulation, CPython, 100 s loiter, then holding, 30 min: times real time", usual, "x", 200.0, at_least=True
        ),
        row("simulation, CPython, under way throughout: times real time", under_way, "x"),
        row("replay, CPython, under way throughout: times real time", UNDER_WAY_S / replay_s, "x"),
        row("replay: differences", float(outcome.different), "", 0.0),
    ]


def pypy_figures(run_dir: Path) -> list[dict[str, Any]]:
    """The same under PyPy, two hours under way throughout; nothing where ``make pypy`` was not run."""
    if not PYPY.exists():
        print("    no PyPy here (make pypy): its figures are left out", file=sys.stderr)
        return []
    speed_up = sailed(PYPY, run_dir, LONG_S, LONG_S)["speed_up"]
    found = said(PYPY, "replay", str(run_dir), "--json")
    here = replay(run_dir)
    return [
        row("simulation, PyPy, under way throughout, 2 h: times real time", speed_up, "x", 500.0, at_least=True),
        row(
            "replay, PyPy, under way throughout, 2 h: times real time",
            LONG_S / found["wall_s"],
            "x",
            500.0,
            at_least=True,
        ),
        row("replay, PyPy: differences", float(len(found["differences"])), "", 0.0),
        row("replay of PyPy's recording by CPython: differences", float(here.different), "", 0.0),
    ]


def sailed(program: Path, run_dir: Path, seconds: float, loiter_s: float) -> dict[str, Any]:
    """Sail a loiter with recorder, truth and all endpoints, then hold; return the simulator's summary."""
    plan = run_dir.with_suffix(".plan")
    circle = plan_item(19, (loiter_s, 0.0, 20.0, 1.0), at_e7=(411_852_000, -87_060_000))
    plan.write_text(
        write_plan(
            PlanFile(
                mission=(
                    plan_item(178, (1.0, 1.5, -1.0, 0.0), frame=2),
                    circle,
                )
            )
        )
    )
    words = ("--plan", plan, "--start", "--speed", "max", "--duration", seconds, "--run-dir", run_dir, "--json")
    return said(program, "sim", *map(str, words))


def said(program: Path, *words: str) -> dict[str, Any]:
    """The object that a command prints last."""
    done = subprocess.run([program, *words], cwd=REPO, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
