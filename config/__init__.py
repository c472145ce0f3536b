"""The configuration data that ships with the software: commented TOML files, found by this one module and by no other."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent


def path(*parts: str) -> Path:
    """Return the path of a shipped file, e.g. ``path("vessels", "otter.toml")``; it need not exist."""
    return ROOT.joinpath(*parts)
