"""What is known of the vessel: the parameter file's schema, and the statics that follow from it.

One file (``config/vessels/*.toml``) feeds the simulator, the controllers' feed-forward, the depth guard's stopping
distance and the tuning tool. Symbols and equations: Fossen, Handbook of Marine Craft (3 degrees of freedom, motion
relative to the water); rudders in the propeller race by momentum theory.
"""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from ..config import Config

RHO_WATER = 1025.0
"""kg/m³, sea water."""


class HullConfig(Config):
    """Size, inertia with added mass, and damping (all coefficients positive)."""

    length_m: float = Field(gt=0)
    beam_m: float = Field(gt=0)
    draught_m: float = Field(gt=0)
    mass_kg: float = Field(gt=0)
    m11_kg: float = Field(gt=0)
    """Surge: mass and added mass."""
    m22_kg: float = Field(gt=0)
    m23_kgm: float = 0.0
    m33_kgm2: float = Field(gt=0)
    xu: float = Field(ge=0)
    """Surge damping, N/(m/s)."""
    xuu: float = Field(ge=0)
    """N/(m/s)²."""
    yv: float = Field(ge=0)
    yvv: float = Field(ge=0)
    nr: float = Field(ge=0)
    """Yaw damping, Nm/(rad/s)."""
    nrr: float = Field(ge=0)
    nur: float = Field(0.0, ge=0)
    """Yaw damping that grows with speed, Nm/(rad/s)/(m/s)."""
    munk: float = Field(0.5, ge=0, le=1)
    """Share of the ideal Munk moment that is left."""
    crossflow_cd: float = Field(0.0, ge=0)
    """Cross-flow drag by five strips on each of two hulls; 0 = contained in yvv and nrr."""


class ThrusterConfig(Config):
    """Fixed propellers. The command -1...1 sets revolutions, as an ESC does, so thrust goes with its square."""

    count: Literal[1, 2] = 2
    lateral_m: float = Field(0.0, ge=0)
    """Distance of each of two thrusters from the centre line."""
    ahead_n: float = Field(gt=0)
    """Bollard thrust of one thruster at command 1."""
    astern_n: float = Field(gt=0)
    lag_s: float = Field(0.15, gt=0)
    dead_band: float = Field(0.03, ge=0, lt=0.5)
    """Commands smaller than this do not turn the propeller."""
    diameter_m: float = Field(0.18, gt=0)
    race_share: float = Field(0.8, ge=0, le=1)
    """Share of the fully developed race that the rudder feels."""


class RudderConfig(Config):
    """Rudders behind the thrusters, all linked mechanically alike: same area, same servo."""

    count: Literal[0, 1, 2] = 2
    area_m2: float = Field(0.01, gt=0)
    """Each."""
    lift_slope_per_rad: float = Field(2.51, gt=0)
    x_m: float = Field(-1.0, lt=0)
    """Position along the hull, forward positive."""
    max_deg: float = Field(30.0, gt=0, le=60)
    """Rudder angle at the servo's outer pulses; neither steering nor gate goes beyond."""
    rate_dps: float = Field(60.0, gt=0)
    lag_s: float = Field(0.1, ge=0)
    """First-order lag of the servo; 0 = the rate limit alone."""
    stall_deg: float = Field(35.0, gt=0)
    after_stall: float = Field(0.8, ge=0, le=1)
    """Share of the lift that is left beyond the stall angle."""
    astern_share: float = Field(0.5, ge=0, le=1)
    """Force in water from behind, against the same flow from ahead."""
    lift_shape: Literal["sin", "half-sin-2"] = "sin"
    """Lift goes with sin(alpha), or with sin(2 alpha)/2."""

    @property
    def max_rad(self) -> float:
        return math.radians(self.max_deg)


class WindageConfig(Config):
    """Areas and coefficients of the wind force (Fossen's form)."""

    frontal_m2: float = Field(0.0, ge=0)
    lateral_m2: float = Field(0.0, ge=0)
    cx: float = Field(0.7, ge=0)
    cy: float = Field(0.9, ge=0)
    cn: float = Field(0.1, ge=0)


class SeakeepingConfig(Config):
    """Static answer to waves, per metre of significant height (RMS)."""

    roll_deg_per_m: float = Field(10.0, ge=0)
    pitch_deg_per_m: float = Field(6.7, ge=0)
    heave_m_per_m: float = Field(0.25, ge=0)
    yaw_nm_per_m: float = Field(26.7, ge=0)


class AntennaConfig(Config):
    """A GNSS antenna, from the vessel's reference point."""

    forward_m: float = Field(0.0, ge=-50, le=50)
    starboard_m: float = Field(0.0, ge=-50, le=50)
    up_m: float = Field(0.0, ge=-10, le=50)


class MountConfig(Config):
    """One sensor of several that does not sit where the hull's common keys say."""

    transducer_depth_m: float | None = Field(None, ge=-5, le=20)
    """Its echo sounder below the waterline, positive down."""
    antenna: AntennaConfig | None = None
    """Its antenna."""


