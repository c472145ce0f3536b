"""The simulated world with a real vessel's process inside, in lock-step: the simulator's Python API."""

from __future__ import annotations

from .settings import SimSettings
from .world import World

__all__ = ["SimSettings", "World"]
