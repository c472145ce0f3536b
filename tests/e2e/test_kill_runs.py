"""kill -9 at random times: every run directory opens, replays and reports, the store opens, one second is lost at most."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from companion.io.keeping.store import Store
from companion.replay import replay, summary
from companion.report.flight import Flight
from companion.report.from_run import read_run
from companion.report.page import make_page
from mavlink_bridge.language.requests import PlanKind

HERE = Path(__file__).parent


def kill_and_check(tmp_path: Path, count: int, seed: int) -> None:
    subprocess.run(
        [sys.executable, HERE / "kill_runs.py", tmp_path, str(count), str(seed)], check=True, cwd=HERE.parents[1]
    )
    lengths = set()
    for folder in sorted(tmp_path.glob("run-*")):
        sailed_s = int.from_bytes((folder / "progress").read_bytes(), "little") * 1e-6
        outcome = replay(folder)
        assert outcome.identical, f"{folder.name}: {summary(outcome, 1.0)}"
        assert outcome.duration_s >= sailed_s - 1.06, folder.name
        flight = read_run(folder)
        assert flight.duration_s >= sailed_s - 1.06, folder.name
        assert flight.settings, folder.name
        assert "Summary" in make_page(thinned(flight))
        store = Store(folder / "store.db")
        assert store.warnings == (), folder.name
        items = store.snapshot().plans.get(PlanKind.MISSION, ())
        assert len(items) in (0, 20)
        store.close()
        lengths.add(round(sailed_s, 1))
    assert len(lengths) > count // 4, "the moments of death were not spread"


def thinned(flight: Flight) -> Flight:
    """The report without its pictures' cost; the pictures of cut runs are tested with the report."""
    flight.series.clear()
    flight.tracks.clear()
    return flight


@pytest.mark.e2e
def test_four_kills(tmp_path):
    kill_and_check(tmp_path, 4, 4)


@pytest.mark.soak
def test_two_hundred_kills(tmp_path):
    kill_and_check(tmp_path, 200, 200)
