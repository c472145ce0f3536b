"""The store's file: its schema, its rows with their CRC, and what can still be had from a damaged one."""

from __future__ import annotations

import contextlib
import json
import os
import sqlite3
import stat
import zlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.requests import PlanKind

from ..log_file import FILE_MODE, sync_folder
from .content import FENCE_LOST, SECTIONS, SaveRecord, StoredRow, apply_entries, entries_of

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
    "SELECT 'whose it is (section meta), records, and what waits to be adopted: rows, no columns'",
)
"""Step n takes a file from schema n to n + 1; the file's ``user_version`` says where it is."""
DAMAGE: Final = (sqlite3.Error, ValueError, TypeError)
"""What reading a damaged file may raise: not all of it comes as an error of the database."""
_PAGE: Final = 4096
"""SQLite's own size of a page; no store was ever made with another."""
_MAGIC: Final = b"SQLite format 3\0"
"""What every database begins with."""
_LOST: Final = "is damaged and lost"
_PREVIOUS: Final = "is damaged; its previous state is used"
_MAY_BE: Final = "may be lost with what is damaged"
_IS_MADE: Final = "SELECT 1 FROM sqlite_master WHERE name = 'entry'"
_UPWARDS: Final = "section, key, generation"
_DOWNWARDS: Final = "section DESC, key DESC, generation DESC"
_FENCE: Final = ("plan", PlanKind.FENCE.name)
_FAR_GENERATION: Final = 1 << 48
"""No store is changed so often: a number beyond it is a flipped bit, and adding to it might not fit."""
_OF_THE_DISK: Final = frozenset(
    {
        sqlite3.SQLITE_BUSY,
        sqlite3.SQLITE_CANTOPEN,
        sqlite3.SQLITE_FULL,
        sqlite3.SQLITE_IOERR,
        sqlite3.SQLITE_LOCKED,
        sqlite3.SQLITE_NOMEM,
        sqlite3.SQLITE_PERM,
        sqlite3.SQLITE_PROTOCOL,
        sqlite3.SQLITE_READONLY,
    }
)


class NotOursError(Exception):
    """A file of a newer version: readable or not, it is left alone."""


def ask(connection: sqlite3.Connection, statement: str, values: tuple[object, ...] = ()) -> list[Any]:
    """Return every row of an answer: a statement that is not read to its end holds the transaction open until it is freed."""
    return connection.execute(statement, values).fetchall()


def migrate(connection: sqlite3.Connection, migrations: tuple[str, ...] = MIGRATIONS) -> None:
    """Bring the schema up to date, each step in one transaction."""
    ((version,),) = ask(connection, "PRAGMA user_version")
    if version > len(migrations) and _is_newer(connection, len(migrations)):
        raise NotOursError(f"written by a newer version of this program (schema {version}, known {len(migrations)})")
    if not 0 <= version <= len(migrations) or (not version and ask(connection, _IS_MADE)):
        raise sqlite3.DatabaseError("malformed header")
    for number in range(version, len(migrations)):
        connection.executescript(f"BEGIN IMMEDIATE;{migrations[number]};PRAGMA user_version={number + 1};COMMIT;")


def _is_newer(connection: sqlite3.Connection, known: int) -> bool:
    """Whether a row with a right CRC says so too: the header alone may have a flipped bit. What cannot be read is newer."""
    try:
        rows, _ = read_entries(connection)
        return int(json.loads(rows.get(("meta", "schema"), '"0"'))) > known
    except (sqlite3.Error, ValueError, TypeError):
        return True


def check(connection: sqlite3.Connection) -> None:
    """Raise sqlite3.DatabaseError when the file is not a sound database."""
    try:
        found = ask(connection, "PRAGMA integrity_check(1)")
    except UnicodeError:  # SQLite's own text quotes the damaged schema
        raise sqlite3.DatabaseError("malformed database schema") from None
    if found != [("ok",)]:
        raise sqlite3.DatabaseError(str(found[0][0]).splitlines()[-1] if found else "no answer")


def crc_of(section: str, key: str, generation: int, body: str) -> int:
    return zlib.crc32("\x1f".join((section, key, str(generation), body)).encode(errors="surrogateescape"))


def _is_sound(section: object, key: object, generation: int, body: object, crc: object) -> bool:
    """Whether a row is as it was written; a flipped bit may have made a BLOB of a text."""
    if not (isinstance(section, str) and isinstance(key, str) and isinstance(body, str)):
        return False
    return crc == crc_of(section, key, generation, body)


def _rows(connection: sqlite3.Connection, order: str) -> sqlite3.Cursor:
    # Bytes that are no text any more must reach the CRC instead of ending the reading.
    connection.text_factory = lambda data: data.decode("utf-8", "surrogateescape")
    return connection.execute(f"SELECT section, key, generation, body, crc FROM entry ORDER BY {order}")


