"""Bad inputs (firmware-reliability §B.8) against the whole vessel under way; names hold ``bad_NN``.

One oracle for all: no tick is lost, every pulse stays in 1000...2000, no thrust while disarmed, and the telemetry goes on.
What each input is answered with is the endpoint's own tests' business.
"""

from __future__ import annotations

import itertools
import math
import random
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.io.links.link import Received
from mavlink_bridge.language.requests import Arm, StartPlan

NAN, INF = math.nan, math.inf
INT_MAX, INT_MIN = 2**31 - 1, -(2**31)
ME, HIM = (255, 190), (1, 1)


class Stranger:
    """Packs messages as any station may."""

    def __init__(self, system=255, component=190) -> None:
        self.maker = mav.MAVLink(None, system, component)

    def __call__(self, name: str, *fields: object) -> bytes:
        message = getattr(mav, f"MAVLink_{name}_message")(*fields)
        data = message.pack(self.maker)
        self.maker.seq = (self.maker.seq + 1) % 256
        return data


def long(number, *params, say=None, target=HIM, confirmation=0) -> bytes:
    values = [*params, *([0.0] * (7 - len(params)))]
    return (say or Stranger())("command_long", *target, number, confirmation, *values)


def item(seq, command=16, p1=0.0, p2=0.0, p3=0.0, p4=0.0, x=411850000, y=-87060000, frame=6, kind=0, say=None) -> bytes:
    return (say or Stranger())("mission_item_int", *HIM, seq, frame, command, 0, 1, p1, p2, p3, p4, x, y, 0.0, kind)


def upload(*items: bytes, kind=0, count=None) -> list[bytes]:
    say = Stranger()
    return [say("mission_count", *HIM, len(items) if count is None else count, kind), *items]


BEAT = Stranger()("heartbeat", 6, 8, 0, 0, 4, 3)
RNG = random.Random(8)
COMMANDS = (
    16,
    20,
    21,
    22,
    92,
    112,
    176,
    178,
    179,
    183,
    185,
    192,
    193,
    207,
    211,
    246,
    252,
    300,
    400,
    410,
    511,
    512,
    519,
    42428,
)
HOSTILE = (NAN, INF, -INF, 1e38, -1e38, 5e-324)


def _frames() -> dict[int, list[bytes]]:
    say = Stranger()
    good = long(400, 1.0)
    broken = good[:-1] + bytes([good[-1] ^ 1])
    lengths = [
        bytes([0xFD, n, 0, 0, 1, 255, 190, *struct.pack("<I", i)[:3]]) for n in range(0, 256, 5) for i in (0, 76, 73)
    ]
    v1 = mav.MAVLink(None, 255, 190)
    old = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(v1, force_mavlink1=True)
    return {
        1: [good[:n] for n in range(len(good))],
        2: [broken] * 20,
        3: lengths,
        4: [b"\xfd\xff\x00" + BEAT * 12, BEAT[:9] + b"\xfd\xfd\xfe" + BEAT],
        5: [bytes([0xFD, 4, 0, 0, 1, 255, 190, 0xFF, 0xFF, 0x7F, 1, 2, 3, 4, 5, 6])],
        6: [bytes([0xFD, 4, 0xFE, 0, 1, 255, 190, 0, 0, 0, 1, 2, 3, 4, 5, 6])],
        7: [old, BEAT, old + BEAT],
        8: [bytes([0xFD, 60, 0, 0, 1, 255, 190, 0, 0, 0]) + bytes(62), good[:1] + b"\x01" + good[2:11] + b"\0\0"],
        9: [BEAT * 20, *(BEAT[i : i + 1] for i in range(len(BEAT)))],
        10: [BEAT + broken + BEAT],
        11: [RNG.randbytes(1400) for _ in range(40)],
        12: [RNG.randbytes(64_000), b""],
        13: [BEAT] * 2000,
        16: [good, good, BEAT, good],
        17: [Stranger(1, 1)("heartbeat", 6, 8, 0, 0, 4, 3), long(400, 1.0, say=Stranger(1, 1))],
        18: [long(400, 0.0, 1.0, say=Stranger(system, component)) for system in (0, 255) for component in (0, 190)],
        19: [long(176, 1.0, 10.0, target=target) for target in ((0, 0), (2, 1), (1, 77), (255, 255))],
        20: [Stranger(255 - i % 2)("manual_control", 1, 500, 0, 500, 0, 0) for i in range(40)],
        21: [Stranger(9, 1)("heartbeat", 2, 3, 0, 0, 4, 3)],
        22: [bytes([0xFD, 0, 1, 0, 1, 255, 190, 0, 0, 0, 1, 2]) + RNG.randbytes(13) for _ in range(50)],
        23: [say("setup_signing", *HIM, bytes(range(32)), 2**48 - 1)],
        24: [Stranger(1 + i % 254, i % 250)("heartbeat", 6, 8, 0, 0, 4, 3) for i in range(600)],
    }


