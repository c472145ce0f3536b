"""Whether a loiter is too tight for the weather: judged by how far off its path the vessel really sails."""

from __future__ import annotations

import math
from typing import Final

_JOINED_S: Final = 15.0
"""Joining the path has its own transient."""
_CROSSED_S: Final = 45.0
"""And so long has a boat that has only crossed it, and must turn round to join it; one that never looks along it is told of then."""
_TOUCH_M: Final = 1.0
"""So near the path the boat counts as on it."""
_MEAN_S: Final = 10.0
"""The error is judged by its mean over about a third of a tight circle."""
_LEAST_M, _SHARE = 0.6, 0.15
"""Off by more than this, and than this share of the radius, is more than gusts and waves do to a path that can be sailed."""
_PAST: Final = 0.8
"""Share of its greatest at which the error is past it. It comes and goes once a lap: told as it grew, it was a tenth of the whole."""
_WAITS_S: Final = 30.0
"""An error that does not come back is told after so long, a lap of a tight circle."""
_MORE: Final = 1.5
"""It is told again when it has been greater by so much: the first lap is sailed from the join, and is the best."""


class TightWatch:
    """Follows the error on one loiter; tells the greatest so far, and again when there was a much greater one."""

    def __init__(self) -> None:
        self._near = self._begun = False
        self._told_m = 0.0
        self._clear()

    def _clear(self) -> None:
        self._joined_s = self._square_m2 = self._worst_m = 0.0
        self._due_s: float | None = None
        """For how long something has been due to be told."""

    def step(self, dt_s: float, *, near: bool, cross_m: float, radius_m: float) -> str:
        """Return what to tell the operator, empty when there is nothing. ``radius_m``: of the tightest bend."""
        if near and not self._near:
            self._near = self._begun = True
            self._clear()
        self._begun = self._begun or abs(cross_m) < _TOUCH_M
        if not self._begun or dt_s <= 0.0:
            return ""
        self._joined_s += dt_s
        self._square_m2 += min(dt_s / _MEAN_S, 1.0) * (cross_m * cross_m - self._square_m2)
        if self._joined_s < (_JOINED_S if self._near else _CROSSED_S):
            return ""
        off_m = abs(cross_m)
        self._worst_m = max(self._worst_m, off_m)
        if not self._is_due(dt_s, radius_m) or (off_m > _PAST * self._worst_m and (self._due_s or 0.0) < _WAITS_S):
            return ""
        self._told_m, self._due_s = self._worst_m, None
        return (
            f"Loiter of {radius_m:.1f} m radius is tighter than wind and current allow: up to {self._told_m:.1f} m off its path; "
            "a greater one would be held"
        )

    def _is_due(self, dt_s: float, radius_m: float) -> bool:
        is_off = math.sqrt(self._square_m2) >= max(_LEAST_M, _SHARE * radius_m)
        if self._due_s is not None:
            self._due_s += dt_s
        elif is_off and self._worst_m >= _MORE * self._told_m:
            self._due_s = 0.0
        return self._due_s is not None
