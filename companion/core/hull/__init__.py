"""What is known of the hull: its file, the forces that follow from it, how it turns and how far it still runs."""

from __future__ import annotations

from .forces import ForceModel
from .handling import Handling
from .vessel_file import VesselConfig

__all__ = ["ForceModel", "Handling", "VesselConfig"]
