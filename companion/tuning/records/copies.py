"""A record that is given twice counts once: a copy, another export whose clock is set otherwise, two that overlap.

A copied folder or a glob gives a record twice: it would count twice, and intervals come out too narrow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, Final

import numpy as np

from ..hull_arrays import STEP_S
from ..voyages import SHORTEST_S, Stretch
from .tables import Tell

Array = Any

_ALIKE: Final = 1e-3
"""In the middle of what was told, in its unit, where it is read at other steps: no two voyages are so alike for as long as a stretch."""
_COMPARED: Final = ("rate", "port", "starboard", "surge")
_SPAN: Final = round(30.0 / STEP_S)
"""Steps: in a shorter while two voyages may turn alike by chance."""
_SMOOTH: Final = 5
"""Steps of a mean, a quarter of a second: rows that were read at other moments between the same ones come out alike."""
_SAME_NOISE: Final = 0.8
"""Correlation of what the rate of turn changes by from step to step: the gyro's noise and the waves. Copies come to 0.91
at least, 150 pairs of voyages to 0.60 at most."""
_TURNED: Final = 2.0
"""Times the middle one, beyond which such changes are the helm's: two voyages by one plan do share these, and they count no more."""
_LIVELY: Final = 0.1
"""Share of a record's own changes below which a while is rest, and rest is like rest."""
_NEAR: Final = 0.02
"""Radians and commands, in the middle, that rows read at other moments may differ by."""


def taken_once(stretches: Sequence[Stretch], tell: Tell) -> list[Stretch]:
    """Return the stretches without what another one holds; ``tell`` is called once for each record that something was left out of."""
    kept: list[tuple[int, Stretch]] = []
    told: set[tuple[str, str]] = set()
    for number, stretch in sorted(enumerate(stretches), key=lambda each: -len(each[1].port)):
        left = [stretch]
        for _, other in kept:
            parts = [part for each in left for part in _without(other, each)]
            lost_s = sum(len(each.port) for each in left) * STEP_S - sum(len(each.port) for each in parts) * STEP_S
            if lost_s > 0.0 and (pair := (stretch.source, other.source)) not in told:
                told.add(pair)
                tell(_said(pair, 0.0 if not parts else lost_s))
            left = parts
        kept += [(number, part) for part in left]
    return [stretch for _, stretch in sorted(kept, key=lambda each: (each[0], each[1].start_s))]


def _said(pair: tuple[str, str], lost_s: float) -> str:
    """``lost_s``: 0 for the whole of it."""
    source, twin = pair
    if source == twin:
        return f"{source}: given twice, taken once"
    return f"{source}: {f'{lost_s:.0f} s of it are' if lost_s else 'the same record as'} {'in ' if lost_s else ''}{twin}, taken once"


def _without(other: Stretch, stretch: Stretch) -> list[Stretch]:
    """What of a stretch does not stand in the other."""
    if _holds(other, stretch):
        return []
    at = _same_from(other, stretch)
    if at is None:
        return [stretch]
    first, last = max(0, -at), min(len(stretch.port), len(other.port) - at)
    parts = [_part(stretch, 0, first), _part(stretch, last, len(stretch.port))]
    return [part for part in parts if part.seconds > SHORTEST_S]


def _part(stretch: Stretch, first: int, last: int) -> Stretch:
    def of(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(each[first:last] for each in value)
        return value[first:last] if isinstance(value, np.ndarray) else value

    cut = {field.name: of(getattr(stretch, field.name)) for field in fields(stretch)}
    return replace(stretch, **cut | {"start_s": stretch.start_s + first * STEP_S})


def _holds(long: Stretch, short: Stretch) -> bool:
    """Whether all that one tells stands in the other, at the same times."""
    first = round((short.start_s - long.start_s) / STEP_S)
    if first < 0 or first + len(short.port) > len(long.port):
        return False
    part = slice(first, first + len(short.port))
    turn = 2.0 * np.pi * round(float(long.psi_rad[first] - short.psi_rad[0]) / (2.0 * np.pi))
    pairs = [(long.psi_rad[part] - turn, short.psi_rad)]
    pairs += [(np.nan_to_num(getattr(long, name)[part]), np.nan_to_num(getattr(short, name))) for name in _COMPARED]
    return all(float(np.median(np.abs(one - other))) < _ALIKE for one, other in pairs)


def _same_from(long: Stretch, short: Stretch) -> int | None:
    """The step of the one at which the other begins, or would, where both tell of the same while, whatever the clocks say."""
    if min(len(long.port), len(short.port)) <= _SPAN + 2 * _SMOOTH:
        return None
    at, likeness = _most_alike(_changes(long.rate), _changes(short.rate))
    if likeness < _SAME_NOISE:
        return None
    first, last = max(0, -at), min(len(short.port), len(long.port) - at)
    one, other = slice(first + at, last + at), slice(first, last)
    turned = np.angle(np.exp(1j * (long.psi_rad[one] - short.psi_rad[other])))
    off = [turned, long.port[one] - short.port[other], long.starboard[one] - short.starboard[other]]
    return at if all(float(np.median(np.abs(each))) < _NEAR for each in off) else None


def _changes(value: Array) -> Array:
    mean = np.full(_SMOOTH, 1.0 / _SMOOTH)
    # twice: the changes of a single mean are two rows, and those are not the same ones
    changes = np.diff(np.convolve(value, np.convolve(mean, mean), mode="valid"))
    most = _TURNED * float(np.median(np.abs(changes)))
    return np.clip(changes, -most, most) if most > 0.0 else changes


def _most_alike(long: Array, short: Array) -> tuple[int, float]:
    """Where the one lies on the other so that they correlate most, over a span at least, and by how much."""
    from scipy.signal import fftconvolve

    at = np.arange(1 - len(short), len(long))
    first, last = np.maximum(0, -at), np.minimum(len(short), len(long) - at)
    sizes = []
    for value, begins, ends in ((long, first + at, last + at), (short, first, last)):
        summed = np.concatenate([[0.0], np.cumsum(value * value)])
        least = _LIVELY * summed[-1] / len(value) * (ends - begins)
        sizes.append(np.maximum(summed[ends] - summed[begins], np.maximum(least, 1e-12)))
    likeness = np.where(last - first >= _SPAN, fftconvolve(long, short[::-1]) / np.sqrt(sizes[0] * sizes[1]), 0.0)
    best = int(np.argmax(likeness))
    return int(at[best]), float(likeness[best])
