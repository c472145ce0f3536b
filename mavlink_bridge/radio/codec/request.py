"""Requests in few bytes: what a ground station asked of the twin, on its way to the vessel.

One code for each kind of request and for each field by its type: positions as degrees * 1e7, other numbers as
MAVLink's REAL32, a parameter by the CRC-16 of its name. Streams of set-points, plans and data for sensors have no
code: they do not cross a slow link this way.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Callable, Iterable
from enum import Enum
from typing import Any, Final

from fastcrc import crc16

from ...language import requests as ask
from .bits import BitReader, BitsError, BitWriter

_KINDS: Final[tuple[type[Any], ...]] = (
    ask.Arm,
    ask.SetMode,
    ask.StartPlan,
    ask.PausePlan,
    ask.SetCurrent,
    ask.Reposition,
    ask.Orbit,
    ask.SetSpeed,
    ask.GuidedHeading,
    ask.SetHomePosition,
    ask.Terminate,
    ask.EnableFence,
    ask.SetParameter,
    ask.Reboot,
    ask.RunPrearmChecks,
    ask.UnlockGuard,
)
"""The place in this table is the code: append, never reorder."""
_KIND_BITS: Final = 5
Resolve = Callable[[int], str | None]


class RequestCodecError(ValueError):
    """Why a request does not cross the radio, or was not understood: one sentence."""


def name_code(name: str) -> int:
    """CRC-16 of a parameter's name."""
    return int(crc16.ibm_3740(name.encode("ascii", "replace")))


def name_codes(names: Iterable[str]) -> dict[int, str]:
    """Names by code. Raises ValueError when two share one."""
    codes: dict[int, str] = {}
    for name in names:
        other = codes.setdefault(name_code(name), name)
        if other != name:
            raise ValueError(f"parameters {name} and {other} have the same code on the radio")
    return codes


OVERRULED: Final = ask.Reply(ask.Result.REJECTED_NOW, "overruled by a stop")


def crosses(body: ask.RequestBody) -> bool:
    """Whether a request has a code."""
    stream = isinstance(body, ask.GuidedHeading) and body.stream
    return type(body) in _KINDS and not stream


def encode_request(body: ask.RequestBody) -> bytes:
    """Raises RequestCodecError for a request without a code."""
    if not crosses(body):
        raise RequestCodecError(f"{type(body).__name__} does not cross the radio link")
    writer = BitWriter()
    writer.put(_KINDS.index(type(body)), _KIND_BITS)
    for field, kind, optional in _fields(type(body)):
        value = getattr(body, field)
        if optional:
            writer.flag(value is not None)
        if value is not None:
            _put(writer, field, kind, value)
    return writer.bytes()


def decode_request(data: bytes, resolve: Resolve) -> ask.RequestBody:
    """``resolve`` finds a parameter's name by its code. Raises RequestCodecError."""
    try:
        reader = BitReader(data)
        code = reader.get(_KIND_BITS)
        if code >= len(_KINDS):
            raise RequestCodecError("a request that this version does not know")
        values: dict[str, Any] = {}
        for field, kind, optional in _fields(_KINDS[code]):
            values[field] = None if optional and not reader.flag() else _get(reader, field, kind, resolve)
        body: ask.RequestBody = _KINDS[code](**values)
    except BitsError as error:
        raise RequestCodecError(f"a request cannot be decoded: {error}") from None
    return body


def _fields(kind: type[Any]) -> list[tuple[str, Any, bool]]:
    """Name, type and whether it may be None, of each field."""
    hints = typing.get_type_hints(kind)
    found = []
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        optional = isinstance(hint, types.UnionType)
        if optional:
            hint = next(item for item in hint.__args__ if item is not type(None))
        found.append((field.name, hint, optional))
    return found


def _put(writer: BitWriter, field: str, kind: Any, value: Any) -> None:
    if kind is bool:
        writer.flag(value)
    elif kind is int:
        writer.signed(value, 4)
    elif kind is str:
        writer.put(name_code(value), 16)
    elif issubclass(kind, Enum):
        writer.put(list(kind).index(value), 3)
    elif field in ("lat_rad", "lon_rad"):
        writer.put(round(math.degrees(value) * 1e7) & 0xFFFF_FFFF, 32)
    else:
        writer.real(value)


def _get(reader: BitReader, field: str, kind: Any, resolve: Resolve) -> Any:
    if kind is bool:
        return reader.flag()
    if kind is int:
        return reader.signed(4)
    if kind is str:
        name = resolve(reader.get(16))
        if name is None:
            raise RequestCodecError("no such parameter on the vessel")
        return name
    if issubclass(kind, Enum):
        members = list(kind)
        index = reader.get(3)
        if index >= len(members):
            raise BitsError("no such choice")
        return members[index]
    if field in ("lat_rad", "lon_rad"):
        number = reader.get(32)
        angle_deg = (number - (1 << 32) if number >> 31 else number) / 1e7
        if abs(angle_deg) > (90.0 if field == "lat_rad" else 180.0):
            raise BitsError("no such place")
        return math.radians(angle_deg)
    value = reader.real()
    if not math.isfinite(value):
        raise BitsError(f"{field} is no number")
    return value
