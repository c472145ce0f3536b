"""Configuration: the schema of the settings file, how it is read, and the parameter table that stations see.

The vessel's own schema is imported when it is first asked for: a process with few settings of its own starts without it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .reading import ConfigError, explain

if TYPE_CHECKING:
    from .schema import Settings, load, load_vessel

__all__ = ["ConfigError", "Settings", "explain", "load", "load_vessel"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(name)
    from . import schema

    return getattr(schema, name)
