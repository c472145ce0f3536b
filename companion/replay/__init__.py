"""Runs a recording again through a freshly built app, and says what came out differently."""

from .recorded import recorded_heading_latency_s, recorded_vessel
from .run import ReplayError, ReplayOutcome, known_settings, replay, summary

__all__ = [
    "ReplayError",
    "ReplayOutcome",
    "known_settings",
    "recorded_heading_latency_s",
    "recorded_vessel",
    "replay",
    "summary",
]
