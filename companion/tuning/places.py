"""Where in a vessel's file each coefficient of a fit stands, and the vessel that has such values."""

from __future__ import annotations

import math
from typing import Final

from ..core.hull import VesselConfig

PLACES: Final = {
    "m22": ("hull", "m22_kg", "kg"),
    "m23": ("hull", "m23_kgm", "kg m"),
    "m33": ("hull", "m33_kgm2", "kg m2"),
    "xu": ("hull", "xu", "N/(m/s)"),
    "xuu": ("hull", "xuu", "N/(m/s)2"),
    "yv": ("hull", "yv", "N/(m/s)"),
    "yvv": ("hull", "yvv", "N/(m/s)2"),
    "nr": ("hull", "nr", "Nm/(rad/s)"),
    "nrr": ("hull", "nrr", "Nm/(rad/s)2"),
    "nur": ("hull", "nur", "Nm/(rad/s)/(m/s)"),
    "munk": ("hull", "munk", ""),
    "ahead": ("thruster", "ahead_n", "N"),
    "astern": ("thruster", "astern_n", "N"),
    "exponent": ("thruster", "exponent", ""),
    "starboard_share": ("thruster", "starboard_share", ""),
    "lag": ("thruster", "lag_s", "s"),
    "speed_loss": ("thruster", "speed_loss", "1/(m/s)"),
    "dead_band": ("thruster", "dead_band", ""),
    "area": ("rudder", "area_m2", "m2"),
    "rudder_lag": ("rudder", "lag_s", "s"),
    "offset": ("rudder", "offset_deg", "deg"),
    "race_share": ("thruster", "race_share", ""),
}
"""Where each coefficient stands in the file."""


def with_values(vessel: VesselConfig, values: dict[str, float]) -> VesselConfig:
    """Return a vessel with these coefficients, within what its file allows."""
    parts: dict[str, dict[str, float]] = {"hull": {}, "thruster": {}, "rudder": {}}
    for name, value in values.items():
        if name in PLACES:
            part, key, _ = PLACES[name]
            parts[part][key] = math.degrees(value) if name == "offset" else _bounded(name, value)
    return vessel.model_copy(
        update={part: getattr(vessel, part).model_copy(update=new) for part, new in parts.items() if new}
    )


def _bounded(name: str, value: float) -> float:
    if name in ("munk", "race_share"):
        return min(max(value, 0.0), 1.0)
    return value if name == "m23" else max(value, 1e-3 if name in ("xu", "lag") else 0.0)
