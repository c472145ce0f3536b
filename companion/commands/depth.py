"""``companion depth``: look at, export, import and forget what the vessel has sounded; convert charts for it."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

from mavlink_bridge.language.geodesy import metres_per_radian

from ..core.guard.depth.memory import TILES_MOST, DepthMemory, DepthMemoryConfig
from ..core.guard.depth.soundings import cell_of, parse
from ..core.guard.depth.tiles import SIDE, Cell
from ..io.keeping import StoreContent
from ..io.keeping.content import SaveDepth, StoredRow, entries_of
from ..io.keeping.depth_store import (
    SIGMA_M,
    Sounded,
    from_geojson,
    geojson_lines,
    join_key,
    memories,
    restore,
    soundings_of,
    xyz_lines,
)
from ..io.whole_file import whole_file
from ..settings import ConfigError
from ..settings.device import no_device
from .chart.convert import add_convert
from .numbers import number
from .outputs import may_write
from .progress import ProgressLine
from .store import read_store, write_store

_RADIUS_MAX_M = 100_000.0
"""Of what is forgotten around a place: beyond it degrees were meant, or all."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("depth", help="depth memory and charts", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    show = actions.add_parser("show", help="say what the vessel remembers of the bottom")
    show.add_argument("store", type=Path, help="the store, state/companion.db by default configuration")
    show.set_defaults(run=_show)
    export = actions.add_parser("export", help="write all soundings as XYZ or GeoJSON")
    export.add_argument("store", type=Path)
    export.add_argument("file", type=Path, nargs="?", help="default: standard output")
    export.add_argument("--format", choices=("xyz", "geojson"), help="default: by the file's name, else xyz")
    export.set_defaults(run=_export)
    load = actions.add_parser("import", help="take soundings into a store; the vessel must not be running")
    load.add_argument("store", type=Path)
    load.add_argument("file", type=Path, help="an export (.geojson), or XYZ, CSV, DUNE ini: depth positive down")
    load.add_argument("--order", choices=("lon-lat", "lat-lon"), default="lon-lat", help="columns of an XYZ file")
    load.add_argument("--cell", type=float, default=2.0, metavar="M", help="as depth.memory.cell_m; default 2")
    load.set_defaults(run=_import)
    forget = actions.add_parser("forget", help="forget soundings; the vessel must not be running")
    forget.add_argument("store", type=Path)
    what = forget.add_mutually_exclusive_group(required=True)
    what.add_argument("--near", type=number(), nargs=3, metavar=("LAT", "LON", "M"), help="within M metres of a place")
    what.add_argument("--all", action="store_true")
    forget.set_defaults(run=_forget)
    add_convert(actions)


def _show(arguments: argparse.Namespace) -> int:
    content = read_store(arguments.store)
    found = list(soundings_of(content))
    if not found:
        print("nothing sounded yet")
        return 0
    depths = [each.depth_m for each in found]
    print(f"places     {len(found)} in {len(content.depth)} tiles, {sum(each.soundings for each in found)} soundings")
    print(f"depths     {min(depths):.2f} to {max(depths):.2f} m below chart datum")
    print(f"latitude   {min(each.lat_deg for each in found):.6f} to {max(each.lat_deg for each in found):.6f}")
    print(f"longitude  {min(each.lon_deg for each in found):.6f} to {max(each.lon_deg for each in found):.6f}")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    may_write(arguments.file, arguments.store)
    content = read_store(arguments.store)
    path: Path | None = arguments.file
    form = arguments.format or ("geojson" if path and path.suffix in (".geojson", ".json") else "xyz")
    lines = (geojson_lines if form == "geojson" else xyz_lines)(soundings_of(content))
    if path is None:
        sys.stdout.writelines(lines)
        return 0
    with (
        ProgressLine("soundings", None) as shown,
        whole_file(path) as beside,
        beside.open("w", encoding="utf-8") as file,
    ):
        for done, line in enumerate(lines):
            shown.count(done / 1e3, SIDE * SIDE * len(content.depth) / 1e3, "thousand at most")
            file.write(line)
    print(path)
    return 0


