"""What is asked about the water under the keel: a sounding from outside, the guard's lock, the memory's false shoals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from .nature import OTHER, SETTING, Ask, Nature
from .spoken import Real, Spoken, Sure

FORGET_MAX_M: Final = 20.0
"""Radius of one order to forget depths: a false echo of 3 s at 3 m/s and the way to stop lie within it, a reef does not."""


@dataclass(frozen=True, slots=True)
class DistanceInput(Ask):
    """DISTANCE_SENSOR from another component: metres below the transducer."""

    value_m: float | None
    signal_quality: float | None = None

    @property
    def nature(self) -> Nature:
        return OTHER


@dataclass(frozen=True, slots=True)
class UnlockGuard(Ask):
    """An operator on the spot lifts a LOCKED depth guard once."""

    spoken = Spoken("USER_1", (Sure(1),))

    @property
    def nature(self) -> Nature:
        return OTHER


@dataclass(frozen=True, slots=True)
class ForgetDepth(Ask):
    """Forget what the depth memory holds around a place: a false shoal bars the way. Charts are never forgotten."""

    lat_rad: float | None = None
    lon_rad: float | None = None
    """None: where the vessel is."""
    radius_m: float = FORGET_MAX_M
    spoken = Spoken("USER_2", (Real("radius_m", 1, least=0.0, most=FORGET_MAX_M, default=FORGET_MAX_M),), place=True)

    @property
    def nature(self) -> Nature:
        return SETTING
