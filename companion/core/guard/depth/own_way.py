"""The way that a vessel makes: towards her bow, and of her own, without what wind and current do to her."""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import EstimatedState


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
