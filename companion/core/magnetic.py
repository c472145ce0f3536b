"""Magnetic variation from the World Magnetic Model, for compasses that show magnetic north and say no more."""

from __future__ import annotations

import math
from typing import Final

from pygeomag import GeoMag
from pygeomag.wmm.wmm_2025 import WMM_2025

from mavlink_bridge.language.messages import GpsFix

_FIRST_DAY_US: Final = 1_735_689_600_000_000
"""2025-01-01, the model's epoch."""
_YEAR_US: Final = 365.25 * 86_400e6
"""A Julian year, as the model reckons."""
_YEARS_VALID: Final = 5.0
"""The World Magnetic Model is made anew every five years."""
_NEAR_RAD: Final = 0.001
"""6 km: the variation changes by less than 0.1 degree, except beside the magnetic poles."""
_KEPT_US: Final = 86_400_000_000
"""A day: the variation moves by 0.2 degrees a year at most where boats sail."""


class MagneticModel:
    """Variation at a place and time, remembered until the vessel is 6 km or a day further."""

    def __init__(self) -> None:
        self._model = GeoMag(coefficients_data=WMM_2025)
        self._known: tuple[float, float, int] | None = None
        self._variation_rad: float | None = None

    def variation_rad(self, lat_rad: float, lon_rad: float, utc_us: int) -> float | None:
        """East positive, at sea level, WMM2025 (NOAA/BGS), good to about 0.5 degree.

        None outside the model's five years and in its blackout zones about the magnetic poles, where no compass steers.
        """
        if self._known is None or not self._still_good(lat_rad, lon_rad, utc_us):
            self._known = (lat_rad, lon_rad, utc_us)
            self._variation_rad = self._compute(lat_rad, lon_rad, utc_us)
        return self._variation_rad

    def _still_good(self, lat_rad: float, lon_rad: float, utc_us: int) -> bool:
        assert self._known is not None
        lat, lon, at_us = self._known
        return abs(lat_rad - lat) < _NEAR_RAD and abs(lon_rad - lon) < _NEAR_RAD and abs(utc_us - at_us) < _KEPT_US

    def _compute(self, lat_rad: float, lon_rad: float, utc_us: int) -> float | None:
        years = (utc_us - _FIRST_DAY_US) / _YEAR_US
        if not 0.0 <= years <= _YEARS_VALID:
            return None
        found = self._model.calculate(
            glat=math.degrees(lat_rad), glon=math.degrees(lon_rad), alt=0.0, time=2025.0 + years
        )
        return None if found.in_blackout_zone else math.radians(found.d)


class FixVariation:
    """The variation where a receiver says that the vessel is; the model is read when it is asked for the first time."""

    def __init__(self) -> None:
        self._model: MagneticModel | None = None

    def of(self, fix: GpsFix | None) -> float | None:
        if fix is None or fix.utc_us is None or fix.lat_rad is None or fix.lon_rad is None:
            return None
        if self._model is None:
            self._model = MagneticModel()
        return self._model.variation_rad(fix.lat_rad, fix.lon_rad, fix.utc_us)
