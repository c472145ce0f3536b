"""Other vessels in the simulated water: they follow routes, manoeuvre, and speak AIS as the standard has it."""

from __future__ import annotations

from .target import Target, VesselText
from .transmitter import Transmitter

__all__ = ["Target", "Transmitter", "VesselText"]
