"""MAVLink FTP, read-only, over files that exist only in memory: parameter lists and component metadata.

There is no path to the computer's disk: a name is looked up in a table, so that nothing outside can be reached. A
repeated request gets the same bytes again; sessions are few and the longest unused is given away. Source: MAVLink guide,
file transfer protocol.
"""

from __future__ import annotations

import struct
import zlib
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

from ..wire.codec import dialect
from ..wire.payload import Packed, packed

MAX_DATA: Final = 239
MAX_SESSIONS: Final = 8
MAX_SENDERS: Final = 32
BURST_PACKETS: Final = 64
_HEADER: Final = struct.Struct("<HBBBBBxI")

File = Callable[[str], bytes]
"""Makes a file's content when it is opened, given the query behind '?' in its name."""


Session = tuple[int, int, int]
"""System and component of the station, and its session number: each station has numbers of its own."""


class Op(IntEnum):
    """Requests and the two kinds of reply."""

    NONE = 0
    TERMINATE = 1
    RESET = 2
    LIST = 3
    OPEN_READ = 4
    READ = 5
    CREATE = 6
    WRITE = 7
    REMOVE = 8
    CREATE_DIRECTORY = 9
    REMOVE_DIRECTORY = 10
    OPEN_WRITE = 11
    TRUNCATE = 12
    RENAME = 13
    CRC32 = 14
    BURST = 15
    ACK = 128
    NAK = 129


class Nak(IntEnum):
    """Why a request was refused."""

    INVALID_SIZE = 3
    INVALID_SESSION = 4
    EOF = 6
    UNKNOWN_COMMAND = 7
    PROTECTED = 9
    NOT_FOUND = 10


_WRITES: Final = frozenset(
    (Op.CREATE, Op.WRITE, Op.REMOVE, Op.CREATE_DIRECTORY, Op.REMOVE_DIRECTORY, Op.OPEN_WRITE, Op.TRUNCATE, Op.RENAME)
)


class _Refused(Exception):  # noqa: N818 - an answer, not a fault
    def __init__(self, reason: Nak) -> None:
        super().__init__(reason)
        self.reason = reason


