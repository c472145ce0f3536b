"""The tracks of Rows: parallel lines over a parallelogram, as points north and east of its start corner.

Rows run along ``bearing``; the next row lies ``hstep`` on, across the bearing and turned by ``cross_angle``, to starboard with
CURVE_RIGHT and to port without. Rows are begun and ended ``coff`` outside. With ``alternation`` below 100 % the rows back lie nearer to
the row before them. Rows on which the boat comes back end where the next begins, with SQUARE_CURVE; without, the turn cuts in. The last row
is the last that fits into ``width``. Source: the drawing of the console, imc-wire §6.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

Point = tuple[float, float]
"""North and east, m."""


@dataclass(frozen=True, slots=True)
class CoverageField:
    """What is covered. Lengths in m, angles in rad; ``alternation`` 0...1."""

    bearing_rad: float
    cross_angle_rad: float
    width_m: float
    length_m: float
    hstep_m: float
    overshoot_m: float
    alternation: float
    square: bool
    right: bool

    @property
    def count(self) -> int:
        """How many rows fit."""
        return math.floor(self.width_m / self.hstep_m + 1e-9) + 1


def rows(field: CoverageField) -> list[Point]:
    """The corners to sail, the lead-in first."""
    side = 1.0 if field.right else -1.0
    across_rad = field.bearing_rad + side * (0.5 * math.pi + field.cross_angle_rad)
    along = (math.cos(field.bearing_rad), math.sin(field.bearing_rad))
    across = (math.cos(across_rad), math.sin(across_rad))
    return [(x * along[0] + y * across[0], x * along[1] + y * across[1]) for x, y in _corners(field)]


def _corners(field: CoverageField) -> Iterator[Point]:
    """Corners along and across, in the field's own axes."""
    yield -field.overshoot_m, 0.0
    for number in range(field.count):
        is_back = bool(number % 2)
        end = -field.overshoot_m if is_back else field.length_m + field.overshoot_m
        yield end, _row_at(field, number)
        if number + 1 < field.count:
            turn = end if field.square else (0.0 if is_back else field.length_m)
            yield turn, _row_at(field, number + 1)


def _row_at(field: CoverageField, number: int) -> float:
    """How far across a row lies."""
    shift = field.hstep_m * (1.0 - field.alternation) if number % 2 else 0.0
    return number * field.hstep_m - shift
