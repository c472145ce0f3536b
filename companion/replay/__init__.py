"""Runs a recording again through a freshly built app, and says what came out differently."""

from .run import Outcome, ReplayError, known_settings, replay, summary

__all__ = ["Outcome", "ReplayError", "known_settings", "replay", "summary"]
