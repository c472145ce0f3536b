"""A depth map: soundings made into a compact grid that errs shallow and says when it does not know.

A cell holds the shallowest sounding within ``spread_m`` of any of its points, so that no interpolation between
soundings can find less water than the map shows; where no sounding is that near, the depth is unknown. Depths are
metres below chart datum, positive down, kept as whole centimetres rounded to the shallow side: two bytes per cell.
"""

from __future__ import annotations

import itertools
import math
import struct
import zlib
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.geodesy import SEMI_MAJOR_AXIS_M, metres_per_radian
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.units import wrap_pi

UNKNOWN_CM: Final = -32768
"""What a cell holds whose depth is unknown."""
DEEPEST_CM: Final = 32767
"""The most that a cell's 16 bits hold: 327 m, and no boat that needs a guard minds more."""
_MAGIC: Final = b"USVDEPTH"
_HEADER: Final = struct.Struct("<8sHddddIII")
_VERSION: Final = 1
"""Of the file's format; raised with it."""
CELLS_MAX: Final = 8_000_000
"""Largest grid, 16 MB."""
_SAMPLES_MAX: Final = 2000
"""Of one leg, when asked how much of it is known: a leg of 5 km on cells of 5 m."""


@dataclass(frozen=True, slots=True)
class Sounding:
    """One charted depth, m below datum (negative: dries)."""

    lat_rad: float
    lon_rad: float
    depth_m: float


def offset(lat_rad: float, lon_rad: float, north_m: float, east_m: float) -> LatLon:
    """Position ``north_m`` and ``east_m`` from another, good to centimetres within 5 km."""
    middle = lat_rad + 0.5 * north_m / metres_per_radian(lat_rad)[0]
    per_lat = metres_per_radian(middle)[0]
    sag_m = 0.5 * east_m * east_m * math.tan(lat_rad) / SEMI_MAJOR_AXIS_M
    lat = lat_rad + (north_m - sag_m) / per_lat
    return LatLon((lat, lon_rad + east_m / metres_per_radian(lat)[1]))


class DepthGrid:
    """A grid in latitude and longitude. Build with ``build`` or ``from_bytes``."""

    def __init__(
        self,
        lat0_rad: float,
        lon0_rad: float,
        dlat_rad: float,
        dlon_rad: float,
        rows: int,
        columns: int,
        cells: array[int],
    ) -> None:
        self.rows, self.columns = rows, columns
        self.lat0_rad, self.lon0_rad = lat0_rad, lon0_rad
        self.dlat_rad, self.dlon_rad = dlat_rad, dlon_rad
        self._cells = cells
        self.pitch_m = dlat_rad * metres_per_radian(lat0_rad)[0]

    def depth_at(self, lat_rad: float, lon_rad: float) -> float | None:
        """Charted depth, m below datum; None = unknown."""
        row = math.floor((lat_rad - self.lat0_rad) / self.dlat_rad)
        # from the western edge eastwards, so that either side of the 180th meridian finds the chart
        column = math.floor((lon_rad - self.lon0_rad) % math.tau / self.dlon_rad)
        if not (0 <= row < self.rows and 0 <= column < self.columns):
            return None
        value = self._cells[row * self.columns + column]
        return None if value == UNKNOWN_CM else value / 100.0

    def plane(self, state: EstimatedState) -> Callable[[float, float], float | None] | None:
        """The map in the plane of a vessel's state: (north, east) in m to depth. Good within a kilometre or so of it."""
        lat_rad, lon_rad, x_m, y_m = state.lat_rad, state.lon_rad, state.x_m, state.y_m
        if lat_rad is None or lon_rad is None or x_m is None or y_m is None:
            return None
        per_lat, per_lon = metres_per_radian(lat_rad)

        def depth_at(north_m: float, east_m: float) -> float | None:
            return self.depth_at(lat_rad + (north_m - x_m) / per_lat, lon_rad + (east_m - y_m) / per_lon)

        return depth_at

    def known_share(self) -> float:
        """Share of the cells with a known depth, 0...1."""
        return 1.0 - self._cells.count(UNKNOWN_CM) / len(self._cells)

    def depths_m(self) -> tuple[float, float] | None:
        """The least and the greatest charted depth, m below datum; None where none is known."""
        known = [cell for cell in self._cells if cell != UNKNOWN_CM]
        return (min(known) / 100.0, max(known) / 100.0) if known else None

    def to_bytes(self) -> bytes:
        """A compact file: header, compressed cells, CRC-32 of all before it."""
        body = zlib.compress(self._cells.tobytes(), 6)
        head = _HEADER.pack(
            _MAGIC,
            _VERSION,
            self.lat0_rad,
            self.lon0_rad,
            self.dlat_rad,
            self.dlon_rad,
            self.rows,
            self.columns,
            len(body),
        )
        return head + body + struct.pack("<I", zlib.crc32(head + body))

    @classmethod
    def from_bytes(cls, data: bytes) -> DepthGrid:
        """Read what ``to_bytes`` wrote; ``ValueError`` says what is wrong with anything else."""
        if len(data) < _HEADER.size + 4 or not data.startswith(_MAGIC):
            raise ValueError("not a depth grid")
        if zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
            raise ValueError("depth grid is damaged (checksum)")
        _, version, lat0, lon0, dlat, dlon, rows, columns, size = _HEADER.unpack_from(data)
        if version != _VERSION:
            raise ValueError(f"depth grid of version {version}, this program reads {_VERSION}")
        cells = array("h", zlib.decompress(data[_HEADER.size : _HEADER.size + size]))
        if len(cells) != rows * columns:
            raise ValueError("depth grid has the wrong size")
        return cls(lat0_rad=lat0, lon0_rad=lon0, dlat_rad=dlat, dlon_rad=dlon, rows=rows, columns=columns, cells=cells)


