"""Both ways to a checksum agree, and with the published check values."""

from __future__ import annotations

from fastcrc import crc8, crc16
from hypothesis import given, strategies as st

from mavlink_bridge.crc import arc, crc24q, mcrf4xx, smbus, table_arc, table_mcrf4xx, table_smbus


def test_check_values():
    assert mcrf4xx(b"123456789") == table_mcrf4xx(b"123456789") == 0x6F91
    assert smbus(b"123456789") == table_smbus(b"123456789") == 0xF4
    assert arc(b"123456789") == table_arc(b"123456789") == 0xBB3D


@given(st.binary(max_size=300))
def test_the_tables_agree_with_the_library(data):
    assert table_mcrf4xx(data) == crc16.mcrf4xx(data)
    assert table_smbus(data) == crc8.smbus(data)
    assert table_arc(data) == crc16.arc(data)


def divided(data: bytes, polynomial: int = 0x1864CFB) -> int:
    """The remainder of the long division that a CRC-24Q is, bit by bit, as the standard defines it."""
    number = int.from_bytes(data, "big") << 24
    while (length := number.bit_length()) > 24:
        number ^= polynomial << length - 25
    return number


@given(st.binary(max_size=64))
def test_crc_24q_is_the_standards_division(data):
    assert crc24q(data) == divided(data)


def test_the_standards_own_example_of_a_frame():
    """Message 1005, RTCM 10403.3, 4.2."""
    assert crc24q(bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")) == 0
