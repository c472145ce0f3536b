"""Recorded logs come back at their own pace: by the logger's stamps, else by the sentences' UTC."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from companion.core.nmea.line import frame
from companion.io.links.file import FileLink
from companion.io.links.link import Received
from companion.io.links.log_time import logger_stamp_us, timed


def took_s(lines: list[bytes]) -> float:
    return [at_us for at_us, _ in timed(lines, 100_000.0)][-1] / 1e6


def rmc(second: float, talker: str = "GP") -> bytes:
    whole = 3600 * 12 + second
    clock = f"{int(whole // 3600) % 24:02d}{int(whole % 3600 // 60):02d}{whole % 60:05.2f}"
    return frame(f"{talker}RMC,{clock},A,4111.1007,N,00842.3729,W,1.0,90.0,010126,,,A")


@pytest.mark.parametrize(
    ("prefix", "step"),
    [
        (lambda n: f"2014-08-01T23:59:{50 + 0.5 * n:09.6f}Z ", 0.5),
        (lambda n: f"2023-09-01 15:56:{10 + 0.5 * n:06.3f} | DEBUG | recv - ", 0.5),
        (lambda n: f"{1_406_851_200 + 0.5 * n:.3f} ", 0.5),
        (lambda n: f"{1_406_851_200_000 + 500 * n};N;", 0.5),
        (lambda n: f"\\s:GP,c:{1_406_851_200 + n}*00\\", 1.0),
    ],
)
def test_the_loggers_own_stamps_tell_when_a_line_came(prefix, step: float) -> None:
    lines = [prefix(n).encode() + frame("HEHDT,218.5,T") for n in range(19)]
    assert took_s(lines) == pytest.approx(18 * step)


def test_a_sentence_is_no_stamp() -> None:
    assert logger_stamp_us(rmc(1.0)) is None
    assert logger_stamp_us(b"123456,4111.1,N") is None


@pytest.mark.parametrize("apart_s", [0.05, 0.5, 1.0, 1.7])
def test_sentences_of_one_moment_with_different_times_do_not_slow_the_replay(apart_s: float) -> None:
    """Two devices on one line, one behind the other; also one device that stamps its sentences differently."""
    lines = [line for n in range(101) for line in (rmc(n), rmc(n - apart_s, "II"), frame("SDDPT,5.0,0.0"))]
    assert took_s(lines) == pytest.approx(100.0, abs=0.1)


def test_a_log_that_was_joined_or_set_back_goes_on() -> None:
    joined = [rmc(n) for n in range(10)] + [rmc(7200 + n) for n in range(10)]
    assert took_s(joined) == pytest.approx(19.0)
    set_back = [rmc(100 + n) for n in range(10)] + [rmc(82 + n) for n in range(10)]
    assert took_s(set_back) == pytest.approx(18.0, abs=1.0)
    midnight = [rmc(43_195 + n) for n in range(10)]
    assert took_s(midnight) == pytest.approx(9.0)


def test_every_recording_takes_as_long_as_its_clock_says(shared_data: Path) -> None:
    """Where one device's RMC or ZDA runs through the log without a step, the replay takes as long as that clock did."""
    judged = 0
    for path in sorted((shared_data / "nmea").rglob("*.log")):
        lines = [line for line in path.read_bytes().splitlines(keepends=True) if not line.startswith(b"#")]
        times = [int(line[7:9]) * 3600 + int(line[9:11]) * 60 + float(line[11:13]) for line in lines if clocked(line)]
        if len(times) < 10 or any(not 0 <= after - before <= 30 for before, after in itertools.pairwise(times)):
            continue
        judged += 1
        first = next(number for number, line in enumerate(lines) if clocked(line))  # before that nothing tells the time
        assert took_s(lines[first:]) == pytest.approx(times[-1] - times[0], rel=0.03, abs=1.1), path.name
    assert judged >= 25


def clocked(line: bytes) -> bool:
    return line[:6] == b"$GPRMC" and line[7:13].isdigit()


def test_a_file_link_gives_the_lines_at_that_pace(tmp_path: Path) -> None:
    path = tmp_path / "two.nmea"
    path.write_bytes(b"".join(line for n in range(11) for line in (rmc(n), rmc(n - 0.6, "II"))))
    link = FileLink("log", str(path), speed=2.0)
    got = []
    for now_us in range(0, 20_000_000, 50_000):
        got += [now_us for event in link.poll(now_us) if isinstance(event, Received)]
    assert got[-1] == pytest.approx(5_000_000, abs=60_000)