def build(
    soundings: Iterable[Sounding],
    pitch_m: float = 5.0,
    spread_m: float = 10.0,
    cell_rad: tuple[float, float] | None = None,
) -> DepthGrid:
    """Make a grid: ``pitch_m`` per cell, each sounding counting for all that is within ``spread_m``, the least depth winning.

    ``cell_rad`` (latitude, longitude): each depth is a chart's cell of this size, and counts for all of it instead; where such
    cells are large, so are the grid's (a quarter of them).
    """
    points = [s for s in soundings if math.isfinite(s.depth_m)]
    if not points:
        raise ValueError("no soundings")
    middle = math.fsum(s.lat_rad for s in points) / len(points)
    per_lat, per_lon = metres_per_radian(middle)
    high_m, wide_m = (0.0, 0.0) if cell_rad is None else (cell_rad[0] * per_lat, cell_rad[1] * per_lon)
    pitch_m = max(pitch_m, 0.25 * min(high_m, wide_m))
    dlat, dlon = pitch_m / per_lat, pitch_m / per_lon
    reach = math.ceil(max(0.5 * high_m, 0.5 * wide_m, 0.0 if cell_rad else spread_m) / pitch_m) + 1
    lat0 = min(s.lat_rad for s in points) - reach * dlat
    lon0 = min(s.lon_rad for s in points) - reach * dlon
    rows = math.ceil((max(s.lat_rad for s in points) - lat0) / dlat) + reach
    columns = math.ceil((max(s.lon_rad for s in points) - lon0) / dlon) + reach
    if rows * columns > CELLS_MAX:
        raise ValueError(
            f"{rows} x {columns} cells is more than {CELLS_MAX}: choose a larger pitch_m, or a chart of less"
            " water (one side of the 180th meridian only)"
        )
    cells = array("h", [UNKNOWN_CM]) * (rows * columns)
    for s in points:
        row, column, value = (s.lat_rad - lat0) / dlat, (s.lon_rad - lon0) / dlon, _centimetres(s.depth_m)
        if cell_rad is None:
            _spread(cells, columns, row, column=column, value=value, reach=spread_m / pitch_m)
        else:
            half = 0.5 * high_m / pitch_m, 0.5 * wide_m / pitch_m
            _fill(cells, columns, (row, column), half, value)
    return DepthGrid(
        lat0_rad=lat0, lon0_rad=lon0, dlat_rad=dlat, dlon_rad=dlon, rows=rows, columns=columns, cells=cells
    )


def _centimetres(depth_m: float) -> int:
    """Whole centimetres, to the shallow side (a hair of tolerance keeps 4.10 m at 410)."""
    return max(UNKNOWN_CM + 1, min(DEEPEST_CM, math.floor(depth_m * 100.0 + 1e-6)))


def _spread(cells: array[int], columns: int, row: float, column: float, value: int, reach: float) -> None:
    """Lower every cell that any point within ``reach`` (in cells) of (row, column) lies in."""
    for i in range(math.floor(row - reach), math.floor(row + reach) + 1):
        gap = max(i - row, row - (i + 1), 0.0)
        half = math.sqrt(max(reach * reach - gap * gap, 0.0))
        for j in range(math.floor(column - half), math.floor(column + half) + 1):
            at = i * columns + j
            if cells[at] == UNKNOWN_CM or value < cells[at]:
                cells[at] = value


