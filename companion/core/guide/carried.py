"""Whether a vessel that held its point is carried off it, or only its position: the anchor watch of a boat that has no anchor."""

from __future__ import annotations

from typing import Final

_FAR_M: Final = 10.0
"""Ten times what is held in 10 m/s of wind."""
_ALONE_TIMES: Final = 2.0
"""A boat that turns only under way circles its point, or sails back to it, at up to 10 m."""
_BACK: Final = 0.5
"""Share of the distance below which it is back."""
_LEAP_S: Final = 3.0
"""A step of the position is followed within a second; in three no boat that holds its point goes half of ``_FAR_M`` unseen."""
_LEAPT: Final = 0.5
"""Share of the distance that the way over ground does not account for: then the position has leapt, and not the boat."""


class CarriedOff:
    """Follows the distance from one point; tells at ``_FAR_M``, and again at each doubling."""

    def __init__(self) -> None:
        self._was_near = False
        self._told_m = self._leapt_m = 0.0
        self._last_m: float | None = None

    def step(self, dt_s: float, distance_m: float, sog_mps: float | None, *, near: bool, turns_at_rest: bool) -> str:
        """Return what to tell the operator, empty when there is nothing. ``near``: the point counts as reached."""
        self._follow_leap(dt_s, distance_m, sog_mps)
        self._was_near = self._was_near or near
        far_m = _FAR_M if turns_at_rest else _ALONE_TIMES * _FAR_M
        if distance_m < _BACK * far_m:
            self._told_m = 0.0
        if not self._was_near or distance_m < max(far_m, 2.0 * self._told_m):
            return ""
        self._told_m = distance_m
        if self._leapt_m > _LEAPT * distance_m:
            return f"position leapt to {distance_m:.0f} m off its point, as no boat goes: look at the receiver"
        return f"carried {distance_m:.0f} m off its point; it goes on trying"

    def _follow_leap(self, dt_s: float, distance_m: float, sog_mps: float | None) -> None:
        """What the distance has grown by of late beyond the way that was made."""
        if self._last_m is not None and sog_mps is not None:
            gained_m = distance_m - self._last_m - sog_mps * dt_s
            self._leapt_m = max(0.0, (1.0 - dt_s / _LEAP_S) * self._leapt_m + gained_m)
        self._last_m = distance_m
