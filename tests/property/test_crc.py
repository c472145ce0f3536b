"""Both ways to a checksum agree, and with the published check values."""

from __future__ import annotations

from fastcrc import crc8, crc16
from hypothesis import given, strategies as st

from mavlink_bridge.crc import mcrf4xx, smbus, table_mcrf4xx, table_smbus


def test_check_values():
    assert mcrf4xx(b"123456789") == table_mcrf4xx(b"123456789") == 0x6F91
    assert smbus(b"123456789") == table_smbus(b"123456789") == 0xF4


@given(st.binary(max_size=300))
def test_the_tables_agree_with_the_library(data):
    assert table_mcrf4xx(data) == crc16.mcrf4xx(data)
    assert table_smbus(data) == crc8.smbus(data)
