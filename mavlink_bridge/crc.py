"""The checksums on the wires: CRC-16/MCRF4XX of MAVLink frames, CRC-16/ARC of IMC packets, CRC-8/SMBUS of the actuator line,
CRC-24Q of RTCM frames.

fastcrc reckons the first three; on PyPy a table does, because there a call into an extension costs more than the whole compiled loop.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

from fastcrc import crc8, crc16


def _stepped(value: int, polynomial: int) -> int:
    """One byte through a reflected shift register."""
    for _ in range(8):
        value = value >> 1 ^ (polynomial if value & 1 else 0)
    return value


_TABLE_16: Final = tuple(_stepped(byte, 0x8408) for byte in range(256))
_TABLE_ARC: Final = tuple(_stepped(byte, 0xA001) for byte in range(256))
_MIRRORED: Final = tuple(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_TABLE_8: Final = tuple(_MIRRORED[_stepped(_MIRRORED[byte], 0xE0)] for byte in range(256))
"""SMBus shifts the other way: 0x07 is 0xE0 seen in a mirror."""


def table_mcrf4xx(data: bytes) -> int:
    """CRC-16/MCRF4XX: polynomial 0x1021 reflected, start 0xFFFF; 0x6F91 for b'123456789'."""
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _TABLE_16[(crc ^ byte) & 0xFF]
    return crc


def table_arc(data: bytes) -> int:
    """CRC-16/ARC: polynomial 0x8005 reflected, start 0; 0xBB3D for b'123456789'."""
    crc = 0
    for byte in data:
        crc = crc >> 8 ^ _TABLE_ARC[(crc ^ byte) & 0xFF]
    return crc


def table_smbus(data: bytes) -> int:
    """CRC-8/SMBUS: polynomial 0x07, start 0; 0xF4 for b'123456789'."""
    crc = 0
    for byte in data:
        crc = _TABLE_8[crc ^ byte]
    return crc


_POLYNOMIAL_24Q: Final = 0x1864CFB


def _stepped_24q(value: int) -> int:
    """One byte, already at the top, through the shift register."""
    for _ in range(8):
        value <<= 1
        if value & 1 << 24:
            value ^= _POLYNOMIAL_24Q
    return value


_TABLE_24Q: Final = tuple(_stepped_24q(byte << 16) for byte in range(256))


def crc24q(data: bytes) -> int:
    """CRC-24Q (RTCM 10403.3, 4.2): polynomial 0x1864CFB, start 0; 0xCDE703 for b'123456789', 0 over a frame with its CRC."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFFFF) ^ _TABLE_24Q[crc >> 16 ^ byte]
    return crc


_IS_PYPY: Final = sys.implementation.name == "pypy"
mcrf4xx: Final[Callable[[bytes], int]] = table_mcrf4xx if _IS_PYPY else crc16.mcrf4xx
arc: Final[Callable[[bytes], int]] = table_arc if _IS_PYPY else crc16.arc
smbus: Final[Callable[[bytes], int]] = table_smbus if _IS_PYPY else crc8.smbus
