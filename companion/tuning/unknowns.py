"""What a fit may change, how widely each is believed before it, when the record has told it, and where in a vessel's file it stands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ..core.config import Config
from ..core.hull import VesselConfig
from ..core.hull.vessel_file import RudderConfig, ThrusterConfig
from .hull_arrays import coefficients
from .windows import Windows

Array = Any

_TOLD: Final = 0.6
"""A value whose spread is still more than this share of the prior's is not told by the record."""
_WIDE: Final = 0.35
"""Neither is one that is known to no better than this, relative for coefficients, in prior widths for offsets."""

_BASELINE_RAD: Final = math.radians(45.0)
"""A baseline that is mounted farther off is one at right angles or back to front, and steers nowhere."""
_TWENTIETH: Final = math.exp(-3.0)
"""No coefficient is so much less than the file said, nor so many times more."""

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


@dataclass(frozen=True, slots=True)
class FitUnknown:
    """One number of the fit, counted in widths of its prior: value = start * exp(width x), or start + width x."""

    name: str
    start: float
    width: float
    relative: bool
    low: float = -6.0
    high: float = 6.0
    """Bounds, in widths."""
    unit: str = ""

    def value(self, x: Array) -> Array:
        """The value at ``x`` widths from the prior's middle."""
        return self.start * np.exp(self.width * x) if self.relative else self.start + self.width * x

    def spread(self, x: Array, deviation: Array) -> Array:
        """Standard deviation of the value."""
        return self.value(x) * self.width * deviation if self.relative else self.width * deviation

    def told(self, deviation: Array) -> bool:
        """Whether the record tells it: much narrower than the prior. What it presses against a bound is told, too."""
        return bool(deviation < _TOLD and (not self.relative or self.width * deviation < _WIDE))

    def known(self, x: Array, deviation: Array) -> bool:
        """Whether it is told, and not at a bound, where its interval would reach beyond what can be."""
        return self.told(deviation) and bool(self.low + 0.05 < x < self.high - 0.05)


def _relative(name: str, start: float, width: float, allowed: tuple[float, float] = (0.0, math.inf)) -> FitUnknown:
    low, high = max(allowed[0] / start, _TWENTIETH), min(allowed[1] / start, 1.0 / _TWENTIETH)
    return FitUnknown(name, start, width, True, low=math.log(low) / width, high=math.log(high) / width)


def _between(name: str, start: float, width: float, low: float, high: float) -> FitUnknown:
    return FitUnknown(name, start, width, relative=False, low=(low - start) / width, high=(high - start) / width)


def _allowed(table: type[Config], key: str) -> tuple[float, float]:
    """Bounds of a key of the vessel file, both included: a fit writes no file that is refused."""
    limits = table.model_fields[key].metadata
    return next(limit.ge for limit in limits if hasattr(limit, "ge")), next(
        limit.le for limit in limits if hasattr(limit, "le")
    )


def unknowns_of(vessel: VesselConfig, windows: Windows) -> list[FitUnknown]:
    """Return what a fit of a vessel to these windows may change. Mass is not among it: motion tells forces per mass only."""
    c = coefficients(vessel)
    least = {"xu": 0.02 * c["xuu"] + 0.1, "xuu": 0.05 * c["xu"] + 0.1, "yv": 0.1, "yvv": 0.1, "nr": 0.01, "nrr": 0.01}
    widths = {"m22": 0.4, "m33": 0.4, "xu": 0.6, "xuu": 0.5, "yv": 0.6, "yvv": 0.8, "nr": 0.6, "nrr": 0.7}
    found = [_relative(name, max(c[name], least.get(name, 1e-6)), width) for name, width in widths.items()]
    # the water that goes along sideways is at least what goes along ahead
    found[0] = replace(found[0], low=math.log(min(0.9 * c["m11"] / c["m22"], 0.95)) / widths["m22"])
    found.append(_between("munk", c["munk"], 0.35, 0.0, 1.0))
    found.append(
        _between("m23", c["m23"], 0.05 * c["m22"] * vessel.hull.length_m / 2.0, -0.3 * c["m22"], 0.3 * c["m22"])
    )
    nr, nrr = max(c["nr"], least["nr"]), max(c["nrr"], least["nrr"])
    most = 2.0 * math.sqrt(nr * nrr) + nr
    found.append(_between("nur", c["nur"], 0.4 * (c["nur"] + nr), 0.0, max(3.0 * most, 2.0 * c["nur"])))
    return found + _propulsion(vessel, c) + _sensors(vessel, windows)


def _propulsion(vessel: VesselConfig, c: dict[str, float]) -> list[FitUnknown]:
    found = [
        _relative("ahead", c["ahead"], 0.45),
        _relative("astern", c["astern"], 0.45),
        _relative("lag", c["lag"], 0.6),
    ]
    if not vessel.thruster.curve:
        found.append(_between("exponent", c["exponent"], 0.5, 0.8, 4.0))
    found.append(_between("speed_loss", c["speed_loss"], 0.08, 0.0, 0.45))
    found.append(_between("dead_band", c["dead_band"], 0.04, 0.0, 0.3))
    if vessel.thruster.count == 2 and vessel.thruster.lateral_m:
        found.append(
            _relative("starboard_share", c["starboard_share"], 0.2, _allowed(ThrusterConfig, "starboard_share"))
        )
    if vessel.rudder.count:
        found.append(_relative("area", c["area"], 0.45))
        found.append(_relative("rudder_lag", c["rudder_lag"], 0.5))
        low, high = map(math.radians, _allowed(RudderConfig, "offset_deg"))
        found.append(_between("offset", c["offset"], math.radians(4.0), low, high))
        found.append(_between("race_share", c["race_share"], 0.25, 0.0, 1.0))
    return found


def _sensors(vessel: VesselConfig, windows: Windows) -> list[FitUnknown]:
    """Of the record: a log may hold its commands later than what they did, so delays may be below zero. A fix has no filter behind it."""
    late, smooth = ["velocity_late", "heading_late"], [] if windows.by_fix.all() else ["velocity_smooth"]
    if windows.smoothed.any():
        late, smooth = [*late, "place_late"], [*smooth, "place_smooth"]
    late.append("bow_late")
    found = [_between(name, 0.0, 0.15, -0.5, 0.9) for name in late]
    found += [_between(name, 0.15, 0.15, 0.0, 1.5) for name in smooth]
    found.append(_between("heading_offset", 0.0, math.radians(2.5), -_BASELINE_RAD, _BASELINE_RAD))
    if not (windows.smoothed | windows.by_fix).all():
        half_m = 0.5 * vessel.hull.length_m
        found.append(_between("sensor_forward", 0.0, 0.3 * half_m, -half_m, half_m))
    ways = [f"wind_{way}_{k}" for k in range(int(windows.voyage.max()) + 1) for way in ("north", "east")]
    return found + [_between(name, 0.0, 4.0, -30.0, 30.0) for name in ways]


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
