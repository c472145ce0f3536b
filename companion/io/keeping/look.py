"""Looking into a store without touching it: not a byte beside it changes, and a vessel that runs with it is not disturbed.

SQLite makes files beside a database even to read it. So a copy is read: the file and what is written but not yet played in.
"""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import tempfile
from pathlib import Path
from typing import Final, NamedTuple

from .content import StoreContent, apply_entries, content_of, rows_of
from .file import check, read_entries
from .mark import WorldKind, settle

_TRIES: Final = 5
"""A running vessel may play its changes in between the copies of the two files; that takes it milliseconds."""


class Found(NamedTuple):
    """What a store holds, and texts about what of it is damaged or not understood."""

    content: StoreContent
    texts: list[str]

    def as_used(self) -> tuple[StoreContent, list[str]]:
        """The content as a boat would use it, and what it would tell. Raises ForeignError for another world's store."""
        rows = rows_of(self.content)
        changes, told = settle(rows, WorldKind.REAL)
        apply_entries(rows, changes)
        return content_of(rows)[0], told


def look(path: Path) -> Found:
    """Read a store's newest content. Raises OSError, sqlite3.Error (no store, or too damaged to be read in order)."""
    with tempfile.TemporaryDirectory(prefix="companion-look-") as folder:
        copy = Path(folder) / "store.db"
        for _ in range(_TRIES):
            before = _state(path)
            _copy(path, copy)
            if _state(path) == before:
                break
        with contextlib.closing(sqlite3.connect(copy)) as connection:
            check(connection)
            tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if tables and "entry" not in tables:
                raise sqlite3.DatabaseError(f"a database with {', '.join(sorted(tables))}")
            rows, damaged = read_entries(connection)
    content, strange = content_of(rows)
    return Found(content, [*damaged, *(f"{name} is not understood" for name in strange)])


def _journal(path: Path) -> Path:
    return path.with_name(f"{path.name}-wal")


def _state(path: Path) -> list[tuple[int, int]]:
    return [(item.stat().st_size, item.stat().st_mtime_ns) for item in (path, _journal(path)) if item.exists()]


def _copy(path: Path, copy: Path) -> None:
    for there, here in ((path, copy), (_journal(path), _journal(copy))):
        here.unlink(missing_ok=True)
        if there.exists() or there == path:
            shutil.copyfile(there, here)
