"""Where a sounding belongs in the depth memory, and what is kept of it: cells of a world-wide grid, held in square tiles.

Rows of cells have one height everywhere; their width in longitude is fixed for each row of tiles, so that cells stay nearly
square at any latitude and a place has one cell, whatever the origin of a run. A tile is one block of bytes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import Final, NamedTuple

from mavlink_bridge.language.geodesy import SEMI_MAJOR_AXIS_M

SIDE: Final = 16
"""Cells along a tile's edge; a power of two."""
_SHIFT: Final = 4
"""Bits of a cell's number within its tile: 2 ** 4 = ``SIDE``."""
_CELL: Final = struct.Struct("<HhffI")
TILE_BYTES: Final = SIDE * SIDE * _CELL.size
_COUNT_MAX: Final = 1000
"""More soundings than this weigh no more: a bottom that changes is learnt in the end."""
_TWICE: Final = 0x8000
"""A bit of a cell's count, which needs ten of its sixteen: a tile of the first releases has it clear."""
PASS_S: Final = 60
"""A sounding so long after the newest one before it belongs to another pass: no false echo, no wobble along an edge lasts so."""
_CM_MAX: Final = 32767
"""The most that 16 bits hold."""
_PINNACLE: Final = 2.0
"""Soundings that make one: the input chain passes a jump when three agree, and the edge of one may lie in the next cell."""
_NO_NOISE: Final = 6.0
"""Times sigma: among a thousand soundings noise does not reach as far."""

TileKey = tuple[int, int]
"""Row and column of a tile."""
CellKey = tuple[int, int]
"""Row and column of a cell; with its row, the column says the longitude."""


class Cell(NamedTuple):
    """What many soundings of one place say. Depths in m below chart datum, positive down."""

    soundings: int
    least_m: float
    """The shallowest sounding, rounded to the shallow centimetre."""
    mean_m: float
    squares: float
    """Sum of the squared deviations from the mean, m^2."""
    last_s: int
    """UTC of the newest sounding, seconds since 1970; 0 = unknown."""
    is_twice: bool = False
    """The shallowest was sounded on two passes."""

    def robust_m(self, sigma_m: float) -> float:
        """The shallow side of the bottom here: the mean less two sigma of what the sounder's noise does not explain.

        Never less than the shallowest sounding, so that one false echo among many does not make a shoal. A pinnacle that was
        sounded is no such echo: it stays, however long the vessel then lies beside it in the same cell, and one that was sounded on two
        passes stays whatever is sounded beside it.
        """
        if self.soundings < 2:
            return self.mean_m
        spread = max(self.squares / (self.soundings - 1) - 2.0 * sigma_m * sigma_m, 0.0)
        if self._shallow_soundings(spread, sigma_m) >= _PINNACLE or (self.is_twice and self._stands_out(sigma_m)):
            return self.least_m
        return max(self.least_m, self.mean_m - 2.0 * math.sqrt(spread))

    def _shallow_soundings(self, spread: float, sigma_m: float) -> float:
        """How many soundings were at the shallowest, if all others were of one deeper bottom; 0 where noise explains it.

        Of a share p at the least and the rest at one depth, variance / (mean - least)^2 is p / (1 - p).
        """
        if not self._stands_out(sigma_m):
            return 0.0
        apart_m = self.mean_m - self.least_m
        return self.soundings * spread / (spread + apart_m * apart_m)

    def _stands_out(self, sigma_m: float) -> bool:
        return self.mean_m - self.least_m > _NO_NOISE * sigma_m

    def _seen_twice(self, later: Cell, alike_m: float) -> bool:
        """Whether the shallowest of both was sounded on two passes; the passes of an unknown time are one."""
        apart_m = later.least_m - self.least_m
        if abs(apart_m) > alike_m:
            return self.is_twice if apart_m > 0.0 else later.is_twice
        is_another = bool(self.last_s and later.last_s) and later.last_s - self.last_s >= PASS_S
        return is_another or self.is_twice or later.is_twice

    def joined(self, other: Cell, alike_m: float = 0.0) -> Cell:
        """Both together, ``other`` being the later one (Chan's update of mean and squares). ``alike_m``: soundings that differ by no more
        are of one bottom.
        """
        count = self.soundings + other.soundings
        share, apart = other.soundings / count, other.mean_m - self.mean_m
        squares = self.squares + other.squares + apart * apart * self.soundings * share
        return Cell(
            count,
            min(self.least_m, other.least_m),
            self.mean_m + share * apart,
            squares,
            max(self.last_s, other.last_s),
            is_twice=self._seen_twice(other, alike_m),
        ).bounded()

    def bounded(self) -> Cell:
        """The same spread, said by no more soundings than count."""
        if self.soundings <= _COUNT_MAX:
            return self
        return self._replace(soundings=_COUNT_MAX, squares=self.squares * _COUNT_MAX / self.soundings)


