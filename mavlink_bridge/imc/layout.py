"""Fields to bytes and back, in both byte orders, by the annotations of the message's class.

Neighbouring numbers are packed as one ``struct``. What a stranger's bytes may cost is bounded: a message holds at most
``MAX_DEPTH`` messages inside one another, and never more than its packet's 65 535 bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import groupby
from typing import Final, assert_never, get_args, get_type_hints

from .fields import NULL_MESSAGE, Kind, LongRaw, LongText, ManyMessages, Message, OneMessage, Scalar, UnknownMessage

MAX_DEPTH: Final = 8
"""A plan's parameter stands five deep: plan control, plan, manoeuvre, action, parameter. The rest is room."""
MAX_LENGTH: Final = 0xFFFF
_NOTHING: Final = -1
"""No bytes are left to read: an inline message that is not known swallowed them."""

Lookup = Callable[[int], type[Message] | None]


class MalformedError(ValueError):
    """Bytes that are no IMC message."""


@dataclass(frozen=True)
class Numbers:
    """Neighbouring fields of fixed size."""

    names: tuple[str, ...]
    little: struct.Struct
    big: struct.Struct


@dataclass(frozen=True)
class Single:
    """A field whose length is not fixed."""

    name: str
    kind: LongText | LongRaw | OneMessage | ManyMessages
    item: type[Message] = Message
    """What a list holds; Message itself: any."""


Step = Numbers | Single


def kinds_of(message: type[Message]) -> dict[str, Kind]:
    """The fields of a message's class in the wire's order, each with its kind."""
    return {name: get_args(hint)[-1] for name, hint in _hints(message).items()}


def _hints(message: type[Message]) -> dict[str, object]:
    hints = get_type_hints(message, include_extras=True)
    return {field.name: hints[field.name] for field in fields(message)}


def items_of(message: type[Message]) -> dict[str, type[Message]]:
    """Of each list among a message's fields what it holds; Message itself: any."""
    lists = {name: get_args(hint)[0] for name, hint in _hints(message).items() if get_args(hint)[-1] == ManyMessages()}
    return {name: get_args(inner)[0] for name, inner in lists.items()}


_STEPS: Final[dict[type[Message], tuple[Step, ...]]] = {}
"""Made when a class is met for the first time: a start need not wait for all of them."""


def steps_of(message: type[Message]) -> tuple[Step, ...]:
    """How a message is written: numbers in runs, everything else singly."""
    known = _STEPS.get(message)
    if known is None:
        known = _STEPS[message] = _steps(message)
    return known


def _steps(message: type[Message]) -> tuple[Step, ...]:
    found: list[Step] = []
    items = items_of(message)
    for fixed, run in groupby(kinds_of(message).items(), key=lambda item: isinstance(item[1], Scalar)):
        if fixed:
            pairs = [(name, kind.code) for name, kind in run if isinstance(kind, Scalar)]
            code = "".join(letter for _, letter in pairs)
            names = tuple(name for name, _ in pairs)
            found.append(Numbers(names, struct.Struct("<" + code), struct.Struct(">" + code)))
        else:
            found += [
                Single(name, kind, items.get(name, Message)) for name, kind in run if not isinstance(kind, Scalar)
            ]
    return tuple(found)


def write_fields(message: Message, *, big_endian: bool = False) -> bytes:
    """The fields of a message, without number and header.

    Raises ValueError for a value that its field cannot hold, and for an ``UnknownMessage`` inside another message.
    """
    try:
        return b"".join(_pieces(message, big_endian=big_endian))
    except (struct.error, OverflowError) as error:
        raise ValueError(f"{type(message).__name__} cannot be written: {error}") from error


def _pieces(message: Message, *, big_endian: bool) -> list[bytes]:
    if isinstance(message, UnknownMessage):
        return [message.rest]
    found = []
    for step in steps_of(type(message)):
        if isinstance(step, Numbers):
            packer = step.big if big_endian else step.little
            found.append(packer.pack(*(getattr(message, name) for name in step.names)))
        else:
            found.append(_single_out(step, getattr(message, step.name), big_endian=big_endian))
    return found


