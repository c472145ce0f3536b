"""A ground station restarts the simulated vessel: pymavlink over TCP sees what it would see of a boat."""

from __future__ import annotations

import math
import time
from pathlib import Path

import pytest
from pymavlink import mavutil

from tests.e2e.sim import Sim

REBOOT = mavutil.mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
BACK_S = 60.0


def connected(sim: Sim, limit_s: float = 10.0):
    link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{sim.port(5760)}", source_system=255, source_component=190)
    assert link.wait_heartbeat(timeout=limit_s)
    return link


def place(link, limit_s: float = 10.0) -> tuple[float, float]:
    message = link.recv_match(type="GLOBAL_POSITION_INT", blocking=True, timeout=limit_s)
    assert message is not None, "no position"
    return message.lat * 1e-7, message.lon * 1e-7


def metres(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.hypot((a[0] - b[0]) * 111_066.0, (a[1] - b[1]) * 111_320.0 * math.cos(math.radians(a[0])))


def back(sim: Sim):
    """The link and the first place of the new life; a link that the old one still took ends unheard."""
    end_s = time.monotonic() + BACK_S
    while time.monotonic() < end_s:
        try:
            link = connected(sim, 2.0)
            return link, place(link, 1.5)
        except (OSError, AssertionError):
            time.sleep(0.2)
    pytest.fail(f"no vessel {BACK_S:g} s after the restart:\n{sim.log.read_text()}")


def test_a_restart_keeps_the_place_the_parameters_and_says_who_asked(tmp_path: Path) -> None:
    adrift = ["--set", "world.water.current_mps=0.5"]
    with Sim(tmp_path / "run", 31, 5.0, adrift) as sim:
        link = connected(sim)
        began = place(link)
        link.param_set_send("DEPTH_MIN", 3.25)
        assert link.recv_match(type="PARAM_VALUE", blocking=True, timeout=10).param_value == 3.25
        lay = began
        while metres(began, lay) < 10.0:
            lay = place(link)
        link.mav.command_long_send(sim.instance + 1, 1, REBOOT, 0, 1, 0, 0, 0, 0, 0, 0)
        assert link.recv_match(type="COMMAND_ACK", blocking=True, timeout=10).result == 0
        link.close()
        again, there = back(sim)
        assert metres(began, there) > 9.0
        assert metres(lay, there) < 40.0, "it drifted on before and after its restart, and no more"
        again.mav.param_request_read_send(sim.instance + 1, 1, b"DEPTH_MIN", -1)
        assert again.recv_match(type="PARAM_VALUE", blocking=True, timeout=10).param_value == 3.25
        again.close()
        assert sim.stop() == 0
    assert "restart, ordered by 255/190 over " in sim.log.read_text()
    assert (tmp_path / "run-2" / "truth.csv").exists()
