"""Scenarios: a file that says what is sailed, what happens and what must come of it, and its judge."""

from __future__ import annotations

from .file import Scenario, read_scenario
from .run import ScenarioOutcome, run_scenario

__all__ = ["Scenario", "ScenarioOutcome", "read_scenario", "run_scenario"]
