"""Starts the simulator as a user does, in a process of its own, and reads what it left behind."""

from __future__ import annotations

import csv
import json
import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

BIN = Path(sys.executable).parent
REPO = Path(__file__).resolve().parents[2]
CLIENTS = Path(__file__).resolve().parent / "clients"
LAT_DEG, LON_DEG = 41.1852, -8.7060
"""A loiter centre some 27 m from the default start, in deep water."""


def free_instance(wanted: int) -> int:
    """Return the wanted instance number, or one further on when a forgotten program sits on its ports."""
    for instance in range(wanted, wanted + 300, 50):
        with socket.socket() as nmea, socket.socket() as gcs:
            if all(
                probe.connect_ex(("127.0.0.1", base + 10 * instance)) for probe, base in ((nmea, 3000), (gcs, 5760))
            ):
                return instance
    raise AssertionError(f"no free ports from instance {wanted} on")


class Sim:
    """``companion sim`` in the background; ends with SIGINT."""

    def __init__(self, run_dir: Path, instance: int, speed: float = 8.0, arguments: Sequence[str] = ()) -> None:
        self.run_dir = run_dir
        self.instance = instance = free_instance(instance)
        self.log = run_dir.with_suffix(".log")
        words = [
            "sim",
            "--speed",
            str(speed),
            "--instance",
            str(instance),
            "--run-dir",
            str(run_dir),
            "--json",
            *arguments,
        ]
        with self.log.open("w") as log:
            self.process = subprocess.Popen([BIN / "companion", *words], stdout=log, stderr=subprocess.STDOUT, cwd=REPO)

    def port(self, base: int) -> int:
        return base + 10 * self.instance

    def wait_ready(self, limit_s: float = 30.0) -> None:
        """Wait until the TCP endpoint answers."""
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            if self.process.poll() is not None:
                raise AssertionError(f"the simulator ended at once:\n{self.log.read_text()}")
            try:
                socket.create_connection(("127.0.0.1", self.port(5760)), timeout=1.0).close()
            except OSError:
                time.sleep(0.1)
            else:
                if (self.run_dir / "lora").exists():
                    return
        raise AssertionError(f"no answer on port {self.port(5760)} in {limit_s} s")

    def stop(self) -> int:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(30.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise

    def __enter__(self) -> Sim:
        self.wait_ready()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.stop()


def client(name: str, *words: str, limit_s: float = 240.0) -> list[dict[str, object]]:
    """Run a client script and return the JSON lines that it printed. A failure shows all of its output."""
    environment = {**os.environ, "PYTHONPATH": str(REPO)}
    done = subprocess.run(
        [sys.executable, CLIENTS / name, *words],
        capture_output=True,
        text=True,
        timeout=limit_s,
        cwd=REPO,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, f"{name} failed\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def circle_rms_m(run_dir: Path, lat_deg: float, lon_deg: float, radius_m: float) -> tuple[float, float, float]:
    """Return (RMS radius error, largest, laps sailed) against truth, from the first touch of the circle in Auto."""
    north_per_deg, east_per_deg = 111_066.0, 111_320.0 * math.cos(math.radians(lat_deg))
    errors: list[float] = []
    turned, last = 0.0, None
    with (run_dir / "truth.csv").open() as file:
        for row in csv.DictReader(file):
            if row["mode"] != "Auto" or row["armed"] != "1":
                continue
            north = (float(row["lat_deg"]) - lat_deg) * north_per_deg
            east = (float(row["lon_deg"]) - lon_deg) * east_per_deg
            error = math.hypot(north, east) - radius_m
            if not errors and abs(error) > 0.5:
                continue
            errors.append(error)
            bearing = math.atan2(east, north)
            if last is not None:
                turned += math.remainder(bearing - last, 2.0 * math.pi)
            last = bearing
    assert errors, "the vessel never reached the circle"
    rms = math.sqrt(sum(error * error for error in errors) / len(errors))
    return rms, max(map(abs, errors)), turned / (2.0 * math.pi)
