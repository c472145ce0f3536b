"""The sea trial: manoeuvres by which a boat measures itself, as a state machine without I/O."""

from __future__ import annotations

from .area import Area, free_around
from .sequence import LEAST_RADIUS_M, MOST_RADIUS_M, Told, Trial, TrialConfig, TrialOutput, manoeuvres_of

__all__ = [
    "LEAST_RADIUS_M",
    "MOST_RADIUS_M",
    "Area",
    "Told",
    "Trial",
    "TrialConfig",
    "TrialOutput",
    "free_around",
    "manoeuvres_of",
]
