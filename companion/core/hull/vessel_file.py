"""What is known of the vessel: the parameter file's schema, and the statics that follow from it.

One file (``config/vessels/*.toml``) feeds the simulator, the controllers' feed-forward, the depth guard's stopping
distance and the tuning tool. Symbols and equations: Fossen, Handbook of Marine Craft (3 degrees of freedom, motion
relative to the water); rudders in the propeller race by momentum theory.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final, Literal

from pydantic import Field, field_validator

from ..config import Config

RHO_WATER = 1025.0
"""kg/m³, sea water."""


class HullConfig(Config):
    """Size, inertia with added mass, and damping (all coefficients positive)."""

    length_m: float = Field(gt=0)
    """Of the waterline, m."""
    beam_m: float = Field(gt=0)
    """Greatest breadth, m."""
    draught_m: float = Field(gt=0)
    """Of the hull without keel and rudders, m."""
    mass_kg: float = Field(gt=0)
    """As she sails, with battery and load."""
    m11_kg: float = Field(gt=0)
    """Surge: mass and added mass."""
    m22_kg: float = Field(gt=0)
    """Sway: mass and added mass."""
    m23_kgm: float = 0.0
    """Coupling of sway and yaw; 0 for a hull that is alike before and behind."""
    m33_kgm2: float = Field(gt=0)
    """Yaw: moment of inertia and added inertia."""
    xu: float = Field(ge=0)
    """Surge damping, N/(m/s)."""
    xuu: float = Field(ge=0)
    """N/(m/s)²."""
    yv: float = Field(ge=0)
    """Sway damping, N/(m/s)."""
    yvv: float = Field(ge=0)
    """Sway damping, N/(m/s)²."""
    nr: float = Field(ge=0)
    """Yaw damping, Nm/(rad/s)."""
    nrr: float = Field(ge=0)
    """Yaw damping, Nm/(rad/s)²."""
    nur: float = Field(0.0, ge=0)
    """Yaw damping that grows with speed, Nm/(rad/s)/(m/s)."""
    munk: float = Field(0.5, ge=0, le=1)
    """Share of the ideal Munk moment that is left."""
    crossflow_cd: float = Field(0.0, ge=0)
    """Cross-flow drag by five strips on each of two hulls; 0 = contained in yvv and nrr."""

    @property
    def turning_kgm2(self) -> float:
        """Inertia that a yaw moment meets where the hull is free to slip: m33 less what sway takes off it by ``m23_kgm``."""
        return self.m33_kgm2 - self.m23_kgm * self.m23_kgm / self.m22_kg


class ThrusterConfig(Config):
    """Fixed propellers. The command -1...1 sets revolutions, as an ESC does, so thrust goes with its square, if not else said."""

    count: Literal[1, 2] = 2
    """One, or two that turn the boat by their difference."""
    lateral_m: float = Field(0.0, ge=0)
    """Distance of each of two thrusters from the centre line."""
    ahead_n: float = Field(gt=0)
    """Bollard thrust of one thruster at command 1."""
    astern_n: float = Field(gt=0)
    """Bollard thrust of one thruster at command -1."""
    lag_s: float = Field(0.15, gt=0)
    """Time constant from command to thrust."""
    dead_band: float = Field(0.03, ge=0, lt=0.5)
    """Commands smaller than this do not turn the propeller."""
    exponent: float = Field(2.0, ge=0.8, le=4.0)
    """Thrust at rest goes with this power of the command."""
    exponent_astern: float | None = Field(None, ge=0.8, le=4.0)
    """Likewise astern; none: as ahead."""
    curve: tuple[tuple[float, float], ...] = ()
    """Instead of exponents: [command, share of full thrust at rest], rising from [-1, -1] through zero to [1, 1]."""
    starboard_share: float = Field(1.0, ge=0.3, le=3.0)
    """Thrust of the starboard thruster over that of the port one, which ``ahead_n`` and ``astern_n`` say."""
    speed_loss: float = Field(0.0, ge=0.0, le=0.5)
    """Share of the bollard thrust that is lost for each m/s ahead at full revolutions, 1/(m/s)."""
    diameter_m: float = Field(0.18, gt=0)
    """Of the propeller: how wide its race is at the rudder."""
    race_share: float = Field(0.8, ge=0, le=1)
    """Share of the fully developed race that the rudder feels."""

    @property
    def turns(self) -> bool:
        """Whether a difference of thrust turns the hull: of one propeller, or of two on the centre line, none does."""
        return self.count == 2 and self.lateral_m > 0.0

    @field_validator("curve")
    @classmethod
    def _rises(cls, points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        rising = all(a[0] < b[0] and a[1] < b[1] for a, b in pairwise(points))
        whole = not points or (points[0] == (-1.0, -1.0) and points[-1] == (1.0, 1.0) and (0.0, 0.0) in points)
        if not (rising and whole):
            raise ValueError("must rise in both columns from [-1, -1] through [0, 0] to [1, 1]")
        return points


_RATE_LAG: Final = 0.75
"""Lag of a servo that turns at its greatest rate, over the time from amidships to hard over: by its describing function a third of the
circle late when it swings over its whole range, less in smaller swings."""
_QUICK_S: Final = 0.75
"""A servo that is hard over sooner than this keeps up with any loop that its lag allows."""


class RudderConfig(Config):
    """Rudders behind the thrusters, all linked mechanically alike: same area, same servo."""

    count: Literal[0, 1, 2] = 2
    """0: none."""
    area_m2: float = Field(0.01, gt=0)
    """Each."""
    lift_slope_per_rad: float = Field(2.51, gt=0)
    """Lift coefficient per radian of angle of attack (2 pi for a thin wing of infinite span)."""
    x_m: float = Field(-1.0, lt=0)
    """Position along the hull, forward positive."""
    max_deg: float = Field(30.0, gt=0, le=60)
    """Rudder angle at the servo's outer pulses; neither steering nor gate goes beyond."""
    rate_dps: float = Field(60.0, gt=0)
    """How fast the servo turns it."""
    lag_s: float = Field(0.1, ge=0)
    """First-order lag of the servo; 0 = the rate limit alone."""
    stall_deg: float = Field(35.0, gt=0)
    """Angle of attack at which the flow breaks away."""
    after_stall: float = Field(0.8, ge=0, le=1)
    """Share of the lift that is left beyond the stall angle."""
    astern_share: float = Field(0.5, ge=0, le=1)
    """Force in water from behind, against the same flow from ahead."""
    offset_deg: float = Field(0.0, ge=-20, le=20)
    """Angle at which the rudders stand when told 0, positive as a command to starboard: a linkage that is not straight."""
    lift_shape: Literal["sin", "half-sin-2"] = "sin"
    """Lift goes with sin(alpha), or with sin(2 alpha)/2."""

    @property
    def max_rad(self) -> float:
        return math.radians(self.max_deg)

    @property
    def useful_rad(self) -> float:
        """Angle up to which more helm turns more: the stop, or where the flow breaks away before it."""
        return math.radians(min(self.max_deg, self.stall_deg))

    @property
    def offset_rad(self) -> float:
        return math.radians(self.offset_deg)

    @property
    def felt_radps(self) -> float | None:
        """The servo's greatest rate where it is felt, rad/s; None where its lag is all that one sees of it."""
        return math.radians(self.rate_dps) if self.max_deg > _QUICK_S * self.rate_dps else None

    @property
    def late_s(self) -> float:
        """Lag in the swings that weather asks for, s: where the servo is slow, most of it is its way from stop to stop."""
        return self.lag_s + _RATE_LAG * max(0.0, self.max_deg / self.rate_dps - _QUICK_S)


