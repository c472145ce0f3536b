"""Two small observers beside the estimator: the drift of the water, and what kind of fix the operator is told of."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import FixType, GpsFix, Severity

_TELL_AFTER_US: Final = 2_000_000
"""A kind of fix that changes back within this is not told."""
_FIX_TEXT: Final = {
    FixType.NONE: "no fix",
    FixType.FIX_2D: "2-D fix",
    FixType.FIX_3D: "3-D fix",
    FixType.DGPS: "differential fix",
    FixType.RTK_FLOAT: "RTK float",
    FixType.RTK_FIXED: "RTK fixed",
}


_NOISE2: Final = 1.0
"""Variance of one sample, m2/s2: gusts and waves last for many samples, so that each alone counts for little."""
_DRIFT_SIGMA: Final = 0.5
"""m/s: most of the water that small boats sail in moves slower than twice this."""
_SHARE_SIGMA: Final = 0.25
"""How wrong a file's speed through the water may well be: thrust and drag by half, each."""
_FOULS_S: Final = 3600.0
"""What the hull makes of its thrust changes over an hour: trim, a battery that sags, weed."""
_CORNER_S: Final = 8.0
"""A heading is a new one against the mean of this time: longer than a turn lasts, shorter than a leg."""
_CORNER_COS: Final = 0.64
"""... when it is 50 degrees off. Only then the share is learnt: on one heading what changes along the bow is the water."""
_JOLT_S: Final = 1.2
"""What the samples say over this time is compared with the drift: longer than a turn's transient of sway lasts at full size."""
_JOLT_MPS: Final = 0.25
"""Beyond this much off the drift the water has changed: more than gusts, waves and turns leave in the samples."""
_QUICK_S: Final = 1.5
"""Time constant of the drift while it has that far to go."""
_TURNING_RADPS: Final = 0.12
"""7 degrees a second: what steering keeps straight in waves turns less."""
_SLIPS_S: Final = 2.5
"""After a turn the slip of the small hulls has died away by then."""
_SLIP_MPS: Final = 0.4
"""For so long after a turn faster than that the hull may slip by up to this more than its file says: no change of the water."""


