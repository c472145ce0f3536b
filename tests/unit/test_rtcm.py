"""Corrections for the GNSS receiver: what QGroundControl cuts comes out whole, and nothing else comes out at all."""

from __future__ import annotations

import random

import pytest

from mavlink_bridge.crc import crc24q
from mavlink_bridge.language import requests as ask
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench, Station

EXAMPLE = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")
"""Message 1005 as the standard prints it (RTCM 10403.3, 4.2)."""


def frame(size, seed=0):
    """A frame of so many bytes in all."""
    body = random.Random(seed).randbytes(size - 6)
    head = b"\xd3" + len(body).to_bytes(2, "big") + body
    return head + crc24q(head).to_bytes(3, "big")


def message(flags, data):
    return dialect.MAVLink_gps_rtcm_data_message(flags & 0xFF, len(data), list(data.ljust(180, b"\0")))


def cut_before_2026(data, sequence):
    """As QGroundControl 3 to 5.0 does: no last empty part, and the fifth part's number runs over into the sequence."""
    if len(data) < 180:
        return [message((sequence & 31) << 3, data)]
    return [
        message(1 | number << 1 | (sequence & 31) << 3, data[start : start + 180])
        for number, start in enumerate(range(0, len(data), 180))
    ]


def cut_since_2026(data, sequence):
    """As QGroundControl's source of 2026 does: 180 whole, an empty last part behind 360 and 540, plain pieces above 720."""
    pieces = [data[start : start + 180] for start in range(0, len(data), 180)]
    if len(data) > 720 or len(pieces) == 1:
        return [message((sequence + number & 31) << 3, piece) for number, piece in enumerate(pieces)]
    if len(data) % 180 == 0 and len(pieces) < 4:
        pieces.append(b"")
    return [message(1 | number << 1 | (sequence & 31) << 3, piece) for number, piece in enumerate(pieces)]


CUTS = [cut_before_2026, cut_since_2026]
SIZES = [25, 179, 180, 181, 359, 360, 361, 539, 540, 541, 719, 720, 721, 900, 1029]


def out(bench):
    return b"".join(
        request.body.data for request in bench.endpoint.requests() if isinstance(request.body, ask.RtcmData)
    )


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("first", [0, 1, 30, 31])
def test_messages_of_every_size_come_out_whole(cut, first):
    bench, wanted = Bench(), b""
    for number, size in enumerate(SIZES * 2):
        data = frame(size, number)
        for part in cut(data, first + number):
            bench.send(part)
        wanted += data
    assert out(bench) == wanted
    assert bench.endpoint.bad_frames == 0


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("size", [180, 360, 540])
def test_each_is_there_as_soon_as_its_last_byte_is(cut, size):
    bench = Bench()
    for part in cut(frame(size), 7):
        if part.len:
            bench.send(part)
    assert out(bench) == frame(size)


@pytest.mark.parametrize("cut", CUTS)
def test_two_stations_at_once_do_not_mix(cut):
    bench = Bench()
    other = Station(254, 190)
    mine = [part for number, size in enumerate(SIZES) for part in cut(frame(size, number), number)]
    theirs = [part for number, size in enumerate(SIZES) for part in cut(frame(size, 100 + number), number)]
    came = []
    for index in range(max(len(mine), len(theirs))):
        for parts, station in ((mine, bench.gcs), (theirs, other)):
            if index < len(parts):
                bench.send(parts[index], station)
                came.append(out(bench))
    whole = [piece for piece in came if piece]
    assert sorted(whole) == sorted(frame(size, base + number) for base in (0, 100) for number, size in enumerate(SIZES))
    assert bench.endpoint.bad_frames == 0


def test_parts_out_of_order_and_the_standards_own_frame():
    bench = Bench()
    parts = cut_before_2026(frame(500), 5)
    for index in (2, 0, 1):
        bench.send(parts[index])
    bench.send(message(0, EXAMPLE))
    assert out(bench) == frame(500) + EXAMPLE


def test_a_lost_part_loses_its_message_and_no_other():
    bench = Bench()
    for number in range(6):
        for index, part in enumerate(cut_before_2026(frame(500, number), number)):
            if (number, index) not in {(1, 1), (3, 0), (4, 2)}:
                bench.send(part)
    assert out(bench) == b"".join(frame(500, number) for number in (0, 2, 5))


@pytest.mark.parametrize(
    "data",
    [
        b"$PASHS,RST\r\n",
        b"$PUBX,41,1,0007,0003,9600,0*10\r\n",
        bytes.fromhex("b5620604040000000200106c"),
        frame(60)[:-1] + bytes([frame(60)[-1] ^ 1]),
        frame(60)[:20] + b"$PASHS,RST\r\n" + frame(60)[32:],
        b"\xd3\xff\xff" + bytes(100),
    ],
    ids=["NMEA", "u-blox NMEA", "UBX", "wrong CRC", "changed", "reserved bits"],
)
def test_nothing_but_a_frame_with_a_right_crc_reaches_the_receiver(data):
    bench = Bench()
    bench.send(message(0, data))
    for part in cut_before_2026(data.ljust(360, b"\0"), 3):
        bench.send(part)
    assert out(bench) == b""
    bench.send(message(0, EXAMPLE + data + EXAMPLE))
    bench.tick()
    assert set(out(bench).split(EXAMPLE)) == {b""}
    assert bench.endpoint.bad_frames >= 1
    assert "Corrections for GNSS refused" in bench.texts()


def test_what_is_told_is_told_rarely():
    bench = Bench()
    for _ in range(300):
        bench.send(message(0, frame(60)[:-1] + b"x"))
        bench.tick(25)
    assert bench.texts().count("refused") == 3
    assert bench.endpoint.bad_frames == 300