class WindageConfig(Config):
    """Areas and coefficients of the wind force (Fossen's form)."""

    frontal_m2: float = Field(0.0, ge=0)
    """Area above the water, seen from ahead."""
    lateral_m2: float = Field(0.0, ge=0)
    """Seen from the side."""
    cx: float = Field(0.7, ge=0)
    """Coefficient of the force along the hull."""
    cy: float = Field(0.9, ge=0)
    """Across it."""
    cn: float = Field(0.1, ge=0)
    """Of the turning moment."""


class SeakeepingConfig(Config):
    """Static answer to waves, per metre of significant height (RMS)."""

    roll_deg_per_m: float = Field(10.0, ge=0)
    """Roll."""
    pitch_deg_per_m: float = Field(6.7, ge=0)
    """Pitch."""
    heave_m_per_m: float = Field(0.25, ge=0)
    """Heave."""
    yaw_nm_per_m: float = Field(26.7, ge=0)
    """Turning moment of the waves."""


class AntennaConfig(Config):
    """A GNSS antenna, from the vessel's reference point."""

    forward_m: float = Field(0.0, ge=-50, le=50)
    """Forward of the reference point."""
    starboard_m: float = Field(0.0, ge=-50, le=50)
    """To starboard of it."""
    up_m: float = Field(0.0, ge=-10, le=50)
    """Above the waterline."""


class MountConfig(Config):
    """One sensor of several that does not sit where the hull's common keys say."""

    transducer_depth_m: float | None = Field(None, ge=-5, le=20)
    """Its echo sounder below the waterline, positive down."""
    antenna: AntennaConfig | None = None
    """Its antenna."""


class VesselConfig(Config):
    """One vessel, from one file: the only home of its geometry."""

    name: str
    """Shown to people."""
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
    stopping_factor: float = Field(1.0, ge=1.0, le=3.0)
    """How much farther than the best estimate the guards reckon the vessel to run: the upper bound of what is not known."""
    mounts: dict[str, MountConfig] = Field(default_factory=dict)
    """By name of a sensor link of the settings (`mavlink`: what stations send): what of it sits elsewhere."""

    def __hash__(self) -> int:
        """By what moves: gains and plants are worked out once per vessel; ``mounts``, a dict, has no hash."""
        return hash((self.name, self.hull, self.thruster, self.rudder))

    @property
    def helm_lag_s(self) -> float:
        """Lag of the rudders in the heading loop, s: where thrust gives at once what a slow servo does not yet, the servo's own."""
        return self.rudder.lag_s if self.thruster.turns else self.rudder.late_s

    def scaled(self, mass: float = 1.0, drag: float = 1.0, thrust: float = 1.0) -> VesselConfig:
        """Return a copy with other inertia, damping or thrust: a wrong belief, or a loaded and fouled hull."""
        inertia = ("mass_kg", "m11_kg", "m22_kg", "m23_kgm", "m33_kgm2")
        damping = ("xu", "xuu", "yv", "yvv", "nr", "nrr", "nur", "crossflow_cd")
        hull = {name: getattr(self.hull, name) * mass for name in inertia}
        hull |= {name: getattr(self.hull, name) * drag for name in damping}
        power = {name: getattr(self.thruster, name) * thrust for name in ("ahead_n", "astern_n")}
        return self.model_copy(
            update={
                "hull": self.hull.model_copy(update=hull),
                "thruster": self.thruster.model_copy(update=power),
            }
        )
