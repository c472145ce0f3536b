"""The force model and the propellers' law for many boats and many stretches of a voyage at once, as numpy arrays.

The equations stand in ``core/hull/forces.py`` and ``core/hull/thrust.py``; here they are a second time because those answer
one boat at a time, and a fit asks a hundred thousand times. A test holds both against each other. Shapes: coefficients
(boats, 1), states (boats, stretches), commands (steps, stretches); what there is a port and a starboard one of has a first axis
for them, of two, and is reckoned once for both: at these sizes it is the calls that take the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from ..core.hull.forces import RHO_AIR
from ..core.hull.vessel_file import RHO_WATER

Array = Any

STEP_S: Final = 0.05
"""Between two commands, as the vessel ticks."""
SUBSTEPS: Final = 3
"""The motion is integrated at 60 Hz: yaw dies away within a third of a second on a small hull."""
_EDGE: Final = 0.006
"""Width over which the dead band opens: a step has no slope to follow."""

_STALLING_RAD: Final = math.radians(1.0)
"""And over which a rudder stalls."""
_SIDES: Final = np.array([1.0, -1.0])[:, None, None]
"""Port, starboard: the way in which each one's thrust turns the bow."""

COEFFICIENTS: Final = (
    *("m11", "m22", "m23", "m33", "xu", "xuu", "yv", "yvv", "nr", "nrr", "nur", "munk"),
    *("ahead", "astern", "exponent", "starboard_share", "lag", "dead_band", "speed_loss"),
    *("area", "offset", "rudder_lag", "race_share"),
)

WIND_MOMENTS: Final = ("wind_turns_oblique", "wind_turns_abeam")
"""Of the coefficient of the wind's moment, what the file does not know."""


def coefficients(vessel: VesselConfig) -> dict[str, float]:
    """Return what a fit may change of a vessel, by short names, SI and radians."""
    hull, thruster, rudder = vessel.hull, vessel.thruster, vessel.rudder
    found = {name: getattr(hull, name) for name in ("xu", "xuu", "yv", "yvv", "nr", "nrr", "nur", "munk")}
    found |= {"m11": hull.m11_kg, "m22": hull.m22_kg, "m23": hull.m23_kgm, "m33": hull.m33_kgm2}
    found |= {"ahead": thruster.ahead_n, "astern": thruster.astern_n, "exponent": thruster.exponent}
    found |= {"starboard_share": thruster.starboard_share, "lag": thruster.lag_s, "dead_band": thruster.dead_band}
    found |= {"speed_loss": thruster.speed_loss, "area": rudder.area_m2, "offset": rudder.offset_rad}
    return found | {"rudder_lag": max(rudder.lag_s, 0.01), "race_share": thruster.race_share}


@dataclass(frozen=True, slots=True)
class Commands:
    """What was sent, and where the boat pointed: (steps, stretches). Wind in m/s, towards where the air goes, NED."""

    port: Array
    starboard: Array
    rudder_rad: Array
    psi_rad: Array


@dataclass(frozen=True, slots=True)
class Drawn:
    """What the modelled yaw rate is drawn to while a stretch is sailed: ``rate`` (steps, stretches), NaN where nothing was heard."""

    rate: Array
    per_s: float


