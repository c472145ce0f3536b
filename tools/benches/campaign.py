"""Benchmark of campaigns: 200 runs on one core, on all cores and on a Dask cluster of two workers; the results must be the same.

The command runs as a user starts it; one core is the same command that may use only one. ``CAMPAIGN_RUNS`` makes it shorter.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tools.figures import row

REPO = Path(__file__).resolve().parents[2]
COMPANION = Path(sys.executable).parent / "companion"
SCENARIOS = ("gnss-outage", "ground-station-lost", "fence", "double-echo")
RUNS = int(os.environ.get("CAMPAIGN_RUNS", "200"))


def run() -> list[dict[str, Any]]:
    """One core, all cores, two workers of a cluster."""
    cores = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as folder:
        one_s, one = timed(Path(folder) / "one", cores=1)
        all_s, every = timed(Path(folder) / "all")
        cluster_s, there = clustered(Path(folder) / "cluster")
    different = sum(every[key] != one[key] for key in one) + sum(there[key] != one[key] for key in one)
    bar = 1.8 if cores == 2 else None
    return [
        row(f"campaign: {RUNS} runs on one core", one_s, "s"),
        row(f"campaign: {cores} cores against one", one_s / all_s, "x", bar, at_least=True),
        row("campaign: a cluster of two workers against one core", one_s / cluster_s, "x"),
        row("campaign: runs whose results differ between one core, all cores and the cluster", different, "", 0.0),
    ]


def timed(folder: Path, *options: str, cores: int | None = None) -> tuple[float, dict[tuple[str, str], str]]:
    """Run the campaign; return its time, and by scenario and seed what was found."""
    folder.mkdir()
    seeds = list(range(1, RUNS // len(SCENARIOS) + 1))
    text = f"[campaign]\nscenarios = {json.dumps(SCENARIOS)}\nseeds = {seeds}\n"
    (folder / "c.toml").write_text(text)
    allowed = sorted(os.sched_getaffinity(0))[:cores]
    began = time.monotonic()
    subprocess.run(
        [COMPANION, "sim", "--campaign", folder / "c.toml", "--json", *options],
        cwd=REPO,
        stdout=subprocess.DEVNULL,
        check=False,  # a scenario that fails is a result here
        preexec_fn=lambda: os.sched_setaffinity(0, allowed),
    )
    wall_s = time.monotonic() - began
    with (folder / "c.csv").open(newline="") as file:
        found = {
            (item["scenario"], item["seed"]): item["distance_m"] + item["findings"] for item in csv.DictReader(file)
        }
    if len(found) != len(seeds) * len(SCENARIOS):
        raise RuntimeError(f"{len(found)} runs are done, not {len(seeds) * len(SCENARIOS)}")
    return wall_s, found


def clustered(folder: Path) -> tuple[float, dict[tuple[str, str], str]]:
    """The same over a cluster of two workers on this computer, its start not counted."""
    with subprocess.Popen(
        [sys.executable, "-m", "tests.e2e.cluster"], cwd=REPO, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        address = json.loads(process.stdout.readline())["address"]
        try:
            return timed(folder, "--cluster", address)
        finally:
            process.stdin.close()


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
