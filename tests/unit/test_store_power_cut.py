"""A power cut at every single change that a save makes to the disk: afterwards the store holds the old or the new.

A preloaded library writes down each write, sync, truncate, unlink and rename of a child that saves. From every prefix
of that list the test rebuilds what the disk may hold: all of it (the process was killed), only what was synced (the
power went), and random parts of what was not (fault row 55).
"""

from __future__ import annotations

import os
import random
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from companion.io.keeping.content import to_json, unpack_tile
from companion.io.keeping.store import Store

HERE = Path(__file__).parent
CHILD = """
import random, sys, time
from pathlib import Path
from companion.io.keeping.store import Store
from companion.io.keeping.content import SaveDepth, SaveParam, SavePlan, Together
from mavlink_bridge.language.requests import PlanItem, PlanKind
folder = Path(sys.argv[1])
def plan(n):
    return SavePlan(PlanKind.MISSION, tuple(PlanItem(16, 6, n, 0, 0, 0, k, n, 0) for k in range(60)))
store = Store(folder / "store.db")
diary = (folder / "diary").open("ab", buffering=0)
for n in range(3):
    depth = SaveDepth(tuple((f"2000/1/{k}", random.Random(k).randbytes(3000) + bytes([n]) * 1096) for k in range(4)))
    ticket = store.submit(Together((plan(n), SaveParam("N", n), depth)))
    while not (done := store.completions()):
        time.sleep(0.0005)
    assert done[0].ok, done
    diary.write(b"%d" % n)
store.close()
"""


def operations(data: bytes):
    """Yield (what, path, offset, data) of a tap's log."""
    at = 0
    while at < len(data):
        what, length, offset, size = struct.unpack_from("<cIQQ", data, at)
        at += 21
        path = data[at : at + length].decode()
        at += length
        yield what.decode(), Path(path).name, offset, data[at : at + size]
        at += size


class Disk:
    """Files as the running system sees them, and as the medium holds them."""

    def __init__(self):
        self.seen: dict[str, bytearray] = {}
        self.durable: dict[str, bytes] = {}
        self.unsynced: dict[str, list[tuple[str, int, bytes]]] = {}

    def apply(self, what, name, offset, data):
        if what == "S":
            self.durable[name] = bytes(self.seen.get(name, b""))
            self.unsynced[name] = []
        elif what == "U":
            for table in (self.seen, self.durable, self.unsynced):
                table.pop(name, None)
        elif what == "R":
            for table in (self.seen, self.durable, self.unsynced):
                if name in table:
                    table[Path(data.decode()).name] = table.pop(name)
        else:
            change(self.seen.setdefault(name, bytearray()), what, offset, data)
            self.unsynced.setdefault(name, []).append((what, offset, data))

    def killed(self):
        return {name: bytes(data) for name, data in self.seen.items()}

    def without_power(self, rng: random.Random | None):
        """What a medium may hold: synced content, plus (with ``rng``) any part of the rest, in any order."""
        found = {}
        for name in self.seen:
            data = bytearray(self.durable.get(name, b""))
            for what, offset, written in self.unsynced.get(name, []) if rng else []:
                if rng.random() < 0.5:
                    kept = written[: rng.randrange(len(written) + 1)] if rng.random() < 0.3 else written
                    change(data, what, offset, kept)
            found[name] = bytes(data)
        return found


def change(data: bytearray, what: str, offset: int, written: bytes) -> None:
    if what == "T":
        del data[offset:]
        data.extend(bytes(offset - len(data)))
    else:
        if len(data) < offset:
            data.extend(bytes(offset - len(data)))
        data[offset : offset + len(written)] = written


@pytest.fixture(scope="module")
def tap_log(tmp_path_factory):
    """What the disk was told while a child saved three times."""
    if shutil.which("gcc") is None:
        if os.environ.get("REQUIRE_ALL") == "1":
            pytest.fail("gcc is missing, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
        pytest.skip("gcc is missing")
    folder = tmp_path_factory.mktemp("tap")
    library = folder / "tap.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", library, HERE / "disk_tap.c", "-ldl"], check=True)
    (folder / "disk").mkdir()
    environment = os.environ | {
        "LD_PRELOAD": str(library),
        "TAP_FOLDER": str(folder / "disk"),
        "TAP_LOG": str(folder / "log"),
    }
    subprocess.run([sys.executable, "-c", CHILD, folder / "disk"], check=True, env=environment, cwd=HERE.parents[1])
    return list(operations((folder / "log").read_bytes()))


def check(folder: Path, files: dict[str, bytes], saved: int, checked: set[int]) -> None:
    """The store holds what was acknowledged, or what was under way; and works on. ``checked``: files that were so before are not again."""
    same = hash((saved, *sorted((name, data) for name, data in files.items() if not name.endswith("-shm"))))
    if same in checked:
        return
    checked.add(same)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, data in files.items():
        if not name.endswith("-shm"):
            (folder / name).write_bytes(data)
    store = Store(folder / "store.db")
    content = to_json(store.snapshot())
    store.close()
    assert store.warnings == ()
    number = content["param"]["N"] if "param" in content else -1
    assert number in (saved, saved + 1)
    if "param" in content:
        items = content["plan"]["MISSION"]
        assert len(items) == 60
        assert {item[2] for item in items} == {number}
        assert {unpack_tile(text, 4096)[-1] for text in content["depth"].values()} == {number}
        assert len(content["depth"]) == 4


def test_row_55_every_prefix_of_every_save_leaves_old_or_new(tap_log, tmp_path):
    disk, saved, rng = Disk(), -1, random.Random(55)
    cuts, checked = 0, set()
    for what, name, offset, data in tap_log:
        if name == "diary":
            saved = int(data)
            continue
        disk.apply(what, name, offset, data)
        for files in (disk.killed(), disk.without_power(None), disk.without_power(rng)):
            check(tmp_path / "after", files, saved, checked)
            cuts += 1
    assert saved == 2
    assert cuts > 100
    assert len(checked) > 40
