"""A raster chart as GDAL reads it: which part, where on the earth, which sign and unit. Read in small blocks, never whole.

Nothing is guessed that could make water deeper: what a chart does not say must be said on the command line.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

METRES: Final = {
    **dict.fromkeys(("", "m", "metre", "metres", "meter", "meters"), 1.0),
    "cm": 0.01,
    "dm": 0.1,
    **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
    "us survey foot": 1200.0 / 3937.0,
    **dict.fromkeys(("fathom", "fathoms"), 1.8288),
}
DOWN: Final = ("depth", "soundings")
UP: Final = ("elevation", "altitude", "height", "topography")
_WGS84: Final = "EPSG:4326"
_BLOCK: Final = 500_000
"""Cells read at once: 4 MB as numbers, and some ten times that while they are worked on."""
_GDAL_CACHE_MB: Final = 32
_SAME: Final = 6e-6
"""Share by which a value may differ from the one that means unknown: a raster keeps seven digits of it, a message shows six."""
_STEPS: Final = 64
"""An edge is looked at in so many places: on a chart of 1000 km it bends by some metres between two."""
_TURNS: Final = (0.0, 360.0, -360.0)
"""By which the same longitude may be told: charts count from -180 to 180 or from 0 to 360."""

_SEEN: Final = 0.49
"""Share of a cell of which a box must hold more before the cell's middle lies in it."""


class ChartError(Exception):
    """A chart that cannot be used as it is, with the reason and the mend."""


@dataclass(frozen=True, slots=True)
class Block:
    """What is known in one part of a chart: arrays of degrees, and of metres below the wanted datum."""

    lat_deg: Any
    lon_deg: Any
    depth_m: Any
    raw: Any
    """The values as they stand in the file."""
    cells: int
    """Cells that the part has, known or not."""
    north_left_deg: float = math.inf
    """Nothing that comes after this part lies north of it."""


