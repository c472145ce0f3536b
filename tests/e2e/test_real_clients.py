"""Real ground-station software against the simulated vessel, every service: MAVSDK and MAVProxy, without one warning in their logs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.e2e.sim import LAT_DEG, LON_DEG, Sim, client


def lines_of(lines: list[dict[str, object]], step: str) -> list[dict[str, object]]:
    return [line for line in lines if line["step"] == step]


@pytest.mark.parametrize(("persona", "port", "instance"), [("generic", 14540, 21), ("ardurover", 14550, 22)])
def test_mavsdk_services(tmp_path: Path, persona: str, port: int, instance: int) -> None:
    with Sim(tmp_path / "run", instance, speed=1.0) as sim:
        lines = client("mavsdk_services.py", f"udpin://0.0.0.0:{sim.port(port)}", persona, str(LAT_DEG), str(LON_DEG))
    assert lines_of(lines, "done")
    assert not lines_of(lines, "complaints")
    (params,) = lines_of(lines, "params")
    assert isinstance(params["floats"], int)
    assert params["floats"] > 60
    assert params["ints"] == 0, "all parameters are REAL32"
    assert lines_of(lines, "param set")[0]["value"] == 1.25
    assert len(lines_of(lines, "param refused")) == 2
    assert lines_of(lines, "fence")[0]["polygons"] == [4]
    assert lines_of(lines, "fence")[0]["circles"] == [30.0]
    x, y = round(LAT_DEG * 1e7), round(LON_DEG * 1e7)
    assert lines_of(lines, "raw mission")[0]["items"] == [[16, 0.0, 0.0, x + 1000, y], [18, 2.0, -25.0, x, y]]
    assert lines_of(lines, "takeoff refused")
