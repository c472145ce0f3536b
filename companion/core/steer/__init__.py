"""Steering: from a wanted heading and speed to what each actuator is asked for."""

from __future__ import annotations

from .gain_check import gains_problem
from .law import SteeringConfig, SteeringError, make_controller, manual_demand, sway_through_water_mps

__all__ = [
    "SteeringConfig",
    "SteeringError",
    "gains_problem",
    "make_controller",
    "manual_demand",
    "sway_through_water_mps",
]
