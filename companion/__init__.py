"""The vessel: decisions in ``core``, devices in ``io``, put together by ``build``, run by ``app``.

The names that a Python program uses are in ``public``; they are loaded when they are first asked for, so that the vessel's
process pays nothing for them.

On PyPy one function of the standard library is made to round as CPython's does, before anything reckons with it: a
recording replays bit for bit on either.
"""

from __future__ import annotations

import math
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, SupportsFloat, SupportsIndex

if TYPE_CHECKING:
    from .public import (
        PlanFile,
        Vessel,
        loiter,
        plan_of,
        read_plan,
        read_run,
        waypoint,
        write_plan,
        write_report,
    )

__all__ = [
    "PlanFile",
    "Vessel",
    "loiter",
    "plan_of",
    "read_plan",
    "read_run",
    "waypoint",
    "write_plan",
    "write_report",
]

if sys.implementation.name == "pypy":  # divides by pi / 180 where CPython multiplies by 180 / pi

    def _degrees(angle_rad: SupportsFloat | SupportsIndex, /) -> float:
        return float(angle_rad) * (180.0 / math.pi)

    math.degrees = _degrees


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(import_module(".public", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