def _commands() -> dict[int, list[bytes]]:
    say = Stranger()

    def whole(number, frame, x, y):
        return say("command_int", *HIM, frame, number, 0, 0, 0.0, 0.0, 0.0, 0.0, x, y, 0.0)

    return {
        25: [long(number, *([value] * 7)) for number in COMMANDS for value in HOSTILE if number not in (185, 246)],
        26: [long(number) for number in (1, 999, 31_000, 65_535)],
        27: [whole(192, frame, x, y) for frame in (0, 7, 21, 255) for x, y in ((INT_MAX, INT_MIN), (INT_MIN, 0))],
        28: [long(400, 1.0, 21196.0), long(400, 1.0, 1e9)],
        29: [long(176, 1.0, 4.0, confirmation=i % 256) for i in range(100)],
        30: [say("set_mode", 1, 1, mode) for mode in (77, 2**32 - 1)] + [long(176, 1.0, NAN)],
        31: [long(511, i, us) for i in (0, 30, 33, 70_000) for us in (0.0, -1.0, 1.0, 2.0**31, NAN)],
        32: [long(246, 1.0), long(246, 2.0)],
        33: [long(179, 0.0, 0, 0, 0, lat, lon) for lat, lon in ((0.0, 0.0), (NAN, NAN), (91.0, 0.0), (0.0, 181.0))],
        34: [say("manual_control", 1, a, b, a, b, 0) for a in (32767, -32768, 1001) for b in (32767, -32768)],
        35: [say("manual_control", 1, 700, 0, 500, 700, 0)] * 5,
        36: [
            say("set_position_target_global_int", 0, *HIM, 5, mask, x, y, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN)
            for mask in (0, 0xFFFF, 0x0DF8)
            for x, y in ((INT_MAX, INT_MAX), (0, 0), (-411_850_000, 870_000_000))
        ],
    }


def _plans() -> dict[int, list[bytes]]:
    say = Stranger()
    other = Stranger(7, 190)
    corner = (411850000, -87060000)

    def polygon(count, run, first=None):
        return upload(
            *(item(i, 5001, first if first is not None else count, x=corner[0] + i * i, kind=1) for i in range(run)),
            kind=1,
        )

    return {
        37: [say("mission_count", *HIM, count, kind) for count in (0, 1, 65_535) for kind in (0, 1, 2, 200)],
        38: [*upload(item(2), item(0), item(0), item(9)), item(1, say=other), item(1, kind=1)],
        39: list(
            itertools.chain.from_iterable(
                upload(item(0, p4=bad), item(1, x=x, y=y))
                for bad in (0.0, NAN)
                for x, y in ((900000000, 1800000000), (900000001, 0), (0, 1800000001), (0, 0), (INT_MIN, INT_MIN))
            )
        ),
        40: list(itertools.chain.from_iterable(upload(item(0), item(1, 17, p3=r)) for r in (-1.0, 0.0, NAN, 1e9, INF))),
        41: list(itertools.chain.from_iterable(upload(item(0), item(1, 178, 1.0, v)) for v in (-2.0, NAN, 1e9, -INF))),
        42: [
            *upload(item(0), item(1, 177, 1.0, -1.0)),
            *upload(item(0), item(1, 177, 2.0, -1.0), item(2, 177, 1.0, -1.0)),
        ],
        43: upload(item(0), item(1), item(1), item(1)),
        44: [
            *itertools.chain.from_iterable(polygon(n, n) for n in (0, 1, 2, 70)),
            *polygon(5, 4),
            *polygon(4, 4, -1e10),
            *polygon(4, 4, NAN),
        ],
        45: upload(item(0, 5003, 20.0, x=corner[0] + 100_000, kind=1), kind=1),
        46: [say("mission_count", *HIM, 0, 1), say("mission_clear_all", *HIM, 1)],
        47: [*upload(item(0), item(1), item(2))[:2], say("mission_clear_all", *HIM, 0)],
        48: [say("mission_set_current", *HIM, 65_535), long(224, 65_535.0), long(224, NAN)],
        49: upload(item(0), item(1, x=0, y=1799999999), item(2, x=0, y=-1799999999)),
    }