def read_entries(connection: sqlite3.Connection) -> tuple[dict[tuple[str, str], str], list[str]]:
    """Newest sound generation of every entry, and texts about damaged ones; a record too when the fence is among these."""
    rows: dict[tuple[str, str], str] = {}
    damaged: dict[tuple[str, str], str] = {}
    for section, key, generation, body, crc in _rows(connection, f"{_UPWARDS} DESC"):
        if not _is_sound(section, key, generation, body, crc):
            older = (section, key) in rows
            what = "had an older state that is damaged; the newest is sound" if older else _LOST
            damaged.setdefault((section, key), what)
            continue
        if (section, key) not in rows:
            rows[section, key] = body
            if (section, key) in damaged:
                damaged[section, key] = _PREVIOUS
    if what := _of_the_fence(damaged, is_there=_FENCE in rows):
        apply_entries(rows, entries_of(SaveRecord(FENCE_LOST, 1, what)))
    elif _FENCE in rows:
        rows.pop(("record", FENCE_LOST), None)  # one was loaded since, or cleared: that is a row too
    return rows, [f"{_shown(section)} {_shown(key)} {what}" for (section, key), what in damaged.items()]


def _of_the_fence(damaged: Mapping[tuple[str, str], str], *, is_there: bool) -> str:
    """What damage did to the fence; a row whose own name is damaged may have been it."""
    if not is_there and any(not _is_known(*name) for name in damaged):
        return _MAY_BE
    what = damaged.get(_FENCE, "")
    return what if what in (_LOST, _PREVIOUS) else ""


def _is_known(section: object, key: object) -> bool:
    return section in SECTIONS and (section != "plan" or key in PlanKind.__members__)


def without_fence(rows: Mapping[tuple[str, str], str]) -> list[StoredRow]:
    """The record for a file that begins with ``rows`` of a damaged one: a fence may be lost, unless it is there."""
    return [] if _FENCE in rows else entries_of(SaveRecord(FENCE_LOST, 1, _MAY_BE))


def _shown(name: object) -> str:
    """A name that may be damaged, fit for a text to the operator."""
    return name if isinstance(name, str) and name.isascii() and name.isprintable() else ascii(name)


def write_entries(connection: sqlite3.Connection, entries: Iterable[StoredRow]) -> None:
    """Write rows in one transaction; each keeps one older generation."""
    connection.execute("BEGIN IMMEDIATE")
    for section, key, body in entries:
        if body is None:
            where, values = ("section = ?", (section,)) if not key else ("section = ? AND key = ?", (section, key))
            connection.execute(f"DELETE FROM entry WHERE {where}", values)
            continue
        ((newest,),) = ask(
            connection,
            "SELECT COALESCE(MAX(generation), 0) FROM entry "
            "WHERE section = ? AND key = ? AND typeof(generation) = 'integer' AND generation < ?",
            (section, key, _FAR_GENERATION),
        )
        generation = newest + 1
        connection.execute(
            "INSERT INTO entry VALUES (?, ?, ?, ?, ?)",
            (section, key, generation, body, crc_of(section, key, generation, body)),
        )
        connection.execute(
            "DELETE FROM entry WHERE section = ? AND key = ? AND generation NOT IN (?, ?)",
            (section, key, generation, newest),
        )
    connection.execute("COMMIT")


def make_new(path: Path, entries: Iterable[StoredRow]) -> None:
    """Make a store that holds ``entries`` from its first moment: written beside, synced, then named.

    A file that is found empty later was therefore emptied by somebody else. Raises OSError, sqlite3.Error.
    """
    making = path.with_name(f"{path.name}.making")
    for old in [*_with_journals(making, "-journal"), *_with_journals(path, "-wal", "-shm")[1:]]:
        old.unlink(missing_ok=True)
    _make(making, entries)
    making.replace(path)
    sync_folder(path.parent)


def keep_private(path: Path) -> None:
    """Take a store that everybody may read from others: an earlier version made it so. What cannot be changed stays."""
    for each in _with_journals(path, "-wal", "-shm"):
        with contextlib.suppress(OSError):
            mode = stat.S_IMODE(each.stat().st_mode)
            if mode & ~FILE_MODE:
                each.chmod(mode & FILE_MODE)


def _make(path: Path, entries: Iterable[StoredRow]) -> None:
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT, FILE_MODE))  # SQLite's journals take it over
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA synchronous=FULL")
        migrate(connection)
        write_entries(connection, entries)


def replace(path: Path, entries: Iterable[StoredRow], why: str) -> Path:
    """Put a new file with ``entries`` in the place of one that is set aside (``free_name``); return where that is now.

    Nothing is moved before the new file is whole on the disk. Raises OSError, sqlite3.Error.
    """
    fresh = _fresh_name(path)
    for old in _with_journals(fresh, "-journal"):
        old.unlink(missing_ok=True)
    try:
        _make(fresh, entries)
        aside = move_aside(path, why)
    except BaseException:
        if path.exists():
            fresh.unlink(missing_ok=True)
        raise
    finish_replacing(path)
    return aside


