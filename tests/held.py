"""What some objects hold, found by walking from them: independent of what else a test run has in memory, and cheap beside it."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import Any

_SHARED = (type, ModuleType, FunctionType, BuiltinFunctionType)
"""Code leads to everything: what its modules hold by name is a root of its own."""


def globals_of(prefix: str) -> list[Any]:
    """What the loaded modules of a package hold by name, and their classes."""
    modules = [module for name, module in sys.modules.items() if name.startswith(prefix)]
    found = [value for module in modules for value in vars(module).values()]
    classes = [value for value in found if isinstance(value, type) and value.__module__.startswith(prefix)]
    return [*found, *(held for each in classes for held in vars(each).values())]


def walk(*roots: Any) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Each object that can be reached, once, with the classes of the three that lead to it, nearest first."""
    seen = {id(root) for root in roots}
    waiting: list[tuple[Any, tuple[str, ...]]] = [(root, ()) for root in roots if not isinstance(root, _SHARED)]
    while waiting:
        item, held_by = waiting.pop()
        yield item, held_by
        holders = (type(item).__name__, *held_by[:2])
        for other in gc.get_referents(item):
            if id(other) not in seen and not isinstance(other, _SHARED):
                seen.add(id(other))
                waiting.append((other, holders))


def bytes_held(*roots: Any) -> int:
    return sum(sys.getsizeof(item) for item, _ in walk(*roots))
