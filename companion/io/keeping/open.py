"""Opening the store's file: new, sound, older, damaged, cut off, another world's, or on a disk that cannot be written.

Whatever it finds, the vessel starts: with a connection to write to, or with what could be read and the reason why not.
"""

from __future__ import annotations

import contextlib
import sqlite3
from pathlib import Path
from typing import Final, NamedTuple

from ..log_file import make_own_folder
from .content import SaveRecord, StoredRow, apply_entries, entries_of
from .file import (
    DAMAGE,
    MIGRATIONS,
    NotOursError,
    ask,
    check,
    finish_replacing,
    free_name,
    is_of_the_disk,
    is_strange,
    keep_private,
    make_new,
    migrate,
    move_aside,
    plain,
    read_entries,
    replace,
    rescue,
    without_fence,
    write_entries,
)
from .mark import ASIDE, ForeignError, WorldKind, marks, new_vessel_id, settle

Rows = dict[tuple[str, str], str]
_BUSY_S: Final = 1.0
_STRANGE: Final = "holds something else than a store and is left alone; name another file"
_SMALLEST: Final = 512
"""No database of SQLite is smaller than its smallest page."""


class OpenedStore(NamedTuple):
    """A store's file, opened as far as it goes."""

    connection: sqlite3.Connection | None
    rows: Rows
    texts: list[str]
    trouble: str
    """Why it cannot be written; empty when it can."""


def open_store(path: Path, world: WorldKind, *, again: bool = False) -> OpenedStore:
    """Open for writing, or read what can be read. ``again``: while the vessel runs; another world's file is then left where it is."""
    texts: list[str] = []
    try:
        make_own_folder(path.parent)
        finish_replacing(path)
        connection, rows = _open_writable(path, world, texts)
        return OpenedStore(connection, rows, texts, "")
    except ForeignError as error:
        return _foreign(path, world, texts, str(error), again=again)
    except NotOursError as error:
        return _read_only(path, world, texts, str(error))
    except OSError as error:
        return _read_only(path, world, texts, error.strerror or str(error))
    except DAMAGE as error:
        if is_of_the_disk(error, path):
            return _read_only(path, world, texts, plain(error))
        return _start_afresh(path, world, texts, plain(error))


def _open_writable(path: Path, world: WorldKind, texts: list[str]) -> tuple[sqlite3.Connection, Rows]:
    _find_or_make(path, world, texts)
    connection = sqlite3.connect(path, timeout=_BUSY_S, isolation_level=None, check_same_thread=False)
    try:
        check(connection)
        ((version,),) = ask(connection, "PRAGMA user_version")
        found, damaged = read_entries(connection) if version else ({}, [])
        if found:
            settle(found, world)  # whose it is, before anything is written
        migrate(connection)
        ask(connection, "PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA synchronous=FULL")
        connection.execute(f"PRAGMA user_version={len(MIGRATIONS)}")  # a real write, to know now
        changes, told = settle(found, world)
        if version == len(MIGRATIONS) and not found:
            texts.append(f"Store {path.name} was emptied: it holds nothing of earlier runs")
            changes += without_fence(found)
        keep_private(path)
        if changes:
            write_entries(connection, changes)
            apply_entries(found, changes)
    except BaseException:
        connection.close()
        raise
    texts += [f"Store: {text}" for text in damaged]
    texts += told
    return connection, found


def _find_or_make(path: Path, world: WorldKind, texts: list[str]) -> None:
    """Make the file when there is none, whole and marked before it gets its name; set aside one that is cut off.

    Raises NotOursError for a short file that never was a store's.
    """
    size = path.stat().st_size if path.exists() else None
    if size is not None and size >= _SMALLEST:
        return
    if size is not None and is_strange(path):
        raise NotOursError(_STRANGE)
    if size is not None:
        aside = move_aside(path, "damaged")
        texts.append(
            f"Store {path.name} was empty or cut off ({size} bytes): what it held is lost; moved to {aside.name}"
        )
    make_new(path, [*marks(world, new_vessel_id()), *(without_fence({}) if size is not None else [])])


