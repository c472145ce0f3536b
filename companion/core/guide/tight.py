"""Whether a loiter is too tight for the weather: judged by how far off its path the vessel really sails."""

from __future__ import annotations

import math

_JOINED_S = 15.0
"""Joining the path has its own transient."""
_TOUCH_M = 1.0
"""So near the path the boat counts as on it."""
_MEAN_S = 10.0
"""The error is told of as its mean over about a third of a tight circle."""
_LEAST_M, _SHARE = 0.6, 0.15
"""Off by more than this, and than this share of the radius, is more than gusts and waves do to a path that can be sailed."""


class TightWatch:
    """Follows the error on one loiter; tells once."""

    def __init__(self) -> None:
        self._joined_s = 0.0
        self._square_m2 = 0.0
        self._begun = self._told = False

    def step(self, dt_s: float, *, near: bool, cross_m: float, radius_m: float) -> str:
        """Return what to tell the operator, empty when there is nothing. ``radius_m``: of the tightest bend."""
        self._begun = self._begun or near or abs(cross_m) < _TOUCH_M
        if not self._begun or self._told or dt_s <= 0.0:
            return ""
        self._joined_s += dt_s
        self._square_m2 += min(dt_s / _MEAN_S, 1.0) * (cross_m * cross_m - self._square_m2)
        off_m = math.sqrt(self._square_m2)
        if self._joined_s < _JOINED_S or off_m < max(_LEAST_M, _SHARE * radius_m):
            return ""
        self._told = True
        return (
            f"Loiter of {radius_m:.1f} m radius is tighter than wind and current allow: {off_m:.1f} m off its path; "
            "it goes on, a greater radius would be held"
        )
