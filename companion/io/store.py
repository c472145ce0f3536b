"""The store: one SQLite file with plans, parameters, airtime ledger, signing stamps and counters.

Changes go through the writer thread and come back as completions, which the app takes as inputs; no tick waits for a
disk. Every row carries a CRC and its previous generation, so a damaged one falls back instead of being believed. A
file that is no database is moved aside and reported; a disk that cannot be written leaves the store in memory, with a
warning. Nothing here is fatal.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import threading
import zlib
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Protocol

from companion.io.store_content import (
    Completion,
    Entry,
    StoreContent,
    StoreOp,
    apply_entries,
    content_of,
    entries_of,
    rows_of,
)
from companion.io.writer import Writer

MIGRATIONS: Final[tuple[str, ...]] = (
    """
    CREATE TABLE entry (
        section TEXT NOT NULL,
        key TEXT NOT NULL,
        generation INTEGER NOT NULL,
        body TEXT NOT NULL,
        crc INTEGER NOT NULL,
        PRIMARY KEY (section, key, generation)
    ) WITHOUT ROWID;
    """,
)
"""Step n takes a file from schema n to n + 1; the file's ``user_version`` says where it is."""
_BUSY_S: Final = 1.0
CLOSE_WAIT_S: Final = 1.0


class AnyStore(Protocol):
    """What the app sees of a store."""

    warnings: tuple[str, ...]

    def snapshot(self) -> StoreContent:
        """Content at start."""
        ...

    def submit(self, op: StoreOp) -> int:
        """Queue a change; return its ticket at once."""
        ...

    def completions(self) -> list[Completion]:
        """Changes that have finished since the last call."""
        ...

    def close(self) -> None: ...


class MemoryStore:
    """The store without a disk, for simulation and tests: a change is done at the next ``completions``.

    A vessel that is started again with the same object finds what it saved.
    """

    def __init__(self, content: StoreContent | None = None) -> None:
        self.warnings: tuple[str, ...] = ()
        self._rows = rows_of(content or StoreContent())
        self._tickets = 0
        self._waiting: list[tuple[int, StoreOp]] = []

    def snapshot(self) -> StoreContent:
        return content_of(self._rows)[0]

    def submit(self, op: StoreOp) -> int:
        self._tickets += 1
        self._waiting.append((self._tickets, op))
        return self._tickets

    def completions(self) -> list[Completion]:
        if not self._waiting:
            return []
        waiting, self._waiting = self._waiting, []
        for _, op in waiting:
            apply_entries(self._rows, entries_of(op))
        return [Completion(ticket, True, "") for ticket, _ in waiting]

    def close(self) -> None:
        """Do what is queued, as the store on disk does."""
        self.completions()


