"""Whether the places of a log can be places: on the globe, no faster than any boat, and on the way that she heads.

Latitude and longitude changed over, or one without its sign, make a track in a mirror: she sails it the other way round than her bow turns.
A current, a wind or a compass that is askew make none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from ..voyages import Column, Stretch
from .pushing import pushing

Array = Any

_MOST_MPS: Final = 30.0
"""Sixty knots: no small boat that is fitted goes faster, and minutes taken for degrees make 60 times her speed."""
_SURE: Final = 0.6
"""Canonical correlation, in the weaker direction, from which on track and bow surely go together: of trials in up to 8 m/s of wind it
came to 0.63 at least, and none of 70 sound records looked mirrored at any. On one line, there and back, it is nearly 0."""
_FEWEST: Final = 1200
"""Steps: a mirror is told by a minute of turns, not by one gust."""
_NOTHING: Final = 1e-6
"""Share of the greatest spread below which a direction has none."""


def too_fast(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """Say that the places make a speed that is no boat's, and why that may be; "" where they do not."""
    made = [track for stretch in stretches if (track := _made(stretch)) is not None]
    if not made:
        return ""
    middle = float(np.nanmedian(np.abs(np.concatenate(made))))
    if middle < _MOST_MPS:
        return ""
    return f"{_named(columns)} make {middle:.3g} m/s: are they in degrees, 53.5 and not 5330.0 or 535000000?"


def _named(columns: Mapping[str, Column]) -> str:
    return f"lat (column {columns['lat'].name}) and lon (column {columns['lon'].name})"


def _made(stretch: Stretch) -> Array | None:
    """Velocity that the places make, ahead and to starboard as one complex number; None where speeds are all that is told."""
    if stretch.track is not None:
        return stretch.track[0] + 1j * stretch.track[1]
    return stretch.surge + 1j * stretch.sway if stretch.from_places else None


def mirrored(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """Say that over ground she goes as her bow's mirror image pushes and not as her bow does, and the mend; "" where she does not."""
    pairs = [pair for stretch in stretches if (pair := _courses(stretch)) is not None]
    if sum(way.shape[1] for way, _ in pairs) < _FEWEST:
        return ""
    way, pushed = (np.concatenate(each, axis=1) for each in zip(*pairs, strict=True))
    together = _rooted(way @ way.T) @ (way @ pushed.T) @ _rooted(pushed @ pushed.T)
    # a place's degrees may be stretched, as they are where lat and lon are changed over: the sign of the whole is a mirror's alone
    if np.linalg.det(together) >= 0.0 or np.linalg.svd(together, compute_uv=False)[-1] < _SURE:
        return ""
    said = f"{_named(columns)} tell of a track that turns to port where her bow turns to starboard"
    return f"{said}; {_unmirrored(together, columns)}"


def _courses(stretch: Stretch) -> tuple[Array, Array] | None:
    """Velocity over ground and what pushes her, north and east, without their means: a steady current is no push."""
    made = _made(stretch)
    if made is None:
        return None
    bow = np.exp(1j * stretch.psi_rad)
    pair = [np.stack([each.real, each.imag]) for each in (made * bow, pushing(stretch) * bow)]
    way, pushed = (each - each.mean(axis=1, keepdims=True) for each in pair)
    return way, pushed


def _rooted(matrix: Array) -> Array:
    """One over the root of a matrix: by it each direction counts alike."""
    sizes, axes = np.linalg.eigh(matrix)
    return (axes / np.sqrt(np.maximum(sizes, _NOTHING * max(float(sizes[-1]), _NOTHING)))) @ axes.T


def _unmirrored(together: Array, columns: Mapping[str, Column]) -> str:
    """What such a mirror looks to be: north for east where they are changed over, else the sign of one."""
    lat, lon = columns["lat"], columns["lon"]
    north, east = float(together[0, 0]), float(together[1, 1])
    if abs(north - east) < abs(together[0, 1] + together[1, 0]):
        swapped = f"lat={lon.name},{lon.zero:.5g},{lon.scale:.5g} lon={lat.name},{lat.zero:.5g},{lat.scale:.5g}"
        return f"are they changed over? then --columns {swapped}"
    if north > east:
        return f"has lon lost its sign (west is below 0)? then --columns lon={lon.name},{lon.zero:.5g},{-lon.scale:.5g}"
    return f"has lat lost its sign (south is below 0)? then --columns lat={lat.name},{lat.zero:.5g},{-lat.scale:.5g}"
