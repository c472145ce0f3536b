"""The vessel put together: modes, plan, orders, refusals, and the one tick that runs every room in its fixed order."""

from __future__ import annotations

from .config import TickInputs, VehicleConfig
from .vehicle import Vehicle

__all__ = ["TickInputs", "Vehicle", "VehicleConfig"]
