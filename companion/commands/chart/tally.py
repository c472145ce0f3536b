"""What a chart is seen to hold while it is read: its range and samples for the reader, and what cannot be meant."""

from __future__ import annotations

import math
from typing import Final

from ...core.guard.depth.soundings import UNKNOWN_M
from .source import Block, ChartError, ChartSource

_DEEPEST_M: Final = 11_100.0
"""Challenger Deep is 10 935 m."""
_HIGHEST_M: Final = 9_000.0
_MOST: Final = 0.5

Place = tuple[float, float, float]
"""Latitude and longitude in degrees, depth in m below the wanted datum."""


class BlockTally:
    """Takes every block; ``refuse`` afterwards what cannot be meant, ``lines`` for the rest."""

    def __init__(self, source: ChartSource, dry_m: float) -> None:
        """``dry_m``: land is no higher than this."""
        self._source, self._dry_m = source, dry_m
        self.read = self.known = self.kept = 0
        self._wrong_side = 0
        self._low, self._high = math.inf, -math.inf
        self._sentinels: dict[float, int] = {}
        self.shallowest: Place | None = None
        self.deepest: Place | None = None
        self.first: Place | None = None

    def add(self, block: Block) -> None:
        """Count one block."""
        self.read += block.cells
        self.known += len(block.raw)
        self.kept += len(block.depth_m)
        if len(block.raw):
            self._low, self._high = min(self._low, float(block.raw.min())), max(self._high, float(block.raw.max()))
            self._wrong_side += int((self._source.in_unit(block.raw) < 0.0).sum())
            for value in UNKNOWN_M:
                if self._low <= value <= self._high:
                    self._sentinels[value] = self._sentinels.get(value, 0) + int((block.raw == value).sum())
        if len(block.depth_m):
            self._sample(block)

    def refuse(self) -> None:
        """Raises ChartError for values that cannot be meant, with the mend."""
        for value, count in self._sentinels.items():
            if count:
                share = 100.0 * count / self.known
                raise ChartError(
                    f"the value {value:g} stands in {count} cells ({share:.1f} %): that is 'unknown', not a depth; "
                    f"say --nodata={value:g}"
                )
        if self.known:
            self._refuse_the_sign()
        if self.shallowest is None or self.deepest is None or self.deepest[2] <= -self._dry_m:
            raise ChartError("no depth in it (nodata, land, or outside the box)")
        if self.deepest[2] > _DEEPEST_M or self.shallowest[2] < -_HIGHEST_M:
            raise ChartError(
                f"depths from {self.shallowest[2]:.0f} to {self.deepest[2]:.0f} m: no sea is like that; "
                f"say --unit, --positive, or --nodata=VALUE (values from {self._low:g} to {self._high:g})"
            )

    def _refuse_the_sign(self) -> None:
        """A file that calls itself one thing and holds the other: land and sea would change places."""
        source, share = self._source, self._wrong_side / self.known
        if source.sign_said.startswith("--"):
            return
        if source.sign > 0.0 and share > _MOST:
            raise ChartError(
                f"{source.sign_said}, but {100.0 * share:.0f} % of its values are below zero, as heights are: "
                "say --positive up or --positive down"
            )
        if source.sign < 0.0 and share == 0.0:
            raise ChartError(
                f"{source.sign_said}, but no value is below zero: no sea in it, or depths: "
                "say --positive up or --positive down"
            )

    def lines(self, datum_m: float) -> list[str]:
        """What the owner should look at before he sails by it."""
        source = self._source
        sign = "depths (positive down)" if source.sign > 0.0 else "heights (positive up)"
        south, west, north, east = source.bounds_deg()
        size = _metres(source.lat_cell_deg, source.lon_cell_deg, 0.5 * (south + north))
        low, high = sorted((source.in_unit(self._low), source.in_unit(self._high)))
        told = [
            f"  values     {low:g} to {high:g} {source.unit_name}, {sign}: {source.sign_said}",
            f"  datum      {datum_m:+g} m on the file's zero level",
            f"  cells      {self.read} of {size[0]:.1f} x {size[1]:.1f} m, {100.0 * self.kept / self.read:.1f} % known",
            f"  box        {south:.5f} {west:.5f} to {north:.5f} {east:.5f} (south west, north east)",
        ]
        for name, place in (("shallowest", self.shallowest), ("deepest", self.deepest), ("for one", self.first)):
            if place is not None:
                told.append(f"  {name:10s} {place[2]:.2f} m below datum at {place[0]:.6f} {place[1]:.6f}")
        return told

    def _sample(self, block: Block) -> None:
        low, high = int(block.depth_m.argmin()), int(block.depth_m.argmax())
        if self.shallowest is None or block.depth_m[low] < self.shallowest[2]:
            self.shallowest = _place(block, low)
        if self.deepest is None or block.depth_m[high] > self.deepest[2]:
            self.deepest = _place(block, high)
        if self.first is None:
            self.first = _place(block, len(block.depth_m) // 2)


def _place(block: Block, number: int) -> Place:
    return float(block.lat_deg[number]), float(block.lon_deg[number]), float(block.depth_m[number])


def _metres(lat_deg: float, lon_deg: float, at_deg: float) -> tuple[float, float]:
    from mavlink_bridge.language.geodesy import metres_per_radian

    per_lat, per_lon = metres_per_radian(math.radians(at_deg))
    return math.radians(lat_deg) * per_lat, math.radians(lon_deg) * per_lon
