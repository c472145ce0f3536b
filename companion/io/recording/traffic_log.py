"""What a run's events keep of other vessels: each that has become dangerous, at its changes and every few seconds until past and clear."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.traffic import NO_TRAFFIC, Danger, OtherVessel, TrafficPicture

_EVERY_US: Final = 5_000_000
_MOST: Final = 16
"""Vessels kept at once, the most dangerous: a crowd must not fill the disk."""


class TrafficLog:
    """Remembers what was kept last of whom."""

    def __init__(self) -> None:
        self._picture: TrafficPicture = NO_TRAFFIC
        self._kept: dict[int, tuple[Danger, int]] = {}

    def changes(self, snapshot: Snapshot) -> Iterator[dict[str, Any]]:
        """Return the fields of this tick's events."""
        picture = snapshot.traffic
        if picture is self._picture:
            return
        self._picture = picture
        threats = {vessel.mmsi: vessel for vessel in picture.threats[:_MOST]}
        ended = [vessel for vessel in picture.vessels if vessel.mmsi in self._kept and vessel.mmsi not in threats]
        for vessel in threats.values():
            danger, at_us = self._kept.get(vessel.mmsi, (Danger.NONE, 0))
            if danger is not vessel.danger or snapshot.t_us - at_us >= _EVERY_US:
                self._kept[vessel.mmsi] = vessel.danger, snapshot.t_us
                yield _fields(vessel, snapshot)
        for vessel in ended:
            yield _fields(vessel, snapshot)
        for mmsi in [mmsi for mmsi in self._kept if mmsi not in threats]:
            del self._kept[mmsi]


def _fields(vessel: OtherVessel, snapshot: Snapshot) -> dict[str, Any]:
    state, sides = snapshot.state, vessel.sides
    own = None if state.lat_rad is None or state.lon_rad is None else [_deg(state.lat_rad), _deg(state.lon_rad)]
    return {
        "mmsi": vessel.mmsi,
        "name": vessel.name,
        "danger": vessel.danger.value,
        "role": vessel.role.value,
        "at": [_deg(vessel.lat_rad), _deg(vessel.lon_rad)],
        "own": own,
        "course_deg": None if vessel.cog_rad is None else round(math.degrees(vessel.cog_rad) % 360.0, 1),
        "sog_mps": None if vessel.sog_mps is None else round(vessel.sog_mps, 2),
        "range_m": None if vessel.range_m is None else round(vessel.range_m, 1),
        "cpa_m": None if vessel.cpa_m is None else round(vessel.cpa_m, 1),
        "tcpa_s": None if vessel.tcpa_s is None else round(vessel.tcpa_s, 1),
        "length_m": None if sides is None else sides.bow_m + sides.stern_m,
    }


def _deg(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 7)
