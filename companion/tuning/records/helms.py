"""What of a record's helm the hull's file does not know: said, never refused, for the file may be the one that is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from ...core.hull import VesselConfig
from ..voyages import Stretch

Array = Any

_BEYOND: Final = 1.1
"""A rudder is laid a little over its stop by its trim."""
_STILL: Final = 1e-3
"""Radians and commands: less is rounding."""


def unlike_file(stretches: Sequence[Stretch], vessel: VesselConfig) -> Iterator[str]:
    """Say where a rudder goes farther than the file's, or nothing that turns her by the file moves."""
    if not stretches:
        return
    rudder, apart = (np.concatenate(each) for each in zip(*map(_helm, stretches), strict=True))
    reach_deg, most_deg = math.degrees(float(np.percentile(rudder, 99.0))), vessel.rudder.max_deg
    ruled = vessel.rudder.count > 0
    if ruled and reach_deg > _BEYOND * most_deg:
        mend = "is the column in radians, is rudder.max_deg right?"
        yield f"take care: rudder goes to {reach_deg:.0f} degrees, and the file's to {most_deg:g}: {mend}"
    if ruled and rudder.max() < _STILL:
        yield "take care: the file has rudders, and in the record none moves: is its column named?"
    if not ruled and apart.max() < _STILL:
        yield "take care: port and starboard are alike in every row, and nothing else turns her: is each its own column?"


def _helm(stretch: Stretch) -> tuple[Array, Array]:
    return np.abs(stretch.rudder_rad), np.abs(stretch.port - stretch.starboard)
