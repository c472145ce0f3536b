"""Rows of control.csv as a replay compares them: which are whole, and when two fields are the same for another kind of machine."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from ..io.log_file import parts_of
from ..io.recording.recorder import CONTROL_COLUMNS, CONTROL_WIDTHS

COLUMNS: Final = tuple(CONTROL_COLUMNS.split(","))
_COMMAS: Final = tuple(width - 1 for width in CONTROL_WIDTHS)
_NEAR: Final = 1e-4
_NEAR_DEG: Final = 1.01e-8
"""Of a position: the last digit that is written, 1 mm."""


def nearly(name: str, was: str, now: str) -> bool:
    """Whether two fields differ no more than another machine's or another Python's arithmetic makes them.

    The last bit of a coordinate is a nanometre, and feedback makes more of it: 1e-4 of a field or of its unit (0.1 mm,
    0.0001 degrees, Nm or m/s) is below all that matters.
    """
    try:
        a, b = float(was), float(now)
    except ValueError:
        return False
    if name.startswith("us_"):
        return abs(a - b) <= 1.0
    if name in {"lat_deg", "lon_deg"}:
        return abs(a - b) <= _NEAR_DEG
    return abs(a - b) <= _NEAR * max(abs(a), abs(b), 1.0)


def control_rows(run_dir: Path) -> Iterator[tuple[int, bytes]]:
    """Yield (tick, line) of control.csv and its parts; what was cut, damaged or written by another version is left out."""
    for path in parts_of(run_dir / "control.csv"):
        with path.open("rb") as file:
            for line in itertools.islice(file, 1, None):
                tick = line.split(b",", 2)[1:2]
                if line.count(b",") in _COMMAS and tick[0].isdigit() and line.endswith(b"\n"):
                    yield int(tick[0]), line


def fields_of(line: bytes) -> list[str]:
    """The fields of a row, as written."""
    return line.decode(errors="replace").rstrip("\n").split(",")
