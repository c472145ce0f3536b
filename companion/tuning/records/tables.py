"""A table of text as a fit reads it: the columns that are asked for, as numbers, row by row.

A byte that a card has lost costs the cell or the row that it stood in, never the record. What is not asked for is not kept: a day at
20 Hz is a million rows.
"""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, TextIO

import numpy as np

Array = Any
Tell = Callable[[str], None]

_OTHER_SEPARATORS: Final = {";": "semicolons", "\t": "tabs"}
"""What spreadsheets part columns by where a comma parts the decimals."""
_NO_TEXT: Final = "\ufffd"
"""Stands for bytes that are no text."""
_STRANGE: Final = 0.3
"""Share of a header from which on it is no text: of UTF-16 it is half, of another country's letters a few."""
_LONGEST: Final = 100_000
"""Characters of a line: what is longer is a hole in a card, and more than the reader of cells bears."""


def header_of(file: Path) -> list[str]:
    """The names of a table's columns. Raises ValueError where it is parted by something else than commas, or is no text."""
    with _opened(file) as opened:
        names = _names(opened)
    told = "".join(names)
    if told.count(_NO_TEXT) > _STRANGE * len(told):
        raise ValueError("its first line is no text in UTF-8: save it as CSV, UTF-8")
    if len(names) == 1 and (by := next((each for each in _OTHER_SEPARATORS if each in names[0]), "")):
        raise ValueError(f"its columns are parted by {_OTHER_SEPARATORS[by]}: write commas, and points in numbers")
    return names


def columns_of(file: Path, wanted: Sequence[str], tell: Tell) -> dict[str, Array]:
    """The named columns as numbers, NaN where a cell holds none. Raises ValueError where no row is as long as the header."""
    found = {name: array("d") for name in wanted}
    with _opened(file) as opened:
        names = _names(opened)
        places = [(len(names) - 1 - names[::-1].index(name), values) for name, values in found.items()]
        lost = _read(csv.reader(_lines(opened)), len(names), places)
    kept = len(next(iter(found.values()), ()))
    if lost.rows and not kept:
        raise ValueError(f"its header names {len(names)} columns, and no row has so many ({lost.first} in the first)")
    if lost.rows:
        tell(f"rows left out for another number of cells than the header has: {lost.rows} of {lost.rows + kept}")
    if lost.cells:
        tell(f"cells left out because bytes in them are lost: {lost.cells} of {kept * len(found)}")
    return {name: np.array(values) for name, values in found.items()}


def _opened(file: Path) -> TextIO:
    return file.open(newline="", encoding="utf-8-sig", errors="replace")


def _names(opened: TextIO) -> list[str]:
    """The names in a header, without the blanks that many write after a comma."""
    return [name.strip() for name in next(csv.reader(_lines(opened, in_cells=True), skipinitialspace=True), [])]


def _lines(opened: TextIO, *, in_cells: bool = False) -> Iterator[str]:
    """Its lines. In a header a cell may go over several; below it a quotation mark without its second is damage, and would swallow rows."""
    for line in opened:
        text = line[:_LONGEST].replace("\0", _NO_TEXT)
        yield text if in_cells or text.count('"') % 2 == 0 else text.replace('"', _NO_TEXT)


class _Lost:
    """What could not be read."""

    rows = 0
    cells = 0
    first = 0
    """Cells of the first such row."""


def _read(rows: Iterable[list[str]], width: int, places: Sequence[tuple[int, array[float]]]) -> _Lost:
    """Put the cells at the places behind each other."""
    lost = _Lost()
    for row in rows:
        if not row:
            continue
        if len(row) < width or any(row[width:]):
            lost.rows += 1
            lost.first = lost.first or len(row)
            continue
        for place, values in places:
            values.append(value := _number(row[place]))
            if math.isnan(value) and _NO_TEXT in row[place]:
                lost.cells += 1
    return lost


def _number(text: str) -> float:
    if not text:
        # without this, a million empty cells are a million exceptions
        return math.nan
    try:
        return float(text)
    except ValueError:
        return math.nan
