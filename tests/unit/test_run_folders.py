"""Runs below one base: fresh names, and room made by the oldest runs and nothing else."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

import pytest

import config
from companion.cli import main
from companion.io.recording.recorder import Recorder
from companion.io.recording.run_folders import free_bytes, is_brief, make_room, new_run_dir

OLD = ("20260101-000000", "20260101-000000-2", "20260101-000000-10", "20260301-120000")
NEWEST = ("20261121-235959", "20261122-000000", "20261122-000000-1")
NAMES = (*OLD, *NEWEST)
SIZE = 64 << 10


def add_run(base: Path, name: str) -> Path:
    (base / name / "earlier-1").mkdir(parents=True)
    (base / name / "run.json").write_text("{}")
    (base / name / "mavlink.tlog").write_bytes(bytes(SIZE))
    return base / name


@pytest.fixture
def base(tmp_path: Path) -> Path:
    for name in NAMES:
        add_run(tmp_path, name)
    return tmp_path


def disk(base: Path, runs: int = 10) -> int:
    """A disk that holds so many runs."""
    return (runs - sum(1 for path in base.iterdir() if (path / "mavlink.tlog").exists())) * SIZE


def names(paths: Iterable[Path]) -> list[str]:
    return [path.name for path in paths]


def test_runs_go_oldest_first_and_only_as_many_as_it_takes(base: Path) -> None:
    assert make_room(base, 3 * SIZE, disk) == []
    assert names(make_room(base, 6 * SIZE, disk)) == list(OLD[:3])
    assert sorted(names(base.iterdir())) == sorted((OLD[3], *NEWEST))


def test_on_a_small_disk_the_newest_runs_stay_and_what_there_is_is_shared(base: Path) -> None:
    assert names(make_room(base, 100 * SIZE, disk, floor_bytes=2 * SIZE)) == list(OLD[:2]), "half of 5 runs' room"
    assert make_room(base, 100 * SIZE, disk, floor_bytes=2 * SIZE) == [], "and not one more at the next start"
    assert names(make_room(base, 100 * SIZE, disk, floor_bytes=50 * SIZE)) == list(OLD[2:])
    assert sorted(names(base.iterdir())) == sorted(NEWEST), "below the floor all goes but these"


def test_a_run_that_somebody_records_is_not_deleted_under_him(base: Path) -> None:
    """Another vessel's, begun under the oldest name."""
    held = Recorder(base / "20250101-000000", free_floor_mb=0)
    assert names(make_room(base, 6 * SIZE, disk)) == list(OLD[:3])
    held.close(0)
    assert names(make_room(base, 7 * SIZE, disk)) == ["20250101-000000", OLD[3]]


def test_a_run_that_began_without_a_clock_is_not_the_oldest(base: Path) -> None:
    for name in ("19700101-000005", "19700101-000007", "19700101-000008", "19700101-000009", "19700101-000010"):
        for path in (add_run(base, name) / "run.json").parent.iterdir():
            os.utime(path, (7, 7))
    set_later = base / "19700101-000007"
    when_s = datetime(2026, 2, 1, tzinfo=UTC).timestamp()
    os.utime(set_later / "mavlink.tlog", (when_s, when_s))
    gone = names(make_room(base, 100 * SIZE, lambda base: disk(base, 13), floor_bytes=50 * SIZE))
    assert gone == [*OLD[:3], set_later.name, OLD[3], "19700101-000005"]


def lasted(run_dir: Path, seconds: float | None, *, parts: int = 1) -> Path:
    """Give a run control rows over so many seconds; None: the header and no row."""
    for part in range(parts):
        shares = () if seconds is None else (part / parts, (part + 1) / parts)
        rows = [f"{500.0 + share * (seconds or 0.0):.3f},7\n" for share in shares]
        (run_dir / (f"control-{part:03d}.csv" if part else "control.csv")).write_text("".join(["t_s,tick\n", *rows]))
    return run_dir


