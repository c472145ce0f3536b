"""The original's bench, which joined two serial ports by socat: a JSON plan echoed into the shore modem's port starts a loiter."""

from __future__ import annotations

import csv
import json
import shlex
import subprocess
import time
from pathlib import Path

from tests.e2e.sim import Sim
from tests.plans import SEED_LOITER


def sails(run_dir: Path) -> bool:
    truth = run_dir / "truth.csv"
    if not truth.exists():
        return False
    with truth.open() as file:
        return any((row.get("mode"), row.get("armed")) == ("Auto", "1") for row in csv.DictReader(file))


def test_a_plan_echoed_into_the_port_starts_a_loiter(tmp_path: Path) -> None:
    words = ("--set", "radio.protocol=json", "--set", "operator.gcs_required=false")
    with Sim(tmp_path / "run", instance=90, speed=1.0, arguments=words) as sim:
        echo = f"echo {shlex.quote(json.dumps(SEED_LOITER))} > {shlex.quote(str(sim.run_dir / 'lora'))}"
        deadline, again = time.monotonic() + 60.0, 0.0
        while not sails(sim.run_dir) and time.monotonic() < deadline:
            if time.monotonic() >= again:
                # a state of the vessel may be on the air: who echoes by hand sees no answer, and echoes again
                again = time.monotonic() + 12.0
                subprocess.run(["sh", "-c", echo], check=True)
            time.sleep(0.5)
        assert sails(sim.run_dir)
