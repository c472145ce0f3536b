"""COMMAND_LONG and COMMAND_INT in few bytes, rebuilt bit for bit aboard, where the vessel itself finds out what they mean.

Usual values have short codes: a codebook of commands, the stations' ids, parameters that are nothing from some place on, whole numbers,
tenths and NaN. The numbers are never taken as floats on the way, so any NaN keeps its bits. What would be longer so goes as it is: the
raw escape holds the payload of any message.
"""

from __future__ import annotations

import struct
from typing import Final

from ...language.requests import Origin
from ...mavlink.commands.command import COMMAND_INT, COMMAND_LONG
from .bits import BitReader, BitsError, BitWriter
from .wire import COMMAND_CODE, COMMAND_FRAMES, COMMANDS, RAW_CODE, REQUEST_BITS, STATIONS

_LONG: Final = struct.Struct("<7IHBBB")
"""Seven parameters, command, target system and component, confirmation."""
_INT: Final = struct.Struct("<4IiiIHBBBBB")
"""Four parameters, x, y, z, command, target system and component, frame, current, autocontinue."""
_OTHER: Final = 31
_NAN_BITS: Final = 0x7FC0_0000
_MAX_SMALL: Final = 100_000.0


def encode_command(origin: Origin, target: tuple[int, int]) -> bytes:
    """Return the shorter of the two forms. ``target``: the vessel's own system and component.

    Raises ValueError for a payload that is longer than its message.
    """
    raw = _raw(origin)
    if origin.message_id not in (COMMAND_LONG, COMMAND_INT):
        return raw
    short = _short(origin, target)
    return min(short, raw, key=len)


def decode_command(data: bytes, target: tuple[int, int]) -> Origin:
    """Rebuild what ``encode_command`` was given, its payload without trailing zeros. Raises BitsError."""
    reader = BitReader(data)
    code = reader.get(REQUEST_BITS)
    if code not in (COMMAND_CODE, RAW_CODE):
        raise BitsError("not a command")
    home_item = reader.flag()
    source = _read_ids(reader, STATIONS)
    if code == RAW_CODE:
        message_id = reader.unsigned(7)
        payload = bytes(reader.get(8) for _ in range(reader.unsigned(5)))
        return Origin(message_id, payload, source, home_item)
    is_int = reader.flag()
    number = reader.get(5)
    command = COMMANDS[number] if number < len(COMMANDS) else reader.get(16)
    to = _read_ids(reader, (target,))
    payload = _read_int(reader, command, to) if is_int else _read_long(reader, command, to)
    return Origin(COMMAND_INT if is_int else COMMAND_LONG, trimmed(payload), source, home_item)


def is_command(data: bytes) -> bool:
    """Whether a message's payload is a command or the raw escape, not a request."""
    return bool(data) and data[0] >> 8 - REQUEST_BITS in (COMMAND_CODE, RAW_CODE)


def trimmed(payload: bytes) -> bytes:
    """The payload as MAVLink 2 sends it."""
    return payload.rstrip(b"\0") or payload[:1]


def _raw(origin: Origin) -> bytes:
    writer = _head(RAW_CODE, origin)
    payload = trimmed(origin.payload)
    writer.unsigned(origin.message_id, 7)
    writer.unsigned(len(payload), 5)
    for value in payload:
        writer.put(value, 8)
    return writer.bytes()


def _head(code: int, origin: Origin) -> BitWriter:
    writer = BitWriter()
    writer.put(code, REQUEST_BITS)
    writer.flag(origin.home_item)
    _write_ids(writer, origin.source, STATIONS)
    return writer


def _short(origin: Origin, target: tuple[int, int]) -> bytes:
    writer = _head(COMMAND_CODE, origin)
    is_int = origin.message_id == COMMAND_INT
    layout = _INT if is_int else _LONG
    if len(origin.payload) > layout.size:
        raise ValueError(f"a command's payload has at most {layout.size} bytes")
    fields = layout.unpack(origin.payload.ljust(layout.size, b"\0"))
    command = fields[7]
    writer.flag(is_int)
    writer.put(COMMANDS.index(command) if command in COMMANDS else _OTHER, 5)
    if command not in COMMANDS:
        writer.put(command, 16)
    _write_ids(writer, fields[8:10], (target,))
    if is_int:
        _write_reals(writer, (*fields[:4], fields[6]))
        _write_place(writer, fields[4], fields[5])
        _write_frame(writer, fields[10], fields[11], fields[12])
    else:
        _write_reals(writer, fields[:7])
        _write_byte(writer, fields[10])
    return writer.bytes()


def _read_long(reader: BitReader, command: int, to: tuple[int, int]) -> bytes:
    reals = _read_reals(reader, 7)
    return _LONG.pack(*reals, command, *to, _read_byte(reader))


