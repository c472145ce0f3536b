"""The directories of runs below one base: a fresh one for each run, and room for it, the oldest going first.

A boat is not looked after like a server: without this its card would be full one day, and the run that somebody wants to see
would be the one that was not recorded.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime, timedelta
from itertools import islice
from pathlib import Path
from typing import Final

from ..log_file import parts_of

KEPT_RUNS: Final = 3
"""The newest runs are never deleted: what happened last is what one wants to see."""
BRIEF_S: Final = 60.0
"""A run shorter than this is a start that came to nothing: a hundred of them, one after another, hold no voyage."""
_BRIEF_BYTES: Final = 2 << 20
"""A minute of control rows at the fastest rate has less; more is not even read."""
_END_BYTES: Final = 4096
"""What is read of a part at either end: some rows, so that the last is known where a power cut has torn one."""
_NAME: Final = re.compile(r"\d{8}-\d{6}(-\d{1,3})?")
_STAMP: Final = "%Y%m%d-%H%M%S"
_CLOCK_WAS_SET: Final = "2020"
"""A name before this year was given by a computer that did not know the time; it says nothing of the run's age."""


def new_run_dir(base: Path) -> Path:
    """Return a fresh directory in ``base``, named after the time, and later than any that is there.

    A computer without a clock of its own begins each start at the date of its image, and what happened last must not look oldest.
    """
    begun = datetime.now(UTC)
    newest = max((path.name[:15] for path in base.glob("*") if _NAME.fullmatch(path.name)), default="")
    if newest >= begun.strftime(_STAMP):
        with contextlib.suppress(ValueError, OverflowError):  # digits that are no date
            begun = datetime.strptime(newest, _STAMP).replace(tzinfo=UTC) + timedelta(seconds=1)
    stamp = begun.strftime(_STAMP)
    for number in range(1000):
        candidate = base / (stamp if not number else f"{stamp}-{number}")
        if not candidate.exists():
            return candidate
    raise OSError(f"{base}: a thousand runs in one second")


def hold(run_dir: Path) -> int | None:
    """Mark a run as being recorded until the descriptor is closed, or its process ends, however that ends. None: no lock can be had."""
    handle = _opened(run_dir)
    if handle is not None and not _locks(handle):
        os.close(handle)
        return None
    return handle


def is_held(run_dir: Path) -> bool:
    """Whether somebody records this run now."""
    handle = _opened(run_dir)
    if handle is None:
        return False
    try:
        return not _locks(handle)
    finally:
        os.close(handle)


def _opened(run_dir: Path) -> int | None:
    if sys.platform == "win32":  # a gateway's, which records no run
        return None
    with contextlib.suppress(OSError):
        return os.open(run_dir, os.O_RDONLY | os.O_DIRECTORY)
    return None


def _locks(handle: int) -> bool:
    """Lock an open folder; False when another has the lock. A disk without locks knows of nobody."""
    if sys.platform != "win32":
        import fcntl  # not on Windows, where the gateway runs too

        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return True
    return True


def free_bytes(folder: Path) -> int:
    """Return what the disk of a folder, or of the nearest one above it that exists, has free. Raises OSError."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return shutil.disk_usage(folder).free


def is_brief(run_dir: Path) -> bool:
    """Whether a run surely holds less than a minute; one of which that cannot be told is taken for a voyage."""
    try:
        parts = parts_of(run_dir / "control.csv")
        sizes = [part.stat().st_size for part in parts]
        if not sizes or 0 in sizes:  # even a start writes a header: what is gone here may have been hours
            return _is_bare(run_dir)
        if sum(sizes) > _BRIEF_BYTES:
            return False
        times_s = [time_s for part in parts for time_s in _times_at_ends(part)]
    except (OSError, ValueError):
        return False
    return not times_s or max(times_s) - times_s[0] < BRIEF_S


def _is_bare(run_dir: Path) -> bool:
    """Whether a start ended before anything was recorded, or its files were never more than names."""
    about = run_dir / "run.json"
    others = [path for path in run_dir.iterdir() if path != about]
    return about.is_file() and all(path.is_file() and not path.stat().st_size for path in others)


def _times_at_ends(part: Path) -> list[float]:
    """The times of a part's first rows and of its last: the clock of a run only goes on. Raises OSError and ValueError."""
    with part.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        if size <= 2 * _END_BYTES:
            rows = file.read().splitlines()[1:]
        else:
            first = file.read(_END_BYTES).splitlines()[1:-1]
            file.seek(-_END_BYTES, os.SEEK_END)
            last = file.read().splitlines()[1:]
            if not first or not last:
                raise ValueError("rows of no run")
            rows = first + last
    return [float(row.partition(b",")[0]) for row in rows]