class Store:
    """The store on disk. Give the process's ``writer`` to share it; else the store makes its own."""

    def __init__(self, path: Path, writer: Writer | None = None) -> None:
        self.path = path
        self._texts: list[str] = []
        self._connection: sqlite3.Connection | None = None
        self._in_memory = ""
        rows = self._open()
        self._content, strange = content_of(rows)
        if strange:
            self._texts.append(f"Store: not understood and left out: {', '.join(strange)}")
        self.warnings = tuple(self._texts)
        self._own_writer = None if writer else Writer()
        self._writer = writer or self._own_writer
        self._tickets = 0
        self._pending = 0
        self._lock = threading.Lock()
        self._done: deque[Completion] = deque()

    def snapshot(self) -> StoreContent:
        return self._content

    @property
    def pending(self) -> int:
        """Changes submitted and not yet finished; a number that stays up means a disk that hangs."""
        return self._pending

    def submit(self, op: StoreOp) -> int:
        self._tickets += 1
        ticket = self._tickets
        self._pending += 1
        assert self._writer is not None
        if not self._writer.post(lambda: self._perform(ticket, entries_of(op))):
            self._done.append(Completion(ticket, False, "the store is busy"))
        return ticket

    def completions(self) -> list[Completion]:
        done: list[Completion] = []
        while self._done:
            done.append(self._done.popleft())
        self._pending -= len(done)
        return done

    def close(self) -> None:
        """Close the file after what is queued; a shared writer does both before its own end."""
        assert self._writer is not None
        if not self._writer.post(self._disconnect, CLOSE_WAIT_S):
            self._disconnect()
        if self._own_writer is not None:
            self._own_writer.close()

    def _disconnect(self) -> None:
        with self._lock:
            connection, self._connection = self._connection, None
            if connection is not None:
                with contextlib.suppress(sqlite3.Error):
                    connection.close()

    def _perform(self, ticket: int, entries: list[Entry]) -> None:
        with self._lock:
            self._done.append(self._written(ticket, entries))

    def _written(self, ticket: int, entries: list[Entry]) -> Completion:
        if self._connection is None:
            return Completion(ticket, True, self._in_memory or "kept in memory only")
        try:
            write_entries(self._connection, entries)
        except sqlite3.Error as error:
            with contextlib.suppress(sqlite3.Error):
                self._connection.rollback()
            return Completion(ticket, False, _plain(error))
        return Completion(ticket, True, "")

    def _open(self) -> dict[tuple[str, str], str]:
        """Open for writing, or read what can be read and stay in memory."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            return self._open_writable()
        except _NotOursError as error:
            return self._stay_in_memory(str(error))
        except sqlite3.DatabaseError as error:
            # "read-only" from a file that may be written is the file's own header, damaged.
            writable = os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK)
            if isinstance(error, sqlite3.OperationalError) and not (writable and "readonly" in str(error)):
                return self._stay_in_memory(_plain(error))
            return self._start_afresh(_plain(error))
        except OSError as error:
            return self._stay_in_memory(error.strerror or str(error))

    def _open_writable(self) -> dict[tuple[str, str], str]:
        connection = sqlite3.connect(self.path, timeout=_BUSY_S, isolation_level=None, check_same_thread=False)
        try:
            check(connection)
            migrate(connection)
            connection.execute("PRAGMA journal_mode=WAL")
            connection.execute("PRAGMA synchronous=FULL")
            connection.execute(f"PRAGMA user_version={len(MIGRATIONS)}")  # a real write, to know now
            rows = self._read(connection)
        except BaseException:
            connection.close()
            raise
        self._connection = connection
        return rows

    def _read(self, connection: sqlite3.Connection) -> dict[tuple[str, str], str]:
        rows, damaged = read_entries(connection)
        self._texts += [f"Store: {text}" for text in damaged]
        return rows

    def _stay_in_memory(self, reason: str) -> dict[tuple[str, str], str]:
        self._in_memory = f"kept in memory only: {reason}"
        self._texts.append(f"Store {self.path.name}: {reason}; changes are kept in memory only")
        if not self.path.is_file():
            return {}
        try:
            with contextlib.closing(sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
                return self._read(connection)
        except sqlite3.Error:
            pass
        try:
            uri = f"{self.path.resolve().as_uri()}?mode=ro&immutable=1"
            with contextlib.closing(sqlite3.connect(uri, uri=True)) as connection:
                return self._read(connection)
        except sqlite3.Error:
            return {}

    def _start_afresh(self, reason: str) -> dict[tuple[str, str], str]:
        """Move the damaged file aside, take over what it still gives, and begin a new one."""
        try:
            aside = move_aside(self.path)
            rescued = rescue(aside)
            self._texts.append(
                f"Store {self.path.name} was damaged ({reason}); moved to {aside.name}, {len(rescued)} entries rescued"
            )
            rows = self._open_writable()
            assert self._connection is not None
            write_entries(self._connection, [Entry(section, key, body) for (section, key), body in rescued.items()])
            return rows | rescued
        except (OSError, sqlite3.Error) as error:
            return self._stay_in_memory(_plain(error) if isinstance(error, sqlite3.Error) else str(error))


class _NotOursError(Exception):
    """A file of a newer version: readable or not, it is left alone."""


def migrate(connection: sqlite3.Connection, migrations: tuple[str, ...] = MIGRATIONS) -> None:
    """Bring the schema up to date, each step in one transaction."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version > len(migrations):
        raise _NotOursError(f"written by a newer version of this program (schema {version}, known {len(migrations)})")
    for number in range(version, len(migrations)):
        connection.executescript(f"BEGIN IMMEDIATE;{migrations[number]};PRAGMA user_version={number + 1};COMMIT;")


