"""The line layer: what is a sentence, what is damage, and that damage costs only itself."""

from __future__ import annotations

import functools
import operator

import pytest

from companion.core.nmea.line import BODY_MAX, LineReader, checksum, frame

HDT = b"$GPHDT,92.40,T*3A\r\n"
GGA = b"$GPGGA,102436.00,4111.1007380,N,00842.3729240,W,2,10,0.9,2.10,M,52.30,M,4.0,0129*5F\r\n"


def read(data: bytes, **options: bool) -> tuple[list[str], LineReader]:
    reader = LineReader(**options)
    return reader.receive(data), reader


@pytest.mark.parametrize("body", [b"", b"A", b"GPHDT,92.40,T", bytes(range(256)), b"x" * BODY_MAX])
def test_checksum_is_the_xor_of_all_bytes(body: bytes) -> None:
    assert checksum(body) == functools.reduce(operator.xor, body, 0)


def test_frame_is_what_the_reader_accepts() -> None:
    assert frame("GPHDT,92.40,T") == HDT
    assert read(frame("GPHDT,92.40,T"))[0] == ["GPHDT,92.40,T"]


@pytest.mark.parametrize("end", [b"\r\n", b"\n", b"\r", b"\n\r", b"", b"   ", b"\x00"])
def test_any_line_end_or_none(end: bytes) -> None:
    bodies, _ = read(HDT.strip() + end + HDT.strip() + end)
    assert bodies == ["GPHDT,92.40,T"] * 2


def test_glued_sentences_are_both_read() -> None:
    bodies, _ = read(HDT.strip() + GGA.strip())
    assert [body[:5] for body in bodies] == ["GPHDT", "GPGGA"]


@pytest.mark.parametrize("kept", range(1, len(GGA) - 2))
def test_row_25_a_cut_sentence_loses_only_itself(kept: int) -> None:
    bodies, reader = read(GGA[:kept] + HDT)
    assert bodies[-1] == "GPHDT,92.40,T"
    assert len(bodies) == 1 + (kept == len(GGA) - 2)
    assert reader.counters.sentences == len(bodies)


@pytest.mark.parametrize("bit", range(8))
def test_row_25_no_flipped_bit_gets_through(bit: int) -> None:
    """Every single-bit error in every byte of a sentence: dropped, and the next sentence is read."""
    for index in range(len(GGA) - 2):
        spoiled = bytearray(GGA)
        spoiled[index] ^= 1 << bit
        bodies, _ = read(bytes(spoiled) + HDT)
        good = [body for body in bodies if body.startswith("GPGGA")]
        # Only the checksum's letter case is not information: '5F' and '5f' are the same number.
        assert not good or bytes(spoiled).upper() == GGA.upper()
        assert bodies[-1] == "GPHDT,92.40,T"


def test_row_27_without_line_ends_the_buffer_stays_bounded_and_the_next_start_is_found() -> None:
    reader = LineReader()
    for _ in range(1000):
        assert reader.receive(b"$GPGGA," + b"1" * 1000) == []
    assert reader.receive(HDT) == ["GPHDT,92.40,T"]
    assert reader.counters.too_long == 1000


def test_row_58_lines_of_82_and_of_10000_characters() -> None:
    long_body = "GPTXT," + "x" * 100
    bodies, reader = read(frame(long_body) + frame("GPTXT," + "y" * 10_000) + HDT)
    assert bodies == [long_body, "GPHDT,92.40,T"]
    assert reader.counters.too_long == 1


@pytest.mark.parametrize(
    ("line", "counter"),
    [
        (b"$GPHDT,92.40,T*3B\r\n", "bad_checksum"),
        (b"$GPHDT,92.40,T\r\n", "no_checksum"),
        (b"$GPHDT,92.40,T*\r\n", "no_checksum"),
        (b"$GPHDT,92.40,T*3\r\n", "no_checksum"),
        (b"$GPHDT,92.40,T*GG\r\n", "bad_checksum"),
        (b"$GPHDT,92.40,T* A\r\n", "bad_checksum"),
        (b"$GPHDT,92.40,T*+3\r\n", "bad_checksum"),
        (frame("GPHDT,92.40,T").replace(b"T*", b"\x00*").replace(b"3A", b"6E"), "not_text"),
        (b"$GPHDT,\xff\xff92.40,T*3A\r\n", "not_text"),
        (b"$*00\r\n", "not_text"),
    ],
)
def test_row_58_each_damage_has_its_counter(line: bytes, counter: str) -> None:
    bodies, reader = read(line + HDT)
    assert bodies == ["GPHDT,92.40,T"]
    assert getattr(reader.counters, counter) == 1


def test_lower_case_checksums_count() -> None:
    assert read(HDT.replace(b"3A", b"3a"))[0] == ["GPHDT,92.40,T"]


def test_sentences_without_checksum_only_on_request() -> None:
    assert read(b"$GPHDT,92.40,T\r\n$GPHDT,1.00,T$GPHDT,2.00,T*\r\n", checksum_required=False)[0] == ["GPHDT,92.40,T"]
    assert read(b"$GPHDT,92.40,T*00\r\n", checksum_required=False)[0] == []


def test_tag_blocks_are_taken_off() -> None:
    tag = b"s:compass,c:1700000000"
    block = b"\\%b*%02X\\" % (tag, checksum(tag))
    bodies, reader = read(block + HDT + block + GGA)
    assert [body[:5] for body in bodies] == ["GPHDT", "GPGGA"]
    assert reader.counters.tag_blocks == 2
    assert reader.counters.bad_checksum == reader.counters.no_checksum == reader.counters.noise_bytes == 0


def test_noise_before_a_sentence_is_counted_and_harmless() -> None:
    bodies, reader = read(b"2014-08-01T00:00:00 " + HDT + b"\x00\xff garbage \r\n" + HDT)
    assert len(bodies) == 2
    assert reader.counters.noise_bytes == 20 + 11


def test_ais_sentences_are_sentences() -> None:
    body = "AIVDM,1,1,,A,13aI8e?P00PGpU:NR6s00?vT2000,0"
    assert read(frame(body).replace(b"$", b"!"))[0] == [body]
