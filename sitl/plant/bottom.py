"""The bottom under the simulated vessel: synthetic slope, shoal, hole and flat, or a grid from soundings.

Depth is water depth in metres, positive down, at metres north and east of the simulation's origin; None = unknown
(outside a map). The true altitude is this depth, plus the tide, less the keel's depth.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from pydantic import Field, model_validator

from companion.core.config import Config
from companion.core.guard.depth.grid import DepthGrid, Sounding
from companion.core.guard.depth.soundings import parse
from companion.settings.device import no_device
from mavlink_bridge.language.geodesy import SEMI_MAJOR_AXIS_M, LocalFrame, metres_per_radian


class Bottom(Protocol):
    """Anything with a depth."""

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m; None where nobody knows."""
        ...


class MoundConfig(Config):
    """A shoal, or with a negative height a hole, of cosine shape."""

    north_m: float = 0.0
    """Of its top, from the start of the run."""
    east_m: float = 0.0
    """Of its top, from the start of the run."""
    radius_m: float = Field(40.0, gt=0)
    """Where it has run out."""
    height_m: float = 0.0
    """Of its top above the bottom around; negative = a hole."""


class SlopeConfig(Config):
    """A bottom that rises from ``start_m`` along ``bearing_deg`` by ``gradient`` metres per metre."""

    bearing_deg: float = 90.0
    """Which way the bottom rises, true."""
    start_m: float = 150.0
    """Where along that bearing the rise begins, from the start of the run."""
    gradient: float = Field(0.05, ge=0, le=10)
    """Metres of rise a metre."""


class BottomConfig(Config):
    """Which bottom. The default: 20 m, rising eastward at 1:20 from 150 m on, a shoal 120 m north, a hole 120 m west."""

    kind: Literal["synthetic", "flat", "file", "chart"] = "synthetic"
    """``file``: soundings; ``chart``: the vessel's own depth.map.file is the real bottom."""
    depth_m: float = Field(20.0, gt=0, le=12000)
    """Water depth of the flat part, m."""
    slope: SlopeConfig | None = SlopeConfig()
    mounds: tuple[MoundConfig, ...] = (
        MoundConfig(north_m=120.0, east_m=0.0, radius_m=30.0, height_m=17.5),
        MoundConfig(north_m=0.0, east_m=-120.0, radius_m=30.0, height_m=-10.0),
    )
    beyond: bool = False
    """Of kind ``chart``: where the chart knows nothing the water is ``depth_m`` deep; else no echo comes back there."""
    file: Path | None = None
    """Soundings (XYZ, CSV or DUNE ini) for kind ``file``."""
    tide_m: float = Field(0.0, ge=-20, le=20)
    """Water level above chart datum, m."""

    @model_validator(mode="after")
    def _nothing_in_vain(self) -> BottomConfig:
        """A shape that this kind of bottom does not have was meant otherwise. Raises ValueError."""
        shapes = {"slope": self.slope is not None, "mounds": bool(self.mounds)}
        vain = [name for name, given in shapes.items() if given and name in self.model_fields_set]
        if self.kind != "synthetic" and vain:
            raise ValueError(
                f"kind = '{self.kind}' has no {' and no '.join(vain)}: say kind = 'synthetic', or leave them out"
            )
        return self


@dataclass(frozen=True, slots=True)
class Flat:
    """The same depth everywhere."""

    depth_m: float = 20.0

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m."""
        return self.depth_m


class Slope:
    """Any bottom that rises along ``bearing_rad`` by ``gradient`` from ``start_m`` on, to no less than 0.2 m of water."""

    __slots__ = ("_base", "_cosine", "_depth_min_m", "_gradient", "_sine", "_start_m")

    def __init__(
        self,
        base: Bottom,
        gradient: float = 0.05,
        bearing_rad: float = 0.0,
        start_m: float = 0.0,
        depth_min_m: float = 0.2,
    ) -> None:
        self._base, self._gradient = base, gradient
        self._cosine, self._sine = math.cos(bearing_rad), math.sin(bearing_rad)
        self._start_m, self._depth_min_m = start_m, depth_min_m

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m."""
        depth_m = self._base.depth_at(north_m, east_m)
        along_m = north_m * self._cosine + east_m * self._sine - self._start_m
        if depth_m is None or along_m <= 0.0:
            return depth_m
        return max(depth_m - self._gradient * along_m, self._depth_min_m)