def finish_replacing(path: Path) -> None:
    """Give a new file its name; a power cut may have come before that. Raises OSError."""
    fresh = _fresh_name(path)
    if fresh.exists() and not path.exists():
        for journal in _with_journals(path, "-wal", "-shm")[1:]:
            journal.unlink(missing_ok=True)  # of the damaged file: they would be played into the new one
        fresh.replace(path)
        sync_folder(path.parent)


def _fresh_name(path: Path) -> Path:
    return path.with_name(f"{path.name}.new")


def _with_journals(path: Path, *suffixes: str) -> list[Path]:
    return [path, *(path.with_name(path.name + suffix) for suffix in suffixes)]


def free_name(path: Path, why: str) -> Path:
    """The first ``name.WHY-N`` that does not exist."""
    number = 1
    while (aside := path.with_name(f"{path.name}.{why}-{number}")).exists():
        number += 1
    return aside


def place_of(path: Path) -> tuple[tuple[int, int] | None, ...]:
    """Which files a store's name and its journal's stand for now; None = no file.

    What was deleted or replaced goes on taking writes by whoever has it open, and nothing of them survives.
    """
    return tuple(_node(each) for each in _with_journals(path, "-wal"))


def _node(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def move_aside(path: Path, why: str) -> Path:
    """Rename a file (and its journals) to its free name. Raises OSError."""
    aside = free_name(path, why)
    path.replace(aside)
    for old, new in zip(_with_journals(path, "-wal", "-shm"), _with_journals(aside, "-wal", "-shm"), strict=True):
        if old.exists():
            old.replace(new)
    return aside


def is_strange(path: Path) -> bool:
    """Whether a file never was a database: somebody else's, a key for one, which is not to be moved.

    A power cut leaves no such thing: it empties or cuts a file, blanks its pages (all 00 or all FF), or changes some bits.
    """
    with path.open("rb") as file:
        head = file.read(_PAGE)
    begun = head[: len(_MAGIC)]
    as_written = sum(byte == wanted for byte, wanted in zip(begun, _MAGIC, strict=False))
    return len(set(head)) > 1 and 2 * as_written < len(begun)


def rescue(path: Path) -> dict[tuple[str, str], str]:
    """Read from a damaged file whatever rows still come with a right CRC."""
    uri = f"{path.resolve().as_uri()}?mode=ro"
    return _rescued(lambda: sqlite3.connect(uri, uri=True)) or _rescued(lambda: _with_new_head(path))


def _rescued(connect: Callable[[], sqlite3.Connection]) -> dict[tuple[str, str], str]:
    found: dict[tuple[str, str], tuple[int, str]] = {}
    for order in (_UPWARDS, _DOWNWARDS):  # from both ends up to what cannot be read
        with contextlib.suppress(*DAMAGE, OSError), contextlib.closing(connect()) as connection:
            for section, key, generation, body, crc in _rows(connection, order):
                if _is_sound(section, key, generation, body, crc):
                    found[section, key] = max(found.get((section, key), (0, "")), (generation, body))
    return {name: body for name, (_, body) in found.items()}


def _with_new_head(path: Path) -> sqlite3.Connection:
    """The file in memory with another first page: that holds the header and the schema, which are known, and no row."""
    data = path.read_bytes()
    connection = sqlite3.connect(":memory:", isolation_level=None)
    migrate(connection)
    head = bytearray(connection.serialize()[:_PAGE])
    head[28:32] = (len(data) // _PAGE).to_bytes(4, "big")
    connection.deserialize(bytes(head) + data[_PAGE:])
    return connection


def is_of_the_disk(error: Exception, path: Path) -> bool:
    """Whether an error speaks of the disk (full, read-only, held by another) and not of a damaged file."""
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
    if code == sqlite3.SQLITE_READONLY:
        # "read-only" from a file that may be written is the file's own header, damaged.
        return not (os.access(path, os.W_OK) and os.access(path.parent, os.W_OK))
    return code in _OF_THE_DISK


def stays_usable(error: sqlite3.Error) -> bool:
    """Whether the connection can go on after an error: a full or busy disk, not one that went away or a file that is damaged."""
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
    return code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def plain(error: Exception) -> str:
    """What reading or writing raised, in words for an operator."""
    if not isinstance(error, sqlite3.Error):
        return "unreadable"
    text = str(error).lower()
    if "full" in text:
        return "no space on the disk"
    if "readonly" in text or "read-only" in text or "unable to open" in text:
        return "the disk cannot be written"
    if "locked" in text:
        return "another program holds the store"
    return str(error) or type(error).__name__
