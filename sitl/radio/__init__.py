"""Two LoRa modules and the air between them, in virtual time."""

from __future__ import annotations

from .air import RadioConfig, RadioEnd, RadioPair

__all__ = ["RadioConfig", "RadioEnd", "RadioPair"]
