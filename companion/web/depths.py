"""The depth map of the page: what the vessel's store remembers around a place, and the owner's chart, as coloured cells.

Read from a copy of the store, which the vessel does not notice; a few times an hour.
"""

from __future__ import annotations

import math
import sqlite3
from pathlib import Path
from typing import Any, Final

from ..configuration import depth_map
from ..core.guard.depth.grid import DepthGrid
from ..io.keeping.depth_store import soundings_of
from ..io.keeping.look import look
from ..settings import ConfigError, Settings
from .track import Point, packed

CELLS_MAX: Final = 1600
REACH_M: Final = 400.0
"""Around the boat: what is on the map at the closer scales."""
_FINEST_M: Final = 4.0
_M_PER_DEG: Final = 111_195.0
_CHART_MAX_BYTES: Final = 30_000_000
"""A larger chart would take this process more memory than the vessel itself."""
_CHART_SIDE: Final = 30


class Depths:
    """Depths around a place."""

    def __init__(self, settings: Settings, store: Path | None) -> None:
        """``store``: the vessel's; it lies beside the socket that is served."""
        self._store = store
        self._wanted = settings.depth.map
        self._chart: DepthGrid | None = None
        self._read = False

    def around(self, lat_deg: float, lon_deg: float) -> dict[str, Any]:
        """Cells as the page draws them: size in m, then places with depths below chart datum. Slow: call it beside the loop."""
        cells: dict[tuple[int, int], Point] = {}
        size_m = _FINEST_M
        narrow = max(math.cos(math.radians(lat_deg)), 0.01)
        sounded = self._sounded(lat_deg, lon_deg, narrow)
        while True:
            cells.clear()
            for point in sounded:
                key = (
                    round((point[0] - lat_deg) * _M_PER_DEG / size_m),
                    round((point[1] - lon_deg) * _M_PER_DEG * narrow / size_m),
                )
                known = cells.get(key)
                if known is None or (point[2] or 0.0) < (known[2] or 0.0):
                    cells[key] = point
            if len(cells) <= CELLS_MAX:
                break
            size_m *= 2.0
        charted = self._charted(lat_deg, lon_deg, narrow)
        return {
            "sounded": {"size_m": size_m, **packed(list(cells.values()))},
            "charted": {"size_m": 2.0 * REACH_M / _CHART_SIDE, **packed(charted)},
        }

    def _sounded(self, lat_deg: float, lon_deg: float, narrow: float) -> list[Point]:
        if self._store is None or not self._store.is_file():
            return []
        try:
            content = look(self._store).content
        except (OSError, sqlite3.Error):
            return []
        reach_deg = REACH_M / _M_PER_DEG
        return [
            (each.lat_deg, each.lon_deg, each.depth_m)
            for each in soundings_of(content)
            if abs(each.lat_deg - lat_deg) < reach_deg and abs(each.lon_deg - lon_deg) * narrow < reach_deg
        ]

    def _charted(self, lat_deg: float, lon_deg: float, narrow: float) -> list[Point]:
        chart = self._load()
        if chart is None:
            return []
        found: list[Point] = []
        step_deg = 2.0 * REACH_M / _CHART_SIDE / _M_PER_DEG
        for row in range(-_CHART_SIDE // 2, _CHART_SIDE // 2 + 1):
            for column in range(-_CHART_SIDE // 2, _CHART_SIDE // 2 + 1):
                lat, lon = lat_deg + row * step_deg, lon_deg + column * step_deg / narrow
                depth_m = chart.depth_at(math.radians(lat), math.radians(lon))
                if depth_m is not None:
                    found.append((lat, lon, depth_m))
        return found

    def _load(self) -> DepthGrid | None:
        if not self._read:
            self._read = True
            file = self._wanted.file
            try:
                small = file is not None and file.stat().st_size <= _CHART_MAX_BYTES
                self._chart = depth_map(self._wanted) if small else None
            except (OSError, ConfigError):
                self._chart = None
        return self._chart
