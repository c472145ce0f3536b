"""Steering: from a wanted heading and speed to what each actuator is asked for. The contract and the registry.

A controller is chosen by name: ``seed`` (the law of the seed's SimpleHeadingAndSpeed), ``model`` (the default, from
the vessel file), or ``module:Class`` for one's own. Any of them is replaceable; none of them reaches an actuator
without the gate.
"""

from __future__ import annotations

import importlib
import math
from typing import Protocol

from pydantic import Field

from mavlink_bridge.language.messages import ActuatorDemand, ActuatorOutput, Desired, EstimatedState
from mavlink_bridge.language.snapshot import ControlTrace
from mavlink_bridge.language.units import clamp

from ..config import Config, param, param_group
from ..hull import VesselConfig
from .pid import PidGains


class SeedConfig(Config):
    """Parameters of the seed's task SimpleHeadingAndSpeed, by its names and defaults. Gains have no default."""

    speed_gains: PidGains | None = param_group("SEED_SPD_", "Speed PID Gains, per m/s")
    heading_gains: PidGains | None = param_group("SEED_HDG_", "Heading PID Gains, per radian")
    max_thruster_output: float = param(
        1.0, "SEED_THR_MAX", "Maximum Thruster Output", ge=0.0, le=1.0, seed="SimpleHeadingAndSpeed"
    )
    max_thruster_differential: float = param(
        0.2, "SEED_THR_DIFF", "Maximum Thruster Differential", ge=0.0, le=1.0, seed="SimpleHeadingAndSpeed"
    )
    max_thruster_rate: float = param(
        0.0,
        "SEED_THR_RATE",
        "Maximum Thruster Rate, both ways; 0 = unlimited",
        unit="1/s",
        ge=0.0,
        le=100.0,
        seed="SimpleHeadingAndSpeed",
    )
    low_speed_thruster_share: float = param(
        0.2, "SEED_LOW_PCT", "Low Speed Thruster Percentage, as a share", ge=0.0, le=1.0, seed="SimpleHeadingAndSpeed"
    )
    high_speed_thruster_share: float = param(
        0.8, "SEED_HIGH_PCT", "High Speed Thruster Percentage, as a share", ge=0.0, le=1.0, seed="SimpleHeadingAndSpeed"
    )
    high_speed_threshold_kn: float = param(
        1.0, "SEED_HIGH_KN", "High Speed Threshold", unit="kn", ge=0.0, le=50.0, seed="SimpleHeadingAndSpeed"
    )
    high_speed_hysteresis_kn: float = param(
        0.1, "SEED_HYST_KN", "High Speed Hysteresis", unit="kn", ge=0.0, le=10.0, seed="SimpleHeadingAndSpeed"
    )


class ModelConfig(Config):
    """The model-based law. Everything else comes from the vessel file."""

    heading_bandwidth: float = param(2.2, "STEER_BW", "Heading loop bandwidth", unit="rad/s", ge=0.3, le=5.0)
    heading_damping: float = param(0.9, "STEER_ZETA", "Heading loop damping ratio", ge=0.4, le=2.0)
    heading_integral: float = param(
        0.15, "STEER_INT", "Heading integral, share of the proportional gain per second", unit="1/s", ge=0.0, le=1.0
    )
    yaw_rate_limit: float = param(0.45, "STEER_RATE", "Greatest planned yaw rate", unit="rad/s", ge=0.05, le=2.0)
    yaw_acceleration: float = param(
        0.6, "STEER_ACC", "Greatest planned yaw acceleration", unit="rad/s^2", ge=0.05, le=5.0
    )
    acceleration: float = param(0.8, "SPEED_ACC", "Greatest planned acceleration", unit="m/s^2", ge=0.05, le=5.0)
    speed_gain: float = param(1.6, "SPEED_P", "Speed gain, share of surge inertia", unit="1/s", ge=0.1, le=5.0)
    speed_integral: float = param(
        0.3, "SPEED_I", "Speed integral, share of the speed gain per second", unit="1/s", ge=0.0, le=2.0
    )
    heading_late_s: float = Field(0.0, ge=0.0, le=1.0)
    """Age of headings when they arrive, s: the heading loop leaves its margins at 0.15 s and this together. Where it is not
    said, the greatest `sensors.nmea.heading_latency_s`."""


class SteeringConfig(Config):
    """Which law steers, and its parameters."""

    profile: str = "model"
    """'model', 'seed', or 'module:Class'."""
    seed: SeedConfig = Field(default_factory=SeedConfig)
    model: ModelConfig = Field(default_factory=ModelConfig)


