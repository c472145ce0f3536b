"""A small MAVLink FTP client for tests: open, read, burst, list, CRC; the caller says which packets get lost."""

from __future__ import annotations

import struct
from typing import Any

from mavlink_bridge.mavlink.wire.codec import dialect

HEADER = struct.Struct("<HBBBBBxI")
ACK, NAK = 128, 129
OPEN, READ, BURST, TERMINATE, RESET, LIST, CRC = 4, 5, 15, 1, 2, 3, 14


class Reply:
    """One reply, taken apart."""

    def __init__(self, message: Any) -> None:
        self.raw = bytes(message.payload)
        self.sequence, self.session, self.op, self.size, self.req_op, self.burst_complete, self.offset = (
            HEADER.unpack_from(self.raw)
        )
        self.data = self.raw[HEADER.size : HEADER.size + self.size]
        self.target = (message.target_system, message.target_component)


class FtpClient:
    """Talks to a ``Bench``."""

    def __init__(self, bench: Any, lose: Any = None) -> None:
        self.bench = bench
        self.sequence = 0
        self.lose = lose or (lambda reply: False)

    def ask(
        self,
        op: int,
        data: bytes = b"",
        *,
        session: int = 0,
        offset: int = 0,
        size: int | None = None,
        sequence: int | None = None,
    ) -> list[Reply]:
        """Send one request and return the replies that came at once."""
        if sequence is None:
            self.sequence = sequence = (self.sequence + 1) & 0xFFFF
        header = HEADER.pack(sequence, session, op, len(data) if size is None else size, 0, 0, offset)
        before = len(self.bench.gcs.inbox)
        self.bench.send(
            dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, list((header + data).ljust(251, b"\0")))
        )
        replies = [Reply(m) for m in self.bench.gcs.inbox[before:] if m.get_type() == "FILE_TRANSFER_PROTOCOL"]
        self.sequence = max([self.sequence, *(reply.sequence for reply in replies)])
        return [reply for reply in replies if not self.lose(reply)]

    def open(self, path: str) -> tuple[int, int] | None:
        """Return (session, size), None when refused."""
        (reply,) = self.ask(OPEN, path.encode())
        return (reply.session, struct.unpack("<I", reply.data)[0]) if reply.op == ACK else None

    def download(self, path: str) -> bytes:
        """Open, burst, fill the gaps one by one, close."""
        opened = self.open(path)
        assert opened is not None, path
        session, size = opened
        parts: dict[int, bytes] = {}
        offset = 0
        while offset < size:
            replies = self.ask(BURST, session=session, offset=offset, size=239)
            parts |= {reply.offset: reply.data for reply in replies if reply.op == ACK}
            end = max((reply.offset + reply.size for reply in replies if reply.op == ACK), default=offset)
            if any(reply.burst_complete for reply in replies) or end == offset:
                offset = max(end, offset + 239 if end == offset else end)
            else:
                offset = end
        for at in range(0, size, 239):
            while at not in parts:
                parts |= {reply.offset: reply.data for reply in self.ask(READ, session=session, offset=at, size=239)}
        self.ask(TERMINATE, session=session)
        return b"".join(parts[at] for at in sorted(parts))[:size]
