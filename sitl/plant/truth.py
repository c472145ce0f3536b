"""What is really so at one moment of the simulated world: the vessel simulator writes it, sensors read it."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.value import value

SIM_UTC_START_US: Final = 1_767_268_800_000_000
"""2026-01-01T12:00:00Z, microseconds since 1970: the UTC at which simulated time 0 stands."""


@value
class Truth:
    """The true state of the vessel. North-east-down, radians, the reference point is the one of the vessel model."""

    t_us: int
    lat_rad: float
    lon_rad: float
    north_m: float
    """From the world's origin."""
    east_m: float
    psi_rad: float
    u_mps: float
    """Surge through the water."""
    v_mps: float
    """Sway through the water."""
    r_radps: float
    vn_mps: float
    """Over ground."""
    ve_mps: float
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    heave_m: float = 0.0
    """Up positive."""
    depth_m: float | None = None
    """Water depth at the vessel, surface (tide included) to bottom; None unknown."""


def utc_us(t_us: int) -> int:
    """Simulated UTC, microseconds since 1970, at simulated time ``t_us``."""
    return SIM_UTC_START_US + t_us
