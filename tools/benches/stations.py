"""Benchmarks of the talk with ground stations: connecting as QGroundControl does, three stations with fast streams, a flood.

Everything goes over real UDP and TCP to ``companion sim`` in a process of its own, at a tick of 50 Hz; processor time is that
process's own, with the streams less without them.
"""

from __future__ import annotations

import itertools
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from tests.qgc_client import QgcClient, run as connect

INSTANCE = 61
STREAMS = (
    "ATTITUDE",
    "GLOBAL_POSITION_INT",
    "VFR_HUD",
    "LOCAL_POSITION_NED",
    "NAV_CONTROLLER_OUTPUT",
    "SERVO_OUTPUT_RAW",
    "GPS_RAW_INT",
    "ALTITUDE",
)
WINDOW_S = 8.0
FLOOD_PER_S = 10_000
TICK_S = 0.02


class Station:
    """A ground station on a socket: keeps arrival times by message name."""

    def __init__(self, port: int, system: int, *, tcp: bool = False) -> None:
        self.codec, self.deframer = Codec(system, 190), Deframer()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if tcp else socket.SOCK_DGRAM)
        if tcp:
            self.socket.connect(("127.0.0.1", port))
        else:
            self.socket.bind(("127.0.0.1", port))
        self.tcp = tcp
        self.peer: Any = None
        self.vessel = 0
        self.arrivals: dict[str, list[float]] = {}

    def read(self) -> None:
        data, peer = self.socket.recvfrom(65_536)
        self.peer = peer or self.peer
        now = time.monotonic()
        for frame in self.deframer.receive(data, round(now * 1e6)):
            message = decode(frame)
            if message is not None:
                self.vessel = frame.system
                self.arrivals.setdefault(message.get_type(), []).append(now)

    def send(self, message: Any) -> None:
        data = self.codec.encode(message)
        if self.tcp:
            self.socket.sendall(data)
        elif self.peer is not None:
            self.socket.sendto(data, self.peer)

    def ask_for_streams(self) -> None:
        for name in STREAMS:
            number = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
            self.send(
                dialect.MAVLink_command_long_message(
                    target_system=self.vessel,
                    target_component=1,
                    command=511,
                    confirmation=0,
                    param1=number,
                    param2=20_000,
                    param3=0,
                    param4=0,
                    param5=0,
                    param6=0,
                    param7=0,
                )
            )


def listen(stations: list[Station], seconds: float, steer: bool = False) -> None:
    """Serve sockets for a while, one HEARTBEAT a second, sticks at 50 Hz when asked."""
    end, beat, stick = time.monotonic() + seconds, 0.0, 0.0
    while (now := time.monotonic()) < end:
        for ready in select.select([station.socket for station in stations], [], [], 0.005)[0]:
            next(station for station in stations if station.socket is ready).read()
        if now >= beat:
            beat = now + 1.0
            for station in stations:
                station.send(
                    dialect.MAVLink_heartbeat_message(
                        type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
                    )
                )
        if steer and now >= stick:
            stick = now + 0.02
            for station in stations:
                station.send(
                    dialect.MAVLink_manual_control_message(target=station.vessel, x=0, y=0, z=0, r=0, buttons=0)
                )


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def row(name: str, value: float, unit: str, bar: float) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "bar": bar, "holds": value < bar}


def p99(values: list[float]) -> float:
    return sorted(values)[int(len(values) * 0.99)]


def gaps(arrivals: list[float]) -> list[float]:
    return [later - sooner for sooner, later in itertools.pairwise(arrivals)]


def flood(target: Any, seconds: float) -> int:
    """Send PING frames from a stranger's socket in a process of its own; return how many it was told to send."""
    code = (
        "import socket,sys,time\nfrom mavlink_bridge.mavlink.wire.codec import Codec, dialect\n"
        "s=socket.socket(socket.AF_INET,socket.SOCK_DGRAM);c=Codec(99,1);t=time.monotonic();n=0\n"
        f"while time.monotonic()-t<{seconds}:\n"
        f"  while n<(time.monotonic()-t)*{FLOOD_PER_S}:\n"
        f"    n+=1;s.sendto(c.encode(dialect.MAVLink_ping_message(n,n,0,0)),{target!r})\n"
        "  time.sleep(0.001)\n"
    )
    subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).resolve().parents[2])
    return round(seconds * FLOOD_PER_S)


def run() -> list[dict[str, Any]]:
    """All rows."""
    with tempfile.TemporaryDirectory() as folder:
        companion = Path(sys.executable).parent / "companion"
        words: list[str | Path] = [
            companion,
            "sim",
            "--speed",
            "1",
            "--instance",
            str(INSTANCE),
            "--run-dir",
            f"{folder}/run",
            "--set",
            "system.tick_hz=50",
        ]
        sim = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return _measure(sim.pid)
        finally:
            sim.send_signal(signal.SIGINT)
            sim.wait(30)


def _measure(pid: int) -> list[dict[str, Any]]:
    shift = 10 * INSTANCE
    client = QgcClient()
    time.sleep(4.0)
    report = connect(f"udp:127.0.0.1:{14550 + shift}", client)
    rows = [row("QGC-like connect over UDP", report.finished_s or 1e9, "s", 2.0)]
    rows += [row("QGC-like parameters over UDP", dict(report.states).get("parameters", 1e9), "s", 0.3)]
    stations = [Station(14550 + shift, 255), Station(14540 + shift, 245), Station(5760 + shift, 250, tcp=True)]
    listen(stations, 2.0)
    before = cpu_s(pid)
    listen(stations, WINDOW_S)
    quiet = cpu_s(pid) - before
    for station in stations:
        station.ask_for_streams()
    listen(stations, 1.0, steer=True)
    for station in stations:
        station.arrivals.clear()
    before = cpu_s(pid)
    listen(stations, WINDOW_S, steer=True)
    share = (cpu_s(pid) - before - quiet) / WINDOW_S * 100.0
    rate = (
        sum(len(times) for station in stations for name, times in station.arrivals.items() if name in STREAMS)
        / WINDOW_S
    )
    rows += [row("3 stations x 8 streams at 50 Hz, processor", share, "% of a core", 10.0)]
    rows += [
        {
            "name": "3 stations x 8 streams at 50 Hz, received",
            "value": rate,
            "unit": "messages/s",
            "bar": 1150.0,
            "holds": rate > 1150.0,
        }
    ]
    late = [abs(gap - TICK_S) for station in stations for gap in gaps(station.arrivals["ATTITUDE"])]
    rows += [row("3 stations x 8 streams, tick lateness p99", p99(late) * 1e3, "ms", 5.0)]
    stations[2].arrivals.clear()
    flood(stations[0].peer, 5.0)
    listen(stations, 5.0)
    flooded = p99(gaps(stations[2].arrivals["ATTITUDE"]))
    rows += [row("10 000 datagrams/s flood, another station's tick p99", flooded / TICK_S, "x nominal", 1.5)]
    return rows