class VesselConfig(Config):
    """One vessel, from one file: the only home of its geometry."""

    name: str
    hull: HullConfig
    thruster: ThrusterConfig
    rudder: RudderConfig = RudderConfig(count=0)
    windage: WindageConfig = WindageConfig()
    seakeeping: SeakeepingConfig = SeakeepingConfig()
    transducer_depth_m: float = Field(0.2, ge=-5, le=20)
    """Echo sounder below the waterline, positive down."""
    keel_depth_m: float = Field(0.35, ge=0, le=20)
    """Lowest point of the vessel (keel, rudder, propeller) below the waterline, positive down. The guard measures from here."""
    antenna: AntennaConfig = AntennaConfig()
    """GNSS antenna."""
    mounts: dict[str, MountConfig] = Field(default_factory=dict)
    """By name of a sensor link of the settings (`mavlink`: what stations send): what of it sits elsewhere."""

    def __hash__(self) -> int:
        """By what moves: gains and plants are worked out once per vessel; ``mounts``, a dict, has no hash."""
        return hash((self.name, self.hull, self.thruster, self.rudder))

    def scaled(self, mass: float = 1.0, drag: float = 1.0, thrust: float = 1.0) -> VesselConfig:
        """Return a copy with other inertia, damping or thrust: a wrong belief, or a loaded and fouled hull."""
        inertia = ("mass_kg", "m11_kg", "m22_kg", "m23_kgm", "m33_kgm2")
        damping = ("xu", "xuu", "yv", "yvv", "nr", "nrr", "nur")
        hull = {name: getattr(self.hull, name) * mass for name in inertia}
        hull |= {name: getattr(self.hull, name) * drag for name in damping}
        power = {name: getattr(self.thruster, name) * thrust for name in ("ahead_n", "astern_n")}
        return self.model_copy(
            update={
                "hull": self.hull.model_copy(update=hull),
                "thruster": self.thruster.model_copy(update=power),
            }
        )


def drag_n(vessel: VesselConfig, surge_mps: float) -> float:
    """Return the resistance at a speed through the water, N, with the sign of the speed."""
    return Statics(vessel).drag_n(surge_mps)


def thrust_n(vessel: VesselConfig, command: float) -> float:
    """Return the steady thrust of one thruster for a command -1...1."""
    if abs(command) < vessel.thruster.dead_band:
        return 0.0
    full = vessel.thruster.ahead_n if command > 0.0 else vessel.thruster.astern_n
    return full * command * abs(command)


def command_for_thrust(vessel: VesselConfig, force_n: float) -> float:
    """Return the command -1...1 for a thrust of one thruster; the inverse of ``thrust_n``, saturated."""
    full = vessel.thruster.ahead_n if force_n > 0.0 else vessel.thruster.astern_n
    return math.copysign(min(1.0, math.sqrt(abs(force_n) / full)), force_n)


def speed_for_thrust(vessel: VesselConfig, total_n: float) -> float:
    """Return the steady speed through the water, m/s, for a total thrust ahead of at least 0 N."""
    return Statics(vessel).speed_for_thrust(total_n)


def top_speed_mps(vessel: VesselConfig) -> float:
    """Return the greatest steady speed through the water."""
    return speed_for_thrust(vessel, 2.0 * full_ahead_n(vessel))


def throttle_to_speed(vessel: VesselConfig, throttle: float) -> float:
    """Return the steady speed through the water, m/s, at a thrust command 0...1 of all thrusters."""
    return Statics(vessel).throttle_to_speed(throttle)


def full_ahead_n(vessel: VesselConfig) -> float:
    """Return full thrust ahead of one side; a single thruster counts as two halves on the centre line."""
    return vessel.thruster.ahead_n * (0.5 if vessel.thruster.count == 1 else 1.0)


def full_astern_n(vessel: VesselConfig) -> float:
    """Return full thrust astern of one side, positive."""
    return vessel.thruster.astern_n * (0.5 if vessel.thruster.count == 1 else 1.0)


def stopping_distance_m(vessel: VesselConfig, speed_mps: float) -> float:
    """Return the way made through the water while coasting to rest."""
    return Statics(vessel).stopping_distance_m(speed_mps)


class Statics:
    """One vessel's numbers at hand, for what asks every tick. Holds no state."""

    __slots__ = ("_all_ahead_n", "_dead_band", "_m11", "_xu", "_xuu")

    def __init__(self, vessel: VesselConfig) -> None:
        self._m11, self._xu, self._xuu = vessel.hull.m11_kg, vessel.hull.xu, vessel.hull.xuu
        self._all_ahead_n = 2.0 * full_ahead_n(vessel)
        self._dead_band = vessel.thruster.dead_band

    def drag_n(self, surge_mps: float) -> float:
        """Return the resistance at a speed through the water, N, with the sign of the speed."""
        return (self._xu + self._xuu * abs(surge_mps)) * surge_mps

    def speed_for_thrust(self, total_n: float) -> float:
        """Return the steady speed through the water, m/s, for a total thrust ahead of at least 0 N."""
        xu, xuu = self._xu, self._xuu
        if xuu < 1e-9:
            return total_n / max(xu, 1e-9)
        return (math.sqrt(xu * xu + 4.0 * xuu * total_n) - xu) / (2.0 * xuu)

    def throttle_to_speed(self, throttle: float) -> float:
        """Return the steady speed through the water, m/s, at a thrust command 0...1 of all thrusters."""
        if throttle < self._dead_band:
            return self.speed_for_thrust(0.0)
        return self.speed_for_thrust(self._all_ahead_n * throttle * throttle if throttle > 0.0 else 0.0)

    def stopping_distance_m(self, speed_mps: float) -> float:
        """Return the way made through the water while coasting to rest (closed form of m u' = -(Xu + Xuu u) u)."""
        xu, xuu, speed = self._xu, self._xuu, abs(speed_mps)
        if xu < 1e-9:
            raise ValueError("without linear surge damping the vessel coasts for ever: give hull.xu")
        if xuu < 1e-9:
            return self._m11 * speed / xu
        return self._m11 / xuu * math.log1p(xuu * speed / xu)