def _single_out(step: Single, value: object, *, big_endian: bool) -> bytes:
    match step.kind:
        case LongText():
            assert isinstance(value, str)
            return _counted(value.encode("utf-8", "surrogateescape"), big_endian=big_endian)
        case LongRaw():
            assert isinstance(value, bytes)
            return _counted(value, big_endian=big_endian)
        case OneMessage():
            assert value is None or isinstance(value, Message)
            return _inline_out(value, big_endian=big_endian)
        case ManyMessages():
            assert isinstance(value, tuple)
            parts = [_inline_out(item, big_endian=big_endian) for item in value]
            return _u16(len(parts), big_endian=big_endian) + b"".join(parts)
        case _ as never:
            assert_never(never)


def _inline_out(message: Message | None, *, big_endian: bool) -> bytes:
    if message is None:
        return _u16(NULL_MESSAGE, big_endian=big_endian)
    if isinstance(message, UnknownMessage):
        raise ValueError(
            f"message {message.number} is not known: what follows it was not read, so it cannot be written"
        )
    return _u16(message.NUMBER, big_endian=big_endian) + b"".join(_pieces(message, big_endian=big_endian))


def _u16(value: int, *, big_endian: bool) -> bytes:
    return struct.pack(">H" if big_endian else "<H", value)


def _counted(data: bytes, *, big_endian: bool) -> bytes:
    return _u16(len(data), big_endian=big_endian) + data


def read_fields(message: type[Message], data: bytes, lookup: Lookup, *, big_endian: bool = False) -> Message:
    """The message whose fields ``data`` is, exactly. Raises MalformedError."""
    reader = _Reader(data, lookup, big_endian)
    found = reader.message(message, 0)
    if reader.at not in (_NOTHING, len(data)):
        raise MalformedError(f"{message.__name__}: {len(data) - reader.at} bytes too many")
    return found


class _Reader:
    """A place in a message's bytes."""

    def __init__(self, data: bytes, lookup: Lookup, big_endian: bool) -> None:
        self.data = data
        self.at = 0
        self._lookup = lookup
        self._big = big_endian
        self._u16 = struct.Struct(">H" if big_endian else "<H")

    def message(self, wanted: type[Message], depth: int) -> Message:
        """The fields that come next, as a message of a known class."""
        values: dict[str, object] = {}
        for step in steps_of(wanted):
            if self.at == _NOTHING:
                break
            if isinstance(step, Numbers):
                packer = step.big if self._big else step.little
                values.update(zip(step.names, packer.unpack(self._take(packer.size)), strict=True))
            else:
                values[step.name] = self._single(step, depth)
        return wanted(**values)

    def _single(self, step: Single, depth: int) -> object:
        match step.kind:
            case LongText():
                return self._take(self._count()).decode("utf-8", "surrogateescape")
            case LongRaw():
                return self._take(self._count())
            case OneMessage():
                return self._inline(depth)
            case ManyMessages():
                return self._list(step.item, depth)
            case _ as never:
                assert_never(never)

    def _list(self, wanted: type[Message], depth: int) -> tuple[Message, ...]:
        found = []
        for _ in range(self._count()):
            item = self._inline(depth)
            if not isinstance(item, wanted):
                raise MalformedError(f"a list of {wanted.__name__} holds {type(item).__name__}")
            found.append(item)
            if self.at == _NOTHING:
                break
        return tuple(found)

    def _inline(self, depth: int) -> Message | None:
        number = self._count()
        if number == NULL_MESSAGE:
            return None
        wanted = self._lookup(number)
        if wanted is None:
            rest, self.at = self.data[self.at :], _NOTHING
            return UnknownMessage(number, rest)
        if depth >= MAX_DEPTH:
            raise MalformedError(f"more than {MAX_DEPTH} messages inside one another")
        return self.message(wanted, depth + 1)

    def _count(self) -> int:
        return int(self._u16.unpack(self._take(2))[0])

    def _take(self, size: int) -> bytes:
        end = self.at + size
        if end > len(self.data):
            raise MalformedError(f"{end - len(self.data)} bytes are missing")
        piece, self.at = self.data[self.at : end], end
        return piece
