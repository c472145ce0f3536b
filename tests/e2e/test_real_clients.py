"""Real ground-station software against the simulated vessel, every service: MAVSDK and MAVProxy, without one warning in their logs."""

from __future__ import annotations

import math
import random
import struct
import zlib
from pathlib import Path

import pytest

from tests.e2e.sim import LAT_DEG, LON_DEG, Sim, client
from tests.qgc_client import QgcClient, run


def lines_of(lines: list[dict[str, object]], step: str) -> list[dict[str, object]]:
    return [line for line in lines if line["step"] == step]


@pytest.mark.parametrize(("persona", "port", "instance"), [("generic", 14540, 21), ("ardurover", 14550, 22)])
def test_mavsdk_services(tmp_path: Path, persona: str, port: int, instance: int) -> None:
    """Three times real time: a heartbeat a second from the station is then one in 3 s."""
    log = earlier_log(tmp_path / "runs")
    changes = ("--set", "operator.gcs_required=false", "--set", f"record.directory={tmp_path / 'runs'}")
    with Sim(tmp_path / "run", instance, speed=3.0, arguments=changes) as sim:
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
    assert bool(lines_of(lines, "mission refused")) is (persona == "ardurover")
    assert lines_of(lines, "mission finished")
    assert lines_of(lines, "takeoff refused")
    if persona == "generic":
        assert lines_of(lines, "logs")[0]["first"] == "2026-05-28T20:26:40Z"
        assert lines_of(lines, "log") == [{**lines_of(lines, "log")[0], "result": "SUCCESS", "crc": zlib.crc32(log)}]


def earlier_log(folder: Path) -> bytes:
    """Put the log of an earlier run there; its content is returned."""
    content = struct.pack(">Q", 1_780_000_000_000_000) + random.Random(1).randbytes(100_000)
    (folder / "earlier").mkdir(parents=True)
    (folder / "earlier" / "mavlink.tlog").write_bytes(content)
    return content


def test_mavproxy_services(tmp_path: Path) -> None:
    folder = tmp_path / "mavproxy"
    folder.mkdir()
    log = earlier_log(tmp_path / "runs")
    with Sim(tmp_path / "run", 23, speed=1.0, arguments=("--set", f"record.directory={tmp_path / 'runs'}")) as sim:
        lines = client(
            "mavproxy_services.py", f"tcp:127.0.0.1:{sim.port(5760)}", str(LAT_DEG), str(LON_DEG), str(folder)
        )
    assert lines_of(lines, "done")
    assert lines_of(lines, "complaints")[0]["lines"] == []
    took_s = lines_of(lines, "parameters")[0]["took_s"]
    assert isinstance(took_s, float)
    assert took_s < 2.0
    assert (folder / "log1.bin").read_bytes() == log


def test_qgc_like_client_over_real_links(tmp_path: Path) -> None:
    """QGroundControl's connect sequence over UDP and TCP, in real time: no complaint, no resend, in less than 2 s."""
    with Sim(tmp_path / "run", 24, speed=1.0) as sim:
        for where in (
            f"udp:127.0.0.1:{sim.port(14550)}",
            f"tcp:127.0.0.1:{sim.port(5760)}",
            f"udp:127.0.0.1:{sim.port(14540)}",
        ):
            station = QgcClient()
            items = [(0, 16, 0.0, 0.0, 0.0, 0.0, 411_852_000, -87_060_000, 0.0)]
            items += [(3, 16, 0.0, 0.0, 0.0, math.nan, 411_852_000 + 100 * n, -87_060_000, 50.0) for n in range(99)]
            station.then(station.upload(0, items))
            report = run(where, station)
            assert report.failures == []
            assert report.finished_s is not None, f"{where}: nothing heard; the simulator said\n{sim.log.read_text()}"
            assert report.finished_s < 2.0
            assert len(report.params) > 60
            assert station.result == 0