def _read_int(reader: BitReader, command: int, to: tuple[int, int]) -> bytes:
    reals = _read_reals(reader, 5)
    x, y = _read_place(reader)
    return _INT.pack(*reals[:4], x, y, reals[4], command, *to, *_read_frame(reader))


# ---- parts ----------------------------------------------------------------------------------------------------------


def _write_ids(writer: BitWriter, ids: tuple[int, int], known: tuple[tuple[int, int], ...]) -> None:
    """A pair of system and component: its place among the known ones in as few bits as they need, the pair itself behind the last."""
    index = known.index(ids) if ids in known else len(known)
    writer.put(index, len(known).bit_length())
    if index == len(known):
        writer.put(ids[0] << 8 | ids[1], 16)


def _read_ids(reader: BitReader, known: tuple[tuple[int, int], ...]) -> tuple[int, int]:
    index = reader.get(len(known).bit_length())
    if index < len(known):
        return known[index]
    ids = reader.get(16)
    return ids >> 8, ids & 0xFF


def _write_reals(writer: BitWriter, words: tuple[int, ...]) -> None:
    """How many there are up to the last that is not zero, then these."""
    count = max((index + 1 for index, word in enumerate(words) if word), default=0)
    writer.put(count, 3)
    for word in words[:count]:
        _write_real(writer, word)


def _read_reals(reader: BitReader, total: int) -> list[int]:
    count = reader.get(3)
    if count > total:
        raise BitsError("too many parameters")
    return [*(_read_real(reader) for _ in range(count)), *([0] * (total - count))]


def _write_real(writer: BitWriter, word: int) -> None:
    """A REAL32 given by its bits: '0' zero, '10' whole, '110' tenths, '1110' NaN, '1111' raw. So an arming fits into three bytes."""
    if word == 0:
        writer.flag(False)
        return
    whole, tenths = _exact(word, 1.0), _exact(word, 10.0)
    if whole is not None:
        writer.put(0b10, 2)
        writer.signed(whole, 2)
    elif tenths is not None:
        writer.put(0b110, 3)
        writer.signed(tenths, 5)
    elif word == _NAN_BITS:
        writer.put(0b1110, 4)
    else:
        writer.put(0b1111, 4)
        writer.put(word, 32)


def _read_real(reader: BitReader) -> int:
    if not reader.flag():
        return 0
    if not reader.flag():
        return _word(_small(reader.signed(2)))
    if not reader.flag():
        return _word(_small(reader.signed(5)) / 10.0)
    return reader.get(32) if reader.flag() else _NAN_BITS


def _small(number: int) -> int:
    if abs(number) > 10 * _MAX_SMALL:
        raise BitsError("no such number")
    return number


def _word(value: float) -> int:
    return int.from_bytes(struct.pack("<f", value), "little")


def _exact(word: int, scale: float) -> int | None:
    """The small whole number that, divided by the scale, is these very bits."""
    (value,) = struct.unpack("<f", word.to_bytes(4, "little"))
    if not abs(value) <= _MAX_SMALL:
        return None
    number = round(value * scale)
    return number if _word(number / scale) == word else None


def _write_byte(writer: BitWriter, value: int) -> None:
    writer.flag(value != 0)
    if value:
        writer.put(value, 8)


def _read_byte(reader: BitReader) -> int:
    return reader.get(8) if reader.flag() else 0


def _write_place(writer: BitWriter, x: int, y: int) -> None:
    """Both zero, or whole: a go-to is rare, and must not depend on where each end thinks the vessel is."""
    writer.flag(x != 0 or y != 0)
    if x or y:
        writer.put(x & 0xFFFF_FFFF, 32)
        writer.put(y & 0xFFFF_FFFF, 32)


def _read_place(reader: BitReader) -> tuple[int, int]:
    if not reader.flag():
        return 0, 0
    x, y = reader.get(32), reader.get(32)
    return x - (x >> 31 << 32), y - (y >> 31 << 32)


def _write_frame(writer: BitWriter, frame: int, current: int, autocontinue: int) -> None:
    known = frame in COMMAND_FRAMES
    writer.put(COMMAND_FRAMES.index(frame) if known else len(COMMAND_FRAMES), 3)
    if not known:
        writer.put(frame, 8)
    _write_byte(writer, current)
    _write_byte(writer, autocontinue)


def _read_frame(reader: BitReader) -> tuple[int, int, int]:
    index = reader.get(3)
    frame = COMMAND_FRAMES[index] if index < len(COMMAND_FRAMES) else reader.get(8)
    return frame, _read_byte(reader), _read_byte(reader)
