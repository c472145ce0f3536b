"""AIS sentences that are cut, spoiled, shuffled and mixed: no exception, bounded memory, and no position that nobody sent."""

from __future__ import annotations

import functools
import operator
import random
import re
from dataclasses import dataclass

import pytest

from companion.core.ais import AisReceiver, PositionReport
from companion.core.ais.assembly import SETS_MAX
from companion.core.ais.receiver import ReceivedReport, is_ais
from companion.core.nmea.line import LineReader, checksum
from companion.core.traffic.table import TRACKS_MAX, Table
from sitl.traffic import encoder

GOOD = [
    "AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5P000,0",
    "AIVDM,1,1,,A,13`l7@?P?w<tSF0l4Q@>4?wqP000,0",
    "AIVDM,1,1,,A,13`l7@7OwvOH9JPGT?l>3h1oP000,0",
    "AIVDM,1,1,,A,B3rl@;h0<on2AN5q4Nhr;wV40000,0",
    "AIVDM,1,1,,A,H3rl@;iHDhDU8t00000000000000,0",
    "AIVDM,1,1,,A,H3rl@;lT00000003CHIi000h5210,0",
    "AIVDM,1,1,,A,C3rl@WP0?Wn2jh5q0r06T60PP:V628NT000000000000?0P21100,0",
    "AIVDM,1,1,,A,E>jap6N62Td7Rah;P0000000000?d2b0;j1l000000N01000000000000000,4",
    "AIVDM,1,1,,A,91b6u6@UQOOH;;0GTjP721h00000,0",
    "AIVDM,1,1,,A,K3`l7@8OcW3121Rl,0",
    "AIVDM,2,1,3,A,53`kBd@0000044444404i0P40000000000000016<Pj::0000<TSm51DQ0CH,0",
    "AIVDM,2,2,3,A,PESp0PPPPPP,2",
]


def line(body: str) -> bytes:
    return b"!%b*%02X\r\n" % (body.encode(), checksum(body.encode()))


class Ear:
    """A line reader and a receiver behind it, as on a sensor link."""

    def __init__(self) -> None:
        self.lines = LineReader()
        self.receiver = AisReceiver()

    def hear(self, data: bytes, now_us: int = 0) -> list[ReceivedReport]:
        found: list[ReceivedReport] = []
        for body in self.lines.receive(data):
            fields = body.split(",")
            if is_ais(fields[0]):
                found += self.receiver.sentence(fields, now_us)
        return found


def positions(found: list[ReceivedReport]) -> set[tuple[int, float | None, float | None]]:
    return {(r.report.mmsi, r.report.lat_rad, r.report.lon_rad) for r in found if isinstance(r.report, PositionReport)}


TRUE = positions(Ear().hear(b"".join(map(line, GOOD))))


def mutated(rng: random.Random) -> bytes:
    """A line that is wrong on its way: bytes flipped, lost, added, or cut; the checksum of before."""
    data = bytearray(line(rng.choice(GOOD)))
    for _ in range(rng.randrange(0, 4)):
        place = rng.randrange(len(data))
        match rng.randrange(4):
            case 0:
                data[place] ^= 1 << rng.randrange(8)
            case 1:
                del data[place]
            case 2:
                data.insert(place, rng.randrange(256))
            case _:
                del data[place : place + rng.randrange(1, 30)]
        if not data:
            break
    return bytes(data)


def resummed(rng: random.Random) -> bytes:
    """A sentence that was cut before its checksum was made: the sum is right, the length is not."""
    body = rng.choice(GOOD).split(",")
    payload = body[5]
    body[5] = payload[: rng.randrange(len(payload))] if rng.random() < 0.5 else payload + "0" * rng.randrange(2, 40)
    return line(",".join(body))


SUMMED = re.compile(rb"[!$]([^!$*\r\n]*)\*([0-9A-Fa-f]{2})")
LONG_ENOUGH = {"1": 28, "2": 28, "3": 28, "9": 28, "B": 28, "C": 52, "K": 16}
"""Characters of a whole position report, by the first of its payload."""


def rightly_summed(data: bytes) -> list[list[str]]:
    """The fields of every sentence in some bytes whose sum is right, as the test reads it; one may begin with a dollar."""
    found = []
    for body, two in SUMMED.findall(data):
        if functools.reduce(operator.xor, body, 0) == int(two, 16):
            found.append(body.decode("latin-1").split(","))
    return found


@dataclass
class Storm:
    """What a receiver made of spoiled lines."""

    lines: int = 0
    positions: int = 0
    from_bad_sums: int = 0
    from_wrong_lengths: int = 0
    most_open_sets: int = 0
    most_tracks: int = 0