class Geometry:
    """From positions to cells and back."""

    def __init__(self, cell_m: float) -> None:
        self.cell_m = cell_m
        self.tile_m = cell_m * SIDE
        self.dlat_rad = cell_m / SEMI_MAJOR_AXIS_M
        self._widths: dict[int, float] = {}

    def dlon_rad(self, tile_row: int) -> float:
        """Width of the cells in a row of tiles, rad of longitude."""
        width = self._widths.get(tile_row)
        if width is None:
            cosine = math.cos((tile_row + 0.5) * SIDE * self.dlat_rad)
            width = self._widths[tile_row] = self.dlat_rad / max(cosine, 0.01)
        return width

    def cell_of(self, lat_rad: float, lon_rad: float) -> CellKey:
        row = math.floor(lat_rad / self.dlat_rad)
        return row, math.floor(lon_rad / self.dlon_rad(row >> _SHIFT))

    def column_of(self, lon_rad: float, tile_row: int) -> int:
        """Column of a longitude among the cells of a row of tiles."""
        return math.floor(lon_rad / self.dlon_rad(tile_row))

    def centre(self, row: int, column: int) -> tuple[float, float]:
        """Latitude and longitude of a cell's middle, rad."""
        return (row + 0.5) * self.dlat_rad, (column + 0.5) * self.dlon_rad(row >> _SHIFT)

    def tiles_around(self, lat_rad: float, lon_rad: float, reach_m: float) -> set[TileKey]:
        """Every tile with a point that may be within ``reach_m``."""
        most = int(reach_m // self.tile_m) + 1
        rings = range(-most, most + 1)
        found = set()
        for down in rings:
            tile_row = math.floor(lat_rad / self.dlat_rad / SIDE) + down
            column = math.floor(lon_rad / self.dlon_rad(tile_row) / SIDE)
            found |= {(tile_row, column + across) for across in rings}
        return found


def tile_of(cell: CellKey) -> TileKey:
    return cell[0] >> _SHIFT, cell[1] >> _SHIFT


def get(tile: bytes | bytearray, cell: CellKey) -> Cell | None:
    """What the tile knows of one of its cells."""
    count, least_cm, mean_m, squares, last_s = _CELL.unpack_from(tile, _at(cell))
    return Cell(count & ~_TWICE, least_cm / 100.0, mean_m, squares, last_s, is_twice=count >= _TWICE) if count else None


def put(tile: bytearray, cell: CellKey, what: Cell) -> None:
    least_cm = max(-_CM_MAX, min(_CM_MAX, math.floor(what.least_m * 100.0 + 1e-6)))
    count = what.soundings | (_TWICE if what.is_twice else 0)
    _CELL.pack_into(tile, _at(cell), count, least_cm, what.mean_m, what.squares, what.last_s)


def cells(key: TileKey, tile: bytes | bytearray) -> Iterator[tuple[CellKey, Cell]]:
    """Every cell of a tile that has been sounded."""
    first_row, first_column = key[0] << _SHIFT, key[1] << _SHIFT
    for number, (count, least_cm, mean_m, squares, last_s) in enumerate(_CELL.iter_unpack(tile)):
        if count:
            place = first_row + (number >> _SHIFT), first_column + (number & (SIDE - 1))
            yield place, Cell(count & ~_TWICE, least_cm / 100.0, mean_m, squares, last_s, is_twice=count >= _TWICE)


def sound(tile: bytes) -> bool:
    """Whether bytes from outside can be a tile: right in size, every number finite and in range."""
    if len(tile) != TILE_BYTES:
        return False
    return all(
        count & ~_TWICE <= _COUNT_MAX and abs(mean_m) <= _CM_MAX and 0.0 <= squares < math.inf
        for count, _, mean_m, squares, _ in _CELL.iter_unpack(tile)
    )


def _at(cell: CellKey) -> int:
    return ((cell[0] & (SIDE - 1)) * SIDE + (cell[1] & (SIDE - 1))) * _CELL.size
