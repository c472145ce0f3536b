"""One line of a benchmark."""

from __future__ import annotations

from typing import Any


def row(name: str, value: float, unit: str, bar: float | None = None, *, at_least: bool = False) -> dict[str, Any]:
    """A figure held against its bar: at most, or at least, so much; without a bar it holds nothing."""
    holds = None if bar is None else (value >= bar if at_least else value <= bar)
    return {"name": name, "value": round(value, 4), "unit": unit, "bar": bar, "holds": holds}