class Controller(Protocol):
    """What every steering law offers. It is stepped once per tick and holds no clock."""

    def reset(self, state: EstimatedState, dt_s: float = 0.0, sent: ActuatorOutput | None = None) -> None:
        """Start afresh, bumplessly, from this state; called each tick while the loops are off.

        ``sent`` is what went out during the last ``dt_s``, by an operator's sticks or a failsafe, so that the modelled
        speed through the water keeps up.
        """
        ...

    def step(
        self, now_us: int, dt_s: float, state: EstimatedState, desired: Desired, sent: ActuatorOutput | None
    ) -> tuple[ActuatorDemand, ControlTrace]:
        """Return what the actuators should do. ``sent`` is what really went out last, None when unknown."""
        ...

    def configure(self, config: SteeringConfig) -> None:
        """Take new settings while running."""
        ...

    def water_speed_mps(self) -> float | None:
        """Return the modelled surge through the water from the actuation sent, None when the law has no model."""
        ...


def manual_demand(
    now_us: int, surge: float, yaw: float, config: SteeringConfig, vessel: VesselConfig, *, mixed: bool = True
) -> ActuatorDemand:
    """Return the demand for an operator's sticks (surge and yaw, each -1...1) by the seed's mix, rudders included.

    The yaw stick has the whole differential here: an operator who turns on the spot wants all of it. Not ``mixed``: the
    thrusters stay alike on a vessel that has rudders, as on one whose thrusters do not turn it.
    """
    limit = config.seed.max_thruster_output
    differential = yaw if vessel.thruster.turns and (mixed or not vessel.rudder.count) else 0.0
    port, starboard = mix(clamp(surge, -1.0, 1.0) * limit, clamp(differential, -1.0, 1.0) * limit, limit)
    rudder_rad = clamp(yaw, -1.0, 1.0) * vessel.rudder.max_rad if vessel.rudder.count else 0.0
    return ActuatorDemand(now_us, port, starboard, rudder_rad, rudder_rad)


def mix(common: float, differential: float, limit: float) -> tuple[float, float]:
    """Return (port, starboard) with the heading's priority: on overflow both shift so that their difference stays.

    (1.0, 0.2) gives (1.0, 0.6) at limit 1, the seed's own example. A difference wider than the range is clamped to it.
    """
    differential = clamp(differential, -limit, limit)
    room = limit - abs(differential)
    common = clamp(common, -room, room)
    return common + differential, common - differential


def steady_speed_mps(controller: Controller) -> float | None:
    """Return the greatest speed through the water at which a law keeps its margins; None when it does not say.

    A law says it by an attribute ``steady_mps``.
    """
    found = getattr(controller, "steady_mps", None)
    return None if found is None else float(found)


def turn_rate_radps(controller: Controller) -> float:
    """Return the greatest yaw rate that a law steers, rad/s; infinite when it does not say.

    A law says it by an attribute ``turn_radps``.
    """
    return float(getattr(controller, "turn_radps", math.inf))


def backs_and_fills(controller: Controller) -> bool:
    """Return whether a law turns a boat of one screw where she lies, by kicks over the rudder whose way it takes back.

    A law says it by an attribute ``backs_and_fills``.
    """
    return bool(getattr(controller, "backs_and_fills", False))


def sway_through_water_mps(controller: Controller) -> float:
    """Return the modelled sway through the water, to starboard positive; 0 when a law does not say it.

    A law says it by an attribute ``water_sway_mps``.
    """
    return float(getattr(controller, "water_sway_mps", 0.0))


def lowered_text(steady_mps: float, top_mps: float) -> str:
    """Say that the vessel is not sailed as fast as it could go; empty when it is."""
    if f"{steady_mps:.1f}" == f"{top_mps:.1f}":
        return ""
    return f"Top speed lowered from {top_mps:.1f} to {steady_mps:.1f} m/s: faster, this hull cannot be steered with safe margins"


class SteeringError(ValueError):
    """The configuration names no usable controller."""


def make_controller(profile: str, config: SteeringConfig, vessel: VesselConfig) -> Controller:
    """Build the controller of a profile. Raises SteeringError with the mend."""
    # the laws import this module for the contract, so they are looked up late
    name = {
        "seed": "companion.core.steer.seed:SeedController",
        "model": "companion.core.steer.model:ModelController",
    }
    target = name.get(profile, profile)
    module, separator, attribute = target.partition(":")
    if not separator:
        raise SteeringError(f"steering.profile {profile!r}: use 'seed', 'model' or 'module:Class'")
    try:
        factory = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise SteeringError(f"steering.profile {profile!r} cannot be loaded: {error}") from error
    controller: Controller = factory(config, vessel)
    return controller
