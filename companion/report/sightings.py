"""A run's events about other vessels, one line each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(slots=True)
class Sighting:
    """One line of the events about a vessel with risk."""

    t_s: float
    mmsi: int
    name: str
    danger: str
    role: str
    at: tuple[float, float]
    """Latitude and longitude, degrees."""
    own: tuple[float, float] | None
    range_m: float | None
    cpa_m: float | None
    tcpa_s: float | None


def sighting_of(data: dict[str, Any]) -> Sighting:
    """Raises KeyError, TypeError and ValueError for a line that was cut."""
    own = data.get("own")
    return Sighting(
        t_s=float(data["t_s"]),
        mmsi=int(data["mmsi"]),
        name=str(data["name"]),
        danger=str(data["danger"]),
        role=str(data["role"]),
        at=(float(data["at"][0]), float(data["at"][1])),
        own=None if own is None else (float(own[0]), float(own[1])),
        range_m=data.get("range_m"),
        cpa_m=data.get("cpa_m"),
        tcpa_s=data.get("tcpa_s"),
    )
