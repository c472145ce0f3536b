"""A console that nobody here wrote (imcpy, DUNE's own code) finds the simulated vessel, plans, starts, stops, aborts. Real processes."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.sim import BIN, LAT_DEG, LON_DEG, REPO, Sim, client

pytest.importorskip("imcpy", reason="imcpy has no wheel for this Python")
INSTANCE = 140


def test_imcpy_finds_plans_starts_stops_and_aborts(tmp_path: Path) -> None:
    with Sim(tmp_path / "run", INSTANCE, speed=1.0, arguments=("--imc",)) as sim:
        sim.wait_ready()
        name = f"usv-{sim.instance + 1}"
        lines = client("imcpy_console.py", name, str(LAT_DEG), str(LON_DEG), limit_s=120.0)
    seen = {line["step"]: line for line in lines}
    print(seen)
    assert "listed" in seen
    assert seen["read back"]["identical"]
    success, failure = 1, 2
    assert seen["start answered"]["type"] == success
    assert seen["executing"]["plan"] == "imcpy-1"
    assert seen["executing"]["man"] == "L1"
    assert seen["moved"]["speed_mps"] > 0.5
    assert seen["stop answered"]["type"] == success
    assert seen["blocked"]["outcome"] == failure
    assert "abort" in seen["aborted"]["words"].lower()


def test_nobody_else_is_heard_unless_the_owner_says_so(tmp_path: Path) -> None:
    """The bridge's own sockets are on the loopback, all of them; another address is refused in words."""
    log = (tmp_path / "imc.log").open("wb")
    words = [BIN / "companion", "imc", "--set", "store=", "--set", "udp_port=7602", "--set", "tcp_port=7602"]
    with subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT, cwd=REPO) as bridge:
        try:
            deadline = time.monotonic() + 30.0
            while b"discovery" not in (tmp_path / "imc.log").read_bytes() and time.monotonic() < deadline:
                time.sleep(0.2)
            hosts = own_sockets(bridge.pid)
        finally:
            bridge.terminate()
    assert hosts
    assert hosts <= {"127.0.0.1", "224.0.75.69"}
    refused = subprocess.run(
        [BIN / "companion", "imc", "--set", "listen=0.0.0.0"], check=False, capture_output=True, text=True, cwd=REPO
    )
    assert refused.returncode == 2
    assert "insecure = true" in refused.stderr


def test_the_bridge_ends_with_a_simulator_that_was_killed(tmp_path: Path) -> None:
    """Nobody could stop it then: it kept its ports and a share of a core for ever."""
    with Sim(tmp_path / "run", INSTANCE + 1, speed=1.0, arguments=("--imc",)) as sim:
        sim.wait_ready()
        bridge = wait_for(lambda: children(sim.process.pid), "no bridge beside the simulator")[0]
        sim.process.kill()
        sim.process.wait()
        wait_for(lambda: not Path(f"/proc/{bridge}/cmdline").exists(), "the bridge lives on")


def children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()]


def wait_for(found: Callable[[], Any], complaint: str) -> Any:
    deadline = time.monotonic() + 30.0
    while not (answer := found()):
        assert time.monotonic() < deadline, complaint
        time.sleep(0.1)
    return answer


def own_sockets(pid: int) -> set[str]:
    """Own addresses of a process' UDP sockets and TCP listeners, from the kernel."""
    inodes = {
        str(path.readlink())[8:-1] for path in Path(f"/proc/{pid}/fd").iterdir() if "socket:" in str(path.readlink())
    }
    found = set()
    for table in ("udp", "tcp"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text(encoding="ascii").splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes and (table == "udp" or fields[3] == "0A"):
                number = bytes.fromhex(fields[1].partition(":")[0])
                found.add(".".join(str(byte) for byte in (number[::-1] if sys.byteorder == "little" else number)))
    return found