def check(connection: sqlite3.Connection) -> None:
    """Raise sqlite3.DatabaseError when the file is not a sound database."""
    found = connection.execute("PRAGMA integrity_check(1)").fetchone()
    if found is None or found[0] != "ok":
        raise sqlite3.DatabaseError(str(found[0]) if found else "no answer")


def crc_of(section: str, key: str, generation: int, body: str) -> int:
    return zlib.crc32("\x1f".join((section, key, str(generation), body)).encode())


def read_entries(connection: sqlite3.Connection) -> tuple[dict[tuple[str, str], str], list[str]]:
    """Newest sound generation of every entry, and texts about damaged ones."""
    rows: dict[tuple[str, str], str] = {}
    damaged: dict[tuple[str, str], str] = {}
    for section, key, generation, body, crc in connection.execute(
        "SELECT section, key, generation, body, crc FROM entry ORDER BY section, key, generation DESC"
    ):
        if not isinstance(body, str) or crc != crc_of(section, key, generation, body):
            damaged.setdefault((str(section), str(key)), "is damaged and lost")
            continue
        if (section, key) not in rows:
            rows[section, key] = body
            if (section, key) in damaged:
                damaged[section, key] = "is damaged; its previous state is used"
    return rows, [f"{section} {key} {what}" for (section, key), what in damaged.items()]


def write_entries(connection: sqlite3.Connection, entries: Iterable[Entry]) -> None:
    """Write rows in one transaction; each keeps one older generation."""
    connection.execute("BEGIN IMMEDIATE")
    for section, key, body in entries:
        if body is None:
            where, values = ("section = ?", (section,)) if not key else ("section = ? AND key = ?", (section, key))
            connection.execute(f"DELETE FROM entry WHERE {where}", values)
            continue
        (newest,) = connection.execute(
            "SELECT COALESCE(MAX(generation), 0) FROM entry WHERE section = ? AND key = ?", (section, key)
        ).fetchone()
        generation = newest + 1
        connection.execute(
            "INSERT INTO entry VALUES (?, ?, ?, ?, ?)",
            (section, key, generation, body, crc_of(section, key, generation, body)),
        )
        connection.execute(
            "DELETE FROM entry WHERE section = ? AND key = ? AND generation < ?", (section, key, generation - 1)
        )
    connection.execute("COMMIT")


def move_aside(path: Path) -> Path:
    """Rename a damaged file (and its journals) to the first free ``name.damaged-N``."""
    number = 1
    while (aside := path.with_name(f"{path.name}.damaged-{number}")).exists():
        number += 1
    path.replace(aside)
    for suffix in ("-wal", "-shm"):
        journal = path.with_name(path.name + suffix)
        if journal.exists():
            journal.replace(aside.with_name(aside.name + suffix))
    return aside


def rescue(path: Path) -> dict[tuple[str, str], str]:
    """Read from a damaged file whatever rows still come with a right CRC."""
    rows: dict[tuple[str, str], str] = {}
    try:
        with contextlib.closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
            for row in connection.execute("SELECT section, key, generation, body, crc FROM entry"):
                section, key, generation, body, crc = row
                if isinstance(body, str) and crc == crc_of(section, key, generation, body):
                    rows[section, key] = body
    except (sqlite3.Error, UnicodeError):
        pass
    return rows


def _plain(error: sqlite3.Error) -> str:
    """An SQLite error in words for an operator."""
    text = str(error).lower()
    if "full" in text:
        return "no space on the disk"
    if "readonly" in text or "read-only" in text or "unable to open" in text:
        return "the disk cannot be written"
    if "locked" in text:
        return "another program holds the store"
    return str(error) or type(error).__name__
