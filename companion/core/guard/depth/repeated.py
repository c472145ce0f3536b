"""Whether the sounder repeats one value while the boat moves: told by a bottom, or by a noise, that cannot have stopped just then.

A boat at rest, a lock, a dredged basin and a sounder of whole feet truly repeat a depth for minutes. So the same digits alone say nothing:
they must last far longer than they ever did lately, in readings and on the way, and either the sounder's own noise has gone (it spanned
several of its digits), or the slope that was being sailed up should have changed the depth by much more than a digit. The slope
alone is worth a word and no more: slopes end on dredged levels, and there an honest sounder of coarse digits does repeat itself.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise
from typing import Final

_MOVES_MPS: Final = 0.3
"""Slower, a bottom takes minutes to change, and a boat at her berth lies still."""
_PAUSE_S: Final = 2.5
"""A gap between two readings counts as no more way than this."""
_HISTORY: Final = 32
"""Changes that say how the sounder speaks: 2 to 10 s of a fast one."""
_FEWEST: Final = 16
"""Changes; of fewer the longest repetition says too little."""
_LONGER: Final = 5.0
"""Times the longest repetition of late. Recorded sounders of 0.1 m repeat 7 readings at most under way, and 4 to 6 all the time."""
_LEAST_COUNT: Final = 6
"""Readings. Noise that spans several digits repeats one in ten at the most: six in a row, one in a hundred thousand."""
_LEAST_WAY_M: Final = 2.0
"""Less is the boat's own length, over which no bottom need change."""
_LEAST_US: Final = 1_000_000
"""Sounders of 10 Hz that measure once or twice a second repeat each value for so long."""
_NOISY_SHARE: Final = 0.25
"""Of the changes turn back by more than a digit. Noise turns back at two of three, a slope or a swell that is rounded at few."""
_DIGITS: Final = 1.5
"""A step of more than one digit: the differences of decimal values are not exact."""
_SLOPE_DIGITS: Final = 8.0
"""So many digits the slope must have been due, for a sounder without noise of its own."""
_SLOPE_M: Final = 1.0
"""And so many metres: slopes end on levels, and a level that a sounder without noise calls level is no fault."""


class RepeatedDepth:
    """Watches what the sounder says. ``hear`` each reading."""

    def __init__(self) -> None:
        self._value_m: float | None = None
        self._count = 0
        self._way_m = 0.0
        self._since_us = self._last_us = 0
        self._slope = 0.0
        self._past: deque[tuple[float, int, float]] = deque(maxlen=_HISTORY)
        """Value, readings and way of each repetition that has ended."""
        self.is_stuck = False
        """The value is repeated, and cannot be true so long."""
        self.is_noise_gone = False
        """And that is proven by the sounder's own noise, whatever the bottom does."""

    @property
    def was_closing(self) -> bool:
        """Whether the bottom was closing when the repetition began."""
        return self._slope > 0.0

    @property
    def repeats(self) -> bool:
        """Whether the last reading was the one before."""
        return self._count > 1

    def hear(self, t_us: int, value_m: float | None, speed_mps: float, slope: float) -> None:
        """Take a reading: as the sounder said it, m, None for its range, which is no depth and may come for hours.

        ``slope``: by how much the bottom was rising for each metre sailed, 0 = it was not.
        """
        since_s, self._last_us = (t_us - self._last_us) * 1e-6, t_us
        is_moving = speed_mps > _MOVES_MPS
        if is_moving:
            self._way_m += speed_mps * min(max(since_s, 0.0), _PAUSE_S)
        if value_m is None or value_m != self._value_m:
            self._begin(t_us, value_m, slope)
            return
        self._count += 1
        if is_moving:
            self.is_stuck = self.is_stuck or self._proven()

    def _begin(self, t_us: int, value_m: float | None, slope: float) -> None:
        # What was stuck says nothing of how long a sounder that lives repeats itself.
        if self._value_m is not None and not self.is_stuck:
            self._past.append((self._value_m, self._count, self._way_m))
        self._value_m, self._count, self._way_m, self._since_us = value_m, 1, 0.0, t_us
        self._slope = slope
        self.is_stuck = self.is_noise_gone = False

    def _proven(self) -> bool:
        way_m = self._way_m
        if self._count < _LEAST_COUNT or way_m < _LEAST_WAY_M or self._last_us - self._since_us < _LEAST_US:
            return False
        if len(self._past) < _FEWEST:
            return False
        if self._count <= _LONGER * max(count for _, count, _ in self._past):
            return False
        if way_m <= _LONGER * max(way_m for *_, way_m in self._past):
            return False
        steps = self._steps()
        digit_m = min(map(abs, steps))
        self.is_noise_gone = self._is_noisy(steps, digit_m)
        return self.is_noise_gone or self._is_due(digit_m)

    def _is_due(self, digit_m: float) -> bool:
        """Whether the slope, as the sounder's own steps tell it, should have changed the depth by much more than a digit.

        A coarse sounder that trembles between two of its digits looks like a steep slope for a second: only what adds up counts.
        """
        assert self._value_m is not None
        made_m, fallen_m = math.fsum(way_m for *_, way_m in self._past), self._past[0][0] - self._value_m
        least_m = _SLOPE_DIGITS * digit_m
        if not self.was_closing or made_m <= 0.0 or fallen_m < least_m:
            return False
        return fallen_m / made_m * self._way_m >= max(least_m, _SLOPE_M)

    def _steps(self) -> list[float]:
        values = [value_m for value_m, *_ in self._past]
        return [after - before for before, after in pairwise(values)]

    @staticmethod
    def _is_noisy(steps: list[float], digit_m: float) -> bool:
        """Whether the sounder's own noise spans several digits, so that none of them can come again and again."""
        least_m = _DIGITS * digit_m
        turns = [a * b < 0.0 and min(abs(a), abs(b)) > least_m for a, b in pairwise(steps)]
        return turns.count(True) >= _NOISY_SHARE * len(turns)
