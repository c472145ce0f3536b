"""Pieces of which any ``count`` rebuild the whole: a systematic Cauchy Reed-Solomon code over GF(256).

Rows 0...63 are the pieces themselves, rows 64...255 mixtures; any ``count`` different rows are enough, whichever were
lost on the way. Field polynomial x^8 + x^4 + x^3 + x^2 + 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

MAX_PIECES: Final = 64
ROWS: Final = 256
_POLYNOMIAL: Final = 0x11D


def _tables() -> tuple[tuple[int, ...], tuple[int, ...]]:
    powers, logs, value = [0] * 510, [0] * 256, 1
    for exponent in range(255):
        powers[exponent] = powers[exponent + 255] = value
        logs[value] = exponent
        value = value << 1 ^ (_POLYNOMIAL if value & 0x80 else 0)
    return tuple(powers), tuple(logs)


_POWERS, _LOGS = _tables()


def _times(one: int, two: int) -> int:
    return _POWERS[_LOGS[one] + _LOGS[two]] if one and two else 0


def _inverse(value: int) -> int:
    return _POWERS[255 - _LOGS[value]]


def _row(number: int, count: int) -> list[int]:
    """Coefficients of a row; x = row number and y = column are never equal, so the Cauchy element exists."""
    if number < MAX_PIECES:
        return [int(column == number) for column in range(count)]
    return [_inverse(number ^ column) for column in range(count)]


def _add_scaled(target: bytearray, source: bytes | bytearray, factor: int) -> None:
    for at, value in enumerate(source):
        target[at] ^= _times(value, factor)


def piece(parts: tuple[bytes, ...], number: int) -> bytes:
    """Row ``number`` (0...255) of equally long parts. Raises IndexError for a systematic row that does not exist."""
    if number < MAX_PIECES:
        return parts[number]
    mixed = bytearray(len(parts[0]))
    for part, factor in zip(parts, _row(number, len(parts)), strict=True):
        _add_scaled(mixed, part, factor)
    return bytes(mixed)


def rebuild(rows: Mapping[int, bytes], count: int) -> bytes | None:
    """The whole from received rows, None while they are too few. Rows of different lengths give None."""
    numbers = [number for number in rows if number >= MAX_PIECES or number < count][:count]
    if len(numbers) < count or len({len(rows[number]) for number in numbers}) != 1:
        return None
    matrix = [(_row(number, count), bytearray(rows[number])) for number in numbers]
    for column in range(count):
        pivot = next((at for at in range(column, count) if matrix[at][0][column]), None)
        if pivot is None:
            return None
        matrix[column], matrix[pivot] = matrix[pivot], matrix[column]
        _normalise(matrix[column], column)
        for at in range(count):
            if at != column and matrix[at][0][column]:
                _eliminate(matrix[at], matrix[column], column)
    return b"".join(bytes(data) for _, data in matrix)


def _normalise(line: tuple[list[int], bytearray], column: int) -> None:
    coefficients, data = line
    factor = _inverse(coefficients[column])
    for at, value in enumerate(coefficients):
        coefficients[at] = _times(value, factor)
    for at, value in enumerate(data):
        data[at] = _times(value, factor)


def _eliminate(line: tuple[list[int], bytearray], pivot: tuple[list[int], bytearray], column: int) -> None:
    factor = line[0][column]
    for at, value in enumerate(pivot[0]):
        line[0][at] ^= _times(value, factor)
    _add_scaled(line[1], pivot[1], factor)
