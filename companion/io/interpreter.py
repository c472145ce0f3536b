"""What a long run asks of the Python under it. CPython's collector is told to leave the objects of the start alone;
PyPy has no such call, and its compiler is told to begin early: a run's ticks are all alike, so what it sees a few hundred
times it will see ten thousand times.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
from typing import Final

_EARLY: Final = (
    "threshold=60,function_threshold=80,trace_eagerness=20,trace_limit=3000,"
    "enable_opts=intbounds:rewrite:virtualize:string:pure:earlyforce:heap"
)
"""PyPy's parameters (by default 1039, 1619, 200, 6000 and all optimizations). Short traces, for a run with many faults takes
many branches, and each is compiled to the end of its trace; under 1500 nearly nothing is compiled any more. All but the
unrolling of loops, which costs more here than it brings."""


def settle() -> None:
    """Collect what the start left behind, then keep the rest out of every later collection."""
    gc.collect()
    if hasattr(gc, "freeze"):
        gc.freeze()


def unsettle() -> None:
    """Undo ``settle``."""
    if hasattr(gc, "unfreeze"):
        gc.unfreeze()


def compile_early() -> None:
    """Have PyPy compile sooner; nothing on CPython."""
    if sys.implementation.name == "pypy":
        importlib.import_module("pypyjit").set_param(_EARLY)


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
