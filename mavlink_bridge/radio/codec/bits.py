"""Bits and variable-length numbers: what the compact codecs are made of.

Signed and unsigned numbers use Exp-Golomb codes of order k, which are short for small values. Floats are MAVLink's 32
bits and come back bit for bit: whole numbers, tenths and NaN have short codes, everything else travels raw.
"""

from __future__ import annotations

import math
import struct
from typing import Final

_NAN_BITS: Final = b"\x00\x00\xc0\x7f"
_MAX_ZEROS: Final = 40


class BitsError(ValueError):
    """A decoder ran out of bits or met a code that no encoder makes."""


def float_bits(value: float) -> bytes:
    """The four bytes of a value as MAVLink sends it. Raises OverflowError for what a REAL32 cannot hold."""
    return struct.pack("<f", value)


class BitWriter:
    """Collects bits, most significant first."""

    __slots__ = ("_count", "_value")

    def __init__(self) -> None:
        self._value = 0
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def put(self, value: int, width: int) -> None:
        """Append ``width`` bits. Raises ValueError when the value does not fit."""
        if not 0 <= value < 1 << width:
            raise ValueError(f"{value} does not fit {width} bits")
        self._value = self._value << width | value
        self._count += width

    def flag(self, on: bool) -> None:
        self.put(1 if on else 0, 1)

    def unsigned(self, value: int, k: int) -> None:
        """Append an Exp-Golomb code of order k."""
        value += 1 << k
        width = value.bit_length()
        self.put(0, width - k - 1)
        self.put(value, width)

    def signed(self, value: int, k: int) -> None:
        self.unsigned(value << 1 if value >= 0 else (-value << 1) - 1, k)

    def real(self, value: float) -> None:
        """Append a REAL32: '00' whole number, '01' tenths, '10' special, '11' raw."""
        wanted = float_bits(value)
        whole = _exact(value, 1.0, wanted)
        tenths = _exact(value, 10.0, wanted)
        if whole is not None:
            self.put(0b00, 2)
            self.signed(whole, 5)
        elif tenths is not None:
            self.put(0b01, 2)
            self.signed(tenths, 5)
        elif wanted == _NAN_BITS:
            self.put(0b10, 2)
        else:
            self.put(0b11, 2)
            self.put(int.from_bytes(wanted, "little"), 32)

    def extend(self, other: BitWriter) -> None:
        """Append all bits of another writer."""
        self._value = self._value << other._count | other._value
        self._count += other._count

    def bytes(self) -> bytes:
        """What was put, filled up with zero bits to whole bytes."""
        size = (self._count + 7) // 8
        return (self._value << (size * 8 - self._count)).to_bytes(size, "big")


def _exact(value: float, scale: float, wanted: bytes) -> int | None:
    """``value * scale`` as a small integer when that gives back the very same four bytes."""
    if not math.isfinite(value) or abs(value) > 100_000.0:
        return None
    number = round(value * scale)
    return number if float_bits(number / scale) == wanted else None


class BitReader:
    """Reads what a ``BitWriter`` made. Raises BitsError at the end of the data."""

    __slots__ = ("_left", "_value")

    def __init__(self, data: bytes) -> None:
        self._value = int.from_bytes(data, "big")
        self._left = len(data) * 8

    @property
    def left(self) -> int:
        """Bits not read yet, the filling included."""
        return self._left

    def get(self, width: int) -> int:
        if width > self._left:
            raise BitsError("too short")
        self._left -= width
        return self._value >> self._left & ((1 << width) - 1)

    def flag(self) -> bool:
        return self.get(1) == 1

    def unsigned(self, k: int) -> int:
        zeros = 0
        while not self.flag():
            zeros += 1
            if zeros > _MAX_ZEROS:
                raise BitsError("no such number")
        return (1 << (k + zeros) | self.get(k + zeros)) - (1 << k)

    def signed(self, k: int) -> int:
        code = self.unsigned(k)
        return code >> 1 if code % 2 == 0 else -((code + 1) >> 1)

    def real(self) -> float:
        kind = self.get(2)
        if kind == 0b00:
            return float(self.signed(5))
        if kind == 0b01:
            return self.signed(5) / 10.0
        raw = _NAN_BITS if kind == 0b10 else self.get(32).to_bytes(4, "little")
        value: float = struct.unpack("<f", raw)[0]
        return value
