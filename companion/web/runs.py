"""The list of recorded runs, and the files of one: by names that are looked up, never by a path that a stranger words."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any, Final

RUNS_MAX: Final = 60
FILES_MAX: Final = 40
_SECRET: Final = frozenset({"companion.db", "companion.db-wal", "companion.db-shm"})
"""What may stand in a run's folder and is nobody's business: a simulation's store."""
_KINDS: Final = frozenset({".json", ".jsonl", ".tlog", ".csv", ".bin", ".html", ".png"})


class Runs:
    """Runs below ``base``."""

    def __init__(self, base: Path) -> None:
        self._base = base

    def listed(self) -> list[dict[str, Any]]:
        """The newest runs first, each with its files and their sizes."""
        found = []
        for name in sorted(_names(self._base), reverse=True)[:RUNS_MAX]:
            files = self._files(name)
            if "run.json" in files:
                sizes = [[each, files[each]] for each in sorted(files)[:FILES_MAX]]
                found.append({"name": name, "report": "report.html" in files, "files": sizes})
        return found

    def open(self, run: str, file: str) -> tuple[int, int] | None:
        """Open one listed file for reading: its descriptor and size; None when it is none of those that are listed."""
        if run not in _names(self._base) or file not in self._files(run):
            return None
        try:
            fd = os.open(self._base / run / file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError:
            return None
        about = os.fstat(fd)
        if not stat.S_ISREG(about.st_mode):
            os.close(fd)
            return None
        return fd, about.st_size

    def _files(self, run: str) -> dict[str, int]:
        """Plain files of a run that may be read, with their sizes."""
        folder = self._base / run
        try:
            with os.scandir(folder) as entries:
                return {
                    each.name: each.stat(follow_symlinks=False).st_size
                    for each in entries
                    if each.is_file(follow_symlinks=False)
                    and each.name not in _SECRET
                    and Path(each.name).suffix in _KINDS
                }
        except OSError:
            return {}


def _names(base: Path) -> set[str]:
    """Folders that are there, not what links to another place."""
    try:
        with os.scandir(base) as entries:
            return {each.name for each in entries if each.is_dir(follow_symlinks=False)}
    except OSError:
        return set()
