"""Other vessels: reports of receivers in, tracks and what they mean for us out. It tells; it never moves or stops the boat."""

from __future__ import annotations

from .config import TrafficConfig
from .traffic import Traffic

__all__ = ["Traffic", "TrafficConfig"]
