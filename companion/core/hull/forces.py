"""The force model: from thrust, rudder angles and outside forces to the accelerations of the hull through the water.

Used by the simulator (integrated at 50-100 Hz), by the controller's observer and feed-forward, and by the tuning tool.
Equations: vessel-control §1.2 (Fossen's 3-DOF form; steady current enters by relative velocity alone).
"""

from __future__ import annotations

import math
from math import atan2, cos, sin, sqrt

from .vessel_file import RHO_WATER, VesselConfig

RHO_AIR = 1.225
"""kg/m³: the standard atmosphere at sea level and 15 degrees Celsius."""


class ForceModel:
    """Hull and rudders of one vessel. All numbers are fixed at construction; the object holds no state."""

    def __init__(self, vessel: VesselConfig) -> None:
        hull, thruster, rudder, wind = vessel.hull, vessel.thruster, vessel.rudder, vessel.windage
        self.vessel = vessel
        self._m11, self._m22, self._m23, self._m33 = hull.m11_kg, hull.m22_kg, hull.m23_kgm, hull.m33_kgm2
        self._det = self._m22 * self._m33 - self._m23 * self._m23
        self._munk_kg = hull.munk * (hull.m22_kg - hull.m11_kg)
        self._damping = (hull.xu, hull.xuu, hull.yv, hull.yvv, hull.nr, hull.nrr, hull.nur)
        strip_m = hull.length_m / 5.0
        self._strip = RHO_WATER * hull.draught_m * hull.crossflow_cd * strip_m
        self._strips_m = tuple(strip_m * k for k in (-2, -1, 0, 1, 2)) if hull.crossflow_cd > 0.0 else ()
        self.lateral_m = thruster.lateral_m if thruster.count == 2 else 0.0
        self.race_per_n = thruster.race_share * 8.0 / (math.pi * RHO_WATER * thruster.diameter_m * thruster.diameter_m)
        if thruster.count == 1:
            self.race_per_n *= 2.0
        area_m2 = rudder.area_m2 * rudder.count / 2.0
        self.lift = 0.5 * RHO_WATER * area_m2 * rudder.lift_slope_per_rad
        self._x_m = rudder.x_m
        self._stall_rad = math.radians(rudder.stall_deg)
        self._after_stall = rudder.after_stall
        self._astern = -rudder.astern_share
        self._half_sin = rudder.lift_shape == "half-sin-2"
        q = 0.5 * RHO_AIR
        self._wind_x = q * wind.cx * wind.frontal_m2
        self._wind_y = q * wind.cy * wind.lateral_m2
        self._wind_n = -2.0 * q * wind.cn * wind.lateral_m2 * hull.length_m

    @property
    def turns_at_rest(self) -> bool:
        """Whether a difference of thrust turns it: a rudder without way on and without race turns nothing."""
        return self.vessel.thruster.turns

    def rates(
        self,
        u: float,
        v: float,
        r: float,
        thrust_port_n: float,
        thrust_starboard_n: float,
        rudder_port_rad: float,
        rudder_starboard_rad: float,
        surge_n: float = 0.0,
        sway_n: float = 0.0,
        yaw_nm: float = 0.0,
    ) -> tuple[float, float, float]:
        """Return (du, dv, dr): accelerations for velocities through the water (m/s, rad/s) and outside forces (N, Nm)."""
        xu, xuu, yv, yvv, nr, nrr, nur = self._damping
        m22, m23, lateral_m = self._m22, self._m23, self.lateral_m
        speed = u if u >= 0.0 else -u
        # Coriolis and damping forces on the bare hull
        x = -(xu + xuu * speed) * u + m22 * v * r + m23 * r * r
        y = -(yv + yvv * (v if v >= 0.0 else -v)) * v - self._m11 * u * r
        n = -(nr + nrr * (r if r >= 0.0 else -r) + nur * speed) * r - self._munk_kg * u * v - m23 * u * r
        for at_m in self._strips_m:
            across = v + at_m * r
            drag = self._strip * abs(across) * across
            y -= drag
            n -= drag * at_m
        x += surge_n + thrust_port_n + thrust_starboard_n
        y += sway_n
        n += yaw_nm + lateral_m * (thrust_port_n - thrust_starboard_n)
        if self.lift > 0.0:
            at_m, aside = self._x_m, lateral_m * r
            flow = v + at_m * r
            cosine, sine = cos(rudder_port_rad), sin(rudder_port_rad)
            force = self._rudder(u + aside, flow, thrust_port_n, rudder_port_rad)
            along, across = force * sine, force * cosine
            x -= along if along >= 0.0 else -along
            y -= across
            n -= at_m * across
            if rudder_starboard_rad != rudder_port_rad:
                cosine, sine = cos(rudder_starboard_rad), sin(rudder_starboard_rad)
            force = self._rudder(u - aside, flow, thrust_starboard_n, rudder_starboard_rad)
            along, across = force * sine, force * cosine
            x -= along if along >= 0.0 else -along
            y -= across
            n -= at_m * across
        det = self._det
        return x / self._m11, (self._m33 * y - m23 * n) / det, (m22 * n - m23 * y) / det

    def actuator_forces(
        self, through: tuple[float, float, float], thrust_n: tuple[float, float], rudder_rad: float | None
    ) -> tuple[float, float]:
        """Return surge force (N) and yaw moment (Nm) of both thrusters and both rudders at (u, v, r) through the water.

        Rudders at None trail with the flow: no force.
        """
        (u, v, r), (port_n, starboard_n) = through, thrust_n
        x, n = port_n + starboard_n, self.lateral_m * (port_n - starboard_n)
        if self.lift > 0.0 and rudder_rad is not None:
            aside, flow = self.lateral_m * r, v + self._x_m * r
            cosine, sine = cos(rudder_rad), sin(rudder_rad)
            port = self._rudder(u + aside, flow, port_n, rudder_rad)
            starboard = self._rudder(u - aside, flow, starboard_n, rudder_rad)
            x -= abs(port * sine) + abs(starboard * sine)
            n -= self._x_m * cosine * (port + starboard)
        return x, n

    def _rudder(self, along: float, across: float, thrust_n: float, delta: float) -> float:
        """Normal force of one rudder, N: inflow from the hull's motion and the propeller race."""
        share = 1.0
        if thrust_n > 0.0:
            flow2 = self.race_per_n * thrust_n
            if along > 0.0:
                flow2 += along * along
            alpha = delta + atan2(across, sqrt(flow2))
        else:
            flow2 = along * along
            if along >= 0.0:
                alpha = delta + atan2(across, along)
            else:
                alpha = delta - atan2(across, -along)
                share = self._astern
        stall = self._stall_rad
        if alpha > stall or alpha < -stall:
            share *= self._after_stall
            alpha = stall if alpha > 0.0 else -stall
        lift = 0.5 * sin(2.0 * alpha) if self._half_sin else sin(alpha)
        return self.lift * share * (flow2 + across * across) * lift

    def wind(self, air_surge_mps: float, air_sway_mps: float) -> tuple[float, float, float]:
        """Return (X, Y, N) in N and Nm of air that moves with this velocity relative to the hull, body axes."""
        a, b = air_surge_mps, air_sway_mps
        speed = math.hypot(a, b)
        return self._wind_x * speed * a, self._wind_y * speed * b, self._wind_n * a * b

    def rudder_slope_nm(self, surge_mps: float, thrust_port_n: float, thrust_starboard_n: float) -> float:
        """Return the yaw moment per radian of both rudders together, Nm/rad, at small angles, in the race."""
        ahead2 = surge_mps * surge_mps if surge_mps > 0.0 else 0.0
        port_n = thrust_port_n if thrust_port_n > 0.0 else 0.0
        starboard_n = thrust_starboard_n if thrust_starboard_n > 0.0 else 0.0
        flow2 = 2.0 * ahead2 + self.race_per_n * (port_n + starboard_n)
        return -self._x_m * self.lift * flow2
