"""The sea trial: manoeuvres by which a boat measures itself, as a state machine without I/O."""

from __future__ import annotations

from .sequence import Told, Trial, TrialConfig, TrialOutput

__all__ = ["Told", "Trial", "TrialConfig", "TrialOutput"]
