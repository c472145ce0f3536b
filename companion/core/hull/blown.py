"""How far wind turns the bow against a heading loop: what a slower loop saves in margins it pays for here."""

from __future__ import annotations

import math
from typing import Final

from .forces import ForceModel
from .statics import Statics
from .vessel_file import VesselConfig

WIND_MPS: Final = 8.0
"""The strongest in which control is measured. Gusts of it go by sooner than the integral gathers them, so the heading gain alone holds."""
MOST_OFF_RAD: Final = math.radians(25.0)
"""A catamaran of 55 kg in such a wind: at 24 degrees her legs were a quarter worse than by the settings' own bandwidth, at 32 three times,
at 45 eight times, and at 88 she was blown 44 m away."""
_SIDE: Final = 2.0
"""Side above the water for each below, where the file tells none: those that do come to 1.5 to 2.2."""
_WAYS: Final = 8
"""Directions of the wind, over one side: the other is alike."""
_HALVINGS: Final = 20
"""Steps to the drift that a hull comes to abeam: to a hundred thousandth of the wind."""


def off_rad(vessel: VesselConfig, speed_mps: float, gain_nm: float) -> float:
    """How far the bow stands off, at a speed through the water, with so many Nm of the law for each radian."""
    return turned_nm(vessel, speed_mps) / gain_nm if gain_nm > 0.0 else math.inf


def turned_nm(vessel: VesselConfig, speed_mps: float) -> float:
    """The greatest moment of such a wind, wherever it comes from, and of what the hull makes of the drift that it brings."""
    model, each_n = ForceModel(_with_a_side(vessel)), 0.5 * Statics(vessel).drag_n(speed_mps)
    ways = (math.pi * (k + 0.5) / _WAYS for k in range(_WAYS))
    return max(abs(_moment_nm(model, speed_mps, each_n, way)) for way in ways)


def _with_a_side(vessel: VesselConfig) -> VesselConfig:
    """A file that says nothing of windage is of a boat that has a side all the same."""
    hull, windage = vessel.hull, vessel.windage
    if windage.lateral_m2 > 0.0:
        return vessel
    area_m2 = _SIDE * hull.length_m * hull.draught_m
    return vessel.model_copy(update={"windage": windage.model_copy(update={"lateral_m2": area_m2})})


def _moment_nm(model: ForceModel, speed_mps: float, each_n: float, way_rad: float) -> float:
    ahead, across = WIND_MPS * math.cos(way_rad) - speed_mps, WIND_MPS * math.sin(way_rad)

    def rates(sway_mps: float) -> tuple[float, float, float]:
        _, push_n, turn_nm = model.wind(ahead, across - sway_mps)
        return model.rates(
            speed_mps,
            sway_mps,
            0.0,
            thrust_port_n=each_n,
            thrust_starboard_n=each_n,
            rudder_port_rad=0.0,
            rudder_starboard_rad=0.0,
            sway_n=push_n,
            yaw_nm=turn_nm,
        )

    low, high = -WIND_MPS, WIND_MPS
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rates(middle)[1] > 0.0 else (low, middle)
    hull = model.vessel.hull
    _, sway, yaw = rates(0.5 * (low + high))
    return hull.m33_kgm2 * yaw + hull.m23_kgm * sway
