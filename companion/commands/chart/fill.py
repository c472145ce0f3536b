"""A chart's cells into the vessel's compact grid: each fills the area that it stands for, the shallowest wins.

Nothing is kept but the grid itself, so a chart of any size needs 16 MB at most.
"""

from __future__ import annotations

import math
from array import array
from typing import Any, Final

from mavlink_bridge.language.geodesy import metres_per_radian

from ...core.guard.depth.grid import CELLS_MAX, DEEPEST_CM, UNKNOWN_CM, DepthGrid
from .source import Block, ChartError, ChartSource

_FINEST: Final = 4
"""A grid cell is at least this share of a chart's: more says nothing new."""


_HIGH: Final = DEEPEST_CM
"""Stands for unknown while minima are taken; what is as deep as that, 327.67 m, is kept as a centimetre less."""


class Fill:
    """A grid over what a source reads. ``add`` each block, then ``grid``."""

    def __init__(self, source: ChartSource, pitch_m: float, spread_m: float) -> None:
        import numpy

        south, west, north, east = (math.radians(each) for each in _one_side(source))
        per_lat, per_lon = metres_per_radian(0.5 * (south + north))
        self._high, self._wide = math.radians(source.lat_cell_deg), math.radians(source.lon_cell_deg)
        self.pitch_m = max(pitch_m, min(self._high * per_lat, self._wide * per_lon) / _FINEST)
        self._dlat, self._dlon = self.pitch_m / per_lat, self.pitch_m / per_lon
        self._more_lat, self._more_lon = spread_m / per_lat, spread_m / per_lon
        self._lat0, self._lon0 = south - self._more_lat - self._dlat, west - self._more_lon - self._dlon
        self._rows = math.ceil((north + self._more_lat - self._lat0) / self._dlat) + 1
        self._columns = math.ceil((east + self._more_lon - self._lon0) / self._dlon) + 1
        if self._rows * self._columns > CELLS_MAX:
            fits_m = self.pitch_m * math.sqrt(self._rows * self._columns / CELLS_MAX)
            raise ChartError(
                f"{self._rows} x {self._columns} cells is more than {CELLS_MAX}: choose --pitch {math.ceil(fits_m)}, "
                "or a --box of less water (one side of the 180th meridian only)"
            )
        self._cells = numpy.full(self._rows * self._columns, _HIGH, dtype="int16")

    def add(self, block: Block) -> None:
        """Lower every grid cell that a chart cell of the block reaches into."""
        import numpy

        lat, lon = numpy.radians(block.lat_deg), numpy.radians(block.lon_deg)
        value = numpy.floor(block.depth_m * 100.0 + 1e-6).clip(UNKNOWN_CM + 1, _HIGH - 1).astype("int16")
        half_lat, half_lon = 0.5 * self._high + self._more_lat, 0.5 * self._wide + self._more_lon
        lon = self._lon0 + (lon - self._lon0) % math.tau
        self._refuse_strangers(lat, lon)
        low, high = _span(lat, half_lat, self._lat0, self._dlat, self._rows)
        left, right = _span(lon, half_lon, self._lon0, self._dlon, self._columns)
        for down in range(int((high - low).max(initial=-1)) + 1):
            for across in range(int((right - left).max(initial=-1)) + 1):
                row, column = low + down, left + across
                inside = (row <= high) & (column <= right)
                numpy.minimum.at(self._cells, row[inside] * self._columns + column[inside], value[inside])

    def _refuse_strangers(self, lat: Any, lon: Any) -> None:
        """Raises ChartError for a cell that lies outside the chart's own edges: its depth would be put where it is not."""
        high, wide = self._lat0 + self._rows * self._dlat, self._lon0 + self._columns * self._dlon
        if len(lat) and (lat.min() < self._lat0 or lat.max() > high or lon.max() > wide):
            raise ChartError(
                "some of its cells lie outside its edges (a pole in it?): choose a --box, or convert to .xyz"
            )

    def grid(self) -> DepthGrid:
        """The grid so far."""
        self._cells[self._cells == _HIGH] = UNKNOWN_CM
        cells = array("h")
        cells.frombytes(self._cells.tobytes())
        return DepthGrid(
            lat0_rad=self._lat0,
            lon0_rad=self._lon0,
            dlat_rad=self._dlat,
            dlon_rad=self._dlon,
            rows=self._rows,
            columns=self._columns,
            cells=cells,
        )


def _one_side(source: ChartSource) -> tuple[float, float, float, float]:
    """South, west, north, east of the grid. Raises ChartError for what lies on both sides of the 180th meridian."""
    south, west, north, east = source.box_deg()
    if east > 180.0 + 1.01 * source.lon_cell_deg:
        raise ChartError(
            f"it lies on both sides of the 180th meridian ({west:.5f} to {east:.5f}), and a .depth on one: "
            "choose a --box on one side"
        )
    return south, west, north, east


def _span(at: Any, half: float, start: float, pitch: float, count: int) -> tuple[Any, Any]:
    """First and last grid cell that each interval reaches into; a hair less, so that a border is not shared."""
    import numpy

    hair = 1e-6
    first = numpy.floor((at - half - start) / pitch + hair).astype("int64")
    last = numpy.floor((at + half - start) / pitch - hair).astype("int64")
    return first.clip(0, count - 1), numpy.maximum(last, first).clip(0, count - 1)
