"""MAVSDK plans and watches the vessel through the gateway: 651 bit/s on the simulated air, in real time."""

from __future__ import annotations

from pathlib import Path

from tests.e2e.sim import LAT_DEG, LON_DEG, Sim, circle_rms_m, client

LOITER_S = 100.0


def test_mavsdk_through_the_gateway(tmp_path: Path) -> None:
    with Sim(tmp_path / "run", 14, speed=1.0, arguments=("--gateway",)) as sim:
        lines = client(
            "mavsdk_loiter.py",
            f"udpin://0.0.0.0:{sim.port(14560)}",
            str(LAT_DEG),
            str(LON_DEG),
            str(LOITER_S),
            "ardurover",
            limit_s=400.0,
        )
    done = {line["step"]: line["at_s"] for line in lines if line["step"] != "progress"}
    print(done)
    assert {"uploaded", "armed", "started", "done"} <= set(done)
    assert done["uploaded"] - done["connected"] < 20.0
    rms_m, worst_m, laps = circle_rms_m(sim.run_dir, LAT_DEG, LON_DEG, 20.0)
    print(f"radius error against truth: {rms_m:.3f} m RMS, {worst_m:.3f} m at most, {laps:.2f} laps")
    assert rms_m < 1.0
    assert laps > 0.9