def take_back(run_dir: Path) -> None:
    """Remove the folder of a start that failed before it recorded anything; an attempt each second would fill a card with them."""
    with contextlib.suppress(OSError):
        if _is_bare(run_dir):
            shutil.rmtree(run_dir, ignore_errors=True)


def make_room(
    base: Path, wanted_bytes: int, free: Callable[[Path], int] = free_bytes, *, floor_bytes: int = 0
) -> list[Path]:
    """Delete the oldest runs in ``base`` until its disk has ``wanted_bytes`` free; return those that went.

    The newest stay in any case, and so do the newest that are not brief. Brief ones go first, and those that stay cost no other
    run its place: a program that starts again and again must not delete the voyage before it. Where the room cannot be had, old
    runs and the new one share what there is above ``floor_bytes``.
    Only directories that bear a time as ``new_run_dir`` gives it and hold a run.json are runs; links are left alone, and so is what
    another process records. What cannot
    be read or deleted stays: a disk's trouble is the recorder's to tell.
    """
    gone: list[Path] = []
    try:
        if free(base) >= wanted_bytes:
            return gone
        runs, spared = _runs(base)
        spared_bytes = sum(map(_size, spared))
        most = free(base) + spared_bytes + sum(map(_size, runs))
        if most < wanted_bytes:
            wanted_bytes = min(most, floor_bytes + max(most - floor_bytes, 0) // 2)
        for run_dir in _brief_first(runs):
            if free(base) + spared_bytes >= wanted_bytes:
                break
            if is_held(run_dir):
                continue
            shutil.rmtree(run_dir, ignore_errors=True)
            if not run_dir.exists():
                gone.append(run_dir)
    except OSError:
        pass
    return gone


def _runs(base: Path) -> tuple[list[Path], list[Path]]:
    """Those that may go, the oldest first, and the brief ones that stay.

    Those of which nobody knows when they were come after the others.
    """
    if not base.is_dir():
        return [], []
    found = [path for path in base.iterdir() if _NAME.fullmatch(path.name) and not path.is_symlink()]
    ages = sorted((_age(path), path) for path in found if (path / "run.json").is_file())
    dated = [path for (stamp, _), path in ages if stamp >= _CLOCK_WAS_SET]
    undated = [path for (stamp, _), path in ages if stamp < _CLOCK_WAS_SET]
    kept: set[Path] = set()
    for group in (dated, undated):
        voyages = (path for path in reversed(group) if not is_brief(path))
        kept |= {*group[-KEPT_RUNS:], *islice(voyages, KEPT_RUNS)}
    return [path for path in (*dated, *undated) if path not in kept], sorted(filter(is_brief, kept))


def _brief_first(runs: Iterable[Path]) -> Iterator[Path]:
    """Give the runs as they go, each looked into at its turn only: a boat with years of runs must be there at once."""
    voyages = []
    for run_dir in runs:
        if is_brief(run_dir):
            yield run_dir
        else:
            voyages.append(run_dir)
    yield from voyages


def _age(run_dir: Path) -> tuple[str, int]:
    stamp, number = run_dir.name[:15], run_dir.name[16:]
    if stamp < _CLOCK_WAS_SET:  # it may have been set later in the run
        written_s = max((path.stat().st_mtime for path in run_dir.iterdir()), default=0.0)
        stamp = max(stamp, datetime.fromtimestamp(written_s, UTC).strftime(_STAMP))
    return stamp, int(number or 0)


def _size(run_dir: Path) -> int:
    return sum(path.lstat().st_blocks * 512 for path in run_dir.rglob("*"))
