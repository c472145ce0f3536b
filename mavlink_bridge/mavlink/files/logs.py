"""Log list and download: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_ERASE and LOG_REQUEST_END of one endpoint.

Entries and data are made only when the link has room for them, so that a download never displaces what steers. Numbers
begin at 1 where the vessel looks like ArduPilot, else at 0 as MAVSDK wants them. What a station asks for twice while it
still waits is sent once; gaps are filled in the order in which they are named. Source: MAVLink common messages 117-122;
the three clients' own ways are in the tests.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from ..persona.port import LOG_PIECE, LogInfo, LogLostError, LogShelf
from ..wire.codec import dialect
from ..wire.payload import Packed, packed

CHUNK: Final = 90
"""Bytes in one LOG_DATA."""
MAX_RANGES: Final = 64
AHEAD: Final = 3
"""Pieces that are fetched before they are needed."""
TAIL_US: Final = 200_000
"""A station that finds a gap asks for the rest of it at every frame that comes; for so long the rest is on its way."""
_DATA: Final = struct.Struct("<IHB")
_DATA_ID: Final = int(dialect.MAVLINK_MSG_ID_LOG_DATA)


@dataclass(slots=True)
class _Range:
    """Bytes of a log that somebody waits for; ``start`` moves as they are sent."""

    log: int
    info: LogInfo
    begin: int
    start: int
    end: int

    def holds(self, other: _Range) -> bool:
        return self.info == other.info and self.begin <= other.begin and other.end <= self.end


class LogServer:
    """Serves the vessel's logs on one endpoint. ``shelf`` None: says that there are none (a radio must not carry them).

    ``erase`` asks the vessel to delete them: who may is the vessel's to say.
    """

    handles: Final = ("LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_ERASE", "LOG_REQUEST_END")

    def __init__(
        self, shelf: LogShelf | None, first_id: int, explain: Callable[[str], None], erase: Callable[[], None]
    ) -> None:
        self._shelf = shelf
        self._first = first_id
        self._wanted: tuple[int, int] | None = None
        self._look = 0
        self._next_entry = 0
        self._ranges: deque[_Range] = deque()
        self._sent: tuple[int, _Range] | None = None
        self._explain, self._ask_to_erase = explain, erase
        self._is_erasing = False

    @property
    def busy(self) -> bool:
        """True while something is to be sent."""
        return self._wanted is not None or bool(self._ranges)

    def handle(self, message: Any, now_us: int) -> None:
        """Take one message of ``handles``; ``next`` has the answers."""
        kind = message.get_type()
        if kind == "LOG_REQUEST_LIST":
            self._list(message.start, message.end)
        elif kind == "LOG_REQUEST_DATA":
            self._data(message.id, message.ofs, message.count, now_us)
        elif kind == "LOG_ERASE":
            self._erase()
        else:
            self._wanted = None
            self._ranges.clear()

    def next(self, now_us: int) -> Packed | None:
        """Return the next entry or piece of data; None when there is none, or none yet (``busy`` tells)."""
        if self._wanted is not None:
            entry = self._entry()
            if entry is not None:
                return entry
        while self._ranges:
            try:
                return self._chunk(now_us)
            except LogLostError as error:
                lost = self._ranges[0].log
                self._explain(f"log {lost + self._first}: {error}")
                self._ranges = deque(each for each in self._ranges if each.log != lost)
        return None

    # The list

    def _list(self, first: int, last: int) -> None:
        self._wanted = first, last
        self._next_entry = max(first - self._first, 0)
        if not self._is_erasing:
            self._look_up()

    def _look_up(self) -> None:
        if self._shelf is not None and (self._next_entry == 0 or not self._shelf.looked):
            self._look = self._shelf.look()

    def _entry(self) -> Packed | None:
        if self._wanted is None or self._is_erasing or (self._shelf is not None and self._shelf.looked < self._look):
            return None
        logs = () if self._shelf is None else self._shelf.logs
        number = self._next_entry
        last = min(len(logs) - 1, self._wanted[1] - self._first)
        if number >= last:
            self._wanted = None
        if number > last and logs:
            return None
        self._next_entry += 1
        info = logs[number] if logs else LogInfo(0, 0)
        highest = len(logs) - 1 + self._first if logs else 0
        return packed(
            dialect.MAVLink_log_entry_message(
                id=number + self._first if logs else 0,
                num_logs=len(logs),
                last_log_num=highest,
                time_utc=info.utc_s,
                size=info.size_bytes,
            )
        )

    def _erase(self) -> None:
        if self._shelf is None:
            self._explain("there are no logs to erase over this link")
        else:
            self._is_erasing = True
            self._ask_to_erase()

    def erase_answered(self) -> None:
        """The vessel has obeyed or refused: a list that was asked for meanwhile shows what is left."""
        self._is_erasing = False
        if self._wanted is not None:
            self._look_up()

    # The data

    def _data(self, number: int, start: int, count: int, now_us: int) -> None:
        log = number - self._first
        logs = () if self._shelf is None else self._shelf.logs
        if not 0 <= log < len(logs):
            self._explain(f"there is no log {number}: list the logs first")
            return
        begin = min(start, logs[log].size_bytes)
        wanted = _Range(log, logs[log], begin, begin, min(start + count, logs[log].size_bytes))
        if any(each.holds(wanted) for each in self._ranges) or self._is_on_its_way(wanted, now_us):
            return
        self._ranges = deque(each for each in self._ranges if each.log == log and not wanted.holds(each))
        if len(self._ranges) < MAX_RANGES:
            self._ranges.append(wanted)

    def _is_on_its_way(self, wanted: _Range, now_us: int) -> bool:
        """True for the rest of a range that has just been sent."""
        if self._sent is None:
            return False
        sent_us, sent = self._sent
        is_rest = wanted.info == sent.info and sent.begin < wanted.begin < wanted.end == sent.end
        return is_rest and 0 <= now_us - sent_us < TAIL_US

    def _chunk(self, now_us: int) -> Packed | None:
        """The next 90 bytes of the first range. Nothing is left beyond the end, which one empty message says."""
        shelf, wanted = self._shelf, self._ranges[0]
        if shelf is None or not _is_kept(shelf.logs, wanted):
            raise LogLostError("is gone")
        at = wanted.start
        data = self._bytes(shelf, wanted.log, at, min(CHUNK, wanted.end - at))
        if data is None:
            return None
        wanted.start = at + len(data)
        if wanted.start >= wanted.end:
            self._sent = now_us, self._ranges.popleft()
        body = _DATA.pack(at, wanted.log + self._first, len(data)) + data
        return _DATA_ID, body.rstrip(b"\0") or b"\0"

    @staticmethod
    def _bytes(shelf: LogShelf, log: int, at: int, count: int) -> bytes | None:
        """Bytes of a log, or None while they are being fetched; sees that the pieces after them come too."""
        if count <= 0:
            return b""
        number, skip = divmod(at, LOG_PIECE)
        piece = shelf.piece(log, number)
        if skip == 0 or piece is None:
            pieces = -(-shelf.logs[log].size_bytes // LOG_PIECE)
            for ahead in range(number + 1, min(number + 1 + AHEAD, pieces)):
                shelf.piece(log, ahead)
        if piece is None:
            return None
        data = piece[skip : skip + count]
        if len(data) < count:
            following = shelf.piece(log, number + 1)
            if following is None:
                return None
            data += following[: count - len(data)]
        if len(data) < count:
            raise LogLostError("is shorter than it was")
        return data


def _is_kept(logs: tuple[LogInfo, ...], wanted: _Range) -> bool:
    """True while the log is still there; that of the present run may have grown."""
    found = logs[wanted.log] if wanted.log < len(logs) else None
    return found is not None and found.utc_s == wanted.info.utc_s and found.size_bytes >= wanted.info.size_bytes
