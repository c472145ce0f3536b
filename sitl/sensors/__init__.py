"""The simulated sensors: truth in, NMEA bytes out, with the faults that real ones have."""

from __future__ import annotations

from .config import SensorFaults, SimulatedSensors
from .talkers import SensorSuite

__all__ = ["SensorFaults", "SensorSuite", "SimulatedSensors"]
