"""The states of the guard with the table of its transitions (vessel-control §5.2), and whether the water is proven to be less than the
lock needs, or only the sounder's noise says so.

The step from correction to locked ends an operator's manoeuvre, so it waits for evidence where waiting is harmless. Proven is a mean
of 0.8 s that lies 1.8 sigma below the lock: at a true altitude on the lock itself noise reaches that once in millions of means,
at one 3 sigma below it is reached within the window (issue of the seed's "turn back": sigma 0.05 m against a margin of 0.1 m).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Final

from mavlink_bridge.language.messages import GuardState

from .input import Altitude, reading_sigma_m

UNKNOWN, OK, CORRECTION, LOCKED = GuardState.UNKNOWN, GuardState.OK, GuardState.CORRECTION, GuardState.LOCKED
_WINDOW_US: Final = 800_000
"""Below the 1 s that a lock may take, tick and filter included."""
_ENOUGH: Final = 3
"""Readings in the window; a slower sounder is believed by its median, which spans as many."""
_SIGMAS: Final = 1.8
"""One sounding of good water in twenty-eight reads so far down; three in a row, one in twenty thousand."""
_CLEAR: Final = 2.0
"""Times the noise of a reading, four times that of the median of five: at the seed's margins 4.2 m, which its own test calls good."""
EPS_M: Final = 1e-9
"""Sums of decimal metres differ by less; 4.0 + 0.1 is 4.1."""
_KEPT: Final = 32
"""Readings that the noise is estimated from: 3 s at 10 Hz."""
_FEWEST: Final = 24
"""Fewer say too little of the noise: its estimate would be off by a third."""
_STEPS: Final = 4
"""Largest second differences left out: a step of the bottom makes three of them, and is no noise."""
_LEFT: Final = 0.53
"""What is left of a normal variance without the largest 4 of 22 to 30 squares (0.49 to 0.56)."""
_CAP: Final = 2.0
"""Times the sensor file's noise: a chop that the differences do not remove must not open the lock further."""
_SECOND_DIFFERENCE: Final = 6.0
"""Variance of z[i+1] - 2 z[i] + z[i-1] over that of z. A slope leaves none, heave of 3 s and 0.1 m at 10 Hz 4 mm."""


def next_state(
    state: GuardState, altitude_m: float | None, min_m: float, minimum_margin_m: float, good_margin_m: float
) -> GuardState:
    """One transition of the guard's table (vessel-control §5.2; unknown: architecture-study §4.8). Pure.

    "Below" is strict, "good" includes equality; both within 1e-9 m, so that decimal thresholds behave.
    """
    if altitude_m is None:
        return LOCKED if state is LOCKED else UNKNOWN
    if altitude_m >= min_m + good_margin_m - EPS_M:
        return OK
    if state is LOCKED or altitude_m < min_m - minimum_margin_m - EPS_M:
        return LOCKED
    if state is OK and altitude_m >= min_m - EPS_M:
        return OK
    return CORRECTION


class LockEvidence:
    """The newest good readings, and what they prove. ``note`` what passed the gate."""

    def __init__(self) -> None:
        self._readings: deque[Altitude] = deque(maxlen=_KEPT)

    def note(self, passed: Sequence[Altitude]) -> None:
        """Take readings that passed the gate; several at once are a confirmed jump, and the noise is estimated anew."""
        if len(passed) > 1:
            self._readings.clear()
        self._readings.extend(passed)

    def sigma_m(self, stated_m: float) -> float:
        """Noise of one reading, slope and heave removed, m: at most twice the stated one, which stands for too few readings."""
        values = [reading.value_m for reading in self._readings]
        if len(values) < _FEWEST:
            return stated_m
        triples = zip(values, values[1:], values[2:], strict=False)
        squares = sorted((a - 2.0 * b + c) * (a - 2.0 * b + c) for a, b, c in triples)[:-_STEPS]
        sigma_m = math.sqrt(math.fsum(squares) / (len(squares) * _SECOND_DIFFERENCE * _LEFT))
        return min(sigma_m, _CAP * stated_m)

    def proves_good(self, filtered_m: float, good_m: float, least_sigma_m: float) -> bool:
        """Whether a median that reaches ``good_m`` is no luck of the noise: it lies well above, or a mean of 1.6 s reaches it too.

        Good by luck ends a correction while its vessel still turns, and the next low reading stops her once more.
        """
        if filtered_m >= good_m + _CLEAR * self.sigma_m(reading_sigma_m(least_sigma_m, filtered_m)) - EPS_M:
            return True
        recent = self._recent(2 * _WINDOW_US)
        return len(recent) < _ENOUGH or math.fsum(recent) / len(recent) >= good_m - EPS_M

    def _recent(self, window_us: int) -> list[float]:
        readings = self._readings
        return [each.value_m for each in readings if readings[-1].t_us - each.t_us < window_us]

    def proves(self, filtered_m: float, lock_m: float, far_m: float, least_sigma_m: float) -> bool:
        """Whether the altitude is below ``lock_m``, or the newest three readings are below ``far_m``.

        ``filtered_m``: the median, for a sounder too slow for a mean. ``least_sigma_m``: noise as the sensor file states it.
        """
        readings = self._readings
        if len(readings) >= _ENOUGH and all(readings[-k].value_m < far_m for k in range(1, _ENOUGH + 1)):
            return True
        recent = self._recent(_WINDOW_US)
        seen_m = math.fsum(recent) / len(recent) if len(recent) >= _ENOUGH else filtered_m
        return seen_m < lock_m - _SIGMAS * self.sigma_m(reading_sigma_m(least_sigma_m, filtered_m))