class HullArrays:
    """What of a vessel is the same for all boats: geometry, windage, shapes of laws."""

    def __init__(self, vessel: VesselConfig) -> None:
        hull, thruster, rudder, wind = vessel.hull, vessel.thruster, vessel.rudder, vessel.windage
        self.rudders = rudder.count
        self._half = 0.5 if thruster.count == 1 else 1.0
        self._single = thruster.count == 1
        self.lateral_m = thruster.lateral_m if thruster.count == 2 else 0.0
        self._curve = np.array(thruster.curve).T if thruster.curve else None
        """Commands and shares of full thrust."""
        self._exponent_astern = thruster.exponent_astern
        """None: as ahead."""
        self._race = (16.0 if self._single else 8.0) / (math.pi * RHO_WATER * thruster.diameter_m**2)
        self._lift = 0.5 * RHO_WATER * rudder.count / 2.0 * rudder.lift_slope_per_rad
        self._x_m, self._stall = rudder.x_m, math.radians(rudder.stall_deg)
        self._after, self._astern, self._half_sin = rudder.after_stall, rudder.astern_share, rudder.lift_shape != "sin"
        self._max_rad, self._rate = rudder.max_rad, math.radians(rudder.rate_dps)
        q = 0.5 * RHO_AIR
        self._wind = (q * wind.cx * wind.frontal_m2, q * wind.cy * wind.lateral_m2)
        self._wind_n = -2.0 * q * wind.cn * wind.lateral_m2 * hull.length_m
        self._wind_unit_n = q * wind.lateral_m2 * hull.length_m
        strip_m = hull.length_m / 5.0
        self._strip = RHO_WATER * hull.draught_m * hull.crossflow_cd * strip_m
        self._strips_m = tuple(strip_m * k for k in (-2, -1, 0, 1, 2)) if hull.crossflow_cd else ()

    def revs(self, c: dict[str, Array], command: Array) -> Array:
        """Share of full revolutions for commands -1...1."""
        size = np.abs(command)
        gate = 1.0 / (1.0 + np.exp(np.clip((c["dead_band"] - size) / _EDGE, -40.0, 40.0)))
        if self._curve is not None:
            share = np.interp(command, *self._curve)
            return np.sign(share) * gate * np.sqrt(np.abs(share))
        exponent = c["exponent"]
        if self._exponent_astern is not None:
            exponent = np.where(command > 0.0, exponent, self._exponent_astern)
        return np.sign(command) * gate * np.maximum(size, 1e-9) ** (0.5 * exponent)

    def thrust(self, c: dict[str, Array], revs: Array, u: Array, shares: Array) -> Array:
        """Thrust of both sides, N; of what the file says of each side ``shares`` is there."""
        way = np.sign(revs)
        slip = c["speed_loss"] * np.maximum(way * u, 0.0)
        size = np.abs(revs)
        full = np.where(revs > 0.0, c["ahead"], c["astern"]) * (self._half * shares)
        return way * full * size * np.maximum(size - slip, 0.0)

    def rates(
        self, c: dict[str, Array], motion: tuple[Array, ...], drive: tuple[Array, ...], air: tuple[Array, ...]
    ) -> Any:
        """Accelerations (surge, sway, yaw) for motion (u, v, r), drive (thrust of both sides N, rudder rad), air (X, Y, N)."""
        u, v, r = motion
        thrust, angle = drive
        port, starboard = thrust
        speed = np.abs(u)
        m11, m22, m23, m33 = c["m11"], c["m22"], c["m23"], c["m33"]
        x = -(c["xu"] + c["xuu"] * speed) * u + m22 * v * r + m23 * r * r + air[0] + port + starboard
        y = -(c["yv"] + c["yvv"] * np.abs(v)) * v - m11 * u * r + air[1]
        n = -(c["nr"] + c["nrr"] * np.abs(r) + c["nur"] * speed) * r - c["munk"] * (m22 - m11) * u * v - m23 * u * r
        n = n + air[2] + self.lateral_m * (port - starboard)
        for at_m in self._strips_m:
            across = v + at_m * r
            drag = self._strip * np.abs(across) * across
            y, n = y - drag, n - drag * at_m
        if self.rudders:
            cosine, sine = np.cos(angle), np.sin(angle)
            along = u + _SIDES * (self.lateral_m * r)
            for force in self._rudders(c, along, v + self._x_m * r, thrust, angle):
                x, y, n = x - np.abs(force * sine), y - force * cosine, n - self._x_m * force * cosine
        det = m22 * m33 - m23 * m23
        return x / m11, (m33 * y - m23 * n) / det, (m22 * n - m23 * y) / det

    def _rudders(self, c: dict[str, Array], along: Array, across: Array, thrust: Array, angle: Array) -> Array:
        ahead = np.maximum(along, 0.0)
        driven = thrust > 0.0
        race2 = np.where(driven, self._race * c["race_share"] * thrust + ahead * ahead, along * along)
        backwards = ~driven & (along < 0.0)
        alpha = angle + np.where(backwards, -1.0, 1.0) * np.arctan2(across, np.sqrt(race2))
        beyond = 1.0 / (1.0 + np.exp(np.clip((self._stall - np.abs(alpha)) / _STALLING_RAD, -40.0, 40.0)))
        share = np.where(backwards, -self._astern, 1.0) * (1.0 - (1.0 - self._after) * beyond)
        alpha = np.clip(alpha, -self._stall, self._stall)
        lift = 0.5 * np.sin(2.0 * alpha) if self._half_sin else np.sin(alpha)
        return self._lift * c["area"] * share * (race2 + across * across) * lift

    def sail(
        self,
        c: dict[str, Array],
        commands: Commands,
        start: Array,
        wind: tuple[Array, Array],
        drift: Array,
        drawn: Drawn | None = None,
    ) -> Array:
        """Sail every boat through every stretch; return (steps, 3, boats, stretches): surge, sway, yaw rate through the water.

        ``start`` (3, boats, stretches); ``wind`` north and east over ground, ``drift`` (2, boats, stretches) likewise. ``drawn``: each
        step is foretold from what was heard before it, in part; None: from the start alone.
        """
        steps, dt = commands.port.shape[0], STEP_S / SUBSTEPS
        u, v, r = (np.array(part, dtype=float) for part in start)
        both = np.stack([commands.port, commands.port if self._single else commands.starboard], axis=1)[:, :, None]
        shares = np.stack([np.ones_like(c["starboard_share"]), c["starboard_share"]])
        revs = self.revs(c, both[0]) + 0.0 * u
        angle = np.clip(commands.rudder_rad[0] + c["offset"], -self._max_rad, self._max_rad) + 0.0 * u
        spin, turn = 1.0 - np.exp(-dt / c["lag"]), 1.0 - np.exp(-dt / c["rudder_lag"])
        out = np.empty((steps, 3, *u.shape))
        blows = bool(np.any(wind[0]) or np.any(wind[1]))
        zero = 0.0 * u
        for k in range(steps):
            out[k, 0], out[k, 1], out[k, 2] = u, v, r
            wanted_revs = self.revs(c, both[k])
            wanted = np.clip(commands.rudder_rad[k] + c["offset"], -self._max_rad, self._max_rad)
            air = (zero, zero, zero)
            if blows:
                air = self._air(c, commands.psi_rad[k], (wind[0] - drift[0], wind[1] - drift[1]), (u, v))
            for _ in range(SUBSTEPS):
                revs = revs + (wanted_revs - revs) * spin
                angle = angle + np.clip((wanted - angle) * turn, -self._rate * dt, self._rate * dt)
                du, dv, dr = self.rates(c, (u, v, r), (self.thrust(c, revs, u, shares), angle), air)
                u = np.clip(u + du * dt, -20.0, 20.0)
                v = np.clip(v + dv * dt, -20.0, 20.0)
                r = np.clip(r + dr * dt, -6.0, 6.0)
            if drawn is not None:
                r = r + drawn.per_s * STEP_S * np.nan_to_num(drawn.rate[k] - out[k, 2])
        return out

    def _air(self, c: dict[str, Array], psi: Array, wind: tuple[Array, Array], way: tuple[Array, Array]) -> Any:
        """Wind force; the air's velocity relative to the water's drift is handed in. What of its moment the file does not know stands in
        ``c`` where a record is asked for it: more of the moment that changes sign abeam, and one of a house before or abaft the middle.
        """
        cosine, sine = np.cos(psi), np.sin(psi)
        a, b = cosine * wind[0] + sine * wind[1] - way[0], cosine * wind[1] - sine * wind[0] - way[1]
        speed = np.hypot(a, b)
        moment = self._wind_n * a * b
        if WIND_MOMENTS[0] in c:
            oblique, abeam = (c[name] for name in WIND_MOMENTS)
            moment = moment - self._wind_unit_n * (2.0 * oblique * a + abeam * speed) * b
        return self._wind[0] * speed * a, self._wind[1] * speed * b, moment
