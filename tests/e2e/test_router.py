"""A station behind a real router, as docs/REACHING.md tells to set it up: MAVProxy between the vessel's TCP port and a station on UDP."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.e2e.sim import BIN, LAT_DEG, LON_DEG, Sim
from tests.qgc_buttons import ARM, GUIDED, HOLD, Steps
from tests.qgc_client import QgcClient, run


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def morning(station: QgcClient) -> Steps:
    """Plan, Guided, arm, Hold, disarm.

    Begun after a heartbeat has gone through: the first one is said before the socket knows whom to tell, and no hand is on the screen so
    soon. The vessel arms for no station whose HEARTBEAT it has not heard.
    """
    yield ("a heartbeat of ours", lambda message: False, 1.5)
    x, y = round(LAT_DEG * 1e7), round(LON_DEG * 1e7)
    home = (0, 16, 0.0, 0.0, 0.0, 0.0, x, y, 0.0)
    stored = yield from station.upload_plan(
        [home, *[(3, 16, 0.0, 0.0, 0.0, 0.0, x + 500 * n, y, 0.0) for n in range(1, 9)]]
    )
    guided = yield from station.validated_mode(GUIDED)
    armed = yield from station.validated_arm()
    yield from station.mode_menu(HOLD)
    yield from station.disarm()
    yield ("the disarmed bit", lambda message: not station.armed and ARM not in station._outstanding, 3.0)
    return stored, guided, armed, station.mode == HOLD, station.armed


@pytest.mark.soak
def test_a_station_behind_mavproxy_connects_uploads_and_orders_without_a_box(tmp_path: Path) -> None:
    port = free_udp_port()
    with Sim(tmp_path / "run", 41, speed=1.0) as sim:
        router = [sys.executable, str(BIN / "mavproxy.py"), f"--master=tcp:127.0.0.1:{sim.port(5760)}"]
        words = [
            f"--out=udp:127.0.0.1:{port}",
            "--default-modules=link",
            "--daemon",
            "--nowait",
            "--state-basedir",
            str(tmp_path),
        ]
        with (tmp_path / "mavproxy.log").open("wb") as log:
            process = subprocess.Popen([*router, *words], stdout=log, stderr=subprocess.STDOUT, cwd=tmp_path)
        try:
            station = QgcClient()
            station.then(morning(station))
            report = run(f"udp:127.0.0.1:{port}", station)
        finally:
            process.terminate()
            process.wait(10.0)
    assert report.finished_s is not None, (tmp_path / "mavproxy.log").read_text()
    assert (report.failures, station.result) == ([], (True, True, True, True, False))
    assert len(report.params) > 60
