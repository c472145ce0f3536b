"""Whether a propeller has lost most of its thrust so slowly that all else has got used to it: weed that gathers for a minute.

What the boat takes for wind and current follows a loss that grows so slowly, and nothing is left to notice. But wind turns a hull by
twice the angle of the bow to it, the other way on the next leg of a square, and a lost propeller by its own thrust on each. So the
moment that is missing is kept for a minute and more, and each loss is weighed with any steady wind beside it. On one long straight
leg the two look the same: there nothing is found before the next corner. A drag to one side (a sonar's pole, a weedy keel, something
towed, a bent rudder) turns her as the square of her way through the water, whatever the thrusters do, and stands beside the wind.
"""

from __future__ import annotations

import math
from typing import Final

_TAU_S: Final = 60.0
"""Two legs of a square, and less than it takes to sail into other weather."""
_SAMPLE_S: Final = 0.5
"""A fifth of the low-pass that the moments have passed."""
_ALIKE_S: Final = 5.0
"""Moments so near in time say the same once: twice that low-pass."""
_LEAST_S: Final = 20.0
"""Of a memory that is shorter nothing is said."""
_GALES: Final = 2.0
"""A steady wind turns the hull by as many times what a gale does, at one sigma: 14 m/s does twice as much as 10 m/s."""
_QUIET: Final = 0.15
"""Share of a gale's moment that is always noise: waves, and a model that is off."""
_LEAST: Final = 0.3
"""And share of the least moment by which a thruster is judged at all."""
_ONE_WAY: Final = 0.7
"""Twice the heading, as a mean over the memory: 1 on a straight leg, this after nine seconds of the next one."""
_ASIDE: Final = 0.6
"""A drag to one side turns the hull by at most so much of what her whole drag would at a thruster's arm; a sonar's pole came to 0.4. One
that gives less than 0.45 of what it is asked for turns her by more."""
_LOST: Final = (0.6, 0.8, 1.0)
"""Shares of one side's thrust that may be lost: what lies between is near one of them."""
_BOTH: Final = (0.3, 0.6)
"""Of both alike: a file whose moments are off, or water full of air."""
_EVIDENCE: Final = 25.0
"""Odds, as a logarithm, against a sound boat in a steady wind, with a drag to one side. Sound hulls came to 5 in a gale, and to 11 with a
drag beyond what is believed; a propeller that faded to a fifth to 28 to 52."""
_AHEAD: Final = 5.0
"""And against a loss of the other side or of both. Sound hulls came to 8 while the evidence was above 12."""

_WIND: Final = (3, 4)
"""Where the wind's two parts stand among what is summed,"""
_DRAG: Final = 5
"""and the drag: as ``step`` puts them."""
_SOUND: Final = (0.0, 0.0)
_ALIKE: Final = tuple((lost, lost) for lost in _BOTH)
_CANDIDATES: Final = (
    _SOUND,
    *_ALIKE,
    *((lost, 0.0) for lost in _LOST),
    *((0.0, lost) for lost in _LOST),
)


class SlowLoss:
    """One vessel's two sides; one call per tick."""

    def __init__(self, gale_nm: float, least_nm: float) -> None:
        """``gale_nm``: what a gale turns the hull by. ``least_nm``: less thrust than makes this moment is not judged."""
        wind_nm, noise_nm = _GALES * gale_nm, max(_QUIET * gale_nm, _LEAST * least_nm)
        self._wind = 1.0 / (wind_nm * wind_nm)
        self._least = noise_nm * noise_nm
        self.forget()

    def forget(self) -> None:
        """Nothing is known."""
        self._sums = [[0.0] * 7 for _ in range(7)]
        self._since_s = 0.0
        self._variance = self._least
        self.lost: tuple[float, float] = _SOUND
        """Share of its thrust that port and starboard have lost, as long as nothing else explains what is missing."""

    def step(
        self, dt_s: float, psi_rad: float, sides_nm: tuple[float, float], missing_nm: float, *, drag_nm: float
    ) -> None:
        """Take what each thruster should turn the hull by, and what is missing of all, after one low-pass.

        ``drag_nm``: what the hull's drag at her way would turn her by at a thruster's arm.
        """
        self._since_s += dt_s
        if self._since_s < _SAMPLE_S - 0.5 * dt_s:
            return
        step_s, self._since_s = self._since_s, 0.0
        found = (missing_nm, *sides_nm, math.cos(2.0 * psi_rad), math.sin(2.0 * psi_rad), drag_nm, 1.0)
        keep = 1.0 - step_s / _TAU_S
        for row, one in zip(self._sums, found, strict=True):
            row[:] = [keep * old + step_s * one * other for old, other in zip(row, found, strict=True)]
        self._weigh()

    def _weigh(self) -> None:
        *_, along_s, across_s, _, age_s = self._sums[-1]
        calm = self._without_wind()
        left = {candidate: _left(calm, candidate) for candidate in _CANDIDATES}
        best = min(left, key=left.__getitem__)
        scale = 0.5 / (_ALIKE_S * self._variance)
        self._variance = max(self._least, left[best] / age_s)
        side = 0 if best[0] > best[1] else 1
        others = min(size for candidate, size in left.items() if candidate[side] <= candidate[1 - side])
        is_known = age_s > _LEAST_S and best[0] != best[1] and math.hypot(along_s, across_s) < _ONE_WAY * age_s
        is_sure = scale * (left[_SOUND] - left[best]) > _EVIDENCE and scale * (others - left[best]) > _AHEAD
        self.lost = best if is_known and is_sure else _SOUND

    def _without_wind(self) -> list[list[float]]:
        """The sums of what the wind that fits best leaves of each."""
        sums = self._sums
        for axis in _WIND:
            by = sums[axis]
            size = by[axis] + self._wind * _ALIKE_S * self._variance
            sums = [[one - row[axis] * other / size for one, other in zip(row, by, strict=True)] for row in sums]
        return sums


def _left(sums: list[list[float]], lost: tuple[float, float]) -> float:
    """What these losses, and the drag to one side that fits best beside them, leave of the square of what is missing, over the memory."""
    weights = (1.0, *lost)
    square = math.fsum(w * math.fsum(v * sums[k][j] for j, v in enumerate(weights)) for k, w in enumerate(weights))
    aside, drag = math.fsum(w * sums[k][_DRAG] for k, w in enumerate(weights)), sums[_DRAG][_DRAG]
    if lost in _ALIKE or drag <= 0.0:  # with a drag beside it, this is any loss of one side
        return square
    share = max(-_ASIDE, min(_ASIDE, aside / drag))
    return square - 2.0 * share * aside + share * share * drag
