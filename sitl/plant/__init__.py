"""The simulated boat in its water: hull, bottom, current, wind and waves, and the truth of every moment."""

from __future__ import annotations

from .hull import SimVessel
from .moved import Motion, MovedVessel
from .truth import Truth
from .water import Water, WaterConfig

__all__ = ["Motion", "MovedVessel", "SimVessel", "Truth", "Water", "WaterConfig"]
