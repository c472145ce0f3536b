"""Measurements that reach the vessel over MAVLink: an echo sounder on another component."""

from __future__ import annotations

from typing import Any, Final

from ...language.requests import DistanceInput

_DOWN: Final = 25


def distance(message: Any) -> DistanceInput | None:
    """DISTANCE_SENSOR that looks down. Outside the sensor's own range there is no bottom: value None."""
    if message.orientation != _DOWN:
        return None
    in_range = message.min_distance <= message.current_distance <= message.max_distance
    quality = None if message.signal_quality == 0 else max(0.0, (message.signal_quality - 1) / 99.0)
    value_m = message.current_distance / 100.0 if in_range and message.signal_quality != 1 else None
    return DistanceInput(value_m, quality)
