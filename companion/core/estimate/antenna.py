"""Where an antenna is beside the vessel's reference point, with the attitude of a moment."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.value import value

from ..hull.geometry import Arm

Pair = tuple[float, float]
"""North and east."""
NO_ARM: Final[Arm] = (0.0, 0.0, 0.0)
"""The antenna stands over the reference point."""


@value
class Attitude:
    """What is needed of the attitude at one moment. psi None = unknown."""

    psi_rad: float | None = None
    r_radps: float = 0.0
    phi_rad: float = 0.0
    theta_rad: float = 0.0


def lever(antenna: Arm, heading: Attitude, psi_rad: float) -> Pair:
    """Antenna position, north and east of the reference point."""
    x, y, z = antenna
    sin_phi, cos_phi = math.sin(heading.phi_rad), math.cos(heading.phi_rad)
    sin_theta, cos_theta = math.sin(heading.theta_rad), math.cos(heading.theta_rad)
    # Rotation by roll and pitch (Fossen 2021, eq. 2.18), then by heading.
    level_x = x * cos_theta + (y * sin_phi + z * cos_phi) * sin_theta
    level_y = y * cos_phi - z * sin_phi
    sine, cosine = math.sin(psi_rad), math.cos(psi_rad)
    return level_x * cosine - level_y * sine, level_x * sine + level_y * cosine


def at_centre(antenna_mps: Pair, ahead_m: Pair, r_radps: float) -> Pair:
    """Velocity of the reference point, by that of an antenna and where it is from there, all north and east."""
    return antenna_mps[0] + r_radps * ahead_m[1], antenna_mps[1] - r_radps * ahead_m[0]
