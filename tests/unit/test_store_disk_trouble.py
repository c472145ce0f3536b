"""A store whose disk is absent, full or read-only at the start, gets well, and fails again: at every cut what was acknowledged is there.

As ``test_store_power_cut.py``, whose tap this uses; the disk's troubles are made by the tap too, so that SQLite meets them.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.test_store_power_cut import Disk, check, operations

HERE = Path(__file__).parent
CHILD = """
import random, sys, time
from pathlib import Path
from companion.io.keeping.store import Store
from companion.io.keeping.content import SaveDepth, SaveParam, SavePlan, Together
from mavlink_bridge.language.requests import PlanItem, PlanKind
folder, flag, trouble = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
def plan(n):
    return SavePlan(PlanKind.MISSION, tuple(PlanItem(16, 6, n, 0, 0, 0, k, n, 0) for k in range(60)))
now_s = [0.0]
def opened():
    return Store(folder / "state" / "store.db", clock_s=lambda: now_s[0])
diary = (folder / "diary").open("ab", buffering=0)
def save(store, n):
    now_s[0] += 2.0
    depth = SaveDepth(tuple((f"2000/1/{k}", random.Random(k).randbytes(3000) + bytes([n]) * 1096) for k in range(4)))
    ticket = store.submit(Together((plan(n), SaveParam("N", n), depth)))
    while True:
        for done in store.completions():
            if done.ticket == ticket:
                if done.ok:
                    diary.write(b"%d" % n)
                return done
        time.sleep(0.0005)
if trouble == "absent":
    (folder / "state").touch()
else:
    store = opened()
    assert save(store, 0).ok
    store.close()
    flag.touch()
store = opened()
assert store.warnings
before = 0 if trouble != "absent" else -1
assert (store.snapshot().params.get("N", -1)) == before, store.warnings
assert not save(store, 1).ok
if trouble == "absent":
    (folder / "state").unlink()
flag.unlink(missing_ok=True)
assert save(store, before + 1).ok
if trouble != "absent":
    flag.touch()
    assert not save(store, before + 2).ok
    flag.unlink()
assert save(store, before + 2).ok
store.close()
"""


@pytest.fixture(scope="module")
def tap(tmp_path_factory):
    """The library that writes down what the disk is told, and that makes its troubles."""
    if shutil.which("gcc") is None:
        if os.environ.get("REQUIRE_ALL") == "1":
            pytest.fail("gcc is missing, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
        pytest.skip("gcc is missing")
    library = tmp_path_factory.mktemp("tap") / "tap.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", library, HERE / "disk_tap.c", "-ldl"], check=True)
    return library


def told(tap, folder, trouble):
    """What the disk was told while a child met the trouble."""
    (folder / "disk").mkdir()
    flag = folder / "flag"
    environment = os.environ | {
        "LD_PRELOAD": str(tap),
        "TAP_FOLDER": str(folder / "disk"),
        "TAP_LOG": str(folder / "log"),
        "TAP_FULL" if trouble == "full" else "TAP_READONLY": str(flag),
    }
    words = [sys.executable, "-c", CHILD, folder / "disk", flag, trouble]
    subprocess.run(words, check=True, env=environment, cwd=HERE.parents[1])
    return list(operations((folder / "log").read_bytes()))


@pytest.mark.parametrize("every", [9, pytest.param(1, marks=pytest.mark.soak)])
@pytest.mark.parametrize("trouble", ["absent", "full", "readonly"])
def test_nothing_acknowledged_is_lost_whatever_the_disk_did_at_the_start(tap, tmp_path, trouble, every):
    disk, saved, rng, cuts = Disk(), -1, random.Random(trouble), 0
    checked: set[int] = set()
    last = 1 if trouble == "absent" else 2
    for number, (what, name, offset, data) in enumerate(told(tap, tmp_path, trouble)):
        if name == "diary":
            saved = int(data)
            continue
        disk.apply(what, name, offset, data)
        if number % every:
            continue
        for files in (disk.killed(), disk.without_power(None), disk.without_power(rng)):
            check(tmp_path / "after", files, saved, checked)
            cuts += 1
    assert saved == last
    assert cuts > 90 // every
