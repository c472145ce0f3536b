"""Configuration: the schema of the settings file, how it is read, and the parameter table that stations see."""

from __future__ import annotations

from .schema import ConfigError, Settings, explain, load, load_vessel

__all__ = ["ConfigError", "Settings", "explain", "load", "load_vessel"]