class DriftFilter:
    """The water's drift, NED, told apart from what the hull's file says wrongly of the speed through the water.

    A Kalman filter with three states: velocity over ground = drift + (1 + share) * speed through the water, along the bow.
    The drift is a slow random walk with a direction of its own; the share turns with the hull. So the first corner tells
    them apart, and a file that is wrong by half no longer passes for a current that jumps at each corner. On one heading
    they cannot be told apart: there the share is held and only reckoned with (Schmidt's filter). Where the water itself
    changes (eddies, shear lines) the drift is quick until it has caught up.
    """

    def __init__(self) -> None:
        self.north_mps: float | None = None
        self.east_mps: float | None = None
        self.share = 0.0
        """What the hull makes more through the water than its file says, over what the file says."""
        # covariances: n, e of the drift, s of the share
        self._nn = self._ee = _DRIFT_SIGMA * _DRIFT_SIGMA
        self._ss = _SHARE_SIGMA * _SHARE_SIGMA
        self._ne = self._ns = self._es = 0.0
        self._off_n = self._off_e = 0.0
        self._straight_s = 0.0
        self._bow_n = self._bow_e = 0.0
        self._learns = False

    def step(
        self,
        dt_s: float,
        tau_s: float,
        *,
        ground: tuple[float, float],
        bow: tuple[float, float],
        through: tuple[float, float],
        r_radps: float,
    ) -> None:
        """Take one sample.

        ``ground``: velocity over ground, m/s NED. ``bow``: unit vector that the hull points along, NED. ``through``: surge
        and sway through the water by the file, m/s. ``r_radps``: turn rate. ``tau_s``: time constant that the drift ends at.
        """
        self._straight_s = 0.0 if r_radps * r_radps > _TURNING_RADPS * _TURNING_RADPS else self._straight_s + dt_s
        if self.north_mps is None or self.east_mps is None:
            self.north_mps = self.east_mps = 0.0
        cos, sin = bow
        surge, sway = through
        self._learns = self._cornered(dt_s, cos, sin)
        walk = _NOISE2 * dt_s * dt_s / (tau_s * tau_s)
        self._nn += walk
        self._ee += walk
        self._ss = min(self._ss + _SHARE_SIGMA * _SHARE_SIGMA * dt_s / _FOULS_S, _SHARE_SIGMA * _SHARE_SIGMA)
        north_mps, east_mps = ground[0] + sway * sin, ground[1] - sway * cos
        made = (1.0 + self.share) * surge
        off_n, off_e = north_mps - made * cos - self.north_mps, east_mps - made * sin - self.east_mps
        self._jolt(dt_s, off_n, off_e, surge_n=surge * cos, surge_e=surge * sin)
        self._correct(off_n, 1.0, 0.0, surge * cos)
        self._correct(east_mps - (1.0 + self.share) * surge * sin - self.east_mps, 0.0, 1.0, surge * sin)

    def _cornered(self, dt_s: float, cos: float, sin: float) -> bool:
        """True from when the bow leaves the heading of the last seconds until the new one has become that."""
        part = dt_s / _CORNER_S if dt_s < _CORNER_S else 1.0
        self._bow_n += part * (cos - self._bow_n)
        self._bow_e += part * (sin - self._bow_e)
        along = self._bow_n * cos + self._bow_e * sin
        return along < _CORNER_COS * math.hypot(self._bow_n, self._bow_e)

    def _jolt(self, dt_s: float, off_n: float, off_e: float, surge_n: float, surge_e: float) -> None:
        """Know the drift less well while the samples of the last second are far off what is expected of them."""
        part = dt_s / _JOLT_S if dt_s < _JOLT_S else 1.0
        self._off_n += part * (off_n - self._off_n)
        self._off_e += part * (off_e - self._off_e)
        least_mps = _JOLT_MPS if self._straight_s > _SLIPS_S else _SLIP_MPS
        if self._off_n * self._off_n + self._off_e * self._off_e > least_mps * least_mps:
            least = _NOISE2 * dt_s / _QUICK_S
            north, east = surge_n * self._ss + 2.0 * self._ns, surge_e * self._ss + 2.0 * self._es
            self._nn += max(least - self._nn - surge_n * north, 0.0)
            self._ee += max(least - self._ee - surge_e * east, 0.0)

    def _correct(self, off_mps: float, n: float, e: float, s: float) -> None:
        """Kalman's update by one component of the velocity, which depends on the states by ``n``, ``e`` and ``s``."""
        by_n = self._nn * n + self._ne * e + self._ns * s
        by_e = self._ne * n + self._ee * e + self._es * s
        by_s = self._ns * n + self._es * e + self._ss * s
        inverse = 1.0 / (n * by_n + e * by_e + s * by_s + _NOISE2)
        assert self.north_mps is not None
        assert self.east_mps is not None
        self.north_mps += by_n * inverse * off_mps
        self.east_mps += by_e * inverse * off_mps
        if self._learns:
            self.share += by_s * inverse * off_mps
            self._ss -= by_s * by_s * inverse
        self._nn -= by_n * by_n * inverse
        self._ee -= by_e * by_e * inverse
        self._ne -= by_n * by_e * inverse
        self._ns -= by_n * by_s * inverse
        self._es -= by_e * by_s * inverse


class FixText:
    """Says the kind of fix when it has changed and stays so for two seconds."""

    def __init__(self, texts: list[tuple[Severity, str]]) -> None:
        self._texts = texts
        self._told: FixType | None = None
        self._new_us: int | None = None

    def note(self, fix: GpsFix) -> None:
        """Take every fix."""
        if fix.fix_type == self._told:
            self._new_us = None
        elif self._new_us is None:
            self._new_us = fix.t_us
        elif fix.t_us - self._new_us >= _TELL_AFTER_US:
            self._told, self._new_us = fix.fix_type, None
            severity = Severity.WARNING if fix.fix_type == FixType.NONE else Severity.INFO
            used = "" if fix.satellites is None else f", {fix.satellites} satellites"
            self._texts.append((severity, f"GNSS: {_FIX_TEXT[fix.fix_type]}{used}"))
