"""The sea trial: manoeuvres by which a boat measures itself, as a state machine without I/O."""

from __future__ import annotations

from .area import TrialArea, free_around
from .sequence import LEAST_RADIUS_M, MOST_RADIUS_M, Trial, TrialConfig, TrialOutput, TrialStanding, manoeuvres_of

__all__ = [
    "LEAST_RADIUS_M",
    "MOST_RADIUS_M",
    "Trial",
    "TrialArea",
    "TrialConfig",
    "TrialOutput",
    "TrialStanding",
    "free_around",
    "manoeuvres_of",
]