class ChartSource:
    """An open chart. ``lat_cell_deg`` and ``lon_cell_deg``: extent of one cell, of a turned one of its box."""

    def __init__(self, chart: Any, arguments: argparse.Namespace) -> None:
        self._chart, self._arguments = chart, arguments
        band = arguments.band
        if not 1 <= band <= chart.count:
            raise ChartError(f"no band {band}; it has {chart.count}")
        self._crs = _crs(chart, arguments)
        self._plain = self._crs == _WGS84
        self.sign, self.sign_said = _sign(chart, arguments)
        self.unit_name, self._unit = _unit(chart, arguments)
        self._scale, self._offset = chart.scales[band - 1], chart.offsets[band - 1]
        self._window = self._wanted()
        self.total = self._window[2] * self._window[3]
        """Cells to be read."""
        self.lat_cell_deg, self.lon_cell_deg = self._extent()

    def blocks(self) -> Iterator[Block]:
        """Every part of the chart, or of the box, from the north."""
        row0, column0, rows, columns = self._window
        wide = min(columns, _BLOCK)
        high = max(1, _BLOCK // wide)
        for row in range(row0, row0 + rows, high):
            tall = min(high, row0 + rows - row)
            below = self._bounds(row + tall, column0, rows + row0 - row - tall, columns)[2]
            for column in range(column0, column0 + columns, wide):
                broad = min(wide, column0 + columns - column)
                left = below if column + broad == column0 + columns else math.inf
                yield replace(self._block(row, column, tall, broad), north_left_deg=left)

    def bounds_deg(self) -> tuple[float, float, float, float]:
        """South, west, north, east of what is read, with the cells' own extent; west from -180 on, east of the meridian beyond 180."""
        south, west, north, east = self._bounds(*self._window)
        west, east = _turned(west, east, 0.5 * self.lon_cell_deg)
        return south, west, north, east

    def box_deg(self) -> tuple[float, float, float, float]:
        """The same of what is kept: no more than the box and a cell around it."""
        south, west, north, east = self.bounds_deg()
        if self._arguments.box is None:
            return south, west, north, east
        low, left, high, right = self._arguments.box
        high_deg, wide_deg = self.lat_cell_deg, self.lon_cell_deg
        south, north = max(south, low - high_deg), min(north, high + high_deg)
        turn = next((turn for turn in _TURNS if left + turn <= east and right + turn >= west), None)
        if turn is not None and left <= right:
            west, east = max(west - turn, left - wide_deg), min(east - turn, right + wide_deg)
        west, east = _turned(west, east, wide_deg)
        return south, west, north, east

    def in_unit(self, raw: Any) -> Any:
        """What values of the file stand for, in the unit that it names: a file may keep whole numbers of a finer one."""
        return raw * self._scale + self._offset

    def _bounds(self, row: int, column: int, rows: int, columns: int) -> tuple[float, float, float, float]:
        """The same of a part, from its row and column."""
        steps = [k / _STEPS for k in range(_STEPS + 1)]
        edge = [(share, end) for share in steps for end in (0.0, 1.0)] + [
            (end, share) for share in steps for end in (0, 1)
        ]
        lats, lons = self._to_degrees(
            [row + down * rows for down, _ in edge], [column + across * columns for _, across in edge]
        )
        return min(lats), min(lons), max(lats), max(lons)

    def _block(self, row: int, column: int, rows: int, columns: int) -> Block:
        import numpy
        from rasterio.windows import Window

        arguments = self._arguments
        window = Window(column, row, columns, rows)
        read = self._chart.read(arguments.band, window=window, masked=True)
        values = read.data.astype("float64")
        known = numpy.isfinite(values) & ~numpy.ma.getmaskarray(read)
        if arguments.nodata is not None:
            known &= abs(values - arguments.nodata) > _SAME * abs(arguments.nodata)
        down, across = known.nonzero()
        raw = values[down, across]
        depth_m = self.sign * self.in_unit(raw) * self._unit + arguments.datum
        depth_m = numpy.maximum(depth_m, -arguments.dry)  # land must not become unknown water
        lat_deg, lon_deg = self._places(down + row + 0.5, across + column + 0.5)
        kept = numpy.isfinite(lat_deg) & numpy.isfinite(lon_deg) & (abs(lat_deg) <= 90.0)
        if arguments.box is not None:
            south, west, north, east = arguments.box
            kept &= (lat_deg >= south) & (lat_deg <= north) & ((lon_deg - west) % 360.0 <= (east - west) % 360.0)
        lon_deg = (lon_deg + 180.0) % 360.0 - 180.0
        return Block(lat_deg[kept], lon_deg[kept], depth_m[kept], raw, rows * columns)

    def _places(self, rows: Any, columns: Any) -> tuple[Any, Any]:
        import numpy
        from rasterio.warp import transform

        a, b, c, d, e, f = self._chart.transform[:6]
        east, north = a * columns + b * rows + c, d * columns + e * rows + f
        if self._plain or not len(rows):
            return north, east
        lon_deg, lat_deg = transform(self._crs, _WGS84, east, north)
        return numpy.asarray(lat_deg), numpy.asarray(lon_deg)

    def _to_degrees(self, rows: list[float], columns: list[float]) -> tuple[list[float], list[float]]:
        import numpy

        lats, lons = self._places(numpy.array(rows, dtype="float64"), numpy.array(columns, dtype="float64"))
        return [float(each) for each in lats], [_near(float(each), float(lons[0])) for each in lons]

    def _wanted(self) -> tuple[int, int, int, int]:
        """First row and column, rows and columns of what is to be read: with a box only what lies in it."""
        from rasterio.warp import transform_bounds
        from rasterio.windows import from_bounds

        chart, box = self._chart, self._arguments.box
        whole = 0, 0, chart.height, chart.width
        transform = chart.transform
        if box is None or transform.b or transform.d or box[3] < box[1]:
            return whole  # a turned chart, or a box across the 180th meridian: looked through cell by cell
        south, west, north, east = box
        if self._plain:
            turn = _turn(west, east, chart.bounds, abs(transform.a))
            bounds = west + turn, south, east + turn, north
        else:
            bounds = transform_bounds(_WGS84, self._crs, left=west, bottom=south, right=east, top=north)
        left, low, right, high = bounds
        if transform.e > 0.0:
            low, high = high, low
        window = from_bounds(left, low, right, high, transform)
        row, column = max(0, math.floor(window.row_off) - 1), max(0, math.floor(window.col_off) - 1)
        last_row = min(chart.height, math.ceil(window.row_off + window.height) + 1)
        last_column = min(chart.width, math.ceil(window.col_off + window.width) + 1)
        if last_row <= row or last_column <= column:
            raise ChartError("no depth in it (the box lies outside the chart)")
        return row, column, last_row - row, last_column - column

    def _extent(self) -> tuple[float, float]:
        row, column, rows, columns = self._window
        most_lat = most_lon = 0.0
        for down in (0, rows // 2, rows - 1):
            for across in (0, columns // 2, columns - 1):
                corners = [(row + down + i, column + across + k) for i in (0, 1) for k in (0, 1)]
                lats, lons = self._to_degrees([float(i) for i, _ in corners], [float(k) for _, k in corners])
                most_lat, most_lon = max(most_lat, max(lats) - min(lats)), max(most_lon, max(lons) - min(lons))
        if not (0.0 < most_lat < 10.0 and 0.0 < most_lon < 10.0):
            raise ChartError("its cells have no sensible size; is --crs right?")
        return most_lat, most_lon


@contextlib.contextmanager
def opened(arguments: argparse.Namespace) -> Iterator[ChartSource]:
    """Open a chart. Raises ChartError with the reason and the mend."""
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)  # of the library, about its own parts
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        try:
            with rasterio.Env(GDAL_CACHEMAX=_GDAL_CACHE_MB), rasterio.open(_path(rasterio, arguments)) as chart:
                yield ChartSource(chart, arguments)
        except RasterioError as error:
            raise ChartError(str(error)) from None


def _turned(west: float, east: float, spare_deg: float) -> tuple[float, float]:
    """The same span, from -180 degrees on; ``spare_deg``: so much of it may lie before the meridian."""
    turns = 360.0 * math.floor((west + spare_deg + 180.0) / 360.0)
    return west - turns, east - turns


def _near(lon_deg: float, other_deg: float) -> float:
    """The same longitude, less than half a turn from another."""
    apart = lon_deg - other_deg
    return other_deg + (apart + 180.0) % 360.0 - 180.0 if abs(apart) > 180.0 and math.isfinite(apart) else lon_deg


def _turn(west: float, east: float, bounds: Any, cell_deg: float) -> float:
    """By which a box lies on a chart that counts otherwise. Raises ChartError for a box of which both ends of the chart hold a part."""
    shared = {turn: min(east + turn, bounds.right) - max(west + turn, bounds.left) for turn in _TURNS}
    most, second = sorted(_TURNS, key=lambda turn: shared[turn], reverse=True)[:2]
    least_deg = _SEEN * cell_deg
    if shared[second] > least_deg and east - west - shared[most] > least_deg:
        edge = (bounds.left + 180.0) % 360.0 - 180.0
        raise ChartError(
            f"the box lies on both sides of {edge:.5f} degrees, where the chart begins and ends: "
            "choose one on each side, into a file each"
        )
    return most


def _path(rasterio: Any, arguments: argparse.Namespace) -> str:
    """The data set to open: the file, or one of its variables."""
    chart: Path = arguments.chart
    if not chart.is_file():
        raise ChartError("no such file")
    with rasterio.open(str(chart)) as opened_chart:
        names = {name.rsplit(":", 1)[-1]: name for name in opened_chart.subdatasets}
    if not names:
        return str(chart)
    if arguments.variable is None:
        raise ChartError(f"several variables; choose one with --variable: {', '.join(sorted(names))}")
    if arguments.variable not in names:
        raise ChartError(f"no variable {arguments.variable}; it has {', '.join(sorted(names))}")
    return str(names[arguments.variable])


def _crs(chart: Any, arguments: argparse.Namespace) -> Any:
    from rasterio.crs import CRS
    from rasterio.errors import CRSError

    try:
        crs = CRS.from_user_input(arguments.crs) if arguments.crs else chart.crs
    except CRSError:
        raise ChartError(f"--crs {arguments.crs}: no such coordinate system") from None
    if crs is None:
        raise ChartError("it names no coordinate system; say it with --crs, such as EPSG:4326 or EPSG:32629")
    if not crs.is_geographic and not crs.is_projected:
        raise ChartError("its coordinate system has no place on the earth; say it with --crs")
    if chart.transform.is_identity:
        raise ChartError("it is not georeferenced")
    return crs


def _sign(chart: Any, arguments: argparse.Namespace) -> tuple[float, str]:
    """1 for depths, -1 for heights; and who said so."""
    if arguments.positive != "auto":
        return (1.0 if arguments.positive == "down" else -1.0), f"--positive {arguments.positive}"
    tags = {key.lower(): str(text).lower() for key, text in chart.tags(arguments.band).items()}
    if tags.get("positive") in ("down", "up"):
        return (1.0 if tags["positive"] == "down" else -1.0), f"positive = {tags['positive']} in the file"
    words = " ".join([tags.get(key, "") for key in ("standard_name", "long_name", "netcdf_varname", "description")])
    words += f" {(chart.descriptions[arguments.band - 1] or '').lower()}"
    down, up = [word for word in DOWN if word in words], [word for word in UP if word in words]
    if bool(down) == bool(up):
        raise ChartError("it does not say whether its values are heights or depths: --positive up or --positive down")
    return (1.0, f"named {down[0]!r}") if down else (-1.0, f"named {up[0]!r}")


def _unit(chart: Any, arguments: argparse.Namespace) -> tuple[str, float]:
    name = arguments.unit or chart.units[arguments.band - 1] or chart.tags(arguments.band).get("units", "")
    try:
        return name.strip().lower() or "m", METRES[name.strip().lower()]
    except KeyError:
        raise ChartError(f"unit {name!r} is not known; say it with --unit") from None
