"""Runs below one base: fresh names, and room made by the oldest runs and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from companion.io.run_folders import free_bytes, make_room, new_run_dir

NAMES = ("20260101-000000", "20260101-000000-2", "20260101-000000-10", "20260301-120000", "20261121-235959")


@pytest.fixture
def base(tmp_path: Path) -> Path:
    for name in NAMES:
        (tmp_path / name / "earlier-1").mkdir(parents=True)
        (tmp_path / name / "run.json").write_text("{}")
    return tmp_path


def disk(base: Path, size: int = 10) -> int:
    """A disk on which each run takes one byte."""
    return size - sum(1 for path in base.iterdir() if path.name in NAMES)


def test_runs_go_oldest_first_and_only_as_many_as_it_takes(base: Path) -> None:
    assert make_room(base, 5, disk) == []
    assert [path.name for path in make_room(base, 8, disk)] == list(NAMES[:3])
    assert sorted(path.name for path in base.iterdir()) == sorted(NAMES[3:])


def test_what_is_no_run_of_ours_stays_however_full_the_disk(base: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    kept = [base / "regatta", base / "20250101-000000", base / "20250101-000000-backup", elsewhere]
    for path in kept:
        path.mkdir()
    (base / "regatta" / "run.json").write_text("{}")
    (elsewhere / "run.json").write_text("{}")
    (base / "20240101-000000").symlink_to(elsewhere)
    (base / "20230101-000000").write_text("a file")
    make_room(base, 1 << 60, disk)
    assert not any((base / name).exists() for name in NAMES)
    assert all(path.is_dir() for path in kept)
    assert (base / "20240101-000000").is_symlink()
    assert (base / "20230101-000000").is_file()


def test_a_disk_in_trouble_deletes_nothing_more(base: Path) -> None:
    def broken(folder: Path) -> int:
        raise OSError(5, "Input/output error")

    assert make_room(base, 8, broken) == []
    assert make_room(base / "missing", 8, disk) == []


def test_room_is_asked_of_the_folder_or_the_one_above(base: Path) -> None:
    assert free_bytes(base / "not" / "yet") > 0


def test_two_runs_in_one_second_have_two_directories(tmp_path: Path) -> None:
    first = new_run_dir(tmp_path)
    first.mkdir()
    second = new_run_dir(tmp_path)
    assert second != first
    assert second.parent == tmp_path
