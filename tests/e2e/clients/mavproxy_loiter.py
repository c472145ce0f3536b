"""MAVProxy as the ground station, by its own commands: wp load, arm, mode AUTO; then watch it sail.

It has no modes for a generic autopilot: there the mission's own command starts it, and the plan has no home.
``mavproxy_loiter.py MASTER LAT_DEG LON_DEG LOITER_S FOLDER [generic]``. Prints one JSON object a line; MAVProxy's own output
goes to FOLDER/mavproxy.log.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

BEGAN = time.monotonic()


def say(step: str, **more: Any) -> None:
    print(json.dumps({"step": step, "at_s": round(time.monotonic() - BEGAN, 2), **more}), flush=True)


class MavProxy:
    """MAVProxy without its windows, commands through its standard input."""

    def __init__(self, master: str, folder: Path) -> None:
        self.log = folder / "mavproxy.log"
        program = Path(sys.executable).parent / "mavproxy.py"
        words = [
            sys.executable,
            program,
            f"--master={master}",
            "--default-modules=link,param,wp,mode,arm,fence,rally,rc,misc,cmdlong,ftp,log",
            "--nowait",
            "--state-basedir",
            str(folder),
        ]
        self.out = self.log.open("wb")
        self.process = subprocess.Popen(
            [str(word) for word in words], stdin=subprocess.PIPE, stdout=self.out, stderr=subprocess.STDOUT, cwd=folder
        )

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line.encode() + b"\n")
        self.process.stdin.flush()
        say("typed", line=line)

    def text(self) -> str:
        return self.log.read_text(errors="replace")

    def wait_for(
        self, pattern: str, limit_s: float = 60.0, again: Callable[[], None] | None = None, every_s: float = 3.0
    ) -> None:
        deadline = time.monotonic() + limit_s
        asked = time.monotonic()
        while time.monotonic() < deadline:
            if re.search(pattern, self.text()):
                say("saw", pattern=pattern)
                return
            if self.process.poll() is not None:
                raise SystemExit(f"MAVProxy ended\n{self.text()[-3000:]}")
            if again is not None and time.monotonic() - asked > every_s:
                asked = time.monotonic()
                again()
            time.sleep(0.2)
        raise SystemExit(f"never saw {pattern!r}\n{self.text()[-3000:]}")


def items(lat_deg: float, lon_deg: float, loiter_s: float, face: str) -> list[str]:
    first = f"1\t3\t16\t0\t0\t0\t0\t{lat_deg:.7f}\t{lon_deg:.7f}\t0\t1"
    speed = "0\t2\t178\t1\t1.5\t-1\t0\t0\t0\t0\t1"
    loiter = f"0\t3\t19\t{loiter_s}\t0\t20\t1\t{lat_deg:.7f}\t{lon_deg:.7f}\t0\t1"
    home = first.replace("1\t3", "1\t0", 1)
    return [first, loiter] if face == "generic" else [home, speed, loiter]


def main(master: str, lat_deg: float, lon_deg: float, loiter_s: float, folder: Path, face: str = "ardurover") -> None:
    plan = folder / "loiter.txt"
    rows = [f"{number}\t{item}" for number, item in enumerate(items(lat_deg, lon_deg, loiter_s, face))]
    plan.write_text("\n".join(["QGC WPL 110", *rows, ""]))
    proxy = MavProxy(master, folder)
    proxy.wait_for(r"(?i)online system|link 1 OK|Received \d+ parameters")
    proxy.wait_for(r"Received \d+ parameters", 90.0)
    proxy.type(f"wp load {plan}")
    proxy.wait_for(r"Loaded \d+ waypoint|Sent waypoint 2|Sent all \d waypoints|Flight plan received")
    time.sleep(1.0)
    proxy.type("arm throttle")
    proxy.wait_for(r"(?i)\barmed\b", again=lambda: proxy.type("arm throttle"))
    if face == "generic":
        proxy.type("long MISSION_START 0 0")
    else:
        proxy.type("mode AUTO")
        proxy.wait_for(r"AUTO>|Mode AUTO", again=lambda: proxy.type("mode AUTO"))
    proxy.wait_for(r"plan complete", 240.0)
    proxy.type("wp list")
    time.sleep(2.0)
    say("done")
    proxy.process.terminate()


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4]), Path(sys.argv[5]), *sys.argv[6:])
