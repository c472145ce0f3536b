"""Two computers of network namespaces: one runs every shipped configuration, from the other a stranger tries every port.

Run it inside a network namespace of its own, where it may make another:  unshare -rn python -m tests.e2e.two_hosts FOLDER
The last line that it prints is a JSON object of what it saw. ``--stranger`` is its other half.
"""

from __future__ import annotations

import contextlib
import json
import selectors
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import all as dialect

from tests.e2e.sim import BIN, REPO

VESSEL, STRANGER = "10.9.0.1", "10.9.0.2"
OPEN_UDP, OPEN_TCP = 20_000, 20_001
"""Doors that one more vessel leaves open on purpose: a sweep that does not find them proves nothing."""
LISTENS = 14_550
"""Where a ground station on the vessel's own computer listens."""


def orders() -> bytes:
    """A heartbeat, a forced arming and a go-to as a ground station of everybody's sends them."""
    mav = dialect.MAVLink(None, srcSystem=254, srcComponent=190)
    messages = (
        dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        dialect.MAVLink_command_long_message(0, 0, 400, 0, 1, 21196, 0, 0, 0, 0, 0),
        dialect.MAVLink_request_data_stream_message(0, 0, 0, 10, 1),
    )
    return b"".join(message.pack(mav) for message in messages)


class Computer:
    """The vessel's computer with the programs that run on it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.programs: dict[str, subprocess.Popen[bytes]] = {}
        run("ip", "link", "set", "lo", "up")

    def start(self, name: str, *words: str) -> None:
        with (self.folder / f"{name}.log").open("wb") as log:
            self.programs[name] = subprocess.Popen(
                [BIN / "companion", *words], stdout=log, stderr=subprocess.STDOUT, cwd=self.folder
            )

    def log(self, name: str) -> str:
        return (self.folder / f"{name}.log").read_text()

    def stop(self) -> None:
        for program in self.programs.values():
            program.send_signal(signal.SIGINT)
        for program in self.programs.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(20)
            program.kill()

    def sockets(self) -> dict[str, list[list[str]]]:
        """What the kernel says of each program: kind, own address and port of all its sockets that can be spoken to."""
        rows: dict[str, list[list[str]]] = {name: [] for name in self.programs}
        names = {str(program.pid): name for name, program in self.programs.items()}
        for line in run("ss", "-Hanptu").splitlines():
            fields = line.split()
            pid = line.partition("pid=")[2].partition(",")[0]
            if pid in names and fields[1] in ("LISTEN", "UNCONN"):
                host, _, port = fields[4].rpartition(":")
                rows[names[pid]].append([fields[0], host, port])
        return rows


def run(*words: str) -> str:
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def start_everything(computer: Computer) -> None:
    """Every configuration that ships, as shipped but for ports that two of them want; and one vessel with open doors."""
    config = REPO / "config"
    (computer.folder / "radio.key").touch(mode=0o600)
    (computer.folder / "radio.key").write_bytes(bytes(range(32)))
    computer.start("boat", "run", str(config / "boat.toml"))
    computer.start(
        "replay", "run", str(config / "replay-nmea.toml"), *sets("endpoints.1.url=tcp-listen://127.0.0.1:5764")
    )
    computer.start(
        "gateway", "gateway", str(config / "gateway.toml"), *sets("endpoints.1.url=tcp-listen://127.0.0.1:5762")
    )
    computer.start("sim", "sim", "--gateway", "--instance", "3", "--run-dir", "sim-run")
    doors = (
        f"endpoints.0.url=udp-listen://0.0.0.0:{OPEN_UDP - 70}",  # --instance 7 moves it,
        "endpoints.0.insecure=true",
        f"plotter=tcp-listen://0.0.0.0:{OPEN_TCP}",
    )
    computer.start("open", "sim", "--instance", "7", "--run-dir", "open-run", *sets(*doors))


def sets(*items: str) -> list[str]:
    return [word for item in items for word in ("--set", item)]


def wait_for(ports: set[int], limit_s: float = 150.0) -> None:
    deadline = time.monotonic() + limit_s
    while ports:
        assert time.monotonic() < deadline, f"nobody listens at {ports}"
        time.sleep(0.2)
        ports = {port for port in ports if f":{port} " not in run("ss", "-Hlntu")}


def heard_locally(limit_s: float = 60.0) -> int:
    """How many vessels a ground station on the vessel's own computer hears at once on the usual port, as QGroundControl would."""
    senders = set()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.1", LISTENS))
        station.settimeout(1.0)
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline and len(senders) < 2:
            with contextlib.suppress(TimeoutError):
                senders.add(station.recvfrom(2000)[1])
    return len(senders)


