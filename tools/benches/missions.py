"""Benchmarks of frames and mission transfers: processor time per frame, recovery from lost bytes, and uploads over real UDP.

The UDP figures come from ``companion sim`` in a process of its own and a ground station that answers at once, both on
this machine; everything else is processor time of this thread.
"""

from __future__ import annotations

import json
import math
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.mavlink.missions.wire import item_to_message
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from tools.plan_items import plan_item

FRAMES = 20_000
INSTANCE = 60
"""Ports out of the way of a simulator that somebody runs."""


def _frames() -> list[bytes]:
    codec = Codec(1, 1)
    messages = [
        dialect.MAVLink_heartbeat_message(
            type=11, autopilot=3, base_mode=81, custom_mode=0, system_status=4, mavlink_version=3
        ),
        dialect.MAVLink_attitude_message(
            time_boot_ms=1, roll=0.1, pitch=0.2, yaw=0.3, rollspeed=0.0, pitchspeed=0.0, yawspeed=0.0
        ),
        dialect.MAVLink_global_position_int_message(
            time_boot_ms=1, lat=411850123, lon=-87062154, alt=0, relative_alt=0, vx=1, vy=2, vz=3, hdg=4
        ),
    ]
    return [codec.encode(messages[number % 3]) for number in range(FRAMES)]


def _time_per(count: int, work: Callable[[], object]) -> float:
    """Best of three, us each."""
    best = math.inf
    for _ in range(3):
        start = time.thread_time()
        work()
        best = min(best, time.thread_time() - start)
    return best / count * 1e6


def _recovered() -> float:
    """Share of the intact frames that come out when 1 % of the bytes are lost."""
    rng, stream, intact = random.Random(1), bytearray(), []
    for raw in _frames()[:5_000]:
        kept = bytes(byte for byte in raw if rng.random() >= 0.01)
        stream += kept
        if kept == raw:
            intact.append(raw)
    deframer = Deframer()
    found = {
        frame.raw for at in range(0, len(stream), 64) for frame in deframer.receive(bytes(stream[at : at + 64]), 0)
    }
    for step in range(1, 100):
        found |= {frame.raw for frame in deframer.receive(b"", step * 1_000_000)}
    return sum(raw in found for raw in intact) / len(intact)


def upload(port: int, count: int, codec: Codec) -> float:
    """Seconds from MISSION_COUNT to MISSION_ACK over UDP. Raises when the vessel refuses or does not end within 60 s."""
    items = [
        plan_item(16, at_e7=(411_850_000 + 100 * number, -87_060_000), frame=0 if number == 0 else 3)
        for number in range(count)
    ]
    deframer = Deframer()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", port))
        link.settimeout(5.0)
        data, vessel = link.recvfrom(65_535)
        target = deframer.receive(data, 0)[0].system
        start = time.monotonic()
        link.sendto(codec.encode(dialect.MAVLink_mission_count_message(target, 1, count, 0)), vessel)
        while time.monotonic() < start + 60.0:
            for frame in deframer.receive(link.recv(65_535), 0):
                message = decode(frame)
                if message is None:
                    continue
                if message.get_type() == "MISSION_ACK":
                    if message.type != 0:
                        raise RuntimeError(f"refused: {message}")
                    return time.monotonic() - start
                if message.get_type() == "MISSION_REQUEST_INT":
                    item = item_to_message(items[message.seq], message.seq, target, 1, PlanKind.MISSION)
                    link.sendto(codec.encode(item), vessel)
    raise RuntimeError(f"{count} items not taken in 60 s")


def _uploads() -> tuple[float, float]:
    """Best of three for 100 and for 829 items."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["sim", "--instance", str(INSTANCE), "--run-dir", str(Path(folder) / "run")]
        command = [sys.executable, "-m", "companion.cli", *words]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as sim:
            try:
                time.sleep(4.0)
                port = 14550 + 10 * INSTANCE
                # one station with running numbers: the same frame again within a second counts as a copy
                codec = Codec(255, 190)
                return min(upload(port, 100, codec) for _ in range(3)), min(upload(port, 829, codec) for _ in range(3))
            finally:
                sim.send_signal(signal.SIGINT)


def run() -> list[dict[str, Any]]:
    """All figures."""
    raws = _frames()
    stream = b"".join(raws)
    message = dialect.MAVLink_global_position_int_message(
        time_boot_ms=1, lat=411850123, lon=-87062154, alt=0, relative_alt=0, vx=1, vy=2, vz=3, hdg=4
    )
    codec = Codec(1, 1)
    frames = Deframer().receive(stream, 0)
    encode_us = _time_per(FRAMES, lambda: [codec.encode(message) for _ in range(FRAMES)])
    cut_us = _time_per(FRAMES, lambda: Deframer().receive(stream, 0))
    decode_us = _time_per(FRAMES, lambda: [decode(frame) for frame in frames])
    share = _recovered()
    short_s, long_s = _uploads()
    return [
        _row("MAVLink frame, encode", encode_us, "us", None, None),
        _row("MAVLink frame, cut out and check", cut_us, "us", None, None),
        _row("MAVLink frame, decode", decode_us, "us", None, None),
        _row("intact frames recovered at 1 % lost bytes", share * 100.0, "%", 100.0, share == 1.0),
        _row("mission upload over UDP, 100 items", short_s, "s", 0.3, short_s < 0.3),
        _row("mission upload over UDP, 829 items", long_s, "s", 3.0, long_s < 3.0),
    ]


def _row(name: str, value: float, unit: str, bar: float | None, holds: bool | None) -> dict[str, Any]:
    return {"name": name, "value": round(value, 3), "unit": unit, "bar": bar, "holds": holds}


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
