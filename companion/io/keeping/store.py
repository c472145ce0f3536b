"""The store: one SQLite file with plans, parameters, airtime ledger, signing stamps and counters.

Changes go through the writer thread and come back as completions, which the app takes as inputs; no tick waits for a
disk. Every row carries a CRC and its previous generation, so a damaged one falls back instead of being believed. A
file that is no database is moved aside and reported. A disk that cannot be written is tried again for as long as the
process lives: meanwhile changes that somebody waits for are refused, and what the vessel keeps for itself is kept here
until it can be written. Nothing here is fatal.
"""

from __future__ import annotations

import contextlib
import sqlite3
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, Protocol

from ..writer import Writer
from .content import Completion, StoreContent, StoredRow, StoreOp, apply_entries, content_of, entries_of, rows_of
from .file import DAMAGE, MIGRATIONS, check, migrate, place_of, plain, read_entries, stays_usable, write_entries
from .mark import WorldKind
from .open import in_one_transaction, open_store

__all__ = ["MIGRATIONS", "AnyStore", "MemoryStore", "Store", "check", "migrate", "read_entries", "write_entries"]

CLOSE_WAIT_S: Final = 1.0
RETRY_S: Final = 30.0
"""A disk that could not be written is tried again so often; a change that comes meanwhile tries it too, once a second at most."""
_AT_ONCE_S: Final = 1.0
_GONE: Final = "its file was deleted or replaced"
IN_FORCE: Final = frozenset({"plan", "param"})
OWN: Final = frozenset({"ledger", "stamp", "counter", "value", "record"})
"""Sections that the vessel keeps by itself and nobody is told of: the newest waits for the disk to come back."""


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
    """The store on disk. Give the process's ``writer`` to share it; else the store makes its own.

    ``memory_ok``: the owner of the boat accepts changes that are not on a disk yet; they are then acknowledged, marked by a text,
    and written when the disk is back. ``clock_s`` paces the trials of a disk.
    """

    def __init__(
        self,
        path: Path,
        writer: Writer | None = None,
        *,
        world: WorldKind = WorldKind.REAL,
        memory_ok: bool = False,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self.path = path
        self._world = world
        self._memory_ok = memory_ok
        self._clock_s = clock_s
        self._connection, rows, texts, self._trouble = open_store(path, world)
        self._place = place_of(path)
        self._content, strange = content_of(rows)
        if strange:
            texts.append(f"Store: not understood and left out: {', '.join(strange)}")
        self.warnings = tuple(texts)
        self._rows = {name: body for name, body in rows.items() if name[0] in IN_FORCE}
        """Plans and parameters as the vessel has them."""
        self._stale = ""
        self._closed = False
        self._unwritten: dict[tuple[str, str], StoredRow] = {}
        """What waits for the disk, the newest of each."""
        self._own_writer = None if writer else Writer()
        self._writer = writer or self._own_writer
        self._tickets = 0
        self._pending = 0
        self._lock = threading.Lock()
        self._done: deque[Completion] = deque()
        self._told = ""
        self._tried_s = clock_s()
        self._next_s = self._tried_s + RETRY_S
        self._tell()

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
        if self._trouble and self._clock_s() >= self._next_s:
            self._next_s = self._clock_s() + RETRY_S
            assert self._writer is not None
            self._writer.post(self._try_again)
        done: list[Completion] = []
        while self._done:
            done.append(self._done.popleft())
        self._pending -= sum(item.ticket > 0 for item in done)
        return done

    def close(self) -> None:
        """Close the file after what is queued; a shared writer does both before its own end."""
        assert self._writer is not None
        if not self._writer.post(self._disconnect, CLOSE_WAIT_S):
            self._disconnect()
        if self._own_writer is not None:
            self._own_writer.close()

    # ---- in the writer's thread ---------------------------------------------------------------------------------

    def _disconnect(self) -> None:
        if not self._lock.acquire(timeout=CLOSE_WAIT_S):
            return  # the writer hangs in a write; what it is at must not be closed under it
        try:
            self._closed = True
            self._let_go()
        finally:
            self._lock.release()

    def _let_go(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            with contextlib.suppress(sqlite3.Error):
                connection.close()

    def _perform(self, ticket: int, entries: list[StoredRow]) -> None:
        with self._lock:
            self._done.append(self._written(ticket, entries))
            self._tell()

    def _written(self, ticket: int, entries: list[StoredRow]) -> Completion:
        self._revive()
        why, is_kept = self._write([*self._unwritten.values(), *entries])
        if why == _GONE and self._revive():
            self._done.append(Completion(0, True, f"Store {self.path.name}: {_GONE}; begun anew"))
            why, is_kept = self._write([*self._unwritten.values(), *entries])
        if not why:
            self._unwritten.clear()
            return Completion(ticket, True, "")
        if not is_kept:
            return Completion(ticket, False, why)
        for entry in entries:
            if self._memory_ok or entry.section in OWN:
                self._unwritten.pop(entry[:2], None)  # the newest last: one may delete what another made
                self._unwritten[entry[:2]] = entry
        return Completion(ticket, self._memory_ok, f"kept in memory only: {why}" if self._memory_ok else why)

    def _write(self, entries: list[StoredRow]) -> tuple[str, bool]:
        """Write rows; return why not, and whether that is the disk's fault, so that another trial may succeed."""
        if self._connection is None:
            return self._trouble or "closed", True
        try:
            in_one_transaction(self._connection, entries)
        except sqlite3.Error as error:
            self._trouble = plain(error)
            if not stays_usable(error):
                self._let_go()
            return self._trouble, True
        except (*DAMAGE, OverflowError) as error:
            return plain(error), False
        if place_of(self.path) != self._place:
            self._trouble = _GONE
            self._let_go()
            return _GONE, True
        self._trouble = ""
        apply_entries(self._rows, [entry for entry in entries if entry.section in IN_FORCE])
        return "", False

    def _try_again(self) -> None:
        with self._lock:
            if self._closed:
                return
            if self._connection is None:
                self._reopen()
            if not self._write([*self._unwritten.values(), _PROBE])[0]:
                self._unwritten.clear()
            self._tell()

    def _revive(self) -> bool:
        """Open a file that was let go again, once a second at most; return whether there is one to write to."""
        if self._connection is None and self._clock_s() - self._tried_s >= _AT_ONCE_S:
            self._reopen()
        return self._connection is not None

    def _reopen(self) -> None:
        """Open the file again. What it holds now and the vessel does not sail by is told; its newer stamps stay."""
        if self._closed:
            return
        self._tried_s = self._clock_s()
        self._connection, rows, texts, self._trouble = open_store(self.path, self._world, again=True)
        if self._connection is None:
            return
        self._place = place_of(self.path)
        self._done.extend(Completion(0, True, text) for text in texts)
        there = {name: body for name, body in rows.items() if name[0] in IN_FORCE}
        if not there:
            self._unwritten |= {
                name: StoredRow(*name, body) for name, body in self._rows.items() if name not in self._unwritten
            }
        elif there != self._rows:
            self._stale = f"holds {len(there)} parameters and plans that are not in force: restart to use them"
        for name in [name for name in self._unwritten if name[0] == "stamp" and _is_older(self._unwritten[name], rows)]:
            del self._unwritten[name]

    def _tell(self) -> None:
        """Say what is wrong, or that it is well again, when that changes."""
        status = self._trouble or self._stale
        if status != self._told:
            self._told = status
            self._done.append(Completion(0, not status, status))


_PROBE: Final = StoredRow("meta", "probe", "0")
"""A write that changes nothing anybody reads, to know whether the disk takes one."""


def _is_older(entry: StoredRow, rows: Mapping[tuple[str, str], str]) -> bool:
    """Whether the disk has a newer time stamp. "clean" is none: it says how the last run ended, and this one has not."""
    there = rows.get(entry[:2])
    return entry.key != "clean" and there is not None and entry.body is not None and int(there) > int(entry.body)