def _foreign(path: Path, world: WorldKind, texts: list[str], why: str, *, again: bool) -> OpenedStore:
    """Another world's store: a boat sets a simulation's aside, unharmed, and begins anew; a simulation leaves a boat's alone."""
    if world is WorldKind.SIMULATED or again:
        return OpenedStore(None, {}, [f"Store {path.name}: {why}, left alone; changes are kept in memory only"], why)
    try:
        barred = entries_of(SaveRecord(ASIDE, 1, free_name(path, WorldKind.SIMULATED.value).name))
        aside = replace(path, [*marks(world, new_vessel_id()), *barred], WorldKind.SIMULATED.value)
        texts.append(f"Store {path.name}: {why}, not used; moved to {aside.name}")
        connection, rows = _open_writable(path, world, texts)
    except (OSError, *DAMAGE) as error:
        reason = error.strerror or str(error) if isinstance(error, OSError) else plain(error)
        texts.append(f"Store {path.name}: {why}, not used; {reason}")
        return OpenedStore(None, _barred(path), texts, reason)
    return OpenedStore(connection, rows, texts, "")


def _barred(path: Path) -> Rows:
    rows: Rows = {}
    apply_entries(rows, entries_of(SaveRecord(ASIDE, 1, path.name)))
    return rows


def _read_only(path: Path, world: WorldKind, texts: list[str], reason: str) -> OpenedStore:
    """Read what is there; nothing can be written."""
    texts.append(f"Store {path.name}: {reason}")
    if path.is_file():
        for more in ("", "&immutable=1"):
            uri = f"{path.resolve().as_uri()}?mode=ro{more}"
            with contextlib.suppress(*DAMAGE), contextlib.closing(sqlite3.connect(uri, uri=True)) as connection:
                rows, damaged = read_entries(connection)
                return _settled(path, world, [*texts, *(f"Store: {text}" for text in damaged)], reason, rows)
    return OpenedStore(None, {}, texts, reason)


def _settled(path: Path, world: WorldKind, texts: list[str], reason: str, rows: Rows) -> OpenedStore:
    """Rows that stay in memory, as this world may use them."""
    try:
        changes, told = settle(rows, world)
    except ForeignError as error:
        barred = _barred(path) if world is WorldKind.REAL else {}
        return OpenedStore(None, barred, [*texts, f"Store {path.name}: {error}, not used"], reason)
    apply_entries(rows, changes)
    return OpenedStore(None, rows, [*texts, *told], reason)


def _start_afresh(path: Path, world: WorldKind, texts: list[str], reason: str) -> OpenedStore:
    """Begin a new file with what the damaged one still gives, and keep that one beside it."""
    rescued = rescue(path)
    if not rescued and is_strange(path):
        return _read_only(path, world, texts, _STRANGE)
    found = f"Store {path.name} is damaged ({reason}), {len(rescued)} entries rescued"
    try:
        if rescued:
            settle(rescued, world)
        apply_entries(rescued, without_fence(rescued))
        aside = replace(path, [StoredRow(*name, body) for name, body in rescued.items()], "damaged")
        texts.append(f"{found}; moved to {aside.name}")
        connection, rows = _open_writable(path, world, texts)
    except ForeignError as error:
        return _foreign(path, world, texts, str(error), again=False)
    except (OSError, *DAMAGE) as error:
        why = error.strerror or str(error) if isinstance(error, OSError) else plain(error)
        texts.append(f"{found}; {why}")
        return _settled(path, world, texts, why, rescued)
    return OpenedStore(connection, rows, texts, "")


def in_one_transaction(connection: sqlite3.Connection, entries: list[StoredRow]) -> None:
    """Write rows, all or none. Raises what SQLite raises, with nothing written."""
    try:
        write_entries(connection, entries)
    except BaseException:
        with contextlib.suppress(sqlite3.Error):
            connection.rollback()
        raise
