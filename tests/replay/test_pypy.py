"""The other Python: under PyPy the simulator makes the same bytes, and either replays what the other recorded."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from companion.io.keeping.content import SaveCounter, SaveParam
from companion.io.keeping.store import Store
from companion.replay import replay, summary
from tests.conftest import PYPY, REPO

SCENARIO = "loiter-in-current-and-wind"
SAME = ("truth.csv", "control.csv", "events.jsonl", "mavlink.tlog")

pytestmark = [
    pytest.mark.skipif(not PYPY.exists(), reason="no PyPy here: make pypy"),
]


def companion(program: Path, *words: str | Path) -> str:
    done = subprocess.run([program, *words], cwd=REPO, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """The same scenario, recorded by this Python and by PyPy."""
    folder = tmp_path_factory.mktemp("pypy")
    for program, name in ((Path(sys.executable).with_name("companion"), "here"), (PYPY, "there")):
        companion(program, "sim", "--scenario", SCENARIO, "--run-dir", folder / name, "--json")
    return folder / "here", folder / "there"


@pytest.mark.parametrize("name", SAME)
def test_the_same_bytes_are_recorded(recordings, name):
    here, there = recordings
    assert (here / name).read_bytes() == (there / name).read_bytes()


def test_each_replays_what_the_other_recorded(recordings):
    here, there = recordings
    outcome = replay(there)
    assert outcome.identical, summary(outcome, 1.0)
    assert "recorded by" in outcome.versions
    assert "on PyPy" in outcome.versions
    assert json.loads(companion(PYPY, "replay", here, "--json"))["identical"]


def test_a_store_is_read_and_written_by_either(tmp_path):
    store = Store(tmp_path / "here.db")
    for op in (SaveParam("DEPTH_MIN", 4.5), SaveCounter("boots", 3)):
        store.submit(op)
    store.close()
    companion(PYPY, "store", "export", tmp_path / "here.db", tmp_path / "out.json")
    companion(PYPY, "store", "import", tmp_path / "there.db", tmp_path / "out.json")
    again = Store(tmp_path / "there.db")
    assert (again.snapshot().params, again.snapshot().counters) == ({"DEPTH_MIN": 4.5}, {"boots": 3})
    again.close()
