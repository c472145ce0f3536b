"""The ways that a vessel may take next: along her path, and straight on where she does not follow it."""

from __future__ import annotations

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast

from .lookahead import PathAhead, strays, way_ahead


def ways(state: EstimatedState, path_ahead: PathAhead | None, reach_m: float, step_m: float) -> list[list[NorthEast]]:
    """The way along the path; and the one straight on, when there is no path or the vessel does not follow it."""
    path = path_ahead(reach_m) if path_ahead is not None else ()
    found = [way_ahead(state, path, reach_m, step_m)]
    if path and strays(state, path):
        found.append(way_ahead(state, None, reach_m, step_m))
    return found
