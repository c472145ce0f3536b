"""``companion depth convert``: a chart as GeoTIFF or NetCDF, off line, into soundings or the compact grid of the vessel.

The vessel itself reads no such formats: this command needs the extra ``charts`` (rasterio, that is GDAL and PROJ), which knows the
compressions, the coordinate systems and the axes. What a chart does not say must be said on the command line;
nothing is guessed that could make water deeper.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from ..core.guard.depth.grid import Sounding, build, metres_per_radian
from ..settings import ConfigError
from . import MissingExtraError, install_line
from .numbers import number

METRES: Final = {
    "": 1.0,
    "m": 1.0,
    "metre": 1.0,
    "metres": 1.0,
    "meter": 1.0,
    "meters": 1.0,
    "cm": 0.01,
    "dm": 0.1,
    "ft": 0.3048,
    "foot": 0.3048,
    "feet": 0.3048,
    "us survey foot": 1200.0 / 3937.0,
    "fathom": 1.8288,
    "fathoms": 1.8288,
}
_DOWN: Final = ("depth", "soundings")
_UP: Final = ("elevation", "altitude", "height", "topography")
_WGS84: Final = "EPSG:4326"

Place = tuple[float, float, float]
"""Longitude and latitude in degrees, depth in m below datum."""


class ChartError(Exception):
    """A chart that cannot be used as it is, with the reason and the mend."""


def add_convert(actions: Any) -> None:
    """Add the action to ``companion depth``."""
    parser = actions.add_parser("convert", help="GeoTIFF or NetCDF chart to XYZ or .depth", description=__doc__)
    parser.add_argument("chart", type=Path, help="a GeoTIFF, a NetCDF, or anything else that GDAL reads as a raster")
    parser.add_argument("out", type=Path, help=".xyz: longitude latitude depth; .depth: the vessel's compact grid")
    parser.add_argument("--positive", choices=("auto", "up", "down"), default="auto", help="up: heights; down: depths")
    parser.add_argument(
        "--datum",
        type=number(),
        default=0.0,
        metavar="M",
        help="height of the wanted chart datum above the file's zero level (LAT 2 m below mean sea level: -2)",
    )
    parser.add_argument("--variable", metavar="NAME", help="of a NetCDF with several")
    parser.add_argument("--band", type=int, default=1, help="of the raster; default 1")
    parser.add_argument("--crs", metavar="EPSG:N", help="coordinate system of a file that names none")
    parser.add_argument("--unit", choices=sorted(set(METRES) - {""}), help="of the values, when the file names none")
    parser.add_argument("--nodata", type=float, metavar="V", help="a value that means unknown, besides the file's own")
    parser.add_argument(
        "--box", type=number(), nargs=4, metavar=("SOUTH", "WEST", "NORTH", "EAST"), help="keep only this"
    )
    parser.add_argument(
        "--dry", type=number(), default=20.0, metavar="M", help="leave out land higher than this above datum"
    )
    parser.add_argument(
        "--thin", type=number(0.0), default=0.0, metavar="M", help="one sounding per M metres: the shallowest"
    )
    parser.add_argument(
        "--pitch", type=number(0.5, 1000.0), default=5.0, metavar="M", help="cell of a .depth grid; default 5"
    )
    parser.add_argument(
        "--spread", type=number(0.0, 1000.0), default=10.0, metavar="M", help="how far a depth counts; default 10"
    )
    parser.set_defaults(run=_convert)


def _convert(arguments: argparse.Namespace) -> int:
    if importlib.util.find_spec("rasterio") is None:
        raise MissingExtraError(f"converting charts needs rasterio: {install_line('charts')}")
    if arguments.out.suffix not in (".xyz", ".depth"):
        print(f"{arguments.out}: must end in .xyz or .depth", file=sys.stderr)
        return 2
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PendingDeprecationWarning)  # of the library, about its own parts
            places = _thinned(_places(arguments), arguments.thin)
            count = _write(arguments, places)
    except (ChartError, ValueError) as error:
        raise ConfigError(str(arguments.chart), [str(error)]) from None
    print(f"{arguments.out}: {count} depths")
    return 0


def _write(arguments: argparse.Namespace, places: Iterator[Place]) -> int:
    """Write what there is; nothing at all for a chart without a depth. A failure leaves no half file."""
    out: Path = arguments.out
    if out.suffix == ".depth":
        soundings = [Sounding(math.radians(lat), math.radians(lon), depth) for lon, lat, depth in places]
        if not soundings:
            raise ChartError("no depth in it (nodata, land, or outside the box)")
        out.write_bytes(build(soundings, arguments.pitch, arguments.spread).to_bytes())
        return len(soundings)
    count = 0
    temporary = out.with_name(f".{out.name}.new")
    try:
        with temporary.open("w", encoding="utf-8") as file:
            file.write("# longitude latitude depth_m (below chart datum, positive down)\n")
            for lon, lat, depth in places:
                file.write(f"{lon:.8f} {lat:.8f} {math.floor(depth * 100.0 + 1e-6) / 100.0:.2f}\n")
                count += 1
        if not count:
            raise ChartError("no depth in it (nodata, land, or outside the box)")
        temporary.replace(out)
    finally:
        temporary.unlink(missing_ok=True)
    return count


def _places(arguments: argparse.Namespace) -> Iterator[Place]:
    """Every depth of the chart, block by block, in degrees and metres below the wanted datum."""
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError
    from rasterio.warp import transform

    warnings.simplefilter("ignore", NotGeoreferencedWarning)
    try:
        with rasterio.open(_source(rasterio, arguments)) as chart:
            band = arguments.band
            if not 1 <= band <= chart.count:
                raise ChartError(f"no band {band}; it has {chart.count}")
            crs = _crs(chart, arguments)
            sign, unit = _sign(chart, arguments), _unit(chart, arguments)
            scale, offset = chart.scales[band - 1], chart.offsets[band - 1]
            for _, window in chart.block_windows(band):
                rows, columns, values = _known(chart, window, arguments)
                if not values:
                    continue
                easts, norths = _centres(chart.transform, rows, columns)
                lons, lats = (easts, norths) if crs == _WGS84 else transform(crs, _WGS84, easts, norths)
                for lon, lat, value in zip(lons, lats, values, strict=True):
                    depth_m = sign * (value * scale + offset) * unit + arguments.datum
                    if _wanted(lon, lat, depth_m, arguments):
                        yield (lon + 180.0) % 360.0 - 180.0, lat, depth_m
    except RasterioError as error:
        raise ChartError(str(error)) from None


def _source(rasterio: Any, arguments: argparse.Namespace) -> str:
    """The data set to open: the file, or one of its variables."""
    path = str(arguments.chart)
    if not arguments.chart.is_file():
        raise ChartError("no such file")
    with rasterio.open(path) as chart:
        names = {name.rsplit(":", 1)[-1]: name for name in chart.subdatasets}
    if not names:
        return path
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


def _sign(chart: Any, arguments: argparse.Namespace) -> float:
    """1 for depths, -1 for heights."""
    if arguments.positive != "auto":
        return 1.0 if arguments.positive == "down" else -1.0
    tags = {key.lower(): str(text).lower() for key, text in chart.tags(arguments.band).items()}
    if tags.get("positive") in ("down", "up"):
        return 1.0 if tags["positive"] == "down" else -1.0
    words = " ".join([tags.get(key, "") for key in ("standard_name", "long_name", "netcdf_varname", "description")])
    words += f" {(chart.descriptions[arguments.band - 1] or '').lower()}"
    down, up = any(word in words for word in _DOWN), any(word in words for word in _UP)
    if down == up:
        raise ChartError("it does not say whether its values are heights or depths: --positive up or --positive down")
    return 1.0 if down else -1.0


def _unit(chart: Any, arguments: argparse.Namespace) -> float:
    name = arguments.unit or chart.units[arguments.band - 1] or chart.tags(arguments.band).get("units", "")
    try:
        return METRES[name.strip().lower()]
    except KeyError:
        raise ChartError(f"unit {name!r} is not known; say it with --unit") from None


def _known(chart: Any, window: Any, arguments: argparse.Namespace) -> tuple[list[int], list[int], list[float]]:
    """Rows, columns and values of a block where the chart knows something."""
    block = chart.read(arguments.band, window=window, masked=True).astype("float64")
    mask = block.mask | ~_finite(block.data)
    if arguments.nodata is not None:
        mask = mask | (block.data == arguments.nodata)
    rows, columns = (~mask).nonzero()
    values = block.data[rows, columns]
    return (rows + window.row_off).tolist(), (columns + window.col_off).tolist(), values.tolist()


def _finite(data: Any) -> Any:
    import numpy

    return numpy.isfinite(data)


def _centres(transform: Any, rows: list[int], columns: list[int]) -> tuple[list[float], list[float]]:
    a, b, c, d, e, f = transform[:6]
    pairs = [(column + 0.5, row + 0.5) for row, column in zip(rows, columns, strict=True)]
    return [a * x + b * y + c for x, y in pairs], [d * x + e * y + f for x, y in pairs]


def _wanted(lon: float, lat: float, depth_m: float, arguments: argparse.Namespace) -> bool:
    if not (math.isfinite(lon) and math.isfinite(lat) and -90.0 <= lat <= 90.0 and depth_m >= -arguments.dry):
        return False
    if arguments.box is None:
        return True
    south, west, north, east = arguments.box
    return bool(south <= lat <= north and (lon - west) % 360.0 <= (east - west) % 360.0)


def _thinned(places: Iterator[Place], spacing_m: float) -> Iterator[Place]:
    """The shallowest of every square of ``spacing_m``, where it is; all with a spacing of 0."""
    if spacing_m <= 0.0:
        yield from places
        return
    least: dict[tuple[int, int], Place] = {}
    per_lat, per_lon = 0.0, 0.0
    for place in places:
        if not per_lat:
            per_lat, per_lon = metres_per_radian(math.radians(place[1]))
        key = (
            math.floor(math.radians(place[1]) * per_lat / spacing_m),
            math.floor(math.radians(place[0]) * per_lon / spacing_m),
        )
        if key not in least or place[2] < least[key][2]:
            least[key] = place
    yield from least.values()
