"""Guidance: from a manoeuvre on the map to a wanted heading, speed and yaw rate, tick by tick."""

from __future__ import annotations

from .guidance import Guidance, GuidanceConfig
from .output import GuidanceOutput

__all__ = ["Guidance", "GuidanceConfig", "GuidanceOutput"]