@dataclass(frozen=True, slots=True)
class Mound:
    """A shoal (``height_m`` positive) or a hole (negative) of cosine shape on any other bottom."""

    base: Bottom
    north_m: float
    east_m: float
    radius_m: float
    height_m: float
    depth_min_m: float = 0.2

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m."""
        depth_m = self.base.depth_at(north_m, east_m)
        north_m, east_m, radius_m = north_m - self.north_m, east_m - self.east_m, self.radius_m
        if north_m >= radius_m or east_m >= radius_m or north_m <= -radius_m or east_m <= -radius_m:
            return depth_m  # nearly everywhere
        away_m = math.hypot(north_m, east_m)
        if depth_m is None or away_m >= self.radius_m:
            return depth_m
        rise_m = self.height_m * 0.5 * (1.0 + math.cos(math.pi * away_m / self.radius_m))
        return max(depth_m - rise_m, self.depth_min_m)


@dataclass(frozen=True, slots=True)
class Tide:
    """Any charted bottom under a water level of its own."""

    base: Bottom
    tide_m: float

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m."""
        depth_m = self.base.depth_at(north_m, east_m)
        return None if depth_m is None else max(depth_m + self.tide_m, 0.0)


class Soundings:
    """Charted soundings: inverse-distance mean of those within ``radius_m``, as the DUNE simulator does; else unknown."""

    def __init__(self, soundings: Iterable[Sounding], frame: LocalFrame, radius_m: float = 10.0) -> None:
        self._radius_m = radius_m
        self._cells: dict[tuple[int, int], list[tuple[float, float, float]]] = {}
        per_lat, per_lon = metres_per_radian(frame.lat_rad)
        for sounding in soundings:
            # To first order, plus the one second-order term that counts: a harbour is small.
            north = (sounding.lat_rad - frame.lat_rad) * per_lat
            east = (
                (sounding.lon_rad - frame.lon_rad)
                * per_lon
                * (1.0 - north * math.tan(frame.lat_rad) / SEMI_MAJOR_AXIS_M)
            )
            north += 0.5 * east * east * math.tan(frame.lat_rad) / SEMI_MAJOR_AXIS_M
            self._cells.setdefault(self._cell(north, east), []).append((north, east, sounding.depth_m))

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m; None with no sounding near."""
        row, column = self._cell(north_m, east_m)
        weights = depths = 0.0
        for i in range(row - 1, row + 2):
            for j in range(column - 1, column + 2):
                for north, east, depth_m in self._cells.get((i, j), ()):
                    away_m = math.hypot(north - north_m, east - east_m)
                    if away_m <= self._radius_m:
                        near_m = max(away_m, 0.01)
                        weight = 1.0 / (near_m * near_m)
                        weights += weight
                        depths += weight * depth_m
        return depths / weights if weights else None

    def _cell(self, north_m: float, east_m: float) -> tuple[int, int]:
        return math.floor(north_m / self._radius_m), math.floor(east_m / self._radius_m)


class Charted:
    """A depth chart as the real bottom; ``beyond`` where it knows nothing."""

    def __init__(self, chart: DepthGrid, frame: LocalFrame, beyond: Bottom | None) -> None:
        self._chart, self._frame, self._beyond = chart, frame, beyond

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m; None where neither knows."""
        depth_m = self._chart.depth_at(*self._frame.to_geodetic(north_m, east_m))
        if depth_m is None and self._beyond is not None:
            return self._beyond.depth_at(north_m, east_m)
        return depth_m


def make_bottom(config: BottomConfig, frame: LocalFrame | None = None, chart: DepthGrid | None = None) -> Bottom:
    """Build the configured bottom. ``frame``: the simulation's plane, needed for kinds ``file`` and ``chart``."""
    bottom: Bottom = Flat(config.depth_m)
    if config.kind == "chart":
        if chart is None or frame is None:
            raise ValueError("a bottom of kind 'chart' needs depth.map.file and a place on earth")
        bottom = Charted(chart, frame, bottom if config.beyond else None)
    if config.kind == "file":
        if config.file is None or frame is None:
            raise ValueError("a bottom of kind 'file' needs a file of soundings and a place on earth")
        bottom = Soundings(parse(no_device(config.file).read_text("utf-8"), config.file.name), frame)
    if config.kind == "synthetic":
        if config.slope is not None:
            slope = config.slope
            bottom = Slope(bottom, slope.gradient, math.radians(slope.bearing_deg), slope.start_m)
        for mound in config.mounds:
            bottom = Mound(bottom, mound.north_m, mound.east_m, mound.radius_m, mound.height_m)
    return Tide(bottom, config.tide_m) if config.tide_m else bottom
