"""Types the lines of the pages as they are printed, in a plain shell, and says of each what came of it. Standard library only.

Runs inside a clean root or a fresh clone: ``python3 tests/e2e/page_driver.py PAGE... `` prints one JSON object a line. What a line
needs beyond the page (a file by the name that the page uses, keys pressed, a vessel to talk to) stands in the tables below; so
does why a line is not tried.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

LIMIT_S = 1500.0
"""For one line: as long as a set-up of everything takes on a slow network."""


@dataclass(frozen=True)
class How:
    """How a line is tried. ``skip``: why it is not. ``until``: ended by Ctrl-C once this was said; ``stays``: at the end of the page."""

    skip: str = ""
    alone: bool = False
    """What stays is ended first, as the page says."""
    until: str = ""
    stays: bool = False
    typed: tuple[tuple[float, str], ...] = ()
    """Seconds to wait, then what is typed."""
    ends: tuple[int, ...] = (0,)
    says: str = ""


@dataclass
class Page:
    """What a page's lines need. ``words``: names of the page that stand for the reader's own."""

    first: str = ""
    words: dict[str, str] = field(default_factory=dict)


SIM = "companion sim --plan my.plan --start --speed max --duration 720 --run-dir run-1 --json >/dev/null"
PLAN = "companion plan make my.plan 41.1854,-8.7060 --radius 20 --duration 300 --speed 1.5"
CHART = """python - 2>/dev/null <<'END'
import numpy, rasterio, rasterio.shutil
place = rasterio.transform.from_origin(-8.8, 41.3, 0.003, 0.003)
options = dict(driver="GTiff", height=60, width=60, count=1, dtype="float32", crs="EPSG:4326", transform=place)
with rasterio.open("chart.tif", "w", **options) as chart:
    chart.write(numpy.full((60, 60), -9.0, "float32"), 1)
    chart.update_tags(1, long_name="elevation")
rasterio.shutil.copy("chart.tif", "gebco.nc", driver="netCDF")
END
"""
TURNS = """python - <<'END'
rate, rows = 0.0, ["time,rudder,rate"]
for tick in range(900):
    rudder = 0.3 if tick // 100 % 2 else -0.3
    rate += 0.1 * (0.4 * rudder - rate) / 2.0
    rows.append(f"{tick / 10},{rudder},{rate}")
open("log.csv", "w").write("\\n".join(rows) + "\\n")
END
"""
LOG = """python - <<'END'
rows = ["t,yaw,u,v,r,right,left"]
for tick in range(900):
    more = 60 if tick // 100 % 2 else -60
    rows.append(f"{tick * 100},0.0,1.2,0.0,{more / 400},{1700 - more},{1300 - more}")
