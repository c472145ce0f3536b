"""A simulated vessel and its page as two processes, and a link of 50 kbit/s for a browser that is far away."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import threading
import time
from pathlib import Path

from companion.io.keeping.keys import page_key_from_passphrase, write_key
from tests.e2e.sim import BIN, REPO, Sim

WORDS = "correct horse battery"


class Boat:
    """The vessel under way on a plan inside a fence, and the page beside it."""

    def __init__(self, folder: Path, instance: int) -> None:
        self.folder = folder
        (folder / "runs").mkdir()
        write_key(folder / "page.key", page_key_from_passphrase(WORDS))
        plan = folder / "p.plan"
        words = [BIN / "companion", "plan", "make", plan, "41.1866,-8.7060", "--radius", "20", "--duration", "900"]
        subprocess.run([*words, "--speed", "1.0"], check=True, capture_output=True, cwd=REPO)
        more = ["--plan", str(plan), "--start", "--set", f"page.key_file={folder / 'page.key'}"]
        self.sim = Sim(folder / "runs" / "20260101-120000", instance, speed=1.0, arguments=more)
        self.sim.wait_ready()
        self.log = folder / "web.log"
        settings = ["--set", "page.port=0", "--set", f"record.directory={folder / 'runs'}"]
        with self.log.open("w") as log:
            self.web = subprocess.Popen(
                [BIN / "companion", "web", REPO / "config" / "sim.toml", *settings, "--vessel", self.sim.run_dir],
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=REPO,
            )
        self.port = self._port()
        self.url = f"http://127.0.0.1:{self.port}/"

    def _port(self) -> int:
        for _ in range(600):
            found = re.search(r"page: http://127\.0\.0\.1:(\d+)/", self.log.read_text())
            if found:
                return int(found[1])
            assert self.web.poll() is None, self.log.read_text()
            time.sleep(0.1)
        raise AssertionError("the page is not served")

    def freeze(self) -> None:
        """The vessel's process hangs."""
        self.sim.process.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        self.sim.process.send_signal(signal.SIGCONT)

    def close(self) -> None:
        self.thaw()
        self.web.send_signal(signal.SIGINT)
        assert self.web.wait(20) == 0
        self.sim.stop()


class SlowLink:
    """Hands TCP connections on to a port at so many bytes a second, all of them together, each way."""

    def __init__(self, port: int, bytes_per_s: float) -> None:
        self._target = port
        self._rate = bytes_per_s
        self._lock = {"down": threading.Lock(), "up": threading.Lock()}
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self.down_bytes = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._server.accept()
                far = socket.socket()
                far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                far.connect(("127.0.0.1", self._target))
            except OSError:
                return
            for way, one, other in (("up", near, far), ("down", far, near)):
                threading.Thread(target=self._carry, args=(way, one, other), daemon=True).start()

    def _carry(self, way: str, one: socket.socket, other: socket.socket) -> None:
        try:
            while data := one.recv(512):
                with self._lock[way]:
                    time.sleep(len(data) / self._rate)
                    if way == "down":
                        self.down_bytes += len(data)
                other.sendall(data)
        except OSError:
            pass
        finally:
            for end in (one, other):
                end.close()

    def close(self) -> None:
        self._server.close()
