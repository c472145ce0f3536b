"""The depth memory between the store and files: tiles by their store keys, and soundings as XYZ and GeoJSON.

XYZ: longitude, latitude (degrees, WGS-84), depth (m below chart datum, positive down), then number of soundings, the shallowest
of them and the time of the newest; the first three are what every chart program reads.
"""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from ...core.guard.depth.memory import TILES_MOST, DepthMemory, DepthMemoryConfig
from ...core.guard.depth.tiles import TILE_BYTES, Cell, TileKey
from .content import StoreContent, unpack_tile

SIGMA_M: Final = 0.05
"""Noise of a sounder, as the depth guard's default, for the robust depth of an export."""


class Sounded(NamedTuple):
    """What is known of one place."""

    lat_deg: float
    lon_deg: float
    depth_m: float
    """The shallow side of the bottom there, m below chart datum, positive down."""
    least_m: float
    mean_m: float
    soundings: int
    utc_s: int
    """Time of the newest, seconds since 1970; 0 = unknown."""


def join_key(cell_m: float, place: TileKey) -> str:
    """The store's key of a tile."""
    return f"{round(cell_m * 1000)}/{place[0]}/{place[1]}"


def split_key(key: str) -> tuple[float, TileKey] | None:
    """Cell size in m, row and column; None for a key that is none."""
    parts = key.split("/")
    try:
        cell_m, row, column = int(parts[0]) / 1000.0, int(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        return None
    return (cell_m, (row, column)) if cell_m > 0.0 and len(parts) == 3 else None


def restore(memory: DepthMemory, tiles: Mapping[str, str]) -> int:
    """Take the tiles of the memory's own cell size; return how many are damaged and left out."""
    damaged = 0
    for key, text in tiles.items():
        found = split_key(key)
        ours = found is not None and found[0] == memory.geometry.cell_m
        if found is None or (ours and not memory.restore(found[1], _unpacked(text))):
            damaged += 1
    memory.restored()
    return damaged


def _unpacked(text: str) -> bytes:
    try:
        return unpack_tile(text, TILE_BYTES)
    except ValueError:
        return b""


def memories(content: StoreContent) -> Iterator[DepthMemory]:
    """The store's memories, one for each cell size."""
    sizes = {found[0] for key in content.depth if (found := split_key(key)) is not None}
    for cell_m in sorted(sizes):
        memory = DepthMemory(DepthMemoryConfig.model_construct(cell_m=cell_m, tiles_max=TILES_MOST), SIGMA_M)
        restore(memory, content.depth)
        yield memory


def soundings_of(content: StoreContent) -> Iterator[Sounded]:
    """Every place that the store knows, the finest cells first."""
    for memory in memories(content):
        for lat_rad, lon_rad, cell in memory.known():
            yield sounded(lat_rad, lon_rad, cell)


def sounded(lat_rad: float, lon_rad: float, cell: Cell) -> Sounded:
    sigma_m = max(SIGMA_M, 0.005 * abs(cell.mean_m))
    return Sounded(
        lat_deg=math.degrees(lat_rad),
        lon_deg=math.degrees(lon_rad),
        depth_m=cell.robust_m(sigma_m),
        least_m=cell.least_m,
        mean_m=cell.mean_m,
        soundings=cell.soundings,
        utc_s=cell.last_s,
    )


def xyz_lines(found: Iterable[Sounded]) -> Iterator[str]:
    """Lines of XYZ with a comment on top."""
    yield "# longitude latitude depth_m soundings least_m last_utc (depth below chart datum, positive down)\n"
    for each in found:
        yield (
            f"{each.lon_deg:.8f} {each.lat_deg:.8f} {each.depth_m:.2f} "
            f"{each.soundings} {each.least_m:.2f} {_time(each.utc_s) or '-'}\n"
        )


def geojson_lines(found: Iterable[Sounded]) -> Iterator[str]:
    """GeoJSON (RFC 7946), a feature a line; depths are properties, positive down."""
    yield '{"type": "FeatureCollection", "features": [\n'
    comma = ""
    for each in found:
        yield comma + json.dumps(_feature(each))
        comma = ",\n"
    yield "\n]}\n"


def _feature(each: Sounded) -> dict[str, Any]:
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [round(each.lon_deg, 8), round(each.lat_deg, 8)]},
        "properties": {
            "depth_m": round(each.depth_m, 3),
            "least_m": round(each.least_m, 3),
            "mean_m": round(each.mean_m, 3),
            "soundings": each.soundings,
            "last": _time(each.utc_s),
        },
    }


def from_geojson(text: str) -> list[Sounded]:
    """Points with a ``depth_m``. Raises ``ValueError`` with what is wrong."""
    data = json.loads(text)
    features = data.get("features") if isinstance(data, dict) else None
    if not isinstance(features, list):
        raise ValueError("a GeoJSON FeatureCollection is expected")
    return [_from_feature(number, feature) for number, feature in enumerate(features)]


def _from_feature(number: int, feature: Any) -> Sounded:
    try:
        lon, lat = (float(value) for value in feature["geometry"]["coordinates"][:2])
        values = feature["properties"]
        depth = float(values["depth_m"])
        least, mean = float(values.get("least_m", depth)), float(values.get("mean_m", depth))
        last = values.get("last")
        utc_s = 0 if last is None else max(0, int(datetime.datetime.fromisoformat(last).timestamp()))
        found = Sounded(
            lat_deg=lat,
            lon_deg=lon,
            depth_m=depth,
            least_m=least,
            mean_m=mean,
            soundings=max(1, int(values.get("soundings", 1))),
            utc_s=utc_s,
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        raise ValueError(f"feature {number}: a point with the property depth_m is expected") from None
    if not all(map(math.isfinite, found)) or abs(lat) > 90.0 or abs(lon) > 180.0:
        raise ValueError(f"feature {number}: no such position or depth")
    return found


def _time(utc_s: int) -> str | None:
    if not utc_s:
        return None
    return datetime.datetime.fromtimestamp(utc_s, datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
