"""Parameters that a station fetched as one file, out of a telemetry log: ArduPilot's ``@PARAM/param.pck`` over MAVLink FTP."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any, Final

from mavlink_bridge.mavlink.wire.codec import dialect

_FILE: Final = b"@PARAM/param.pck"
_HEADER: Final = struct.Struct("<HBBBBBxI")
_OPEN, _READ, _BURST, _ACK = 4, 5, 15, 128
_MAGICS: Final = (0x671B, 0x671C)
_TYPES: Final = {
    1: ("<b", dialect.MAV_PARAM_TYPE_INT8),
    2: ("<h", dialect.MAV_PARAM_TYPE_INT16),
    3: ("<i", dialect.MAV_PARAM_TYPE_INT32),
    4: ("<f", dialect.MAV_PARAM_TYPE_REAL32),
}
Values = dict[str, tuple[float, int]]
"""Name to value and MAV_PARAM_TYPE."""
_Talk = tuple[int, int]
"""System and component of the vehicle; of the station."""


@dataclass(slots=True)
class _Download:
    blocks: dict[int, bytes] = field(default_factory=dict)
    done: bool = False

    def take(self, offset: int, data: bytes) -> Values | None:
        """Keep a block; the values once all are there."""
        self.blocks[offset] = data
        whole = b""
        for start, block in sorted(self.blocks.items()):
            if start > len(whole):
                return None
            whole = whole[:start] + block
        return None if self.done else unpack(whole)


class PackedParams:
    """Looks at FTP messages in a log's order."""

    def __init__(self) -> None:
        self._asked: dict[tuple[int, int], bool] = {}
        self._downloads: dict[tuple[_Talk, _Talk, int], _Download] = {}

    def take(self, sender: tuple[int, int], message: Any) -> Values | None:
        """The values that a message completes: what ``sender``, a vehicle, holds."""
        raw = bytes(message.payload)
        _, session, op, size, asked_op, _, offset = _HEADER.unpack_from(raw)
        data = raw[_HEADER.size : _HEADER.size + size]
        if op == _OPEN:
            self._asked[sender] = data.startswith(_FILE)
        if op != _ACK:
            return None
        station = (message.target_system, message.target_component)
        key = (sender, station, session)
        if asked_op == _OPEN:
            self._downloads.pop(key, None)
            if self._asked.pop(station, False):
                self._downloads[key] = _Download()
        download = self._downloads.get(key)
        if download is None or asked_op not in (_READ, _BURST):
            return None
        values = download.take(offset, data)
        download.done |= values is not None
        return values


def unpack(data: bytes) -> Values | None:
    """The values of a packed file; None when it is cut or is none."""
    found: Values = {}
    try:
        magic, count, _ = struct.unpack_from("<HHH", data)
        at, name = 6, b""
        while magic in _MAGICS and len(found) < count:
            if not data[at]:
                at += 1  # padding: no value is spread over two blocks
                continue
            form, kind = _TYPES[data[at] & 15]
            defaulted, common, rest = data[at] >> 4 & 1, data[at + 1] & 15, (data[at + 1] >> 4) + 1
            name = name[:common] + data[at + 2 : at + 2 + rest]
            at += 2 + rest
            found[name.decode("ascii")] = float(struct.unpack_from(form, data, at)[0]), kind
            at += struct.calcsize(form) * (1 + defaulted)
    except (struct.error, IndexError, KeyError, UnicodeDecodeError):
        return None
    return found or None
