"""``companion depth convert``: a chart as GeoTIFF or NetCDF, off line, into soundings or the compact grid of the vessel.

The vessel itself reads no such formats: this command needs the extra ``charts`` (rasterio, that is GDAL and PROJ), which knows the
compressions, the coordinate systems and the axes. What it has understood is printed for its owner to look at, and what
cannot be meant is refused.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.geodesy import metres_per_radian

from ...io.whole_file import whole_file
from ...settings import ConfigError
from .. import MissingExtraError, install_line
from ..numbers import number, whole
from ..outputs import may_write
from ..progress import ProgressLine
from .fill import Fill
from .source import METRES, Block, ChartError, ChartSource, opened
from .tally import BlockTally

_INTERRUPTED: Final = 130
"""Exit status of a program that Ctrl-C has ended, as shells have it."""

Place = tuple[float, float, float]
"""Longitude and latitude in degrees, depth in m below datum."""


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
    parser.add_argument("--band", type=whole(1), default=1, help="of the raster; default 1")
    parser.add_argument("--crs", metavar="EPSG:N", help="coordinate system of a file that names none")
    parser.add_argument("--unit", choices=sorted(set(METRES) - {""}), help="of the values, when the file names none")
    parser.add_argument("--nodata", type=float, metavar="V", help="unknown, besides the file's own: --nodata=-3.4e38")
    parser.add_argument(
        "--box", type=number(), nargs=4, metavar=("SOUTH", "WEST", "NORTH", "EAST"), help="keep only this"
    )
    parser.add_argument(
        "--dry",
        type=number(0.0),
        default=20.0,
        metavar="M",
        help="land higher than this is written as so high; default 20",
    )
    parser.add_argument(
        "--thin", type=number(0.0), default=0.0, metavar="M", help="one sounding per M metres: the shallowest"
    )
    parser.add_argument(
        "--pitch", type=number(0.5, 1000.0), default=5.0, metavar="M", help="cell of a .depth grid; default 5"
    )
    parser.add_argument(
        "--spread",
        type=number(0.0, 1000.0),
        default=0.0,
        metavar="M",
        help="of a .depth grid: how far a cell counts beyond its own area; default 0",
    )
    parser.set_defaults(run=_convert)


def _convert(arguments: argparse.Namespace) -> int:
    if importlib.util.find_spec("rasterio") is None:
        raise MissingExtraError(f"converting charts needs rasterio: {install_line('charts')}")
    if arguments.out.suffix not in (".xyz", ".depth"):
        print(f"{arguments.out}: must end in .xyz or .depth", file=sys.stderr)
        return 2
    may_write(arguments.out, arguments.chart)
    progress = ProgressLine("chart", None)
    try:
        with opened(arguments) as source:
            told = _write(arguments, source, progress)
    except (ChartError, ValueError) as error:
        progress.close()
        raise ConfigError(str(arguments.chart), [str(error)]) from None
    except KeyboardInterrupt:
        progress.close()
        print(f"interrupted: {arguments.out} is not written", file=sys.stderr)
        return _INTERRUPTED
    print("\n".join(told))
    return 0


def _write(arguments: argparse.Namespace, source: ChartSource, progress: ProgressLine) -> list[str]:
    """Write what there is, and say what; nothing at all for a chart that cannot be meant. A failure leaves no half file."""
    out: Path = arguments.out
    tally = BlockTally(source, arguments.dry)
    with whole_file(out) as temporary:
        if out.suffix == ".depth":
            grid = Fill(source, arguments.pitch, arguments.spread)
            with temporary.open("wb") as binary:
                for block in _counted(source, tally, progress):
                    grid.add(block)
                tally.refuse()
                binary.write(grid.grid().to_bytes())
            made = f"grid of {grid.pitch_m:.1f} m"
        else:
            with temporary.open("w", encoding="utf-8") as text:
                text.writelines(_xyz(arguments, source, _counted(source, tally, progress)))
            tally.refuse()
            made = f"{tally.kept} depths" if arguments.thin <= 0.0 else f"the shallowest of each {arguments.thin:g} m"
    return [f"{out}: {made}", *tally.lines(arguments.datum)]


def _counted(source: ChartSource, tally: BlockTally, progress: ProgressLine) -> Iterator[Block]:
    for block in source.blocks():
        tally.add(block)
        progress.count(tally.read / 1e6, source.total / 1e6, "million cells")
        yield block
    progress.close()


def _xyz(arguments: argparse.Namespace, source: ChartSource, blocks: Iterable[Block]) -> Iterator[str]:
    """Lines of a file of soundings; its head says for how much water each of them stands."""
    south, _, north, _ = source.bounds_deg()
    per_lat, per_lon = metres_per_radian(math.radians(max(abs(south), abs(north))))
    # The shallowest of a square may lie anywhere in it, and stands for all of it.
    more_lat, more_lon = (math.degrees(2.0 * arguments.thin / per) for per in (per_lat, per_lon))
    yield "# longitude latitude depth_m (below chart datum, positive down)\n"
    yield f"# cell_deg {source.lat_cell_deg + more_lat:.9f} {source.lon_cell_deg + more_lon:.9f}\n"
    for lon, lat, depth_m in _thinned(blocks, arguments.thin):
        yield f"{lon:.8f} {lat:.8f} {math.floor(depth_m * 100.0 + 1e-6) / 100.0:.2f}\n"


def _places(block: Block) -> Iterator[Place]:
    return zip(block.lon_deg.tolist(), block.lat_deg.tolist(), block.depth_m.tolist(), strict=True)


def _thinned(blocks: Iterable[Block], spacing_m: float) -> Iterator[Place]:
    """The shallowest of every square of ``spacing_m``, where it is; all with a spacing of 0.

    A square is given out as soon as nothing more can come into it: what is kept is as long as the chart is wide.
    """
    least: dict[int, dict[int, Place]] = {}
    per_lat, per_lon = 0.0, 0.0
    for block in blocks:
        if spacing_m <= 0.0:
            yield from _places(block)
            continue
        for place in _places(block):
            if not per_lat:
                per_lat, per_lon = metres_per_radian(math.radians(place[1]))
            band = least.setdefault(math.floor(math.radians(place[1]) * per_lat / spacing_m), {})
            column = math.floor(math.radians(place[0]) * per_lon / spacing_m)
            if column not in band or place[2] < band[column][2]:
                band[column] = place
        if block.north_left_deg < math.inf:
            last = math.floor(math.radians(block.north_left_deg) * per_lat / spacing_m)
            for row in [row for row in least if row > last]:
                yield from least.pop(row).values()
    for band in least.values():
        yield from band.values()
