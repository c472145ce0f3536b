"""The same record given twice, by a glob or a copied folder: it would count twice, and intervals come out too narrow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from .hull_arrays import STEP_S
from .voyages import Stretch, Tell

_ALIKE: Final = 1e-3
"""In the middle of what was told, in its unit, where it is read at other steps: no two voyages are so alike for as long as a stretch."""
_COMPARED: Final = ("rate", "port", "starboard", "surge")


def taken_once(stretches: Sequence[Stretch], tell: Tell) -> list[Stretch]:
    """Return the stretches without those that another one holds; ``tell`` is called once for each record that was left out of."""
    kept: list[Stretch] = []
    told: set[tuple[str, str]] = set()
    for stretch in sorted(stretches, key=lambda each: -len(each.port)):
        twin = next((other for other in kept if _holds(other, stretch)), None)
        if twin is None:
            kept.append(stretch)
        elif (pair := (stretch.source, twin.source)) not in told:
            told.add(pair)
            tell(
                f"{stretch.source}: given twice, taken once"
                if stretch.source == twin.source
                else f"{stretch.source}: the same record as {twin.source}, taken once"
            )
    return [stretch for stretch in stretches if any(stretch is each for each in kept)]


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