def main(folder: Path) -> None:
    computer = Computer(folder)
    stranger = subprocess.Popen(
        ["unshare", "-n", sys.executable, "-m", "tests.e2e.two_hosts", "--stranger"],
        cwd=REPO,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert stranger.stdin is not None
    assert stranger.stdout is not None
    try:
        assert stranger.stdout.readline() == "ready\n"
        run("ip", "link", "add", "vessel0", "type", "veth", "peer", "name", "stranger0", "netns", str(stranger.pid))
        run("ip", "address", "add", f"{VESSEL}/24", "dev", "vessel0")
        run("ip", "link", "set", "vessel0", "up")
        start_everything(computer)
        wait_for({5760, 5762, 5764, 5790, 3030, OPEN_UDP, OPEN_TCP})
        local = heard_locally()
        stranger.stdin.write("go\n")
        stranger.stdin.flush()
        found = json.loads(stranger.stdout.readline())
        found["sockets"] = computer.sockets()
        found["local"] = local
    finally:
        stranger.kill()
        computer.stop()
    found["logs"] = {name: computer.log(name) for name in computer.programs}
    print(json.dumps(found))


class Sweep:
    """The stranger's attempt at every port. What comes back is counted by the port that it comes from."""

    def __init__(self) -> None:
        self.answers: dict[str, dict[int, int]] = {"udp": {}, "tcp": {}}
        """Bytes that came, by kind and port."""
        self._orders = orders()

    def udp(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
            sock.setblocking(False)
            for port in range(1, 65536):
                with contextlib.suppress(OSError):
                    sock.sendto(self._orders, (VESSEL, port))
                if port % 500 == 0:
                    self._collect(sock, 0.0)
            self._collect(sock, 2.0)
            for port in list(self.answers["udp"]):  # what a stranger does who has been answered
                sock.sendto(self._orders, (VESSEL, port))
            self._collect(sock, 2.0)

    def _collect(self, sock: socket.socket, wait_s: float) -> None:
        deadline = time.monotonic() + wait_s
        while True:
            try:
                data, address = sock.recvfrom(65536)
            except OSError:
                if time.monotonic() >= deadline:
                    return
                time.sleep(0.01)
            else:
                self._count("udp", address[1], data)

    def _count(self, kind: str, port: int, data: bytes) -> None:
        self.answers[kind][port] = self.answers[kind].get(port, 0) + len(data)

    def tcp(self) -> None:
        ready = selectors.DefaultSelector()
        for port in range(1, 65536):
            sock = socket.socket()
            sock.settimeout(2.0)
            if sock.connect_ex((VESSEL, port)):
                sock.close()
                continue
            self._count("tcp", port, b"")
            sock.sendall(self._orders)
            ready.register(sock, selectors.EVENT_READ, port)
        deadline = time.monotonic() + 2.0
        while time.monotonic() < deadline and ready.get_map():
            for key, _ in ready.select(0.1):
                assert isinstance(key.fileobj, socket.socket)
                data = key.fileobj.recv(65536)
                self._count("tcp", key.data, data)
                if not data:
                    ready.unregister(key.fileobj)


def stranger() -> None:
    print("ready", flush=True)
    sys.stdin.readline()
    run("ip", "address", "add", f"{STRANGER}/24", "dev", "stranger0")
    run("ip", "link", "set", "stranger0", "up")
    sweep = Sweep()
    sweep.udp()
    sweep.tcp()
    result: dict[str, Any] = {"answers": sweep.answers}
    print(json.dumps(result), flush=True)
    time.sleep(600)


if __name__ == "__main__":
    stranger() if sys.argv[1] == "--stranger" else main(Path(sys.argv[1]))
