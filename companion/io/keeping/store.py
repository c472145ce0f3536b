"""The store: one SQLite file with plans, parameters, airtime ledger, signing stamps and counters.

Changes go through the writer thread and come back as completions, which the app takes as inputs; no tick waits for a
disk. Every row carries a CRC and its previous generation, so a damaged one falls back instead of being believed. A
file that is no database is moved aside and reported; a disk that cannot be written leaves the store in memory, with a
warning. Nothing here is fatal.
"""

from __future__ import annotations

import contextlib
import sqlite3
import threading
from collections import deque
from pathlib import Path
from typing import Final, Protocol

from ..writer import Writer
from .content import Completion, Entry, StoreContent, StoreOp, apply_entries, content_of, entries_of, rows_of
from .file import (
    DAMAGE,
    MIGRATIONS,
    NotOursError,
    ask,
    check,
    finish_replacing,
    is_of_the_disk,
    migrate,
    plain,
    read_entries,
    replace_damaged,
    rescue,
    write_entries,
)

__all__ = ["MIGRATIONS", "AnyStore", "MemoryStore", "Store", "check", "migrate", "read_entries", "write_entries"]

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
        if not self._lock.acquire(timeout=CLOSE_WAIT_S):
            return  # the writer hangs in a write; what it is at must not be closed under it
        try:
            connection, self._connection = self._connection, None
            if connection is not None:
                with contextlib.suppress(sqlite3.Error):
                    connection.close()
        finally:
            self._lock.release()

    def _perform(self, ticket: int, entries: list[Entry]) -> None:
        with self._lock:
            self._done.append(self._written(ticket, entries))

    def _written(self, ticket: int, entries: list[Entry]) -> Completion:
        if self._connection is None:
            return Completion(ticket, True, self._in_memory or "kept in memory only")
        try:
            write_entries(self._connection, entries)
        except (*DAMAGE, OverflowError) as error:
            with contextlib.suppress(sqlite3.Error):
                self._connection.rollback()
            return Completion(ticket, False, plain(error))
        return Completion(ticket, True, "")

    def _open(self) -> dict[tuple[str, str], str]:
        """Open for writing, or read what can be read and stay in memory."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            finish_replacing(self.path)
            return self._open_writable()
        except NotOursError as error:
            return self._stay_in_memory(str(error))
        except OSError as error:
            return self._stay_in_memory(error.strerror or str(error))
        except DAMAGE as error:
            if is_of_the_disk(error, self.path):
                return self._stay_in_memory(plain(error))
            return self._start_afresh(plain(error))

    def _open_writable(self) -> dict[tuple[str, str], str]:
        connection = sqlite3.connect(self.path, timeout=_BUSY_S, isolation_level=None, check_same_thread=False)
        try:
            check(connection)
            migrate(connection)
            ask(connection, "PRAGMA journal_mode=WAL")
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
        for more in ("", "&immutable=1"):
            uri = f"{self.path.resolve().as_uri()}?mode=ro{more}"
            with contextlib.suppress(*DAMAGE), contextlib.closing(sqlite3.connect(uri, uri=True)) as connection:
                return self._read(connection)
        return {}

    def _start_afresh(self, reason: str) -> dict[tuple[str, str], str]:
        """Begin a new file with what the damaged one still gives, and keep that one beside it."""
        rescued = rescue(self.path)
        found = f"Store {self.path.name} is damaged ({reason}), {len(rescued)} entries rescued"
        try:
            aside = replace_damaged(self.path, rescued)
            self._texts.append(f"{found}; moved to {aside.name}")
            return self._open_writable()
        except (OSError, *DAMAGE) as error:
            why = error.strerror or str(error) if isinstance(error, OSError) else plain(error)
            self._in_memory = f"kept in memory only: {why}"
            self._texts.append(f"{found}; {why}, so changes are kept in memory only")
            return rescued
