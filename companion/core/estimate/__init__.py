"""The estimator: measurements of several sensors in, the vessel's state at each tick out, with honest validity and age."""

from __future__ import annotations

from .config import EstimatorConfig
from .estimator import Estimator
from .motion import SmoothMotion

__all__ = ["Estimator", "EstimatorConfig", "SmoothMotion"]
