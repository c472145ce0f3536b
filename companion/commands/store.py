"""``companion store``: look at, save and restore what the vessel keeps (plans, parameters, counters)."""

from __future__ import annotations

import argparse
import contextlib
import json
import sqlite3
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..io.keeping import StoreContent
from ..io.keeping.content import SECTIONS, StoredRow, content_of, from_json, rows_of, to_json
from ..io.keeping.file import make_new
from ..io.keeping.look import look
from ..io.keeping.mark import WorldKind, marks, new_vessel_id, settle
from ..io.keeping.store import check, migrate, read_entries, write_entries
from ..io.log_file import make_own_folder
from ..io.recording.recorder import write_json
from ..settings import ConfigError
from ..settings.device import no_device
from .outputs import may_write

FORMAT = "usv-companion store 1"
_OF_A_SIMULATION = ("plan", "param")
"""Soundings, counters and stamps of a simulation are none of a boat's."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("store", help="export and import what the vessel keeps", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    show = actions.add_parser("show", help="say what is in it")
    show.add_argument("store", type=Path, help="the store, state/companion.db by default configuration")
    show.set_defaults(run=_show)
    export = actions.add_parser("export", help="write everything as JSON")
    export.add_argument("store", type=Path)
    export.add_argument("file", type=Path, nargs="?", help="default: standard output")
    export.set_defaults(run=_export)
    load = actions.add_parser("import", help="take an export into a store; the vessel must not be running")
    load.add_argument("store", type=Path)
    load.add_argument("file", type=Path)
    load.add_argument("--replace", action="store_true", help="forget everything else that the store holds")
    load.set_defaults(run=_import)
    from .store_adopt import add_action

    add_action(actions)


def read_store(path: Path) -> StoreContent:
    """Content of a store file, read only. Raises ConfigError when it is none."""
    if not path.is_file():
        raise ConfigError(str(path), ["no such store; the configuration's key store names it"])
    try:
        content, texts = look(path)
    except OSError as error:
        raise ConfigError(str(path), [f"cannot be read: {error.strerror or error}"]) from None
    except sqlite3.Error as error:
        raise ConfigError(str(path), [_no_store(error)]) from None
    for text in texts:
        print(f"{path}: {text}", file=sys.stderr)
    return content


def _ours(connection: sqlite3.Connection) -> None:
    """Raise sqlite3.DatabaseError for a database that another program made."""
    tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if tables and "entry" not in tables:
        raise sqlite3.DatabaseError(f"a database with {', '.join(sorted(tables))}")


def _no_store(error: sqlite3.Error) -> str:
    if isinstance(error, sqlite3.OperationalError) and "no such table" not in str(error):
        return f"cannot be read: {error}"
    if "malformed" in str(error):
        return f"is damaged ({error}); a vessel that starts with it rescues what it can"
    return f"is no store of this program ({error})"


def _show(arguments: argparse.Namespace) -> int:
    content = read_store(arguments.store)
    print(f"world      {content.world or 'not known (first release)'}, vessel {content.vessel or 'not known'}")
    for kind, items in content.plans.items():
        print(f"{kind.name.lower():10} {len(items)} items")
    for name, value in content.params.items():
        print(f"parameter  {name} = {value:g}")
    for radio, entries in content.ledger.items():
        print(f"airtime    {radio}: {len(entries)} transmissions, {sum(spent for _, spent in entries) / 1e6:.1f} s")
    for stream, stamp in content.stamps.items():
        print(f"stamp      {stream} = {stamp}")
    for name, number in content.counters.items():
        print(f"counter    {name} = {number}")
    for key, text in content.values.items():
        print(f"value      {key} = {text[:60]}")
    for name, record in content.records.items():
        print(f"record     {name} = {json.dumps(record.data)[:60]}")
    if content.old_plans or content.old_depth:
        print(f"waits      {len(content.old_plans)} plans, {len(content.old_depth)} tiles; see 'companion store adopt'")
    if content.depth:
        print(f"depth      {len(content.depth)} tiles; see 'companion depth'")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    may_write(arguments.file, arguments.store)
    content = read_store(arguments.store)
    data = {"format": FORMAT, **to_json(content)}
    if arguments.file is None:
        print(json.dumps(data, indent=1, sort_keys=True))
        return 0
    try:
        write_json(arguments.file, data)
    except OSError as error:
        print(f"{arguments.file}: {error.strerror}", file=sys.stderr)
        return 1
    print(arguments.file)
    return 0


def _import(arguments: argparse.Namespace) -> int:
    try:
        data = json.loads(no_device(arguments.file).read_text(encoding="utf-8"))
        if not isinstance(data, dict) or data.pop("format", None) != FORMAT:
            raise ValueError(f"not an export of this program ({FORMAT!r} expected)")
        rows = rows_of(from_json(data))
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise ConfigError(str(arguments.file), [getattr(error, "strerror", None) or str(error)]) from None
    wanted = sum(len(section) for section in data.values())
    if len(rows) < wanted:
        raise ConfigError(
            str(arguments.file), [f"{wanted - len(rows)} entries are not understood; nothing was changed"]
        )
    taken = SECTIONS if data.get("meta", {}).get("world") != WorldKind.SIMULATED else _OF_A_SIMULATION
    entries = [StoredRow(section, key, body) for (section, key), body in rows.items() if section in taken]
    entries = [entry for entry in entries if entry.section != "meta"]
    if len(taken) < len(SECTIONS):
        print(f"{arguments.file}: of a simulation: only its parameters and plans are taken", file=sys.stderr)
    if arguments.replace:
        entries = [StoredRow(section, "", None) for section in SECTIONS if section != "meta"] + entries
    if not write_store(arguments.store, entries):
        return 1
    print(f"{arguments.store}: {sum(entry.body is not None for entry in entries)} entries taken over")
    return 0


def write_store(path: Path, entries: Iterable[StoredRow]) -> bool:
    """Write rows into a store file in one transaction; False with a message when that cannot be.

    Raises ConfigError when the file is no store.
    """
    try:
        make_own_folder(path.parent)
        if not path.exists():
            make_new(path, marks(WorldKind.REAL, new_vessel_id()))
        with contextlib.closing(sqlite3.connect(path, timeout=1.0, isolation_level=None)) as connection:
            check(connection)
            _ours(connection)
            migrate(connection)
            rows, _ = read_entries(connection)
            world = WorldKind(content_of(rows)[0].world or WorldKind.REAL)
            write_entries(connection, [*settle(rows, world)[0], *entries])
    except (OSError, sqlite3.Error) as error:
        if isinstance(error, sqlite3.DatabaseError) and not isinstance(error, sqlite3.OperationalError):
            raise ConfigError(str(path), [_no_store(error)]) from None
        hint = "; stop the vessel first" if "locked" in str(error) else ""
        print(f"{path}: {error}{hint}", file=sys.stderr)
        return False
    return True
