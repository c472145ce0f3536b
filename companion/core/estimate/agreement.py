"""Whether a receiver's places go where its own speed leads: a place that creeps away, or a speed in the wrong unit, is seen in a minute.

One of the two is wrong then, and which is not known. So it is only told.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from .witness import Told

_LOOK_US: Final = 5_000_000
"""Nothing that is looked for is faster, and what is told must have looked so twice."""
_WINDOW_US: Final = 90_000_000
"""Longer than a plain receiver's places wander to and fro, shorter than the noise of a speed needs to add up."""
_APART_M: Final = 15.0
"""Places without corrections wander by 6 m within a minute and a half, and step by as much beside a wall."""
_APART_SHARE: Final = 0.2
"""Of the way that the speed leads: what a slow receiver misses of the turns is less."""
_TWICE: Final = 2
_GAP_US: Final = 3_200_000

_Seen = tuple[int, complex, complex]


class PlaceAgainstSpeed:
    """One receiver; call once for each fix that is believed."""

    def __init__(self) -> None:
        self.is_apart = False
        """Whether both disagree."""
        self._begin()

    def _begin(self) -> None:
        self._past: deque[_Seen] = deque()
        self._led = self._last = 0j
        self._last_us = 0
        self._looks = 0

    def step(self, told: Told) -> str:
        """Take a fix; return what to say, empty for nothing."""
        since_us, self._last_us = told.t_us - self._last_us, told.t_us
        if told.mps is None or not 0 < since_us < _GAP_US:
            self._begin()
            self._last_us = told.t_us
        if told.mps is None:
            return ""
        velocity = complex(*told.mps)
        if self._past:
            self._led += 0.5e-6 * since_us * (self._last + velocity)
        self._last = velocity
        past = self._past
        if past and told.t_us - past[-1][0] < _LOOK_US:
            return ""
        past.append((told.t_us, complex(*told.at_m), self._led))
        while told.t_us - past[0][0] > _WINDOW_US:
            past.popleft()
        return self._judge()

    def _judge(self) -> str:
        apart_m, over_us = self._most_apart()
        self._looks = min(self._looks + 1, _TWICE) if apart_m > 0.0 else max(self._looks - 1, 0)
        if not self.is_apart and self._looks == _TWICE:
            self.is_apart = True
            return f"Receiver's place and speed disagree: {apart_m:.0f} m in {over_us * 1e-6:.0f} s"
        if self.is_apart and self._looks == 0 and len(self._past) > _TWICE:
            self.is_apart = False
            return "Receiver's place and speed agree again"
        return ""

    def _most_apart(self) -> tuple[float, int]:
        """Return by how much both are apart, m, and over how long; 0 where they agree."""
        now_us, at, led = self._past[-1]
        found = 0.0, 0
        for then_us, was_at, was_led in self._past:
            moved, way = at - was_at, led - was_led
            apart_m = abs(moved - way)
            if apart_m > max(_APART_M, _APART_SHARE * abs(way), found[0]):
                found = apart_m, now_us - then_us
        return found
