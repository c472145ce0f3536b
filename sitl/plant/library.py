"""The vessels that ship with the software, by name."""

from __future__ import annotations

import tomllib

import config
from companion.core.hull import VesselConfig


def vessel_names() -> list[str]:
    return sorted(file.stem for file in config.path("vessels").glob("*.toml"))


def load_vessel(name: str) -> VesselConfig:
    """Return a shipped vessel. Raises FileNotFoundError for a name that is not among ``vessel_names()``."""
    return VesselConfig.model_validate(tomllib.loads(config.path("vessels", f"{name}.toml").read_text("utf-8")))
