"""Requests in few bytes: what a ground station asked of the twin, on its way to the vessel.

Which number stands for which request, and its fields with their form and order, is said on the code page (``wire``). Streams
of set-points, plans and data for sensors have no row there: they do not cross a slow link this way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, Final, assert_never

from fastcrc import crc16

from ...language import requests as ask
from ...language.figures import Figure, Hover, figure_of
from ...language.messages import LoiterDirection
from ...language.units import e7_to_deg, rad_to_e7
from .bits import BitReader, BitsError, BitWriter
from .wire import FIGURE, LOITER_DIRECTION, MODE, REQUEST_BITS, REQUESTS, Form

_NUMBERS: Final = {row.kind: number for number, row in REQUESTS.items()}
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
    return type(body) in _NUMBERS and not stream


def encode_request(body: ask.RequestBody) -> bytes:
    """Raises RequestCodecError for a request without a code."""
    if not crosses(body):
        raise RequestCodecError(f"{type(body).__name__} does not cross the radio link")
    writer = BitWriter()
    number = _NUMBERS[type(body)]
    writer.put(number, REQUEST_BITS)
    for field in REQUESTS[number].fields:
        value = getattr(body, field.name)
        if field.optional:
            writer.flag(value is not None)
        if value is not None:
            _put(writer, field.form, value)
    return writer.bytes()


def decode_request(data: bytes, resolve: Resolve) -> ask.RequestBody:
    """``resolve`` finds a parameter's name by its code. Raises RequestCodecError."""
    try:
        reader = BitReader(data)
        row = REQUESTS.get(reader.get(REQUEST_BITS))
        if row is None:
            raise RequestCodecError("a request that this version does not know")
        values: dict[str, Any] = {}
        for field in row.fields:
            values[field.name] = None if field.optional and not reader.flag() else _get(reader, field.form, resolve)
        body: ask.RequestBody = row.kind(**values)
    except BitsError as error:
        raise RequestCodecError(f"a request cannot be decoded: {error}") from None
    return body


def _put(writer: BitWriter, form: Form, value: Any) -> None:
    match form:
        case Form.FLAG:
            writer.flag(value)
        case Form.WHOLE:
            writer.signed(value, 4)
        case Form.REAL:
            writer.real(value)
        case Form.NAME:
            writer.put(name_code(value), 16)
        case Form.LATITUDE | Form.LONGITUDE:
            writer.put(rad_to_e7(value) & 0xFFFF_FFFF, 32)
        case Form.MODE:
            writer.put(MODE.number(value), MODE.bits)
        case Form.FIGURE:
            _put_figure(writer, value)
        case _:
            assert_never(form)


def _get(reader: BitReader, form: Form, resolve: Resolve) -> Any:
    match form:
        case Form.FLAG:
            return reader.flag()
        case Form.WHOLE:
            return reader.signed(4)
        case Form.REAL:
            return _finite(reader.real())
        case Form.NAME:
            return _resolved(reader.get(16), resolve)
        case Form.LATITUDE:
            return _angle_rad(reader.get(32), 90.0)
        case Form.LONGITUDE:
            return _angle_rad(reader.get(32), 180.0)
        case Form.MODE:
            return MODE.member(reader.get(MODE.bits))
        case Form.FIGURE:
            return _get_figure(reader)
        case _:
            assert_never(form)


_SIZES: Final = ("radius_m", "length_m", "bearing_rad")
"""What a figure may have of sizes, in the order of the air; what it has not is absent."""


def _put_figure(writer: BitWriter, figure: Figure) -> None:
    writer.put(FIGURE.number(type(figure)), FIGURE.bits)
    for name in _SIZES:
        size = getattr(figure, name, None)
        writer.flag(size is not None)
        if size is not None:
            writer.real(size)
    direction = LoiterDirection.CW if isinstance(figure, Hover) else figure.direction
    writer.put(LOITER_DIRECTION.number(direction), LOITER_DIRECTION.bits)


def _get_figure(reader: BitReader) -> Figure:
    kind = FIGURE.member(reader.get(FIGURE.bits))
    sizes = {name: _finite(reader.real()) if reader.flag() else None for name in _SIZES}
    return figure_of(kind.name, direction=LOITER_DIRECTION.member(reader.get(LOITER_DIRECTION.bits)), **sizes)


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise BitsError("a field is no number")
    return value


def _resolved(code: int, resolve: Resolve) -> str:
    name = resolve(code)
    if name is None:
        raise RequestCodecError("no such parameter on the vessel")
    return name


def _angle_rad(number: int, limit_deg: float) -> float:
    angle_deg = e7_to_deg(number - (1 << 32) if number >> 31 else number)
    if abs(angle_deg) > limit_deg:
        raise BitsError("no such place")
    return math.radians(angle_deg)