def _rest() -> dict[int, list[bytes]]:
    say = Stranger()

    def put(name, value, kind=9):
        return say("param_set", *HIM, name, value, kind)

    ftp = [
        struct.pack("<HBBBBBxI", i, 0, op, size, 0, 0, offset) + text
        for i, (op, size, offset, text) in enumerate(
            (
                (4, 24, 0, b"../../../../etc/passwd\0\0"),
                (4, 255, 0, b"a" * 239),
                (5, 0, 2**32 - 1, b""),
                (3, 255, 2**32 - 4, b""),
                (15, 239, 2**32 - 9, b""),
            )
        )
    ]
    return {
        50: [put(b"DEPTH_MIN", value, kind) for value in (*HOSTILE, -0.0) for kind in (1, 6, 9, 10, 200)],
        51: [put(name, 1.0) for name in (b"ABCDEFGHIJKLMNOP", b"", b"\xff\xfe\x00", b"NO_SUCH")],
        52: [say("param_request_read", *HIM, b"", index) for index in (-1, 32_767, -32_768)],
        53: [put(b"DEPTH_MIN", -5.0), put(b"DEPTH_MIN", 1e6), put(b"GATE_THR_MIN", 0.5), put(b"GATE_THR_MAX", -0.5)],
        54: [Stranger(250 + i % 3)("param_request_list", *HIM) for i in range(100)],
        55: [put(b"SYSID_THISMAV", 7.0), put(b"GCS_REQUIRED", 1.0), put(b"GCS_REQUIRED", 0.0)],
        56: [say("file_transfer_protocol", 0, *HIM, (data + bytes(251))[:251]) for data in ftp],
        57: [say("log_request_data", *HIM, 65_535, 2**32 - 1, 2**32 - 1), say("log_request_list", *HIM, 9, 1)],
    }


CASES = {**_frames(), **_commands(), **_plans(), **_rest()}


@pytest.fixture(scope="module")
def trip():
    return under_way()


def under_way():
    from tests.scenario.conftest import Voyage

    made = Voyage()
    made.sail(1.5, (400.0, 0.0), (0.0, 0.0))
    made.run(5.0)
    made.station = made.world.ground("gcs")
    return made


def oracle(trip, seconds):
    ticks, count = trip.snapshot.tick, round(seconds * 20)
    heard = False
    for _ in range(count):
        trip.step()
        pulses = trip.board.pulses_us
        assert all(1000.0 <= pulse <= 2000.0 for pulse in pulses)
        if not trip.snapshot.armed:
            assert (trip.snapshot.output.thruster_port, trip.snapshot.output.thruster_starboard) == (0.0, 0.0)
        heard = any(isinstance(event, Received) for event in trip.station.poll(trip.world.now_us)) or heard
    assert trip.snapshot.tick == ticks + count, "no tick is lost"
    assert heard, "telemetry goes on"
    assert not any("failed (" in text for text in trip.texts), trip.texts[-5:]


def feed(trip, number):
    for data in CASES[number]:
        trip.station.write(0, data)
        if 37 <= number <= 49:
            trip.step()  # a plan is a conversation
    # A source that floods is muted for five seconds; the next input must be heard again.
    oracle(trip, 7.0 if len(CASES[number]) > 30 or number in (12, 13) else 1.5)
    if not trip.snapshot.armed and not trip.snapshot.terminated:
        trip.ask(Arm(arm=True))
        trip.ask(StartPlan(0))


@pytest.mark.parametrize("number", sorted(CASES), ids=lambda number: f"bad_{number:02d}")
def test_bad_input(trip, number):
    feed(trip, number)


def test_the_inputs_do_arrive():
    """So that the oracle above judges something: damage is counted, and nothing is lost to the flood protection for good."""
    trip = under_way()
    for number in sorted(CASES):
        feed(trip, number)
    health = next(link for link in trip.snapshot.links if link.name == "gcs")
    assert health.bad_frames > 5
    assert health.bytes_in > 200_000


def test_bad_59_plans_of_the_seed_that_are_none(trip):
    """On the radio port in its plain protocol JSON is noise; the parser itself has its own tests."""
    radio = trip.world.ground("shore")
    for text in ('{"plan":', "[" * 10_000, '{"a":1e999}', '{"a":NaN}', "x" * 100_000):
        radio.write(0, text.encode("utf-16" if text.startswith("x") else "utf-8"))
    oracle(trip, 1.5)


def test_bad_60_what_the_board_never_says(trip):
    plain = trip.board.step
    words = itertools.cycle(
        (b"\xff\x00garbage\r\n", b"$S,active,9999,9999,9999,9999*00\n", b"USV-ACT 1.0 reset=power\r\n", b"\n" * 300)
    )
    trip.board.step = lambda now_us: plain(now_us) + next(words)
    try:
        oracle(trip, 3.0)
    finally:
        trip.board.step = plain
    oracle(trip, 2.0)
