"""A live simulation of a boat's own file, killed without notice while a station changes things: not a byte of the boat's is another."""

from __future__ import annotations

import signal
import socket
import subprocess
import time
from pathlib import Path

import pytest

import config as shipped
from companion.io.keeping import Store
from companion.io.keeping.content import SaveParam
from companion.io.keeping.look import look
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from tests.e2e.sim import BIN, free_instance

pytestmark = pytest.mark.e2e


def everything(folder: Path) -> dict[str, bytes]:
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file() and "runs-sim" not in path.parts)
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def test_a_killed_rehearsal_leaves_the_boat_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "my-boat.toml").write_text(shipped.path("boat.toml").read_text())
    store = Store(tmp_path / "state" / "companion.db")
    store.submit(SaveParam("DEPTH_MIN", 1.75))
    store.close()
    before = everything(tmp_path)
    for kill_after_s in (0.0, 1.5):
        instance = free_instance(140)
        words = ["sim", "--config", "my-boat.toml", "--copy-store", "--instance", str(instance), "--speed", "8"]
        with (tmp_path.parent / f"{tmp_path.name}.log").open("w") as log:
            sim = subprocess.Popen([BIN / "companion", *words], cwd=tmp_path, stdout=log, stderr=log)
        link = _connected(5760 + 10 * instance, sim)
        codec = Codec(255, 190)
        for value in (0.5, 0.75):
            link.sendall(codec.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
            link.sendall(codec.encode(dialect.MAVLink_param_set_message(1 + instance, 1, b"DEPTH_MIN", value, 9)))
        time.sleep(kill_after_s)
        sim.send_signal(signal.SIGKILL)
        sim.wait(20)
        link.close()
        assert everything(tmp_path) == before
    kept = [look(path).content for path in (tmp_path / "runs-sim").glob("*/companion.db")]
    assert kept
    assert {content.world for content in kept} == {"simulated"}


def _connected(port: int, sim: subprocess.Popen[bytes]) -> socket.socket:
    deadline_s = time.monotonic() + 60.0
    while time.monotonic() < deadline_s:
        assert sim.poll() is None, "the simulator ended by itself"
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=1.0)
        except OSError:
            time.sleep(0.1)
    raise AssertionError(f"no answer on port {port}")
