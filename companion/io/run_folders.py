"""The directories of runs below one base: a fresh one for each run, and room for it, the oldest going first.

A boat is not looked after like a server: without this its card would be full one day, and the run that somebody wants to see
would be the one that was not recorded.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

_NAME: Final = re.compile(r"\d{8}-\d{6}(-\d{1,3})?")


def new_run_dir(base: Path) -> Path:
    """Return a fresh directory named after the time, in ``base``."""
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    for number in range(1000):
        candidate = base / (stamp if not number else f"{stamp}-{number}")
        if not candidate.exists():
            return candidate
    raise OSError(f"{base}: a thousand runs in one second")


def free_bytes(folder: Path) -> int:
    """Return what the disk of a folder, or of the nearest one above it that exists, has free. Raises OSError."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return shutil.disk_usage(folder).free


def make_room(base: Path, wanted_bytes: int, free: Callable[[Path], int] = free_bytes) -> list[Path]:
    """Delete the oldest runs in ``base`` until its disk has ``wanted_bytes`` free; return those that went.

    Only directories that bear a time as ``new_run_dir`` gives it and hold a run.json are runs; links are left alone. What cannot
    be read or deleted stays: a disk's trouble is the recorder's to tell.
    """
    gone: list[Path] = []
    try:
        for run_dir in _runs(base):
            if free(base) >= wanted_bytes:
                break
            shutil.rmtree(run_dir, ignore_errors=True)
            if not run_dir.exists():
                gone.append(run_dir)
    except OSError:
        pass
    return gone


def _runs(base: Path) -> list[Path]:
    """Oldest first."""
    if not base.is_dir():
        return []
    found = [path for path in base.iterdir() if _NAME.fullmatch(path.name) and not path.is_symlink()]
    return sorted((path for path in found if (path / "run.json").is_file()), key=_age)


def _age(run_dir: Path) -> tuple[str, int]:
    stamp, number = run_dir.name[:15], run_dir.name[16:]
    return stamp, int(number or 0)
