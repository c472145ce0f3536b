"""MAVSDK plans and watches the vessel through the gateway: 651 bit/s on the simulated air, in real time."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from pymavlink import mavutil

from tests.e2e.sim import BIN, LAT_DEG, LON_DEG, REPO, Sim, circle_rms_m, client

GATEWAY_INSTANCE = 70
"""The gateway of instance N serves the port on which instance N + 1 speaks to its ground station: no neighbours here."""
LOITER_S = 32.0
RADIUS_M = 10.0
"""In real time: two thirds of a small lap are enough to see it sailed."""


def test_mavsdk_through_the_gateway(tmp_path: Path) -> None:
    with Sim(tmp_path / "run", GATEWAY_INSTANCE, speed=1.0, arguments=("--gateway",)) as sim:
        lines = client(
            "mavsdk_loiter.py",
            f"udpin://0.0.0.0:{sim.port(14560)}",
            str(LAT_DEG),
            str(LON_DEG),
            str(LOITER_S),
            "ardurover",
            f"--radius-m={RADIUS_M}",
            limit_s=150.0,
        )
    done = {line["step"]: line["at_s"] for line in lines if line["step"] != "progress"}
    print(done)
    assert {"uploaded", "armed", "started", "done"} <= set(done)
    assert done["uploaded"] - done["connected"] < 20.0
    rms_m, worst_m, laps = circle_rms_m(sim.run_dir, LAT_DEG, LON_DEG, RADIUS_M)
    print(f"radius error against truth: {rms_m:.3f} m RMS, {worst_m:.3f} m at most, {laps:.2f} laps")
    assert rms_m < 1.0
    assert laps > 0.6


def test_world_and_gateway_beside_a_separate_vessel(tmp_path: Path) -> None:
    """``companion sim --world-only --gateway`` says what the vessel needs, and with that the two hear each other."""
    instance, run_dir = GATEWAY_INSTANCE + 5, tmp_path / "run"
    words = ["sim", "--world-only", "--gateway", "--instance", str(instance), "--run-dir", str(run_dir)]
    with subprocess.Popen([BIN / "companion", *words], stdout=subprocess.PIPE, text=True, cwd=REPO) as world:
        assert world.stdout is not None
        told = next(line for line in world.stdout if "the vessel needs" in line)
        own = [f"sensors.0.url=tcp://127.0.0.1:{3000 + 10 * instance}", "endpoints=[]"]
        given = [*re.findall(r"--set (\S+)", told), *own]
        vessel = subprocess.Popen(
            [BIN / "companion", "run", "config/sim.toml", "--run-dir", str(run_dir)]
            + [word for item in given for word in ("--set", item)],
            cwd=REPO,
        )
        station = mavutil.mavlink_connection(f"udpin:127.0.0.1:{14560 + 10 * instance}", dialect="all")
        try:
            heard = station.wait_heartbeat(timeout=60)
        finally:
            station.close()
            for process in (vessel, world):
                process.terminate()
                process.wait(20)
    assert heard is not None
    assert (heard.get_srcSystem(), heard.type) == (1 + instance, 11)