def _fill(cells: array[int], columns: int, middle: tuple[float, float], half: tuple[float, float], value: int) -> None:
    """Lower every cell that a rectangle reaches into; a hair less, so that a border is not shared."""
    (row, column), (high, wide) = middle, half
    for i in range(math.floor(row - high + 1e-6), math.floor(row + high - 1e-6) + 1):
        for j in range(math.floor(column - wide + 1e-6), math.floor(column + wide - 1e-6) + 1):
            at = i * columns + j
            if cells[at] == UNKNOWN_CM or value < cells[at]:
                cells[at] = value


@dataclass(frozen=True, slots=True)
class PlanLeg:
    """The way that one plan item asks for: corner points (lat, lon) in rad."""

    seq: int
    points_rad: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class PlanProblem:
    """The first item of a plan that the map forbids."""

    seq: int
    reason: str


def check_plan(grid: DepthGrid, legs: Sequence[PlanLeg], least_depth_m: float) -> PlanProblem | None:
    """Hold every leg against the map; return the first item that crosses less than ``least_depth_m`` of charted depth.

    Unknown water is not refused: a map rarely covers all.
    """
    for leg in legs:
        for i, point in enumerate(leg.points_rad):
            shallow_m = _shallower(grid, leg.points_rad[max(i - 1, 0)], point, least_depth_m)
            if shallow_m is not None:
                return PlanProblem(leg.seq, f"charted depth {shallow_m:.1f} m, at least {least_depth_m:.1f} m needed")
    return None


def _shallower(
    grid: DepthGrid, start: tuple[float, float], end: tuple[float, float], least_depth_m: float
) -> float | None:
    """The first charted depth below ``least_depth_m`` along a straight leg, sampled at half the grid's pitch."""
    high, wide = _travel(start, end)
    rows, columns = high / grid.dlat_rad, wide / grid.dlon_rad
    count = max(1, math.ceil(2.0 * math.hypot(rows, columns)))
    for turn_rad in (-math.tau, 0.0, math.tau):
        first, last = _span(grid, (start[0], start[1] + turn_rad), rows, columns)
        for i in range(math.floor(first * count), math.ceil(last * count) + 1):
            share = min(max(i / count, 0.0), 1.0)
            depth_m = grid.depth_at(start[0] + share * high, start[1] + share * wide)
            if depth_m is not None and depth_m < least_depth_m:
                return depth_m
    return None


def _travel(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
    """From one place to another, rad of latitude and longitude: the short way round, as it is sailed."""
    return end[0] - start[0], wrap_pi(end[1] - start[1])


def _span(grid: DepthGrid, start: tuple[float, float], rows: float, columns: float) -> tuple[float, float]:
    """The share of a leg that can lie on the grid; (1, 0) when none can."""
    low, high = 0.0, 1.0
    for at, travel, size in (
        ((start[0] - grid.lat0_rad) / grid.dlat_rad, rows, grid.rows),
        ((start[1] - grid.lon0_rad) / grid.dlon_rad, columns, grid.columns),
    ):
        if travel == 0.0:
            if not 0.0 <= at <= size:
                return 1.0, 0.0
            continue
        enter, leave = sorted((-at / travel, (size - at) / travel))
        low, high = max(low, enter), min(high, leave)
    return (low, high) if low <= high else (1.0, 0.0)


def unknown_share(grid: DepthGrid, legs: Sequence[PlanLeg]) -> float:
    """Share of a plan's way, by length, on which the map knows no depth, 0...1."""
    unknown_m = total_m = 0.0
    for leg in legs:
        for start, end in itertools.pairwise(leg.points_rad):
            high, wide = _travel(start, end)
            per_lat, per_lon = metres_per_radian(start[0])
            length_m = math.hypot(high * per_lat, wide * per_lon)
            count = min(max(1, math.ceil(2.0 * length_m / grid.pitch_m)), _SAMPLES_MAX)
            missing = 0
            for i in range(count):
                share = (i + 0.5) / count
                missing += grid.depth_at(start[0] + share * high, start[1] + share * wide) is None
            unknown_m += length_m * missing / count
            total_m += length_m
    return unknown_m / total_m if total_m > 0.0 else 0.0