open("log.csv", "w").write("\\n".join(rows) + "\\n")
END
"""
PAGES = {
    # on the boat the bench run before has made the store that is copied; here a run without devices does
    "docs/COMMISSIONING.md": Page(
        f"{PLAN}; {SIM}; companion run config/boat.toml --duration 2 >/dev/null 2>&1", {"RUN_DIR": "run-1"}
    ),
    "docs/DEPTH.md": Page(
        "printf -- '-8.7052 41.1838 6.5\\n' > s.xyz; mkdir -p state; companion depth import state/companion.db s.xyz; "
        + CHART
    ),
    "docs/PAGE.md": Page(
        "cp config/boat.toml my-boat.toml; mkdir -p /etc/usv-companion; id usv >/dev/null || useradd -r usv"
    ),
    "docs/RASPBERRY.md": Page(words={" usv_companion-*.whl": " build/usv_companion-*.whl"}),
    "docs/REACHING.md": Page(
        f"{PLAN}; mkdir -p /etc/usv-companion; companion sim >sim.log 2>&1 & SIM=$!; sleep 12",
        {"F.plan": "my.plan", "--config boat.toml": "--config config/boat.toml"},
    ),
    "docs/RECORDINGS.md": Page(f"{PLAN}; {SIM}", {"RUN_DIR": "run-1", "F.tlog": "run-1/mavlink.tlog"}),
    "docs/SCENARIOS.md": Page(words={"F.toml": "campaign.toml"}),
    "docs/TUNING.md": Page(f"{PLAN}; {SIM}; {TURNS}", {"RUN/": "run-1/", "boat.toml": "config/boat.toml"}),
    "docs/UPGRADING.md": Page("cp config/boat.toml my-boat.toml"),
    "docs/VESSEL.md": Page(
        f"{PLAN}; {SIM}; cp -r run-1 run-2; cp config/vessels/otter.toml my-hull.toml; {LOG}",
        {"OTHER_RUN_DIR": "run-2", "RUN_DIR": "run-1", "RUN/": "run-1/", "boat.toml": "config/boat.toml"},
    ),
}
HARDWARE = How(skip="needs the hardware and a person")
ELSEWHERE = How(skip="is typed on another computer")
LINES: tuple[tuple[str, How], ...] = (
    (r"make sim\b", How(until="recording in", stays=True)),
    (r"make (test|soak)\b", How(skip="the suite is what CI runs")),
    (r"make pypy\b|\.venv-pypy/", How(skip="tests/replay/test_pypy.py tries it")),
    (
        r"mavproxy\.py",
        How(
            typed=((40, "wp load my-plan.txt"), (25, "arm throttle"), (10, "mode AUTO"), (30, "exit")),
            ends=(0, 1),  # 1.8.75 ends so at every 'exit'
            says="Mode AUTO",
        ),
    ),
    (r"companion run my-boat\.toml", How(until=".", alone=True)),
    (r"companion sim (--config|--set vessel|--imc)", How(until="recording in")),
    (r"companion web ", How(until="page: http")),
    (r"companion status", How(skip="no service runs in a root; tests/unit/test_status_socket.py tries it")),
    (r"companion trial (check|start|status)", How(skip="needs a vessel at sea; tests/e2e/test_trial_command.py")),
    # a loiter, or a drawing of a turn, is too poor a record, and that is said
    (r"companion tune (vessel|identify)", How(ends=(0, 1))),
    # no station has fetched the parameters in the log of a simulation alone, and that is said
    (r"companion plan extract F\.tlog", How(ends=(0, 1))),
    (r"companion bench-actuators", HARDWARE),
    (r"companion lora ", HARDWARE),
    (r"make -C firmware flash", HARDWARE),
    (r"sim_vehicle\.py|param set ", How(skip="ArduPilot's own shell")),
    (r"scp ", ELSEWHERE),
    (r".*10\.42\.0\.1", How(skip="needs the boat's access point")),
    (r".*(--cluster)", How(skip="needs a cluster; tests/e2e/test_campaign_cluster.py has one")),
    (r"sudo systemctl|journalctl", How(skip="systemd does not run in a root")),
    (r"sudo udevadm", How(skip="no devices in a root")),
    (r"companion keys make --passphrase", How(typed=((2, "twelve gulls over water"), (1, "twelve gulls over water")))),
    (r"companion replay .* --set", How(ends=(0, 1))),
    (r"companion tune margins", How(ends=(0, 1))),
    (r"sudo apt(-get)? install", How(typed=((3, "y"),))),
)


def blocks(text: str) -> list[tuple[str, list[str]]]:
    """Language and lines of each fenced block."""
    return [(kind, body.splitlines()) for kind, body in re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S)]


def is_typed(line: str) -> bool:
    """A drawing is no line to type; a line that a program reads is typed with the program's."""
    return bool(re.match(r"[\w./~$(]", line)) and not re.search("[\u2500-\u25ff]", line)


def how_of(line: str) -> How:
    return next((how for pattern, how in LINES if re.match(pattern, line)), How())


