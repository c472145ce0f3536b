"""What pushes a vessel that keeps its station: wind and current together, as a force on the hull, whatever its heading.

Near its point a vessel needs no more than that: where the bow must look, and how strong it is. The drift of the estimator
is no help there: it is ground velocity less the modelled speed through the water, so the thrust that holds against wind
makes a "drift" out of itself that turns with the bow, and the manoeuvre feeds what it steers by. Here the forces are
balanced over ground instead: what moves the hull beyond its own thrust and damping is the push. It is kept north and east,
so that a turning hull does not turn it.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from mavlink_bridge.language.units import clamp

from ..hull import Handling
from ..hull.actuator_model import ActuatorModel
from ..hull.left import Shares
from .gust import GustObserver

_TAU_S = 4.0
"""Poles of the observer: longer than a gust's first shove, shorter than the way a boat loses meanwhile."""
_SLOW_MPS = 0.7
"""Faster over ground the hull's own damping is most of the balance: the push stays as it is known."""
_SMALL_MPS = 0.2
"""The speed at which the hull's drag across and along are compared: a boat on station is about as slow."""
_ON_THE_SPOT = 0.14
"""Differential thrust of a gentle turn on the spot, over the sum of full thrust ahead and astern: the error is learnt in half a turn."""
_WRONG_MOST = 0.5
"""As wrong as a file may well be about thrust astern over thrust ahead."""
_STIFF = 0.2
"""Moment per radian over the yaw inertia, 1/s², of a wind that a soft heading loop (about 0.8) is no match for."""


class PushObserver:
    """Estimates the push in newtons as it acts along the hull, north and east.

    A hull answers a push from abeam more than one from ahead: wind by its side area, current by its sway damping. The
    push from abeam is scaled down by the mean of both, so that the direction is right on average before the bow has
    come to look at it, and exact when it does.
    """

    def __init__(self, handling: Handling) -> None:
        vessel = handling.vessel
        hull, wind = vessel.hull, vessel.windage
        self._rates = handling.model.rates
        self._drag_n = handling.drag_n
        self._m11, self._m22 = hull.m11_kg, hull.m22_kg
        by_area = wind.frontal_m2 * wind.cx > 0.0
        by_wind = wind.cy * wind.lateral_m2 / (wind.cx * wind.frontal_m2) if by_area else 2.0
        by_water = (hull.yv + hull.yvv * _SMALL_MPS) / max(hull.xu + hull.xuu * _SMALL_MPS, 1e-6)
        self._broad = math.sqrt(max(by_wind, 0.5) * max(by_water, 0.5))
        self._turning_m = (
            2.0 * wind.cn * wind.lateral_m2 * hull.length_m / (wind.cx * wind.frontal_m2) if by_area else 0.5
        )
        self._stiff_nm = _STIFF * hull.m33_kgm2
        self._actuators = ActuatorModel(vessel)
        thruster = vessel.thruster
        turns = handling.model.lateral_m > 0.0
        self._turning_n = _ON_THE_SPOT * (thruster.ahead_n + thruster.astern_n) if turns else math.inf
        self._turns_with = 0.0
        """Thrust ahead that comes with a turn on the spot and is not in the file, over the differential thrust."""
        self.north_n = self.east_n = 0.0
        self._u_mps = self._v_mps = 0.0
        self._gust = GustObserver(vessel)
        self._running = False

    def begin(self, drift: tuple[float, float]) -> None:
        """Start with what the estimator takes for drift, m/s north and east: the best guess after a voyage."""
        mps = math.hypot(drift[0], drift[1])
        share = self._drag_n(mps) / mps if mps > 1e-6 else 0.0
        self.north_n, self.east_n = share * drift[0], share * drift[1]
        self._running = False
        self._actuators.clear()

    def forget(self) -> None:
        """What was taken for a push was none."""
        self.north_n = self.east_n = 0.0

    def thrusters(self, shares: Shares) -> None:
        """Reckon with what each thruster still gives of what it is told."""
        self._actuators.shares = shares

    @property
    def strength_n(self) -> float:
        return math.hypot(self.north_n, self.east_n)

    @property
    def against_rad(self) -> float:
        """Where the push comes from: the heading that faces it."""
        return math.atan2(-self.east_n, -self.north_n)

    @property
    def firmness(self) -> float:
        """How much the wind, if it were all of the push, would turn the bow away, over what a soft heading loop bears; 0 to 1."""
        return min(1.0, self._turning_m * self.strength_n / self._stiff_nm)

    @property
    def gust_rad(self) -> float:
        """How far to starboard of its usual direction the wind stands now, as far as that is believed."""
        return self._gust.off_rad

    def counter_nm(self, psi_rad: float) -> float:
        """Yaw moment that takes what the wind, gust and all, turns a bow away with that looks there; none where that is little."""
        off_rad = self.against_rad + self._gust.off_rad - psi_rad
        return 0.5 * self.firmness * self._turning_m * self.strength_n * math.sin(2.0 * off_rad)

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> None:
        """Take one tick: the state, and what went out during it."""
        actuators = self._actuators
        actuators.step(dt_s, sent)
        psi, u, v, r = state.psi_rad, state.u_mps, state.v_mps, state.r_radps
        if psi is None or u is None or v is None or dt_s <= 0.0:
            self._running = False
            return
        if not self._running or math.hypot(u, v) > _SLOW_MPS:
            self._running = True
            self._u_mps, self._v_mps = u, v
            self._gust.begin(psi, r or 0.0)
            return
        cos, sin = math.cos(psi), math.sin(psi)
        ahead_n = self.north_n * cos + self.east_n * sin
        differential_n = 0.5 * abs(actuators.port_n - actuators.starboard_n)
        ahead_n += self._turns_with * differential_n
        abeam_n = self._broad * (self.east_n * cos - self.north_n * sin)
        angle = actuators.rudder_rad
        du, dv, dr = self._rates(
            self._u_mps,
            self._v_mps,
            r or 0.0,
            thrust_port_n=actuators.port_n,
            thrust_starboard_n=actuators.starboard_n,
            rudder_port_rad=angle,
            rudder_starboard_rad=angle,
            surge_n=ahead_n,
            sway_n=abeam_n,
        )
        off_u, off_v = u - self._u_mps, v - self._v_mps
        self._u_mps += (du + 2.0 / _TAU_S * off_u) * dt_s
        self._v_mps += (dv + 2.0 / _TAU_S * off_v) * dt_s
        gain = dt_s / (_TAU_S * _TAU_S)
        more = gain * self._m11 * off_u * differential_n / (self._turning_n * self._turning_n)
        self._turns_with = clamp(self._turns_with + more, -_WRONG_MOST, _WRONG_MOST)
        more_n, aside_n = gain * self._m11 * off_u, gain * self._m22 / self._broad * off_v
        self.north_n += more_n * cos - aside_n * sin
        self.east_n += more_n * sin + aside_n * cos
        if r is not None:
            nm_per_rad = self._turning_m * self.strength_n
            self._gust.step(
                dt_s, psi_rad=psi, r_radps=r, dr_radps2=dr, against_rad=self.against_rad, nm_per_rad=nm_per_rad
            )