def storm(count: int, seed: int) -> Storm:
    rng, ear, table, clock_us, seen = random.Random(seed), Ear(), Table(600.0), 0, Storm()
    tail = b""
    for _ in range(count):
        clock_us += rng.randrange(0, 400_000)
        data = mutated(rng)
        tail = (tail + data)[-400:]
        for received in ear.hear(data, clock_us):
            if isinstance(received.report, PositionReport) and received.report.has_position:
                seen.positions += 1
                told = rightly_summed(tail)
                seen.from_bad_sums += not told
                seen.from_wrong_lengths += not any(is_whole(fields) for fields in told)
                table.take_position(received.report, clock_us, None, None)
        seen.lines += 1
        seen.most_open_sets = max(seen.most_open_sets, ear.receiver.open_sets)
        seen.most_tracks = max(seen.most_tracks, table.count)
    return seen


def is_whole(fields: list[str]) -> bool:
    """Whether a sentence can hold a position report: by itself, and of the length of its type or up to six bits more."""
    payload = fields[5] if len(fields) > 6 else ""
    size = LONG_ENOUGH.get(payload[:1], 0)
    return fields[1:2] == ["1"] and bool(size) and (size <= len(payload) <= size + 1 or payload[0] == "K")


def assert_clean(seen: Storm) -> None:
    assert (seen.from_bad_sums, seen.from_wrong_lengths) == (0, 0), seen
    assert seen.positions > seen.lines / 10, "a storm in which nothing is heard shows nothing"
    assert seen.most_open_sets <= SETS_MAX
    assert seen.most_tracks <= TRACKS_MAX


def test_spoiled_lines_bring_no_exception_and_no_position_of_their_own() -> None:
    assert_clean(storm(4_000, seed=5))


@pytest.mark.soak
def test_a_million_spoiled_lines() -> None:
    seen = storm(1_000_000, seed=6)
    assert_clean(seen)
    assert seen.lines == 1_000_000


def split(number: int, rng: random.Random) -> tuple[tuple[bytes, bytes], tuple[float, float]]:
    """A ship's position in two sentences of one set, and where she is."""
    report = encoder.StationReport(244_000_000 + number, rng.uniform(-1.0, 1.0), rng.uniform(-3.0, 3.0), 5)
    payload = encoder.sentences(report.class_a(), 0).split(b",")[5].decode()
    bodies = [f"AIVDM,2,{n},{number % 10},A,{part},0" for n, part in ((1, payload[:14]), (2, payload[14:]))]
    return (line(bodies[0]), line(bodies[1])), (report.lat_rad, report.lon_rad)


def test_parts_of_two_ships_never_make_one() -> None:
    """Sets that cross each other, a third of the parts lost, and the same sequence number again after 5 s."""
    rng, ear, waiting, heard = random.Random(9), Ear(), b"", 0
    true: dict[int, tuple[float, float]] = {}
    for number in range(3_000):
        (first, second), true[244_000_000 + number] = split(number, rng)
        sent = [part for part in (first, waiting) if rng.random() > 0.33]
        waiting = second
        for mmsi, lat_rad, lon_rad in positions(ear.hear(b"".join(sent), number * 500_000)):
            heard += 1
            assert true[mmsi] == pytest.approx((lat_rad, lon_rad), abs=1e-7)
        assert ear.receiver.open_sets <= SETS_MAX
    assert 1_000 < heard < 1_700


def test_what_was_cut_before_its_sum_was_made_gives_no_position() -> None:
    rng, ear = random.Random(2), Ear()
    for number in range(3_000):
        found = ear.hear(resummed(rng), number * 3_000_000)
        # type 27 filled to a whole slot is legal, and anything of five bits more
        assert positions(found) <= TRUE, found
    assert ear.receiver.damaged > 2_000


def test_random_payloads_bring_no_exception() -> None:
    rng, ear = random.Random(3), Ear()
    legal = [chr(code) for code in (*range(0x30, 0x58), *range(0x60, 0x78))]
    for number in range(3_000):
        payload = "".join(rng.choices(legal, k=rng.randrange(1, 72)))
        count = rng.randrange(1, 10)
        body = f"AIVDM,{count},{rng.randrange(1, count + 1)},{rng.randrange(10)},A,{payload},{rng.randrange(6)}"
        ear.hear(line(body), number * 1_000)
        assert ear.receiver.open_sets <= SETS_MAX


def test_the_same_bytes_in_any_pieces_give_the_same_reports() -> None:
    data = b"".join(map(line, GOOD))
    whole = Ear().hear(data)
    assert len(whole) == len(GOOD)  # two sentences make one message, type 19 two reports
    for seed in range(20):
        rng, ear, found, rest = random.Random(seed), Ear(), [], data
        while rest:
            size = rng.randrange(1, 60)
            found += ear.hear(rest[:size])
            rest = rest[size:]
        assert found == whole
    assert [report for byte in [Ear()] for at in range(len(data)) for report in byte.hear(data[at : at + 1])] == whole