class Shell:
    """One plain shell, kept over a page, as a reader keeps a terminal."""

    def __init__(self) -> None:
        self._shell = subprocess.Popen(
            ["bash", "--norc"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._kept: list[subprocess.Popen[str]] = []

    def run(self, line: str, how: How) -> tuple[bool, str]:
        """Type a line; whether it did what it should, and what it said last."""
        if how.until:
            return self._until(line, how)
        feed = "".join(f"sleep {wait}; echo {text!r}; " for wait, text in how.typed)
        source = f"({feed}) | " if how.typed else ""
        end = "" if how.typed else " < /dev/null"
        said, status = self._typed(f"{source}{{ {line}\n}}{end}")
        return status in how.ends and how.says in said, said

    def _typed(self, text: str) -> tuple[str, int]:
        assert self._shell.stdin is not None
        assert self._shell.stdout is not None
        self._shell.stdin.write(f"{text}\nprintf '\\n@@%s@@\\n' $?\n")
        self._shell.stdin.flush()
        said: list[str] = []
        for line in self._shell.stdout:
            if found := re.fullmatch(r"@@(\d+)@@\n", line):
                return "".join(said), int(found[1])
            said.append(line)
        raise SystemExit(f"the shell ended at: {text}")

    def _until(self, line: str, how: How) -> tuple[bool, str]:
        """Start it as in a terminal of its own, wait for what it says, and press Ctrl-C."""
        if how.alone:
            self._end_what_stays()
        where, _ = self._typed("pwd; echo $PATH")
        folder, path = where.split()[:2]
        process = subprocess.Popen(
            ["bash", "-c", f"cd {folder}; PATH={path}; exec {line.split('  #')[0]}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        assert process.stdout is not None
        said, began = "", time.monotonic()
        for text in process.stdout:
            said += text
            if re.search(how.until, said) or time.monotonic() - began > LIMIT_S:
                break
        seen = re.search(how.until, said) is not None
        self._kept.append(process)
        if how.stays:
            return seen and process.poll() is None, said
        time.sleep(3.0)
        return seen and self._end(process) in (0, 130), said

    def _end(self, process: subprocess.Popen[str]) -> int:
        """Ctrl-C, as a terminal gives it: to all of them."""
        self._kept.remove(process)
        os.killpg(process.pid, signal.SIGINT)
        process.communicate(timeout=60.0)
        return process.returncode

    def close(self) -> list[int]:
        """End what still runs; its exit statuses."""
        ends = self._end_what_stays()
        self._typed('[ -z "$SIM" ] || kill $SIM; wait')  # what the page's first line has left running keeps its ports
        self._shell.kill()
        return ends

    def _end_what_stays(self) -> list[int]:
        return [self._end(process) for process in list(self._kept)]


def try_page(name: str) -> None:
    """Type all lines of a page."""
    page, shell, text = PAGES.get(name, Page()), Shell(), Path(name).read_text(encoding="utf-8")
    if name != "README.md":
        shell.run(". .venv/bin/activate", How())
    if page.first:
        shell.run(page.first, How())
    tables = [body for kind, body in blocks(text) if kind == "toml"]
    if name == "docs/SCENARIOS.md":
        (campaign,) = (table for table in tables if table[0] == "[campaign]")
        Path("mine.toml").write_text("\n".join(tables[0]) + "\n")
        Path("campaign.toml").write_text("\n".join(campaign) + "\n")
    for kind, body in blocks(text):
        if kind == "python" and name == "README.md":
            Path("snippet.py").write_text("\n".join(body) + "\n")
            _say(name, "(the Python of the page)", *_timed(shell, "python snippet.py", How()))
        for line in body if kind == "" else []:
            if is_typed(line):
                how, typed = how_of(line), line
                for word, own in page.words.items():
                    typed = typed.replace(word, own)
                _say(name, line, *_timed(shell, typed, how), skip=how.skip)
    _say(name, "(Ctrl-C to what still ran)", set(shell.close()) <= {0, 130, -signal.SIGINT}, "", 0.0)


def _timed(shell: Shell, line: str, how: How) -> tuple[bool, str, float]:
    began = time.monotonic()
    done, said = (True, "") if how.skip else shell.run(line, how)
    return done, said, time.monotonic() - began


def _say(page: str, line: str, done: bool, said: str, took_s: float, skip: str = "") -> None:
    told = {"page": page, "line": line.strip(), "works": done, "took_s": round(took_s, 1), "skip": skip}
    print(json.dumps({**told, "said": "" if done else said[-1500:]}), flush=True)


if __name__ == "__main__":
    for each in sys.argv[1:]:
        try_page(each)