@pytest.mark.parametrize("seconds", [None, 0.0, 4.0, 59.0])
def test_a_program_that_starts_again_and_again_deletes_no_voyage(base: Path, seconds: float | None) -> None:
    """Each start makes room for a whole run: at the fourth the voyage before them was the oldest."""
    assert names(make_room(base, 6 * SIZE, disk)) == list(OLD[:3])
    left = (OLD[3], *NEWEST)
    gone: list[str] = []
    for start in range(20):
        gone += names(make_room(base, 6 * SIZE, disk))
        lasted(add_run(base, f"20261123-0000{start:02d}"), seconds)
    assert gone
    assert all(name.startswith("20261123") for name in gone)
    assert gone == sorted(gone), "the oldest first"
    assert all((base / name).exists() for name in (*left, "20261123-000019", "20261123-000018", "20261123-000017"))


def test_a_card_below_the_floor_keeps_the_newest_voyages_and_the_newest_starts(base: Path) -> None:
    starts = [lasted(add_run(base, f"20261123-00000{start}"), 3.0).name for start in range(5)]
    gone = names(make_room(base, 100 * SIZE, lambda base: disk(base, 13), floor_bytes=99 * SIZE))
    assert gone == [*starts[:2], *OLD]
    assert sorted(names(base.iterdir())) == sorted((*NEWEST, *starts[2:]))


@pytest.mark.parametrize("seconds", [61.0, 8_000.0])
def test_a_run_of_a_minute_is_a_voyage(base: Path, seconds: float) -> None:
    assert not is_brief(lasted(base / OLD[0], seconds))
    assert not is_brief(lasted(base / OLD[1], seconds, parts=3))
    assert is_brief(lasted(base / OLD[2], 30.0, parts=3))


def test_starts_that_end_before_their_first_row_delete_no_voyage(base: Path) -> None:
    """A port that another program has: the unit starts again for ever, and each start left a folder."""
    starts = [f"20261123-0000{start:02d}" for start in range(20)]
    for name in starts:
        (base / name).mkdir()
        (base / name / "run.json").write_text("{}")
        (base / name / "inputs.bin").touch()
    gone = names(make_room(base, 100 * SIZE, disk, floor_bytes=99 * SIZE))
    assert gone == [*starts[:-3], *OLD]
    assert sorted(names(base.iterdir())) == sorted((*NEWEST, *starts[-3:]))


@pytest.mark.parametrize(
    "left", ["inputs.bin", "mavlink.tlog", "events-001.jsonl", "notes.txt", "earlier-1/control.csv"]
)
def test_a_run_whose_rows_are_missing_is_a_voyage_by_what_else_it_holds(tmp_path: Path, left: str) -> None:
    path = tmp_path / left
    path.parent.mkdir(exist_ok=True)
    path.write_text("something")
    (tmp_path / "run.json").write_text("{}")
    assert not is_brief(tmp_path)


@pytest.mark.parametrize("lost", ["control.csv", "control-001.csv"])
def test_rows_that_a_power_cut_emptied_do_not_make_a_voyage_brief(tmp_path: Path, lost: str) -> None:
    """Its telemetry and inputs were whole, and it went first, even as the newest voyage."""
    run_dir = lasted(add_run(tmp_path, OLD[0]), 30.0, parts=2)
    assert is_brief(run_dir)
    (run_dir / lost).write_bytes(b"")
    assert not is_brief(run_dir)


def wide(run_dir: Path, seconds: float, *, end: str = "") -> Path:
    """Give a run rows as wide as real ones, ten in a second."""
    rows = [f"{500.0 + tenth / 10:.3f},{'7' * 300}\n" for tenth in range(round(seconds * 10) + 1)]
    (run_dir / "control.csv").write_text("".join(["t_s,tick\n", *rows, end]))
    return run_dir


@pytest.mark.parametrize("end", ["", "5", "530.1,77"])
def test_a_long_file_is_known_by_its_ends_wherever_a_power_cut_tore_it(base: Path, end: str) -> None:
    assert is_brief(wide(base / OLD[0], 59.0, end=end))
    assert not is_brief(wide(base / OLD[1], 61.0, end=end))
    assert not is_brief(wide(base / OLD[2], 3.0, end="x" * 9_000)), "no row at its end"