def _import(arguments: argparse.Namespace) -> int:
    try:
        found = _soundings(arguments)
    except (OSError, ValueError) as error:
        raise ConfigError(str(arguments.file), [getattr(error, "strerror", None) or str(error)]) from None
    if not found:
        raise ConfigError(str(arguments.file), ["holds no sounding"])
    if max(each.depth_m for each in found) < 0.0:
        print(
            f"{arguments.file}: all of it lies above datum. Are these heights? Depths are positive down",
            file=sys.stderr,
        )
    if not 0.5 <= arguments.cell <= 50.0:
        print("--cell: 0.5 to 50 m", file=sys.stderr)
        return 2
    content = read_store(arguments.store) if arguments.store.is_file() else StoreContent()
    memory = DepthMemory(DepthMemoryConfig(cell_m=arguments.cell, tiles_max=TILES_MOST), SIGMA_M)
    restore(memory, content.depth)
    shown = ProgressLine("soundings", None)
    for done, each in enumerate(found):
        shown.count(done / 1e3, len(found) / 1e3, "thousand")
        place = memory.geometry.cell_of(math.radians(each.lat_deg), math.radians(each.lon_deg))
        count = min(each.soundings, 1000)
        memory.add(place, Cell(count, each.least_m, each.mean_m, _squares(each, count), each.utc_s))
    shown.close()
    if memory.forgotten:
        too_many = f"with it the store would hold more than {TILES_MOST} tiles; take a larger --cell, or less of it"
        raise ConfigError(str(arguments.file), [too_many])
    if not write_store(arguments.store, _entries(memory)):
        return 1
    print(f"{arguments.store}: {len(found)} soundings taken over")
    return 0


def _squares(each: Sounded, count: int) -> float:
    """The spread that gives the exported depth again."""
    spread_m = max(0.0, 0.5 * (each.mean_m - each.depth_m))
    sigma_m = max(SIGMA_M, 0.005 * abs(each.mean_m))
    return (spread_m * spread_m + 2.0 * sigma_m * sigma_m) * (count - 1) if spread_m else 0.0


def _soundings(arguments: argparse.Namespace) -> list[Sounded]:
    path: Path = arguments.file
    text = no_device(path).read_text(encoding="utf-8-sig")
    if path.suffix in (".geojson", ".json"):
        return from_geojson(text)
    soundings = parse(text, path.name, arguments.order)
    if (cell := cell_of(text)) is not None and soundings:
        _refuse_a_coarse_chart(cell, soundings[0].lat_rad, arguments.cell)
    return [
        Sounded(
            lat_deg=math.degrees(s.lat_rad),
            lon_deg=math.degrees(s.lon_rad),
            depth_m=s.depth_m,
            least_m=s.depth_m,
            mean_m=s.depth_m,
            soundings=1,
            utc_s=0,
        )
        for s in soundings
    ]


def _refuse_a_coarse_chart(cell_rad: tuple[float, float], lat_rad: float, memory_cell_m: float) -> None:
    """Raises ValueError for depths that stand for more water than a cell of the memory: between them it would know of none."""
    per_lat, per_lon = metres_per_radian(lat_rad)
    high_m, wide_m = cell_rad[0] * per_lat, cell_rad[1] * per_lon
    if max(high_m, wide_m) > memory_cell_m:
        raise ValueError(
            f"a chart with cells of {high_m:.0f} x {wide_m:.0f} m, the memory has {memory_cell_m:g} m: "
            "name it in depth.map.file instead"
        )


def _forget(arguments: argparse.Namespace) -> int:
    if arguments.near is not None:
        _place_is_one(*arguments.near)
    content = read_store(arguments.store)
    if arguments.all:
        if not write_store(arguments.store, [StoredRow("depth", "", None)]):
            return 1
        print(f"{arguments.store}: {len(content.depth)} tiles forgotten")
        return 0
    lat_deg, lon_deg, radius_m = arguments.near
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    forgotten, entries = 0, []
    for memory in memories(content):
        forgotten += memory.forget(lambda at, on: _distance_m(lat, lon, at, on) <= radius_m)
        entries += _entries(memory)
    if not write_store(arguments.store, entries):
        return 1
    print(f"{arguments.store}: {forgotten} places forgotten")
    return 0


def _place_is_one(lat_deg: float, lon_deg: float, radius_m: float) -> None:
    """Raise where no place on earth is meant."""
    for name, value, least, most, unit in (
        ("latitude", lat_deg, -90.0, 90.0, "degrees"),
        ("longitude", lon_deg, -180.0, 180.0, "degrees"),
        ("radius", radius_m, 0.0, _RADIUS_MAX_M, "m"),
    ):
        if not least <= value <= most:
            raise ConfigError("--near", [f"{name} {value:g}: give LAT LON M, {name} from {least:g} to {most:g} {unit}"])


def _distance_m(lat_rad: float, lon_rad: float, other_lat: float, other_lon: float) -> float:
    per_lat, per_lon = metres_per_radian(lat_rad)
    return math.hypot((other_lat - lat_rad) * per_lat, (other_lon - lon_rad) * per_lon)


def _entries(memory: DepthMemory) -> list[StoredRow]:
    changed, gone = memory.take_changes(TILES_MOST)
    cell_m = memory.geometry.cell_m
    tiles = tuple((join_key(cell_m, key), tile) for key, tile in changed)
    return entries_of(SaveDepth(tiles, tuple(join_key(cell_m, key) for key in gone)))
