"""How the vessel answers the helm, worked out once from its file: authority, damping in yaw, turning ability.

Tables over speed, so that controllers and guidance look numbers up instead of solving for them each tick.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .forces import ForceModel
from .left import WHOLE, Shares, shared_ahead_n
from .settling import settled
from .statics import Statics, drag_n, top_speed_mps
from .thrust import ThrustLaw
from .vessel_file import VesselConfig

_TURNS_AWAY_PER_S = 1.0
"""Growth of the turn rate beyond which a helmsman, or a light hand on the helm, is late."""
_POINTS = 9
"""Speeds of the tables; between them values change by less than the file's own error."""
_STEP_S = 0.05
"""Euler's step: one tick,"""
_RUN_STEPS = 200
"""and how many: by 10 s the turn of a hull of this size is steady."""
_SLOWEST_ALONE = 0.02
"""Where a lone thruster turns the hull against all helm, rad/s: a turn the other way waits for more speed."""


_SLOWED = 0.75
"""Share of her way that a boat keeps in a turn that matters more."""

SLOW_SHARE = 1.0 / 3.0
"""Share of the top speed at which it is judged how quickly a turn is taken up: there rudders have little flow."""
BRAKED_SHARE = 0.5
"""Share of one thruster's astern thrust that a steering law slows her with under way: the rest is left for the turn."""
TURN_S = 8.0
"""Wind and current set a stopped boat for so long, until its bow is round and it holds its place: any of the shipped hulls."""
_SURGE_RAD = 0.8
"""Phase that a speed loop may lose by propellers and sensors at its bandwidth: it keeps 44 degrees."""
_SEEN_LATE_S = 0.2
"""Age of a speed: half the time between fixes, and the filter's."""

