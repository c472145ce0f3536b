"""Depth runs: a hull driven straight at a bottom under the guard alone, for the slope table and for the benchmarks.

No navigation and no radio: hull, sounder, guard, and thrust cut (or astern) a fixed delay after the guard says so. The
figures of vessel-control §5.4 are made this way.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import DepthGrid
from companion.core.guard.depth.guard import DepthGuard
from companion.core.hull import VesselConfig
from companion.core.hull.geometry import geometry_of
from companion.core.hull.statics import command_for_thrust, drag_n, stopping_distance_m
from companion.core.hull.stopping import Braking
from companion.core.hull.thrust import ThrustLaw
from mavlink_bridge.language.messages import Distance, EstimatedState
from sitl.plant import SimVessel
from sitl.plant.bottom import Bottom

_STEP_US = 10_000
_TICK_US = 50_000
_SOUNDER_US = 100_000
_REST_MPS = 0.005
"""Heavy boats run on for a metre from 5 cm/s."""


@dataclass(frozen=True, slots=True)
class Noise:
    """The sounder's faults (vessel-control §1.3)."""

    sigma_m: float = 0.05
    drop: float = 0.02
    outlier: float = 0.01

    def read(self, rng: random.Random, true_m: float) -> float | None:
        """One reading of a true distance, m."""
        if rng.random() < self.drop:
            return None
        if rng.random() < self.outlier:
            return true_m * rng.choice((0.3, 0.5, 2.0))
        return true_m + rng.gauss(0.0, max(self.sigma_m, 0.005 * true_m)) if self.sigma_m > 0.0 else true_m


QUIET = Noise(0.0, 0.0, 0.0)


def under_way(vessel: VesselConfig, speed_mps: float) -> SimVessel:
    """Return the hull at a steady speed in still water, its propellers turning as that takes."""
    hull, law = SimVessel(vessel), ThrustLaw(vessel)
    hull.place(surge_mps=speed_mps)
    port_n = drag_n(vessel, speed_mps) * law.sides[0].ahead_n / law.all_ahead_n
    hull.revs = [law.revs(law.command(0, port_n, speed_mps))] * 2
    return hull


@dataclass
class DepthRun:
    """One approach due north from the origin at a steady speed."""

    vessel: VesselConfig
    bottom: Bottom
    speed_mps: float
    guard: DepthGuardConfig = field(default_factory=DepthGuardConfig)
    delay_s: float = 0.3
    noise: Noise = QUIET
    seed: int = 1
    grid: DepthGrid | None = None
    origin_rad: tuple[float, float] = (0.7188, -0.1519)
    limit_s: float = 3600.0
    slow: bool = True
    """Follow the guard's advice to go slower."""
    thruster_min: float = -1.0
    """The gate's least command."""

    def lowest_altitude_m(self) -> float:
        """Sail until stopped; return the least true altitude of the keel on the way, m."""
        return min(altitude for _, altitude in self.track())

    def track(self) -> list[tuple[float, float]]:
        """Sail until stopped; return (north m, true altitude m) each tick."""
        hull = under_way(self.vessel, self.speed_mps)
        guard = DepthGuard(self.guard, geometry_of(self.vessel))
        guard.set_map(self.grid)
        rng = random.Random(self.seed)
        braking, delay_us = Braking(self.vessel, least=self.thruster_min), round(self.delay_s * 1e6)
        cut_us: int | None = None
        brakes_until_us: int | None = None
        wanted_mps, now_us = self.speed_mps, 0
        made: list[tuple[float, float]] = []
        while now_us < self.limit_s * 1e6:
            state = self._state(hull, now_us)
            altitude_m = self._altitude(hull)
            made.append((hull.north_m, altitude_m))
            if now_us % _SOUNDER_US == 0:
                distance_m = altitude_m + self.vessel.keel_depth_m - self.vessel.transducer_depth_m
                guard.measure(Distance(now_us, self.noise.read(rng, distance_m)), state)
            is_active = cut_us is None or brakes_until_us is None
            out = guard.step(now_us, state, is_active, None, self._coasting, braking=braking)
            if cut_us is None and (out.abort or out.flags.depth_ahead or out.flags.depth_braking):
                cut_us = now_us + delay_us
            if cut_us is not None and brakes_until_us is None and not out.flags.depth_braking:
                brakes_until_us = now_us + delay_us
            if self.slow and out.slow_to_mps is not None:
                wanted_mps = min(self.speed_mps, out.slow_to_mps)
            for _ in range(_TICK_US // _STEP_US):
                if cut_us is None or now_us < cut_us:
                    command = self._command(hull.u_mps, wanted_mps)
                else:
                    command = self.thruster_min if brakes_until_us is None or now_us < brakes_until_us else 0.0
                hull.step(_STEP_US * 1e-6, command, command, 0.0, 0.0)
                now_us += _STEP_US
            if cut_us is not None and now_us > cut_us and hull.u_mps < _REST_MPS:
                break
        return made

    def _command(self, surge_mps: float, wanted_mps: float) -> float:
        if surge_mps > wanted_mps + 0.1:
            return 0.0
        return self._ahead(wanted_mps)

    def _ahead(self, speed_mps: float) -> float:
        return command_for_thrust(self.vessel, 0.5 * drag_n(self.vessel, speed_mps))

    def _coasting(self, speed_mps: float) -> float:
        return stopping_distance_m(self.vessel, speed_mps)

    def _altitude(self, hull: SimVessel) -> float:
        depth_m = self.bottom.depth_at(hull.north_m, hull.east_m)
        return (math.inf if depth_m is None else depth_m) - self.vessel.keel_depth_m

    def _state(self, hull: SimVessel, now_us: int) -> EstimatedState:
        # Near the origin the plane is flat enough for a sphere.
        lat, lon = self.origin_rad
        return EstimatedState(
            now_us,
            lat_rad=lat + hull.north_m / 6.36e6,
            lon_rad=lon,
            origin_lat_rad=lat,
            origin_lon_rad=lon,
            x_m=hull.north_m,
            y_m=hull.east_m,
            vx_mps=hull.vn_mps,
            vy_mps=hull.ve_mps,
            u_mps=hull.u_mps,
            psi_rad=hull.psi_rad,
            r_radps=hull.r_radps,
            sog_mps=math.hypot(hull.vn_mps, hull.ve_mps),
            cog_rad=math.atan2(hull.ve_mps, hull.vn_mps),
        )
