"""``companion trial`` against the simulator through real MAVSDK."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.e2e.sim import BIN, Sim


@pytest.mark.e2e
def test_a_trial_is_looked_at_begun_watched_and_stopped(tmp_path: Path) -> None:
    pytest.importorskip("mavsdk")
    with Sim(tmp_path / "run", instance=47, speed=4.0) as sim:
        words = [BIN / "companion", "trial"]
        url = ("--url", f"udpin://0.0.0.0:{sim.port(14540)}")
        looked = subprocess.run([*words, "check", *url], capture_output=True, text=True, timeout=60, check=False)
        assert looked.returncode == 0, looked.stderr
        assert "A sea trial may begin here: a circle of 80 m" in looked.stderr
        with subprocess.Popen(
            [*words, "start", "--quick", *url],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as start:
            assert start.stdin is not None
            assert start.stderr is not None
            heard = ""
            for line in start.stderr:
                heard += line
                if "Trial 1/10 in 5 s" in line:
                    start.stdin.write("full\n")
                elif "whole throttle allowed" in line:
                    start.stdin.write("stop\n")
                start.stdin.flush()
            assert start.wait(30.0) == 1
        assert "rest: the drift (half throttle until confirmed)" in heard
        assert "Trial ended: ordered; 0 of 10 manoeuvres done" in heard
