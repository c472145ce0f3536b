"""The logs as endpoints see them: what the archive has fetched lately, and a way to ask for more.

Its state changes only by what the archive completes, which is recorded input: a replay serves the same bytes at the same
time. Memory is bounded: a few pieces are kept, few are fetched at once.
"""

from __future__ import annotations

import json
import zlib
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.mavlink.persona.port import LOG_PIECE, LogInfo, LogLostError

from .io.recording.log_archive import AnyArchive, ArchiveLook, Erase, Fetched, LogOp, Read

KEPT_PIECES: Final = 32
MAX_FETCHES: Final = 32
Piece = tuple[int, int]


class Logs:
    """A ``LogShelf`` over an archive."""

    def __init__(self, archive: AnyArchive, say: Callable[[Severity, str], None]) -> None:
        self._archive = archive
        self._say = say
        self._names: tuple[str, ...] = ()
        self.logs: tuple[LogInfo, ...] = ()
        self.looked = 0
        self._looking: int | None = None
        self._erasing: int | None = None
        self._erased_by = ""
        self._fetching: dict[int, Piece] = {}
        self._asked: set[Piece] = set()
        self._pieces: OrderedDict[Piece, bytes] = OrderedDict()
        self._lost: dict[Piece, str] = {}
        self.waiting = 0
        """Orders that the archive has not finished; without any, ``collect`` has nothing to do."""

    def look(self) -> int:
        """Have the logs looked up, once for all who ask meanwhile."""
        if self._looking is None:
            self._looking = self._order(ArchiveLook())
        return self._looking

    def erase(self, by: str) -> None:
        """Delete the logs of earlier runs, as somebody has ordered; a look that comes after it sees them gone."""
        if self._erasing is None:
            self._erased_by = by
            self._erasing = self._order(Erase())
            self._looking = None

    def piece(self, log: int, number: int) -> bytes | None:
        """Bytes of a log, or None while they are fetched. Raises LogLostError."""
        key = (log, number)
        data = self._pieces.get(key)
        if data is not None:
            return data
        if key in self._lost:
            raise LogLostError(self._lost.pop(key))
        if key not in self._asked and len(self._fetching) < MAX_FETCHES:
            self._asked.add(key)
            self._fetching[self._order(Read(self._names[log], number * LOG_PIECE, LOG_PIECE))] = key
        return None

    def _order(self, op: LogOp) -> int:
        self.waiting += 1
        return self._archive.submit(op)

    def collect(self) -> None:
        """Take in what the archive has finished."""
        for fetched in self._archive.completions():
            self.waiting -= 1
            if fetched.ticket == self._erasing:
                self._erased(fetched)
            elif fetched.ticket in self._fetching:
                self._take(self._fetching.pop(fetched.ticket), fetched)
            else:
                self._found(fetched)

    def _found(self, fetched: Fetched) -> None:
        if fetched.ticket == self._looking:
            self._looking = None
        self.looked = fetched.ticket
        if not fetched.ok:
            self._say(Severity.WARNING, f"Logs not looked up: {fetched.body.decode(errors='replace')}")
        found = json.loads(fetched.body) if fetched.ok else []
        names = tuple(str(name) for name, _, _ in found)
        logs = tuple(LogInfo(min(size, 0xFFFFFFFF), begin_s) for _, size, begin_s in found)
        if names != self._names or logs != self.logs:
            self._forget()
        self._names, self.logs = names, logs

    def _erased(self, fetched: Fetched) -> None:
        self._erasing = None
        self._names, self.logs = (), ()
        self._forget()
        if not fetched.ok:
            self._say(Severity.WARNING, f"Logs not erased: {fetched.body.decode()}")
            return
        gone, _, left = fetched.body.decode().partition(" ")
        rest = f"; {left} left: another vessel's, unknown, or in use" if left else ""
        self._say(Severity.NOTICE, f"Logs of {gone} earlier runs erased by {self._erased_by}{rest}")

    def _forget(self) -> None:
        self._pieces.clear()
        self._lost.clear()
        self._asked.clear()
        self._fetching = dict.fromkeys(self._fetching, (-1, -1))

    def _take(self, key: Piece, fetched: Fetched) -> None:
        self._asked.discard(key)
        if key[0] < 0:
            return
        if not fetched.ok:
            self._lost[key] = fetched.body.decode(errors="replace")
            return
        self._pieces[key] = zlib.decompress(fetched.body)
        if len(self._pieces) > KEPT_PIECES:
            self._pieces.popitem(last=False)
