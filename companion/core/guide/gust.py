"""Gusts from the side, felt by how they turn the hull.

A gust shows in the turning at once and in the way that it makes seconds later; a boat with slow propellers that waits for
the way has lost half a metre. What turns the hull beyond its own actuators is the wind's moment, and that over the moment
per radian says where the wind stands. A compass that is late, or a file that is wrong about the moments, makes such a moment
too, and more of it the more the boat works: what swings wider than wind does is believed less.
"""

from __future__ import annotations

from mavlink_bridge.language.units import clamp, wrap_pi

from ..hull import VesselConfig

_TAU_S = 0.4
"""Poles of the moment: a tenth of a gust's time, and four values of a compass of 10 Hz."""
_MOST_RAD = 0.6
"""No gust turns the wind further."""
_USUAL_S = 20.0
"""What lasts longer is no gust: a propeller that pulls aside, a rudder that is off."""
_SWINGS_RAD = 0.22
"""RMS of a gusty wind's direction, as it is felt on ten hulls with true files (0.13 to 0.19) and a little more. Late compasses and
wrong files felt 0.24 to 0.6."""


class GustObserver:
    """Fed by whoever has the force model: its yaw acceleration without wind, beside the measured rate."""

    def __init__(self, vessel: VesselConfig) -> None:
        hull = vessel.hull
        self._inertia_kgm2 = hull.turning_kgm2
        self._swings_rad2 = _SWINGS_RAD * _SWINGS_RAD
        self.begin(0.0, 0.0)

    def begin(self, psi_rad: float, r_radps: float) -> None:
        """Start anew from this heading and yaw rate."""
        self._r_radps = r_radps
        """Yaw rate as modelled."""
        self._moment_nm = 0.0
        """What it takes to keep it right."""
        self._once_rad = self._twice_rad = psi_rad
        """The heading as late as the moment is: after one of its poles, and after both."""
        self._usual_rad = 0.0
        self.off_rad = 0.0
        """How far to starboard of its usual direction the wind stands now, as far as that is believed."""

    def step(
        self, dt_s: float, *, psi_rad: float, r_radps: float, dr_radps2: float, against_rad: float, nm_per_rad: float
    ) -> None:
        """Take one tick. ``dr_radps2``: the model's yaw acceleration; ``against_rad``: where the push comes from on the whole;
        ``nm_per_rad``: the moment, if wind is all of the push, for each radian that it stands off the bow.
        """
        off_radps = r_radps - self._r_radps
        self._r_radps += (dr_radps2 + self._moment_nm / self._inertia_kgm2 + 2.0 / _TAU_S * off_radps) * dt_s
        self._moment_nm += self._inertia_kgm2 * off_radps * dt_s / (_TAU_S * _TAU_S)
        part = min(dt_s / _TAU_S, 1.0)
        self._once_rad = wrap_pi(self._once_rad + part * wrap_pi(psi_rad - self._once_rad))
        self._twice_rad = wrap_pi(self._twice_rad + part * wrap_pi(self._once_rad - self._twice_rad))
        most_nm = _MOST_RAD * nm_per_rad
        if most_nm <= 0.0:
            self._usual_rad = self.off_rad = 0.0
            return
        # wind from starboard turns the bow to port
        aside_rad = -_MOST_RAD * clamp(self._moment_nm / most_nm, -1.0, 1.0)
        seen_rad = wrap_pi(self._twice_rad + aside_rad - against_rad)
        self._usual_rad = wrap_pi(self._usual_rad + wrap_pi(seen_rad - self._usual_rad) * dt_s / _USUAL_S)
        off_rad = wrap_pi(seen_rad - self._usual_rad)
        self._swings_rad2 += (off_rad * off_rad - self._swings_rad2) * dt_s / _USUAL_S
        believed = min(_SWINGS_RAD * _SWINGS_RAD / self._swings_rad2, 1.0)
        self.off_rad = believed * believed * off_rad
