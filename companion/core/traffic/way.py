"""A vessel's straight way, out of all her reports since she went straight: a filter of place and velocity, the same for both axes.

Her receiver's course is two degrees off in each report; two places five minutes apart tell her velocity to a few centimetres
a second. Both count by their variances. A report that fits neither begins a new way.
"""

from __future__ import annotations

import math
from typing import Final

WANDER_M2PS3: Final = 0.2 * 0.2 / 180.0
"""Variance that her velocity gains in a second, (m/s)2: by helm and stream 0.2 m/s after three minutes."""
_FITS_SIGMAS: Final = 3.0
_BOTH: Final = math.sqrt(2.0)
"""Two axes."""


class Way:
    """Place is kept as north and east from the newest report, metres; variances are those of one axis."""

    __slots__ = ("_cross", "_east_m", "_north_m", "_place", "_rate", "vx_mps", "vy_mps")

    def __init__(self, vx_mps: float, vy_mps: float, place_m: float, rate_mps: float) -> None:
        """``place_m`` and ``rate_mps``: one sigma of the report."""
        self.vx_mps, self.vy_mps = vx_mps, vy_mps
        self._north_m = self._east_m = 0.0
        self._place, self._cross, self._rate = place_m * place_m, 0.0, rate_mps * rate_mps

    @property
    def off_m(self) -> tuple[float, float]:
        """North and east from the newest report to where the whole way puts her."""
        return self._north_m, self._east_m

    @property
    def rate_mps(self) -> float:
        """One sigma of the velocity, each axis."""
        return math.sqrt(self._rate)

    def join(
        self, moved_m: tuple[float, float], told: tuple[float, float], dt_s: float, sigmas: tuple[float, float]
    ) -> bool:
        """Take a further report; False: she no longer goes this way, which is then of no more use.

        ``moved_m``: from the report before to this one; ``told``: its velocity; ``sigmas``: of its place, m, and of its velocity, m/s.
        """
        self._carry(dt_s)
        place2, rate2 = sigmas[0] * sigmas[0], sigmas[1] * sigmas[1]
        north, east = moved_m[0] - self._north_m, moved_m[1] - self._east_m
        vn, ve = told[0] - self.vx_mps, told[1] - self.vy_mps
        if not (_fits(north, east, self._place + place2) and _fits(vn, ve, self._rate + rate2)):
            return False
        share, gain = self._place / (self._place + place2), self._cross / (self._place + place2)
        self._north_m, self._east_m = self._north_m + share * north, self._east_m + share * east
        self.vx_mps, self.vy_mps = self.vx_mps + gain * north, self.vy_mps + gain * east
        self._rate -= gain * self._cross
        self._place, self._cross = self._place * (1.0 - share), self._cross * (1.0 - share)
        vn, ve = told[0] - self.vx_mps, told[1] - self.vy_mps
        share, gain = self._rate / (self._rate + rate2), self._cross / (self._rate + rate2)
        self.vx_mps, self.vy_mps = self.vx_mps + share * vn, self.vy_mps + share * ve
        self._north_m += gain * vn - moved_m[0]
        self._east_m += gain * ve - moved_m[1]
        self._place -= gain * self._cross
        self._rate, self._cross = self._rate * (1.0 - share), self._cross * (1.0 - share)
        return True

    def _carry(self, dt_s: float) -> None:
        self._north_m += self.vx_mps * dt_s
        self._east_m += self.vy_mps * dt_s
        self._place += dt_s * (2.0 * self._cross + dt_s * (self._rate + WANDER_M2PS3 * dt_s / 3.0))
        self._cross += dt_s * (self._rate + 0.5 * WANDER_M2PS3 * dt_s)
        self._rate += WANDER_M2PS3 * dt_s


def _fits(one: float, other: float, variance: float) -> bool:
    return math.hypot(one, other) <= _FITS_SIGMAS * _BOTH * math.sqrt(variance)
