"""A plan held against the owner's chart, as the vessel does at the upload: too shallow, or how much of it nobody knows."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.plans import PlanFile

from ...configuration import depth_map
from ...core.guard.depth.grid import DepthGrid, PlanLeg, check_plan, unknown_share
from ...core.guard.depth.plan_legs import plan_legs
from ...settings import Settings, load_vessel

_DRAWN: Final = 60
"""Points looked at on each leg for the drawing: as many as it has letters."""


@dataclass(frozen=True, slots=True)
class ChartedWater:
    """What the chart says of a plan."""

    refused: tuple[str, ...] = ()
    told: tuple[str, ...] = ()
    unknown_rad: tuple[tuple[float, float], ...] = ()
    """Places on the way, latitude and longitude, whose depth the chart does not know."""


def water_of(plan: PlanFile, settings: Settings) -> ChartedWater:
    """Hold a plan against the chart of the settings. Raises ConfigError for a chart that cannot be read."""
    depth = settings.depth
    grid = depth_map(depth.map) if depth.enabled else None
    if grid is None:
        return ChartedWater()
    legs = plan_legs(compile_items(plan.mission).plan.maneuvers, None, settings.guidance.loiter_radius_m)
    keel_m = load_vessel(settings.vessel).keel_depth_m
    shallow = check_plan(grid, legs, depth.min_altitude_m - depth.map_offset_m(keel_m))
    refused = () if shallow is None else (f"item {shallow.seq}: {shallow.reason}",)
    share = unknown_share(grid, legs)
    told = (f"chart {depth.map.file}: {grid_words(grid)}", unknown_words(share))
    return ChartedWater(refused, told, tuple(_unknown(grid, legs)))


def unknown_words(share: float) -> str:
    """How much of a plan the chart does not know."""
    if share <= 0.0:
        return "all of this plan lies in charted water"
    return f"{_percent(share)} of this plan lies in unknown water"


def _percent(share: float) -> str:
    return "less than 1 %" if share < 0.01 else f"{100.0 * share:.0f} %"


def grid_words(grid: DepthGrid) -> str:
    """Where a grid lies, how large it is and what it knows."""
    per_lat, per_lon = metres_per_radian(grid.lat0_rad)
    north_m, east_m = grid.rows * grid.dlat_rad * per_lat, grid.columns * grid.dlon_rad * per_lon
    lat, lon = grid.lat0_rad + 0.5 * grid.rows * grid.dlat_rad, grid.lon0_rad + 0.5 * grid.columns * grid.dlon_rad
    place = f"{north_m / 1000.0:.1f} x {east_m / 1000.0:.1f} km about {math.degrees(lat):.4f} {math.degrees(lon):.4f}"
    known = f"cells of {grid.pitch_m:.1f} m, {_percent(grid.known_share())} known"
    depths = grid.depths_m()
    return f"{place}, {known}" + ("" if depths is None else f", {depths[0]:.1f} to {depths[1]:.1f} m below datum")


def chart_warnings(grid: DepthGrid | None) -> list[str]:
    """What is odd about a chart as a whole."""
    depths = None if grid is None else grid.depths_m()
    if grid is None or (depths is not None and depths[1] > 0.0):
        return []
    what = "knows no depth" if depths is None else f"lies above datum everywhere, {depths[0]:.1f} to {depths[1]:.1f} m"
    return [f"depth.map.file: the chart {what}; depths are metres, positive downwards"]


def _unknown(grid: DepthGrid, legs: list[PlanLeg]) -> list[tuple[float, float]]:
    found = []
    for leg in legs:
        for start, end in itertools.pairwise(leg.points_rad):
            for step in range(_DRAWN + 1):
                share = step / _DRAWN
                place = start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
                if grid.depth_at(*place) is None and all(map(math.isfinite, place)):
                    found.append(place)
    return found
