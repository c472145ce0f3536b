"""Whether a propeller has lost most of its thrust so slowly that all else has got used to it: weed that gathers for a minute.

What the boat takes for wind and current follows a loss that grows so slowly, and nothing is left to notice. But wind turns a hull by
twice the angle of the bow to it, the other way on the next leg of a square, and a lost propeller by its own thrust on each. So the
moment that is missing is kept for a minute and more, and each loss is weighed with any steady wind beside it. On one long straight
leg the two look the same: there nothing is found before the next corner.
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
_LOST: Final = (0.6, 0.8, 1.0)
"""Shares of one side's thrust that may be lost: what lies between is near one of them."""
_BOTH: Final = (0.3, 0.6)
"""Of both alike: a file whose moments are off, or water full of air."""
_EVIDENCE: Final = 40.0
"""Odds, as a logarithm, against a sound boat in a steady wind. Sound hulls came to 24 in a gale, a propeller that faded to a fifth to
39 to 2300."""
_AHEAD: Final = 5.0
"""And against a loss of the other side or of both. Sound hulls came to 8 while the evidence was above 12."""

_SOUND: Final = (0.0, 0.0)
_CANDIDATES: Final = (
    _SOUND,
    *((lost, lost) for lost in _BOTH),
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
        self._sums = [[0.0] * 6 for _ in range(6)]
        self._since_s = 0.0
        self._variance = self._least
        self.lost: tuple[float, float] = _SOUND
        """Share of its thrust that port and starboard have lost, as long as nothing else explains what is missing."""

    def step(self, dt_s: float, psi_rad: float, sides_nm: tuple[float, float], missing_nm: float) -> None:
        """Take what each thruster should turn the hull by, and what is missing of all, after one low-pass."""
        self._since_s += dt_s
        if self._since_s < _SAMPLE_S - 0.5 * dt_s:
            return
        step_s, self._since_s = self._since_s, 0.0
        found = (missing_nm, *sides_nm, math.cos(2.0 * psi_rad), math.sin(2.0 * psi_rad), 1.0)
        keep = 1.0 - step_s / _TAU_S
        for row, one in zip(self._sums, found, strict=True):
            row[:] = [keep * old + step_s * one * other for old, other in zip(row, found, strict=True)]
        self._weigh(*self._sums[-1][3:])

    def _weigh(self, along_s: float, across_s: float, age_s: float) -> None:
        left = {candidate: self._left(candidate) for candidate in _CANDIDATES}
        best = min(left, key=left.__getitem__)
        scale = 0.5 / (_ALIKE_S * self._variance)
        self._variance = max(self._least, left[best] / age_s)
        side = 0 if best[0] > best[1] else 1
        others = min(size for candidate, size in left.items() if candidate[side] <= candidate[1 - side])
        is_known = age_s > _LEAST_S and best[0] != best[1] and math.hypot(along_s, across_s) < _ONE_WAY * age_s
        is_sure = scale * (left[_SOUND] - left[best]) > _EVIDENCE and scale * (others - left[best]) > _AHEAD
        self.lost = best if is_known and is_sure else _SOUND

    def _left(self, lost: tuple[float, float]) -> float:
        """What these losses and the wind that fits best beside them leave of the square of what is missing, over the memory."""
        sums, weights = self._sums, (1.0, *lost)
        left = [math.fsum(w * sums[k][axis] for k, w in enumerate(weights)) for axis in range(5)]
        square = math.fsum(w * left[k] for k, w in enumerate(weights))
        along, across = left[3], left[4]
        wind = self._wind * _ALIKE_S * self._variance
        a, b, c = sums[3][3] + wind, sums[3][4], sums[4][4] + wind
        return square - (c * along * along - 2.0 * b * along * across + a * across * across) / (a * c - b * b)
