"""The telemetry logs of this and earlier runs, for ground stations to list and download: looked up and read by the writer thread.

What is asked for comes back as a completion, which the app takes as input; nothing waits for a disk. One run is one
log: its parts one after the other make a telemetry log again. Only files that a look has found are read or deleted.
"""

from __future__ import annotations

import contextlib
import json
import struct
import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from ..clock import EARLIEST_UTC_US
from ..keeping.mark import WorldKind
from ..log_file import parts_of
from ..writer import Writer
from .run_folders import is_held

MAX_LOGS: Final = 500
_UNKNOWN_UTC_US: Final = EARLIEST_UTC_US + 30 * 86_400_000_000
"""A log that seems to begin before this was written by a computer that did not know the time: the file's own date is better."""
_STAMP: Final = struct.Struct(">Q")


@dataclass(frozen=True, slots=True)
class ArchiveLook:
    """Look the logs up; comes back as JSON: [name, size, UTC in seconds] for each, oldest first."""


@dataclass(frozen=True, slots=True)
class Read:
    """Read some bytes of a log; they come back deflated."""

    name: str
    start: int
    size: int


@dataclass(frozen=True, slots=True)
class Erase:
    """Delete the logs of this vessel's earlier runs; comes back with how many, as text, and behind a space how many were left."""


LogOp = ArchiveLook | Read | Erase


class Fetched(NamedTuple):
    """What an operation gave; ``body`` says why not when it is not ``ok``."""

    ticket: int
    ok: bool
    body: bytes


class AnyArchive(Protocol):
    """What the app sees of the archive."""

    def submit(self, op: LogOp) -> int:
        """Queue an operation; return its ticket at once."""
        ...

    def completions(self) -> list[Fetched]:
        """Operations that have finished since the last call, in their order."""
        ...


class LogArchive:
    """Logs below ``folder`` and the log of the present run. ``writer`` None works at once, as a simulation wants."""

    def __init__(self, folder: Path, current: Path, writer: Writer | None = None) -> None:
        self._folder = folder
        self._current = current
        self._writer = writer
        self._tickets = 0
        self._done: deque[Fetched] = deque()
        self._parts: dict[str, tuple[tuple[Path, int], ...]] = {}

    def submit(self, op: LogOp) -> int:
        self._tickets += 1
        ticket = self._tickets
        if self._writer is None:
            self._perform(ticket, op)
        elif not self._writer.post(lambda: self._perform(ticket, op)):
            self._done.append(Fetched(ticket, False, b"the disk is busy"))
        return ticket

    def completions(self) -> list[Fetched]:
        if not self._done:
            return []
        return [self._done.popleft() for _ in range(len(self._done))]

    def _perform(self, ticket: int, op: LogOp) -> None:
        try:
            self._done.append(Fetched(ticket, True, self._carry_out(op)))
        except OSError as error:
            self._done.append(Fetched(ticket, False, (error.strerror or str(error)).encode()))

    def _carry_out(self, op: LogOp) -> bytes:
        if isinstance(op, ArchiveLook):
            return json.dumps(self._look()).encode()
        if isinstance(op, Read):
            return zlib.compress(self._read(op), 1)
        gone, left = self._erase()
        return (f"{gone} {left}" if left else str(gone)).encode()

    def _look(self) -> list[tuple[str, int, int]]:
        """Name, size and beginning of each run that has a log, oldest first; the present run is the last."""
        folders = {path.name: path for path in self._runs()}
        found: list[tuple[int, str, int]] = []
        self._parts = {}
        for name, folder in folders.items():
            with contextlib.suppress(
                OSError
            ):  # lost+found, or a run that is damaged: the others are wanted all the same
                parts = log_parts(folder)
                if parts:
                    found.append((_begin_s(parts[0][0]), name, sum(size for _, size in parts)))
                    self._parts[name] = parts
        found.sort(key=lambda each: (folders[each[1]] == self._current, each))
        return [(name, size, begin_s) for begin_s, name, size in found[-MAX_LOGS:]]

    def _runs(self) -> list[Path]:
        current = self._current.resolve()
        try:
            earlier = [path for path in self._folder.iterdir() if path.is_dir() and path.resolve() != current]
        except (FileNotFoundError, NotADirectoryError):
            earlier = []
        return [*earlier, self._current]

    def _read(self, op: Read) -> bytes:
        data, start, left = b"", op.start, op.size
        for path, size in self._parts.get(op.name, ()):
            if start < size and left > 0:
                with path.open("rb") as file:
                    file.seek(start)
                    piece = file.read(min(left, size - start))
                if not piece:
                    raise OSError("is shorter than it was")
                data += piece
                left -= len(piece)
            start = max(start - size, 0)
        return data

    def _erase(self) -> tuple[int, int]:
        """Other vessels may record into the same folder, and a person may have put their runs there: those stay."""
        self._look()
        gone, left, ours = 0, 0, vessel_of(self._current)
        for parts in self._parts.values():
            run_dir = parts[0][0].parent
            if run_dir == self._current:
                continue
            if ours is None or vessel_of(run_dir) != ours or is_held(run_dir):
                left += 1
                continue
            for path, _ in parts:
                path.unlink(missing_ok=True)
            gone += 1
        return gone, left


def log_parts(run_dir: Path) -> tuple[tuple[Path, int], ...]:
    """The files of one run's telemetry log and their sizes, in their order; empty when there is none."""
    paths = parts_of(run_dir / "mavlink.tlog")
    found = [(path, path.stat().st_size) for path in paths if not path.is_symlink()]
    return tuple(each for each in found if each[1] > 0)


def vessel_of(run_dir: Path) -> tuple[object, object] | None:
    """Whose run it is by its run.json: the vessel's id and its number on MAVLink; None = nobody knows.

    A boat without a store has another id at each start: there her name stands for it.
    """
    try:
        about = json.loads((run_dir / "run.json").read_text(encoding="utf-8"))
        settings = about.get("settings", {})
        system = settings.get("system", {})
        name, number = system.get("name"), system.get("system_id")
        has_store = settings.get("store") != ""
    except (OSError, ValueError, AttributeError, RecursionError):
        return None
    vessel = about.get("vessel_id")
    if vessel is not None and name and not has_store and about.get("world_kind") == WorldKind.REAL:
        vessel = ("no store", name)
    return None if vessel is None else (vessel, number)


def _begin_s(path: Path) -> int:
    with path.open("rb") as file:
        head = file.read(_STAMP.size)
    stamp_us = _STAMP.unpack(head)[0] if len(head) == _STAMP.size else 0
    if _UNKNOWN_UTC_US < stamp_us < 2**32 * 1_000_000:
        return int(stamp_us // 1_000_000)
    return int(path.stat().st_mtime)


class RecordingArchive:
    """An archive that hands what it gives to a recorder as well; the app cannot tell."""

    def __init__(self, archive: AnyArchive, keep: Callable[[Fetched], None]) -> None:
        self._archive = archive
        self._keep = keep

    def submit(self, op: LogOp) -> int:
        return self._archive.submit(op)

    def completions(self) -> list[Fetched]:
        done = self._archive.completions()
        for fetched in done:
            self._keep(fetched)
        return done


class ReplayArchive:
    """Gives what a recording says, when it says so."""

    def __init__(self) -> None:
        self._tickets = 0
        self._done: list[Fetched] = []

    def load(self, fetched: list[Fetched]) -> None:
        """Take over what came in the step that begins."""
        self._done = fetched

    def submit(self, op: LogOp) -> int:
        self._tickets += 1
        return self._tickets

    def completions(self) -> list[Fetched]:
        done, self._done = self._done, []
        return done
