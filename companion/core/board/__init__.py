"""The actuator board: its line, its bytes, its health, and which wire carries what."""

from __future__ import annotations

from .actuator_map import ActuatorConfig
from .arduino import Arduino, BoardPhase

__all__ = ["ActuatorConfig", "Arduino", "BoardPhase"]
