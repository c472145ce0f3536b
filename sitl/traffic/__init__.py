"""Other vessels in the simulated water: they follow routes, manoeuvre, and speak AIS as the standard has it."""

from __future__ import annotations

from .fleet import Fleet
from .target import Target, VesselText
from .transmitter import AisText

__all__ = ["AisText", "Fleet", "Target", "VesselText"]
