"""Recorded NMEA logs as they came: line by line with its own time, and the reader fed as the vessel feeds it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from operator import itemgetter
from pathlib import Path

from companion.core.nmea.reader import NmeaConfig, NmeaReader
from companion.io.links.log_time import timed

POLL_US = 50_000


def log_lines(path: Path) -> list[bytes]:
    """The lines of a log without gpsd's comments."""
    return [line for line in path.read_bytes().splitlines(keepends=True) if not line.startswith(b"#")]


def timed_lines(
    path: Path, gap_us: int = 2_000, line_us: float = 100_000.0, *, spread: bool = False
) -> Iterator[tuple[int, bytes]]:
    """Yield (time, line): by the log's own stamps or UTC; lines of one moment come ``gap_us`` after each other, as over a wire
    that is fast enough for them.

    ``spread``: evenly until the next moment, as on a network of many talkers.
    """
    now_us = 0
    moments = [
        (at_us, [line for _, line in group]) for at_us, group in groupby(timed(log_lines(path), line_us), itemgetter(0))
    ]
    for (at_us, lines), (next_us, _) in zip(moments, [*moments[1:], (moments[-1][0] + 1e6, [])], strict=True):
        room_us = (next_us - at_us) / len(lines)
        step_us = room_us if spread else min(gap_us, 0.9 * room_us)
        for number, line in enumerate(lines):
            now_us = max(round(at_us + number * step_us), now_us)
            yield now_us, line


def replayed(path: Path, config: NmeaConfig, gap_us: int = 2_000) -> tuple[NmeaReader, list[tuple[int, object]]]:
    """Everything that a reader makes of a log, polled at 20 Hz in between."""
    reader = NmeaReader(config)
    found: list[tuple[int, object]] = []
    poll_us = now_us = 0
    for now_us, line in timed_lines(path, gap_us):
        while poll_us + POLL_US <= now_us:
            poll_us += POLL_US
            found += [(poll_us, item) for item in reader.poll(poll_us)]
        found += [(now_us, item) for item in reader.receive(line, now_us)]
    for step in range(1, 21):
        found += [(now_us + step * POLL_US, item) for item in reader.poll(now_us + step * POLL_US)]
    return reader, found
