"""A disk that is full: said at the end of a rehearsal, and nothing half is left on it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import require

pytestmark = pytest.mark.e2e
COMPANION = Path(sys.executable).with_name("companion")
SAIL = ("sim", "--speed", "max", "--duration", "20")


@pytest.fixture
def full(tmp_path: Path) -> Iterator[Path]:
    """A disk of its own with 8 kB left."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = (
        os.geteuid() == 0
        and not subprocess.run(
            ("mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)), capture_output=True, check=False
        ).returncode
    )
    require(mounted, "the right to mount a disk")
    (disk / "ballast").write_bytes(bytes(248 << 10))
    try:
        yield disk
    finally:
        subprocess.run(("umount", str(disk)), check=True)


def companion(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run((COMPANION, *words), capture_output=True, text=True, check=False)


def test_a_simulation_says_that_it_was_not_recorded(full: Path) -> None:
    run = full / "run"
    done = companion(*SAIL, "--run-dir", str(run))
    assert done.returncode == 1
    assert f"NOT recorded in {run}" in done.stderr
    assert "run.json" in done.stderr
    assert "space" in done.stderr
    assert "companion report" not in done.stdout
    assert "Traceback" not in done.stderr
    assert all(path.read_bytes().endswith(b"\n") for path in run.glob("*") if path.is_file()), "nothing half"
    assert not (run / "run.json").exists()


def test_room_that_ends_under_way_is_told_and_what_was_kept_can_be_seen(full: Path) -> None:
    (full / "ballast").write_bytes(bytes(100 << 10))
    run = full / "run"
    done = companion(*SAIL, "--run-dir", str(run), "--set", "record.free_floor_mb=0")
    assert done.returncode == 1
    assert f"NOT recorded in {run}" in done.stderr
    (full / "ballast").unlink()
    seen = companion("report", str(run), "-o", str(full.parent / "seen.html"))
    assert seen.returncode == 0, seen.stderr


def test_no_command_leaves_half_a_file(full: Path) -> None:
    (full / "ballast").write_bytes(bytes(255 << 10))
    before = {path.name for path in full.rglob("*")}
    points = [f"41.18{k:02d},-8.706" for k in range(90)]
    done = companion("plan", "make", str(full / "r.plan"), *points)
    assert done.returncode != 0
    assert f"{full}/r.plan: No space left" in done.stderr
    assert "Traceback" not in done.stderr
    assert {path.name for path in full.rglob("*")} == before


def test_a_campaign_names_the_table_that_has_no_room(full: Path) -> None:
    (full / "ballast").write_bytes(bytes(248 << 10))
    (full / "c.toml").write_text('[campaign]\nscenarios = ["sounder-drop-out"]\n')
    (full / "ballast").write_bytes(bytes(252 << 10))
    before = {path.name for path in full.rglob("*")}
    done = companion("sim", "--campaign", str(full / "c.toml"))
    assert done.returncode == 1
    assert f"{full}/c.csv: No space left" in done.stderr
    assert "Traceback" not in done.stderr
    assert {path.name for path in full.rglob("*")} == before
