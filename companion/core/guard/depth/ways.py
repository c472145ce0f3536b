"""The ways of a vessel: what she makes towards her bow and of her own, and what she may take next, along her path or straight on."""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast

from .lookahead import PathAhead, strays, way_ahead


def headway_mps(state: EstimatedState | None) -> float:
    """Speed over ground towards the bow, m/s: a boat that is set sideways, or goes astern already, has no way to take off."""
    if state is None or state.sog_mps is None:
        return 0.0
    if state.psi_rad is None or state.vx_mps is None or state.vy_mps is None:
        return state.sog_mps
    return state.vx_mps * math.cos(state.psi_rad) + state.vy_mps * math.sin(state.psi_rad)


def own_way(state: EstimatedState) -> tuple[float, float]:
    """The way that the vessel makes of her own, m/s north and east: through the water or over ground, whichever is less."""
    north, east = state.vx_mps, state.vy_mps
    if north is None or east is None:
        return state.sog_mps or 0.0, 0.0
    over_ground = north, east
    through_water = north - (state.drift_n_mps or 0.0), east - (state.drift_e_mps or 0.0)
    return min(over_ground, through_water, key=lambda way: math.hypot(*way))


def ways(state: EstimatedState, path_ahead: PathAhead | None, reach_m: float, step_m: float) -> list[list[NorthEast]]:
    """The way along the path; and the one straight on, when there is no path or the vessel does not follow it."""
    path = path_ahead(reach_m) if path_ahead is not None else ()
    found = [way_ahead(state, path, reach_m, step_m)]
    if path and strays(state, path):
        found.append(way_ahead(state, None, reach_m, step_m))
    return found
