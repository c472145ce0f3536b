"""The depth memory: what the vessel has sounded itself, kept by place for the way ahead and for the next voyage.

Every sounding that passed the input chain goes into a cell of a grid, reduced to chart datum by the same tide and keel
depths as the charts. What a voyage adds is bounded: the tile of cells that was sailed over longest ago is forgotten
first; what the store held at the start is never too much. Only a cell that the vessel has left counts, so that no vessel is
stopped by what it is measuring now. No I/O: who keeps it takes ``take_changes`` and gives them back to ``restore``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from pydantic import Field

from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.language.messages import EstimatedState

from ...config import Config, param
from .shelf import TileShelf
from .tiles import PASS_S, TILE_BYTES, Cell, CellKey, Geometry, TileKey, cells, get, put, sound, tile_of

_PROVEN: Final = 2.0
"""Sigma of the mean by which a cell must be too shallow before it stops anybody."""
_ALIKE: Final = 3.0
"""Times sigma: the shallowest soundings of two passes over one top differ by no more, 95 times in a hundred."""
TILES_MOST: Final = 100_000
"""Tiles that a store is given at most: the vessel holds them packed, some 50 MB, and takes them back in some ten seconds."""
_NO_DATE: Final = 1 << 32
"""Later than any: soundings without a date, which an import brings, are the last to be forgotten."""
_CLEAR_M: Final = 48.0
"""Clear water is looked for so far beyond the reach, so that the next looks find the answer ready."""


class DepthMemoryConfig(Config):
    """What is remembered of the bottom."""

    enabled: bool = param(True, "DEPTH_MEMORY", "Remember the depths sailed over and look ahead with them", live=False)
    cell_m: float = Field(2.0, ge=0.5, le=50)
    """Size of a cell. Memory of another size is kept in the store, but not used."""
    tiles_max: int = Field(2000, ge=16, le=TILES_MOST)
    """How much a voyage adds to: tiles of 16 x 16 cells, 4 kB each; then the one sailed over longest ago goes. No limit to an import."""
    save_s: float = Field(10.0, ge=1, le=3600)
    """What is new goes to the store this often; a power cut loses no more."""


class DepthMemory:
    """The grid of own soundings. ``note`` each sounding; ``shoal_near`` asks for what is known to be too shallow."""

    def __init__(self, config: DepthMemoryConfig, sigma_m: float) -> None:
        """``sigma_m``: noise of one sounding, 1 sigma."""
        self.geometry = Geometry(config.cell_m)
        self._sigma_m = sigma_m
        self._tiles_max = self._most = config.tiles_max
        self._tiles = TileShelf(config.tiles_max)
        self._rank: dict[TileKey, tuple[int, float]] = {}
        """Of tiles that are being taken back: the newest sounding, and the shallowest, negative."""
        self.forgotten = 0
        """Tiles that had to go because there was no room."""
        self._changed: dict[TileKey, None] = {}
        self._gone: list[TileKey] = []
        self._open: CellKey | None = None
        self._count, self._least_m, self._mean_m, self._squares, self._last_s = 0, 0.0, 0.0, 0.0, 0
        self._floor_m = -math.inf
        self._shoals: dict[TileKey, dict[CellKey, float]] = {}
        self._around: list[tuple[int, dict[CellKey, float]]] = []
        """Shoals of the tiles around, each with the row of its tile."""
        self._centre: tuple[int, int, int] | None = None
        self._clear: tuple[float, float, float] | None = None
        """North, east and radius of water in which nothing shallow is known, m."""

    def __len__(self) -> int:
        """Tiles held."""
        return len(self._tiles)

    # ---- taking soundings ---------------------------------------------------------------------------------------

    def note(self, state: EstimatedState, t_us: int, depth_m: float, utc_s: int) -> None:
        """Take a sounding: depth below chart datum in m, measured at ``t_us``; ``utc_s`` 0 = unknown."""
        lat_rad, lon_rad = state.lat_rad, state.lon_rad
        if lat_rad is None or lon_rad is None or not math.isfinite(depth_m):
            return
        if t_us != state.t_us:
            ago_s = (state.t_us - t_us) * 1e-6
            per_lat, per_lon = metres_per_radian(lat_rad)
            lat_rad -= (state.vx_mps or 0.0) * ago_s / per_lat
            lon_rad -= (state.vy_mps or 0.0) * ago_s / per_lon
        cell = self.geometry.cell_of(lat_rad, lon_rad)
        if cell != self._open:
            self.close_cell()
            self._open, self._least_m = cell, depth_m
        self._count += 1
        step = depth_m - self._mean_m
        mean_m = self._mean_m = self._mean_m + step / self._count
        self._squares += step * (depth_m - mean_m)
        if depth_m < self._least_m:
            self._least_m = depth_m
        self._last_s = utc_s

    def close_cell(self) -> None:
        """Put the cell under the keel into the memory: the vessel has left it, or the run ends."""
        cell, self._open = self._open, None
        if cell is None:
            return
        new = Cell(self._count, self._least_m, self._mean_m, self._squares, self._last_s)
        self._count, self._mean_m, self._squares = 0, 0.0, 0.0
        self.add(cell, new.bounded())

    def add(self, cell: CellKey, new: Cell) -> None:
        """Join what is known of a cell with more of it."""
        key = tile_of(cell)
        tile = self._tiles.opened(key) if key in self._changed else self._tiles.sailed_over(key)
        if tile is None:
            tile = self._new_tile(key)
        old = get(tile, cell)
        put(tile, cell, new if old is None else old.joined(new, _ALIKE * self._noise_m(new)))
        self._changed[key] = None
        shoals = self._shoals.get(key)
        if shoals is not None:
            found = get(tile, cell)
            assert found is not None
            self._judge(shoals, cell, found)
        else:
            self._clear = self._centre = None

    def _new_tile(self, key: TileKey) -> bytearray:
        while len(self._tiles) >= self._most:
            self._remove(self._tiles.first_to_go(self._tiles_max))
            self.forgotten += 1
        self._shoals[key] = {}
        self._centre = None
        if key in self._gone:
            self._gone.remove(key)
        tile = bytearray(TILE_BYTES)
        self._tiles.put(key, tile)
        return tile

    def _remove(self, key: TileKey) -> None:
        self._tiles.remove(key)
        self._changed.pop(key, None)
        self._forget_shoals(key)
        self._gone.append(key)

    # ---- looking ahead ------------------------------------------------------------------------------------------

    def shoals_near(self, state: EstimatedState, reach_m: float, floor_m: float) -> bool:
        """Whether any cell is known with less than ``floor_m`` (below datum) in the tiles within ``reach_m``.

        Selects the cells that ``shoal_at`` answers for. Costs next to nothing where the water around is clear.
        """
        if floor_m != self._floor_m:
            self._floor_m, self._clear, self._centre = floor_m, None, None
            self._shoals.clear()
        clear, x_m, y_m = self._clear, state.x_m, state.y_m
        if x_m is None or y_m is None or state.lat_rad is None or state.lon_rad is None:
            return False
        if clear is not None and abs(x_m - clear[0]) + abs(y_m - clear[1]) + reach_m <= clear[2]:
            return False
        for wide_m in (reach_m, reach_m + _CLEAR_M):
            clear_m = self._clear_m(state.lat_rad, state.lon_rad, wide_m)
            if clear_m <= reach_m:
                return True
            self._clear = x_m, y_m, clear_m
        return False

    def _clear_m(self, lat_rad: float, lon_rad: float, reach_m: float) -> float:
        """How far it is at least to the nearest shoal, or to where the tiles within ``reach_m`` end, m."""
        geometry = self.geometry
        row, column = geometry.cell_of(lat_rad, lon_rad)
        rings = int(reach_m // geometry.tile_m) + 1
        centre = (*tile_of((row, column)), rings)
        if centre != self._centre:
            self._centre = centre
            around = sorted(key for key in geometry.tiles_around(lat_rad, lon_rad, reach_m) if key in self._tiles)
            self._around = [(key[0], self._shoals_of(key)) for key in around]
            if len(self._shoals) > self._tiles_max:
                self._shoals = {key: self._shoals[key] for key in around}
        nearest = round(rings * geometry.tile_m / geometry.cell_m) + 1
        for tile_row, shoals in self._around:
            if shoals:
                middle = column if tile_row == centre[0] else geometry.column_of(lon_rad, tile_row)
                nearest = min(nearest, *(max(abs(down - row), abs(across - middle)) for down, across in shoals))
        return (nearest - 1) * geometry.cell_m

    def shoal_at(self, lat_rad: float, lon_rad: float, cells_aside: int = 1) -> float | None:
        """Least depth below datum known in the cell of a place and ``cells_aside`` around it; None = nothing shallow.

        Only depths below the floor of the last ``shoals_near`` are told.
        """
        geometry = self.geometry
        row, _ = geometry.cell_of(lat_rad, lon_rad)
        least_m: float | None = None
        for tile_row, shoals in self._around:
            if not shoals:
                continue
            column = geometry.column_of(lon_rad, tile_row)
            for down in range(row - cells_aside, row + cells_aside + 1):
                for across in range(column - cells_aside, column + cells_aside + 1):
                    depth_m = shoals.get((down, across))
                    if depth_m is not None and (least_m is None or depth_m < least_m):
                        least_m = depth_m
        return least_m

    def known_m(self, lat_rad: float, lon_rad: float, utc_s: int) -> float | None:
        """The shallow side of what was sounded in the cell of a place on an earlier pass, m below datum; None = nothing.

        What is sounded now vouches for nothing: a false echo is remembered too. ``utc_s`` as in ``note``.
        """
        cell = self.geometry.cell_of(lat_rad, lon_rad)
        key = tile_of(cell)
        found = get(self._tiles.look(key), cell) if key in self._tiles else None
        if found is None or not utc_s or not found.last_s or utc_s - found.last_s < PASS_S:
            return None
        return found.robust_m(self._noise_m(found))

    def plane(self, state: EstimatedState, cells_aside: int) -> Callable[[float, float], float | None]:
        """``shoal_at`` in the plane of a state with a position: (north, east) in m to depth."""
        lat_rad, lon_rad, x_m, y_m = state.lat_rad or 0.0, state.lon_rad or 0.0, state.x_m or 0.0, state.y_m or 0.0
        per_lat, per_lon = metres_per_radian(lat_rad)

        def depth_at(north_m: float, east_m: float) -> float | None:
            return self.shoal_at(lat_rad + (north_m - x_m) / per_lat, lon_rad + (east_m - y_m) / per_lon, cells_aside)

        return depth_at

    def _shoals_of(self, key: TileKey) -> dict[CellKey, float]:
        shoals = self._shoals.get(key)
        if shoals is None:
            shoals = self._shoals[key] = {}
            for cell, found in cells(key, self._tiles.look(key)):
                self._judge(shoals, cell, found)
        return shoals

    def _judge(self, shoals: dict[CellKey, float], cell: CellKey, found: Cell) -> None:
        sigma_m = self._noise_m(found)
        depth_m = found.robust_m(sigma_m)
        if depth_m + _PROVEN * sigma_m / math.sqrt(found.soundings) < self._floor_m:
            shoals[cell] = depth_m
            self._clear = None
        else:
            shoals.pop(cell, None)

    def _noise_m(self, found: Cell) -> float:
        return max(self._sigma_m, 0.005 * abs(found.mean_m))

    def _forget_shoals(self, key: TileKey) -> None:
        self._shoals.pop(key, None)
        self._clear = self._centre = None

    # ---- keeping and giving -------------------------------------------------------------------------------------

    def take_changes(self, most: int) -> tuple[list[tuple[TileKey, bytes]], list[TileKey]]:
        """Tiles that changed since they were taken last, as bytes, and tiles that were forgotten; ``most`` of each."""
        keys = list(self._changed)[:most]
        for key in keys:
            del self._changed[key]
        gone, self._gone = self._gone[:most], self._gone[most:]
        return [(key, bytes(self._tiles.look(key))) for key in keys], gone

    @property
    def waiting(self) -> int:
        """Tiles that changed or were forgotten since they were taken last."""
        return max(len(self._changed), len(self._gone))

    def put_back(self, changed: Sequence[TileKey], gone: Sequence[TileKey]) -> None:
        """These could not be kept: they count as changed again."""
        self._changed |= {key: None for key in changed if key in self._tiles}
        self._gone += [key for key in gone if key not in self._tiles]

    def restore(self, key: TileKey, tile: bytes) -> bool:
        """Take a tile back; False when it is none. Call in any order; ``restored`` afterwards."""
        if not sound(tile):
            return False
        self._tiles.put(key, bytearray(tile))
        found = [cell for _, cell in cells(key, tile)]
        newest_s, least_m = (
            max((each.last_s for each in found), default=0),
            min((each.least_m for each in found), default=0.0),
        )
        self._rank[key] = newest_s or _NO_DATE, -least_m
        return True

    def restored(self) -> None:
        """Put the tiles in order of their newest sounding; without a date the deepest first. However many there are, they stay."""
        sailed_since = [key for key in self._tiles if key not in self._rank]
        ranked = sorted(self._rank, key=lambda key: (self._rank[key], key))
        imported = [key for key in ranked if self._rank[key][0] == _NO_DATE]
        self._tiles.put_in_order([*ranked[: len(ranked) - len(imported)], *sailed_since], imported)
        self._most = max(min(self._tiles_max + len(imported), TILES_MOST), len(self._tiles))
        self._rank.clear()
        self._shoals.clear()
        self._clear = self._centre = None

    def known(self) -> Iterator[tuple[float, float, Cell]]:
        """Every sounded cell: latitude and longitude of its middle in rad, and what is known, from south to north."""
        for key in sorted(self._tiles):
            for (row, column), cell in cells(key, self._tiles.look(key)):
                yield (*self.geometry.centre(row, column), cell)

    def forget_near(self, lat_rad: float, lon_rad: float, radius_m: float) -> tuple[int, float | None]:
        """Forget every cell that reaches into a circle, the open one too; return how many, and their least depth, m."""
        per_lat, per_lon = metres_per_radian(lat_rad)
        reach_m = radius_m + 0.75 * self.geometry.cell_m
        self.close_cell()
        depths_m = []

        def within(lat: float, lon: float) -> bool:
            return math.hypot((lat - lat_rad) * per_lat, (lon - lon_rad) * per_lon) <= reach_m

        for key in [each for each in self.geometry.tiles_around(lat_rad, lon_rad, reach_m) if each in self._tiles]:
            found = cells(key, self._tiles.look(key))
            depths_m += [what.least_m for place, what in found if within(*self.geometry.centre(*place))]
            self._forget_in(key, within)
        return len(depths_m), min(depths_m, default=None)

    def forget(self, within: Callable[[float, float], bool]) -> int:
        """Forget every cell whose middle (lat, lon in rad) is ``within``; return how many."""
        return round(math.fsum(self._forget_in(key, within) for key in list(self._tiles)))

    def _forget_in(self, key: TileKey, within: Callable[[float, float], bool]) -> int:
        found = list(cells(key, self._tiles.look(key)))
        kept = [(cell, what) for cell, what in found if not within(*self.geometry.centre(*cell))]
        if len(kept) < len(found):
            self._remove(key)
            for cell, what in kept:
                self.add(cell, what)
        return len(found) - len(kept)
