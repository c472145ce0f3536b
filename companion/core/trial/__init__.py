"""The sea trial: manoeuvres by which a boat measures itself, as a state machine without I/O."""

from __future__ import annotations

from .area import TrialArea, free_around
from .manoeuvres import NO_SPINS, manoeuvres_of
from .sequence import LEAST_RADIUS_M, MOST_RADIUS_M, Trial, TrialConfig, TrialOutput, TrialStanding

__all__ = [
    "LEAST_RADIUS_M",
    "MOST_RADIUS_M",
    "NO_SPINS",
    "Trial",
    "TrialArea",
    "TrialConfig",
    "TrialOutput",
    "TrialStanding",
    "free_around",
    "manoeuvres_of",
]
