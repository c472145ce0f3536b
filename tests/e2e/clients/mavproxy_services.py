"""MAVProxy's own commands one after the other: parameters, waypoints, fence, rally, logs, modes, arming, go-to, return.

``mavproxy_services.py MASTER LAT_DEG LON_DEG FOLDER``. Prints one JSON object a line; MAVProxy's output is FOLDER/mavproxy.log.
"""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

from mavproxy_loiter import MavProxy, say

COMPLAINT = re.compile(
    r"(?i)warn|error|exception|traceback|fail|breach|no link|link \d down|disabled|unknown|timeout|lost"
)


def write_files(folder: Path, lat: float, lon: float) -> None:
    """A plan, a fence and rally points in the files that MAVProxy loads."""

    def row(seq: int, frame: int, command: int, p: tuple[float, ...], d_lat: float, d_lon: float) -> str:
        numbers = "\t".join(str(value) for value in p)
        return f"{seq}\t{int(seq == 0)}\t{frame}\t{command}\t{numbers}\t{lat + d_lat:.7f}\t{lon + d_lon:.7f}\t0\t1"

    plan = [
        row(0, 0, 16, (0, 0, 0, 0), 0, 0),
        row(1, 3, 16, (0, 2, 0, 0), 2e-4, 0),
        row(2, 3, 16, (0, 2, 0, 0), 2e-4, 3e-4),
    ]
    corners = [(-4e-3, -4e-3), (-4e-3, 4e-3), (4e-3, 4e-3), (4e-3, -4e-3)]
    fence = [row(number, 0, 5001, (4, 0, 0, 0), a, b) for number, (a, b) in enumerate(corners)]
    rally = [row(0, 3, 5100, (0, 0, 0, 0), 1e-4, 1e-4), row(1, 3, 5100, (0, 0, 0, 0), -1e-4, 1e-4)]
    for name, rows in (("plan.txt", plan), ("fence.txt", fence), ("rally.txt", rally)):
        (folder / name).write_text("\n".join(["QGC WPL 110", *rows, ""]))


def main(master: str, lat: float, lon: float, folder: Path) -> None:
    write_files(folder, lat, lon)
    proxy = MavProxy(master, folder)
    proxy.wait_for(r"online system", 60.0)
    online_s = time.monotonic()
    proxy.wait_for(r"Received \d+ parameters", 60.0)
    say("parameters", took_s=round(time.monotonic() - online_s, 2))
    proxy.type("param set CRUISE_SPEED 1.25")
    time.sleep(1.0)
    proxy.type("param show CRUISE_SPEED")
    proxy.wait_for(r"CRUISE_SPEED\s+1\.25")
    for command, answer in (
        (f"wp load {folder / 'plan.txt'}", r"Loaded \d+ waypoint"),
        ("wp list", r"Requesting \d+ waypoints|Saved \d+ waypoints"),
        (f"fence load {folder / 'fence.txt'}", r"(?i)loaded .*fence|Loaded \d+ geo|fence"),
        ("fence list", r"(?i)fence item|Requesting \d+ fence|Saved \d+ fence|POLYGON"),
        (f"rally load {folder / 'rally.txt'}", r"(?i)Loaded \d+ rally"),
        ("rally list", r"(?i)rally"),
        ("log list", r"Log 1 +numLogs 2"),
        (f"log download 1 {folder / 'log1.bin'}", r"Finished downloading"),
        ("arm throttle", r"(?i)\barmed\b"),
        ("mode AUTO", r"AUTO>|Mode AUTO"),
        ("mode HOLD", r"HOLD>|Mode HOLD"),
        (f"guided {lat + 1e-4} {lon} 0", r"GUIDED>|Mode GUIDED"),
        ("rtl", r"RTL>|Mode RTL"),
        ("mode MANUAL", r"MANUAL>|Mode MANUAL"),
        ("disarm", r"(?i)disarmed"),
    ):
        proxy.type(command)
        proxy.wait_for(answer, 30.0)
        time.sleep(0.7)
    proxy.process.terminate()
    time.sleep(1.0)
    proxy.process.kill()
    lines = [line for line in proxy.text().splitlines() if COMPLAINT.search(line)]
    say("complaints", lines=lines)
    say("done")


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4]))
