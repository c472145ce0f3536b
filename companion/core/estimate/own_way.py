"""What the vessel's own way tells: of a heading that is in question, and of a receiver that repeats itself.

Her way through the water is made by thrust, along the bow; her way over ground by that and by the water, which ``water`` knows.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import GpsFix

from .water import NOWHERE, WAY_MPS, WaterMeans, part_of, towards

_OWN_SHARE: Final = 0.6
"""Of a way through the water thrust makes at least this by the file, with the share that was learnt. Else the water has begun to move."""
_PART_SHARE: Final = 0.4
"""A file whose thrust and drag are wrong by half explains so much of a way that is all by thrust."""
_SETS_IN_MPS: Final = 1.2
"""Water may begin to move so fast within a silence. A heading that would need more, where she makes good way, is wrong."""
_STEADY_S: Final = 1.0
_STEADY_COS: Final = 0.966
"""A course within 15 degrees of its mean of so long is steady: in a turn of 15 degrees a second it lags by as much itself."""
_ASTERN_MPS: Final = 0.3
"""Modelled way astern from which on the course is that of the stern: less is a hull that has just been stopped."""

_Pair = tuple[float, float]


class OwnWay:
    """What the way through the water says of a heading: by thrust, or by water that has begun to move."""

    def __init__(self, water: WaterMeans) -> None:
        self.ground_mps: _Pair | None = None
        """Over ground, NED, at the last tick; None without a position."""
        self.modelled_mps: _Pair | None = None
        """Surge and sway by thrust; None where unknown."""
        self.least_mps = 0.0
        """A slower way tells of no heading."""
        self._water = water
        self._lately_mps = NOWHERE

    def step(self, dt_s: float, ground_mps: _Pair | None) -> None:
        """Take the velocity of this tick."""
        self.ground_mps = ground_mps
        if ground_mps is not None:
            self._lately_mps = towards(self._lately_mps, ground_mps, part_of(dt_s, _STEADY_S))

    @property
    def stern_rad(self) -> float:
        """How far the bow is from where thrust takes the vessel: half round while she goes astern."""
        return math.pi if self.modelled_mps is not None and self.modelled_mps[0] < -_ASTERN_MPS else 0.0

    def goes_against(self, psi_rad: float) -> bool:
        """Whether she makes way elsewhere than a heading points."""
        ground = self.ground_mps
        return ground is not None and self._water.goes_against(psi_rad + self.stern_rad, ground, self.least_mps)

    def is_driven(self) -> bool:
        """Whether thrust may explain how fast she goes by a file that is wrong by half: what carries her at rest is no way of hers."""
        return self.is_hers(_PART_SHARE)

    def is_hers(self, share: float = _OWN_SHARE) -> bool:
        """Whether thrust may well explain how fast she goes: else the water is not what it was."""
        if self.ground_mps is None or self.modelled_mps is None:
            return True
        made_mps = abs(self.modelled_mps[0]) * (1.0 + self._water.made_share)
        return made_mps >= share * math.hypot(*self._water.through_mps(self.ground_mps))

    def is_steady(self) -> bool:
        """Whether the course does not change: in a turn it lags behind the bow."""
        if self.ground_mps is None:
            return False
        (north, east), (before_n, before_e) = map(self._water.through_mps, (self.ground_mps, self._lately_mps))
        made = math.hypot(north, east) * math.hypot(before_n, before_e)
        return north * before_n + east * before_e >= _STEADY_COS * made

    def denies(self, psi_rad: float) -> bool:
        """Whether no water that may have set in explains how she goes, with a heading."""
        if self.ground_mps is None or self.modelled_mps is None:
            return True
        north, east = self._water.through_mps(self.ground_mps)
        surge, sway = self.modelled_mps
        cos, sin = math.cos(psi_rad), math.sin(psi_rad)
        return math.hypot(north - surge * cos + sway * sin, east - surge * sin - sway * cos) > _SETS_IN_MPS


class MadeWay:
    """Whether the vessel makes way over ground: a receiver that then repeats itself is frozen."""

    def __init__(self) -> None:
        self._place: tuple[float | None, float | None] | None = None
        self._drift_mps = NOWHERE

    def is_made(self, fix: GpsFix, psi_rad: float | None, *, water_mps: float | None, drift_mps: _Pair) -> bool:
        """By what the fix says, or by the vessel's motion through the water and the drift, m/s north and east.

        The drift as it was when the position last changed: a receiver that repeats itself teaches a wrong one.
        """
        if (fix.lat_rad, fix.lon_rad) != self._place:
            self._place, self._drift_mps = (fix.lat_rad, fix.lon_rad), drift_mps
        if fix.sog_mps is not None and fix.sog_mps > WAY_MPS:
            return True
        if water_mps is None or psi_rad is None:
            return water_mps is not None and abs(water_mps) > WAY_MPS
        north, east = self._drift_mps
        return math.hypot(water_mps * math.cos(psi_rad) + north, water_mps * math.sin(psi_rad) + east) > WAY_MPS
