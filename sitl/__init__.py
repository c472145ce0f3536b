"""The simulated vessel, its sensors, its actuator board, its radio and its water, in lock-step with the real app.

``simulate`` sails a plan, ``run_scenario`` a scenario file, ``World`` gives every step to its caller. The names are loaded when they
are first asked for: ``companion --help`` needs none of them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .scenario import Scenario, read_scenario, run_scenario
    from .voyage import simulate
    from .world import SimSettings, World

__all__ = ["Scenario", "SimSettings", "World", "read_scenario", "run_scenario", "simulate"]

_ROOMS: Final = {
    "Scenario": "scenario",
    "SimSettings": "world",
    "World": "world",
    "read_scenario": "scenario",
    "run_scenario": "scenario",
    "simulate": "voyage",
}


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return getattr(import_module(f".{_ROOMS[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