_Tables = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Linear and quadratic damping, greatest yaw rate, sway over yaw rate: each over speed."""
_KEPT: dict[VesselConfig, _Tables] = {}
"""Of vessels with whole thrusters: at a start four parts ask for the same, and it is most of the work of a start."""
_KEPT_MOST = 16
"""A vessel has one file; only trials of many hulls in one process have more."""


@dataclass(frozen=True, slots=True)
class YawAuthority:
    """Yaw moments in Nm that are to be had at a steady speed."""

    rudder_nm: float
    """Both rudders at their limit, in the race of the thrust that holds the speed."""
    differential_nm: float
    """Differential thrust without giving up speed."""


class Handling:
    """Tables of one vessel from rest to top speed (through the water)."""

    def __init__(self, vessel: VesselConfig) -> None:
        self.vessel = vessel
        self.model = ForceModel(vessel)
        self._law = ThrustLaw(vessel)
        self._shares = WHOLE
        self.drag_n = Statics(vessel).drag_n
        """Resistance in N at a speed through the water in m/s."""
        self.top_mps = top_speed_mps(vessel)
        self._speeds = [self.top_mps * k / (_POINTS - 1) for k in range(_POINTS)]
        self._per_mps = (_POINTS - 1) / self.top_mps
        tables = _KEPT.get(vessel) or self._kept()
        self._linear, self._quadratic, self._rates, self._sway = tables
        hull = vessel.hull
        self.sway_lag_s = hull.m22_kg / max(hull.yv + 0.3 * hull.yvv, 1.0)
        """How fast the sideways slip of a turn builds up."""
        self.surge_radps = _SURGE_RAD / (vessel.thruster.lag_s + _SEEN_LATE_S)
        """Bandwidth of a speed loop that slow propellers allow."""
        self.slows_mps2 = (
            self.drag_n(SLOW_SHARE * self.top_mps) + BRAKED_SHARE * vessel.thruster.astern_n
        ) / hull.m11_kg
        """Deceleration that she is sure of under way, at a third of the top speed: half of one thruster astern and the drag there."""
        self._steered_radps = math.inf
        self.takes_up_s = self._takes_up()
        """How long a turn takes from the order to its full rate, at a third of the top speed: there rudders have little flow."""

    def _takes_up(self) -> float:
        speed_mps = SLOW_SHARE * self.top_mps
        hull, given = self.vessel.hull, self.authority(speed_mps)
        moment_nm = given.rudder_nm + given.differential_nm
        if moment_nm <= 0.0:
            return 0.0
        lag_s = given.rudder_nm * self.vessel.helm_lag_s + given.differential_nm * self.vessel.thruster.lag_s
        inertia = hull.turning_kgm2
        return (lag_s + inertia * self._look_up(self._rates, speed_mps)) / moment_nm

    def _kept(self) -> _Tables:
        """Work the tables out, and keep them for whoever asks next."""
        if len(_KEPT) >= _KEPT_MOST:
            _KEPT.clear()
        damping = [self._damping(speed) for speed in self._speeds]
        rates, sway = (
            [self._steady_turn(speed) for speed in self._speeds],
            [self._leeway(speed) for speed in self._speeds],
        )
        tables = _KEPT[self.vessel] = (
            tuple(one for one, _ in damping),
            tuple(two for _, two in damping),
            tuple(rates),
            tuple(sway),
        )
        return tables

    def thrusters(self, shares: Shares) -> None:
        """Tabulate the turns anew for what each thruster still gives, port and starboard: those to the worse side."""
        self._shares = shares
        self._rates = tuple(self._steady_turn(speed) for speed in self._speeds)

    def steered_within(self, rate_radps: float) -> None:
        """Reckon with a steering law that turns the vessel no faster than this, rad/s, whatever the hull could."""
        self._steered_radps = rate_radps

    def authority(self, speed_mps: float) -> YawAuthority:
        """Return what rudders and thrusters can give at a steady speed."""
        vessel, law = self.vessel, self._law
        most_n = law.ahead_n * (1.0 - law.loss * speed_mps) if law.loss else law.ahead_n
        each_n = min(drag_n(vessel, speed_mps) / 2.0, most_n)
        slope = self.model.rudder_slope_nm(speed_mps, each_n, each_n)
        rudder = 0.5 * slope * math.sin(2.0 * vessel.rudder.useful_rad) if vessel.rudder.count else 0.0
        spare_n = min(most_n - each_n, law.astern_n + each_n)
        return YawAuthority(rudder, 2.0 * self.model.lateral_m * spare_n)

    def reach_radps(self, speed_mps: float, error_rad: float) -> float:
        """Return the bandwidth of a heading loop at which an error just uses up the yaw authority at a speed, rad/s."""
        given = self.authority(speed_mps)
        return math.sqrt((given.rudder_nm + given.differential_nm) / (self.vessel.hull.turning_kgm2 * error_rad))

    def yaw_damping(self, speed_mps: float) -> tuple[float, float]:
        """Return (linear, quadratic) damping of the steadily turning hull, Nm/(rad/s) and Nm/(rad/s)²."""
        place = speed_mps * self._per_mps
        linear, quadratic = self._linear, self._quadratic
        if place <= 0.0:
            return linear[0], quadratic[0]
        if place >= _POINTS - 1:
            return linear[-1], quadratic[-1]
        k = int(place)
        part = place - k
        return linear[k] + part * (linear[k + 1] - linear[k]), quadratic[k] + part * (quadratic[k + 1] - quadratic[k])

    @property
    def turns_away(self) -> bool:
        """Whether the hull, left alone at half of her speed, turns away by herself, faster with each second."""
        return self.yaw_damping(0.5 * self.top_mps)[0] < -_TURNS_AWAY_PER_S * self.vessel.hull.turning_kgm2

    def rate_for(self, moment_nm: float) -> float:
        """Return the steady yaw rate of the resting hull under a moment, rad/s."""
        linear, quadratic = max(self._linear[0], 1e-3), self._quadratic[0]
        if quadratic < 1e-6:
            return moment_nm / linear
        return (math.sqrt(linear * linear + 4.0 * quadratic * moment_nm) - linear) / (2.0 * quadratic)

    def moment_for(self, rate_radps: float) -> float:
        """Return the moment that turns the resting hull steadily at a yaw rate, Nm: the inverse of ``rate_for``."""
        return (max(self._linear[0], 1e-3) + self._quadratic[0] * rate_radps) * rate_radps

    def max_yaw_rate(self, speed_mps: float) -> float:
        """Return the greatest steady yaw rate at a speed through the water, rad/s."""
        return min(self._look_up(self._rates, speed_mps), self._steered_radps)

    @property
    def slow_turn_radps(self) -> float:
        """Return the greatest steady yaw rate under way at a third of the top speed, rad/s: most boats turn round faster."""
        return self.max_yaw_rate(SLOW_SHARE * self.top_mps)

    def yaw_rate_for_way(self, speed_mps: float) -> float:
        """Return the greatest yaw rate of a turn that may cost a quarter of the speed through the water, rad/s.

        Near full speed all thrust drives a boat without rudders: holding her speed she turns hardly at all.
        """
        return max(self.max_yaw_rate(speed_mps), self.max_yaw_rate(_SLOWED * speed_mps))

    def sway_per_rate(self, speed_mps: float) -> float:
        """Return the sideways slip of a steady gentle turn over its yaw rate, m (negative: outwards)."""
        return self._look_up(self._sway, speed_mps)

    def turn_radius_m(self, speed_mps: float) -> float:
        """Return the radius of the tightest steady turn at a speed through the water."""
        return speed_mps / max(self.max_yaw_rate(speed_mps), 1e-3)

    def _look_up(self, table: tuple[float, ...], speed_mps: float) -> float:
        place = speed_mps * self._per_mps
        if place <= 0.0:
            return table[0]
        if place >= _POINTS - 1:
            return table[-1]
        k = int(place)
        return table[k] + (place - k) * (table[k + 1] - table[k])

    def _damping(self, speed_mps: float) -> tuple[float, float]:
        slow, fast = 0.05, 0.35
        gentle = self._turning_moment(speed_mps, slow) / slow
        hard = self._turning_moment(speed_mps, fast) / fast
        quadratic = max(0.0, (hard - gentle) / (fast - slow))
        return gentle - quadratic * slow, quadratic

    def _turning_moment(self, speed_mps: float, rate: float) -> float:
        """Yaw moment that holds a yaw rate with rudders amidships, sway in balance, Nm."""
        hull, thrust_n = self.vessel.hull, drag_n(self.vessel, speed_mps) / 2.0

        def slips(v: float, _: float) -> tuple[float, float]:
            _, dv, dr = self._rates_of((speed_mps, v, rate), (thrust_n, thrust_n))
            return dv + hull.m23_kgm / hull.m22_kg * dr, 0.0

        v, _ = settled(slips, 0.2, 60)
        _, dv, dr = self._rates_of((speed_mps, v, rate), (thrust_n, thrust_n))
        return -(hull.m23_kgm * dv + hull.m33_kgm2 * dr)

    def _leeway(self, speed_mps: float) -> float:
        """Sway over yaw rate in a gentle turn by the rudders, whose side force adds to the slip."""
        hull, rate = self.vessel.hull, 0.1
        thrust_n = drag_n(self.vessel, speed_mps) / 2.0

        def slips(v: float, _: float) -> tuple[float, float]:
            _, dv, dr = self._rates_of((speed_mps, v, rate), (thrust_n, thrust_n))
            moment = -(hull.m23_kgm * dv + hull.m33_kgm2 * dr)
            side_n = moment / self.vessel.rudder.x_m if self.vessel.rudder.count and speed_mps > 0.5 else 0.0
            return dv + (hull.m23_kgm * dr + side_n) / hull.m22_kg, 0.0

        v, _ = settled(slips, 0.15, 120)
        return v / rate

    def _steady_turn(self, speed_mps: float) -> float:
        """Steady yaw rate with rudders hard over and all the differential that the speed leaves."""
        each_n = drag_n(self.vessel, speed_mps) / 2.0
        if self._shares != WHOLE:
            port_n, starboard_n = shared_ahead_n(self.vessel, self._shares, 2.0 * each_n)
            return max(self._turn(speed_mps, port_n, starboard_n, to_port=port_n > starboard_n), _SLOWEST_ALONE)
        authority = self.authority(speed_mps)
        half_n = authority.differential_nm / (2.0 * max(self.model.lateral_m, 1e-6)) if self.model.lateral_m else 0.0
        return max(self._turn(speed_mps, each_n + half_n, each_n - half_n), 1e-3)

    def _turn(self, speed_mps: float, port_n: float, starboard_n: float, *, to_port: bool = False) -> float:
        """Yaw rate that a turn under this thrust and full helm settles at, positive when it goes that way."""
        sense = -1.0 if to_port else 1.0
        angle = sense * self.vessel.rudder.useful_rad if self.vessel.rudder.count else 0.0

        def turns(v: float, r: float) -> tuple[float, float]:
            _, dv, dr = self._rates_of((speed_mps, v, r), (port_n, starboard_n), angle)
            return dv, dr

        _, r = settled(turns, _STEP_S, _RUN_STEPS)
        return sense * r

    def _rates_of(
        self, through: tuple[float, float, float], thrust_n: tuple[float, float], rudder_rad: float = 0.0
    ) -> tuple[float, float, float]:
        u, v, r = through
        return self.model.rates(
            u,
            v,
            r,
            thrust_port_n=thrust_n[0],
            thrust_starboard_n=thrust_n[1],
            rudder_port_rad=rudder_rad,
            rudder_starboard_rad=rudder_rad,
        )