def crc32(data: bytes) -> int:
    """CRC-32 as FTP and component metadata mean it: start value 0 and no final inversion."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


@dataclass(slots=True)
class _Request:
    sequence: int
    session: int
    op: int
    size: int
    offset: int
    data: bytes
    sender: tuple[int, int]

    @property
    def key(self) -> Session:
        return (*self.sender, self.session)

    @property
    def path(self) -> str:
        return self.data[: self.size].partition(b"\0")[0].decode("utf-8", "replace")


@dataclass(slots=True)
class _Burst:
    request: _Request
    offset: int
    sequence: int
    left: int


class FileServer:
    """Serves named files to any number of stations."""

    def __init__(self, files: Mapping[str, File]) -> None:
        self._files = files
        self._open: OrderedDict[Session, bytes] = OrderedDict()
        self._bursts: deque[_Burst] = deque()
        self._last: OrderedDict[tuple[int, int], tuple[bytes, list[Any]]] = OrderedDict()

    def handle(self, message: Any) -> list[Any]:
        """Answer one FILE_TRANSFER_PROTOCOL request. Replies to others' requests are ignored."""
        payload = bytes(message.payload)
        sequence, session, op, size, _, _, offset = _HEADER.unpack_from(payload)
        if op >= Op.ACK:
            return []
        sender = (message.get_srcSystem(), message.get_srcComponent())
        request = _Request(
            sequence=sequence,
            session=session,
            op=op,
            size=size,
            offset=offset,
            data=payload[_HEADER.size :],
            sender=sender,
        )
        last = self._last.get(sender)
        if last is not None and last[0] == payload and op != Op.BURST:
            return last[1]
        answer = self._answer(request)
        self._last[sender] = (payload, answer)
        self._last.move_to_end(sender)
        if len(self._last) > MAX_SENDERS:
            self._last.popitem(last=False)
        return answer

    def next(self, now_us: int) -> Packed | None:
        """Return the next packet of a burst, None when none is under way."""
        while self._bursts:
            burst = self._bursts[0]
            held = self._open.get(burst.request.key)
            if held is None:
                self._bursts.popleft()
                continue
            step = burst.request.size or MAX_DATA
            data = held[burst.offset : burst.offset + step]
            burst.left -= 1
            is_last = burst.left == 0 or burst.offset + len(data) >= len(held)
            reply = self._reply(
                burst.request, Op.ACK, data, offset=burst.offset, sequence=burst.sequence, burst_complete=is_last
            )
            burst.offset += len(data)
            burst.sequence += 1
            if is_last:
                self._bursts.popleft()
            return packed(reply)
        return None

    def _answer(self, request: _Request) -> list[Any]:
        try:
            if request.size > MAX_DATA:
                raise _Refused(Nak.INVALID_SIZE)
            handler = _HANDLERS.get(request.op)
            if handler is None:
                raise _Refused(Nak.PROTECTED if request.op in _WRITES else Nak.UNKNOWN_COMMAND)
            data = handler(self, request)
        except _Refused as refusal:
            return [self._reply(request, Op.NAK, bytes([refusal.reason]), request.offset)]
        return [] if data is None else [self._reply(request, Op.ACK, data, request.offset)]

    def _terminate(self, request: _Request) -> bytes:
        self._held(request)
        del self._open[request.key]
        return b""

    def _reset(self, request: _Request) -> bytes:
        for key in [key for key in self._open if key[:2] == request.sender]:
            del self._open[key]
        return b""

    def _nothing(self, _: _Request) -> bytes:
        return b""

    def _open_read(self, request: _Request) -> bytes:
        """Open a file. MAVProxy names the session itself and waits for that number; others send 0 and take ours."""
        content = self._content(request.path)
        if not request.session:
            taken = {key[2] for key in self._open if key[:2] == request.sender}
            request.session = next(number for number in range(MAX_SESSIONS + 1) if number not in taken)
        self._open[request.key] = content
        if len(self._open) > MAX_SESSIONS:
            self._open.popitem(last=False)
        return struct.pack("<I", len(content))

    def _read(self, request: _Request) -> bytes:
        content = self._held(request)
        data = content[request.offset : request.offset + (request.size or MAX_DATA)]
        if not data:
            raise _Refused(Nak.EOF)
        return data

    def _burst(self, request: _Request) -> None:
        content = self._held(request)
        if request.offset >= len(content):
            raise _Refused(Nak.EOF)
        kept = [burst for burst in self._bursts if burst.request.key != request.key]
        self._bursts = deque([*kept, _Burst(request, request.offset, request.sequence + 1, BURST_PACKETS)])

    def _crc(self, request: _Request) -> bytes:
        return struct.pack("<I", crc32(self._content(request.path)))

    def _list(self, request: _Request) -> bytes:
        folder = request.path.strip("/")
        prefix = f"{folder}/" if folder else ""
        entries: set[str] = set()
        for name in self._files:
            if name.startswith(prefix):
                head, slash, _ = name[len(prefix) :].partition("/")
                entries.add(f"D{head}" if slash else f"F{head}\t{len(self._files[name](''))}")
        if not entries:
            raise _Refused(Nak.NOT_FOUND)
        listing = b""
        for entry in sorted(entries)[request.offset :]:
            line = entry.encode() + b"\0"
            if len(listing) + len(line) > MAX_DATA:
                break
            listing += line
        if not listing:
            raise _Refused(Nak.EOF)
        return listing

    def _content(self, path: str) -> bytes:
        name, _, query = path.partition("?")
        make = self._files.get(name.lstrip("/"))
        if make is None:
            raise _Refused(Nak.NOT_FOUND)
        return make(query)

    def _held(self, request: _Request) -> bytes:
        held = self._open.get(request.key)
        if held is None:
            raise _Refused(Nak.INVALID_SESSION)
        self._open.move_to_end(request.key)
        return held

    @staticmethod
    def _reply(
        request: _Request, op: Op, data: bytes, offset: int, sequence: int | None = None, burst_complete: bool = False
    ) -> Any:
        number = (request.sequence + 1 if sequence is None else sequence) & 0xFFFF
        header = _HEADER.pack(number, request.session, op, len(data), request.op, burst_complete, offset)
        return dialect.MAVLink_file_transfer_protocol_message(
            target_network=0,
            target_system=request.sender[0],
            target_component=request.sender[1],
            payload=list((header + data).ljust(251, b"\0")),
        )


_HANDLERS: Final[dict[int, Callable[[FileServer, _Request], bytes | None]]] = {
    Op.NONE: FileServer._nothing,
    Op.TERMINATE: FileServer._terminate,
    Op.RESET: FileServer._reset,
    Op.LIST: FileServer._list,
    Op.OPEN_READ: FileServer._open_read,
    Op.READ: FileServer._read,
    Op.CRC32: FileServer._crc,
    Op.BURST: FileServer._burst,
}
