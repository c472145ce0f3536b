"""No shipped configuration lets another computer order the vessel about or read where it is: every port of every one is tried."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.conftest import require
from tests.e2e.sim import REPO
from tests.e2e.two_hosts import OPEN_TCP, OPEN_UDP

UNSHARE = ["unshare", "-n"] if os.geteuid() == 0 else ["unshare", "-rn"]
SHIPPED = ("boat", "replay", "gateway", "sim")
TOOLS = ("unshare", "ip", "ss")


def namespaces() -> bool:
    """Whether this machine lets us make two network namespaces and a cable between them."""
    if any(shutil.which(tool) is None for tool in TOOLS):
        return False
    words = [*UNSHARE, "sh", "-c", "ip link add cable0 type veth peer name cable1 && unshare -n true"]
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


def was_armed(run_dir: Path) -> bool:
    with (run_dir / "truth.csv").open() as file:
        return any(row["armed"] == "1" for row in csv.DictReader(file))


def sweep(folder: Path) -> dict[str, Any]:
    """Run both computers; return what was seen."""
    words = [*UNSHARE, sys.executable, "-m", "tests.e2e.two_hosts", str(folder)]
    done = subprocess.run(words, cwd=REPO, capture_output=True, text=True, timeout=400, check=False)
    logs = "".join(f"--- {path.name}\n{path.read_text()[-1500:]}\n" for path in folder.glob("*.log"))
    assert done.returncode == 0, f"{done.stderr[-3000:]}\n{logs}"
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_another_computer_orders_nothing_and_reads_nothing_but_where_a_door_was_opened_on_purpose(
    tmp_path: Path,
) -> None:
    require(namespaces(), "network namespaces (unshare of util-linux, ip and ss of iproute2, and leave to use them)")
    found = sweep(tmp_path)
    answers = found["answers"]
    assert set(answers["udp"]) == {str(OPEN_UDP)}
    assert set(answers["tcp"]) == {str(OPEN_TCP)}
    assert found["local"] >= 2, "stations on the vessel's own computer are served"
    assert not was_armed(tmp_path / "sim-run")
    for events in tmp_path.glob("runs/*/events.jsonl"):
        assert '"event": "armed", "value": true' not in events.read_text()
    # a sweep that finds no open door would prove nothing
    assert answers["udp"][str(OPEN_UDP)] > 1000
    assert answers["tcp"][str(OPEN_TCP)] > 100
    assert was_armed(tmp_path / "open-run")
    for name in (*SHIPPED, "open"):
        every_socket_was_told(name, found["sockets"][name], found["logs"][name])


def every_socket_was_told(name: str, sockets: list[list[str]], log: str) -> None:
    """Compare what the kernel knows of a program with what it said at its start."""
    told = [line.split("; ")[0] for line in log.splitlines() if "socket" in line]
    free = sum("free port" in line and "UDP" in line for line in told)
    assert sockets
    for kind, host, port in sockets:
        assert name == "open" or host in ("127.0.0.1", "[::1]"), f"{name}: {kind} {host}:{port} is open to others"
        if not any(line.endswith(f"{kind.upper()} {host} port {port}") for line in told):
            assert kind == "udp", f"{name}: {kind} {host}:{port} was not told"
            free -= 1
    assert free >= 0, f"{name}: more sockets than were told"
