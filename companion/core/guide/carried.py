"""Whether a vessel that held its point is carried off it: the anchor watch of a boat that has no anchor."""

from __future__ import annotations

from typing import Final

_FAR_M: Final = 10.0
"""Ten times what is held in 10 m/s of wind."""
_ALONE_TIMES: Final = 2.0
"""A boat that turns only under way circles its point, or sails back to it, at up to 10 m."""
_BACK: Final = 0.5
"""Share of the distance below which it is back."""


class CarriedOff:
    """Follows the distance from one point; tells at ``_FAR_M``, and again at each doubling."""

    def __init__(self) -> None:
        self._was_near = False
        self._told_m = 0.0

    def step(self, distance_m: float, *, near: bool, turns_at_rest: bool) -> str:
        """Return what to tell the operator, empty when there is nothing. ``near``: the point counts as reached."""
        self._was_near = self._was_near or near
        far_m = _FAR_M if turns_at_rest else _ALONE_TIMES * _FAR_M
        if distance_m < _BACK * far_m:
            self._told_m = 0.0
        if not self._was_near or distance_m < max(far_m, 2.0 * self._told_m):
            return ""
        self._told_m = distance_m
        return f"carried {distance_m:.0f} m off its point; it goes on trying"