@pytest.mark.skipif(not Path("/proc/self/io").exists(), reason="what a process reads is counted by Linux only")
@pytest.mark.parametrize(("brief", "looks"), [(0, 45), (35, 10)])
def test_a_start_with_years_of_runs_reads_little_of_them(tmp_path: Path, brief: int, looks: int) -> None:
    """Each had been read from end to end before the boat was there."""

    def read_bytes() -> int:
        return int(Path("/proc/self/io").read_text().split()[1])

    lasting = [50.0] * brief + [500.0] * (40 - brief)
    runs = [wide(add_run(tmp_path, f"20260101-0000{number:02d}"), seconds) for number, seconds in enumerate(lasting)]
    before = read_bytes()
    assert make_room(tmp_path, 2 * SIZE, lambda base: disk(base, 41)) == runs[:1]
    assert read_bytes() - before < looks * 10_000


@pytest.mark.parametrize("rows", ["", "1.0,3\n\0\0\0\n", "1.0,3\nx"])
def test_a_run_of_which_nobody_can_tell_is_taken_for_a_voyage(base: Path, rows: str) -> None:
    if rows:
        (base / OLD[0] / "control.csv").write_text(f"t_s,tick\n{rows}")
    assert not is_brief(base / OLD[0])


def test_what_is_no_run_of_ours_stays_however_full_the_disk(base: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    kept = [base / "regatta", base / "20250101-000000", base / "20250101-000000-backup", elsewhere]
    for path in kept:
        path.mkdir()
    (base / "regatta" / "run.json").write_text("{}")
    (elsewhere / "run.json").write_text("{}")
    (base / "20240101-000000").symlink_to(elsewhere)
    (base / "20230101-000000").write_text("a file")
    make_room(base, 1 << 60, disk, floor_bytes=1 << 50)
    assert not any((base / name).exists() for name in OLD)
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


def test_a_voyage_that_began_without_a_clock_is_newer_than_what_was_before_it(tmp_path: Path) -> None:
    """Begun at the date of the image, on a card with runs of later dates, it was the first to go."""
    quay = [lasted(add_run(tmp_path, f"2999123{day}-235959"), 120.0) for day in range(2)]
    sea = [lasted(add_run(tmp_path, new_run_dir(tmp_path).name), 3600.0) for _ in range(3)]
    assert names(sea) == ["30000101-000000", "30000101-000001", "30000101-000002"]
    assert make_room(tmp_path, 100 * SIZE, disk, floor_bytes=99 * SIZE) == quay


def test_digits_that_are_no_date_stop_no_start(tmp_path: Path) -> None:
    add_run(tmp_path, "99999999-999999")
    add_run(tmp_path, "99991231-235959")
    assert new_run_dir(tmp_path).name < "9999"


def test_what_could_not_be_had_is_in_the_log(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from companion.commands.run import _make_room, log
    from companion.settings.schema import RecordConfig

    said: list[str] = []
    monkeypatch.setattr(log, "warning", lambda text, *values: said.append(text % values))
    _make_room(RecordConfig(directory=str(base), max_mb=1 << 30))
    assert "MB for a whole recording" in said[-1]
    assert all((base / name).exists() for name in NEWEST)


@pytest.mark.parametrize("own", [True, False])
def test_a_start_that_fails_leaves_no_folder_but_one_that_was_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], own: bool
) -> None:
    runs = tmp_path / "runs"
    with socket.create_server(("127.0.0.1", 0)) as other:
        url = f"tcp-listen://127.0.0.1:{other.getsockname()[1]}"
        keys = [f'endpoints=[{{name="gcs", url="{url}"}}]', "store=", f"record.directory={runs}"]
        words = [word for key in keys for word in ("--set", key)]
        named = [] if own else ["--run-dir", str(runs / "regatta")]
        assert main(["run", str(config.path("replay-nmea.toml")), "--duration", "0.1", *words, *named]) == 2
    assert "in use" in capsys.readouterr().err
    assert names(runs.iterdir()) == ([] if own else ["regatta"])
