"""The QGC-like client as the ground station: connect in QGroundControl's order, upload, GUIDED, arm, MISSION_START.

``qgc_loiter.py UDP_PORT LAT_DEG LON_DEG LOITER_S``: listens on the port as QGroundControl does. Prints one JSON object
a line.
"""

from __future__ import annotations

import json
import socket
import sys
import time
from typing import Any

from tests.qgc_client import QgcClient

ARM, START_MISSION, SET_MODE = 400, 300, 176
GUIDED, CUSTOM = 15, 1
DONE = "plan complete"


def say(step: str, **more: Any) -> None:
    print(json.dumps({"step": step, "at_s": round(time.monotonic() - BEGAN, 2), **more}), flush=True)


BEGAN = time.monotonic()


class Station:
    """The client on a socket."""

    def __init__(self, port: int) -> None:
        self.client = QgcClient()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.settimeout(0.02)
        self.peer: Any = None
        self.texts: list[str] = []

    def turn(self) -> None:
        try:
            data, self.peer = self.socket.recvfrom(65536)
        except TimeoutError:
            data = b""
        now_us = round((time.monotonic() - BEGAN) * 1e6)
        self.client.receive(data, now_us)
        out = self.client.take(now_us)
        if out and self.peer is not None:
            self.socket.sendto(out, self.peer)

    def run(self, script: Any = None, limit_s: float = 60.0) -> Any:
        if script is not None:
            self.client.start(script)
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            self.turn()
            if self.client.idle:
                return self.client.result
        raise SystemExit(f"no end: {self.client.report}")

    def watch(self, limit_s: float) -> None:
        """Look on until the vessel says that its plan is done."""
        end = time.monotonic() + limit_s
        while time.monotonic() < end and not any(DONE in text for _, _, text in self.client.report.texts):
            self.turn()


def main(port: int, lat_deg: float, lon_deg: float, loiter_s: float) -> None:
    station = Station(port)
    station.run()
    report = station.client.report
    say("connected", took_s=report.finished_s, parameters=len(report.params), failures=report.failures)
    x, y = round(lat_deg * 1e7), round(lon_deg * 1e7)
    items = [
        (0, 16, 0, 0, 0, 0, x, y, 0),
        (2, 178, 1, 1.5, -1, 0, 0, 0, 0),
        (3, 19, loiter_s, 0, 20, 1, x, y, 50),
    ]
    result = station.run(station.client.upload(0, items))
    if result != 0:
        raise SystemExit(f"upload ended with {result}")
    say("uploaded")
    for name, command in (
        ("mode", (SET_MODE, CUSTOM, GUIDED)),
        ("armed", (ARM, 1)),
        ("started", (START_MISSION, 0, 2)),
    ):
        for _ in range(20):
            result = station.run(station.client.command(*command))
            if result == 0:
                break
            say("retry", what=name, result=result)
            time.sleep(0.5)
        else:
            raise SystemExit(f"{name}: {result}")
        say(name)
    station.watch(float(sys.argv[5] if len(sys.argv) > 5 else 60))
    say("done")


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4]))
