"""How fast the water under the keel comes and goes with the waves, so that heave is not taken for a slope.

A sea shows itself by what a slope never does: the altitude rises again, several times, in the period of waves. Its rises bound what it
will fall by. Where the altitude falls out of what the last waves spanned, it is the bottom that closes, and nothing is allowed for.
"""

from __future__ import annotations

import math
from collections import deque
from operator import sub
from typing import Final

from mavlink_bridge.language.value import value

from .input import Altitude

_MEAN_US: Final = 500_000
"""Readings are averaged over so much: five of a sounder of 10 Hz, and a sixth of the waves of sheltered water."""
_STEP_SIGMAS: Final = 6.0
"""The altitude has turned when it is back by so many sigma of that mean: two means differ by it once in tens of thousands."""
_STEP_MOST: Final = 4.0
"""But so many of one reading: a slow sounder's means are of one or two, and six would hide waves of 0.3 m."""
_KEPT_US: Final = 30_000_000
"""Waves come in groups: after the lull between two the next high one is no surprise."""
_FEWEST: Final = 2
"""One rise is the far side of a ridge."""
_PERIOD_US: Final = 16_000_000
"""With longer between two crests it is the bottom that goes up and down; few swells that reach a coast are longer."""
_KEPT_WAVES: Final = 5
"""The same in waves of a swell, of which 30 s hold two or three: half a group."""
_HIGHEST_M: Final = 2.0
"""A rise by more is the bottom's: a sea of 1 m lifts the shipped boats by 1.8 m at times."""
_DEEPER: Final = 0.5
"""Share of the highest wave by which the next may reach below the lowest: half of that stopped a boat every few minutes."""
_SWELL_US: Final = 8_000_000
_SWELL_DEEPER: Final = 0.25
"""The same of a swell, with longer than that between two crests: one is more like the other, and hills passed over may look like it."""
_HALF_WAVE: Final = 12.0 / (math.pi * math.pi)
"""Rate of the line through half a wave, times its length by its height: the steepest there is."""
_FACE: Final = 1.3 * math.pi
"""Rate of a line much shorter than the wave, times its period by its height: the steepest of its face; some are shorter than most."""
_WHOLE_WAVES: Final = 3.0 / math.pi
"""The same of a line longer than the wave, times its length by the wave's once more."""


@value
class _Rise:
    """From a trough to a crest."""

    crest_us: int
    low_m: float
    height_m: float


class Sea:
    """Follows the altitude from trough to crest. ``add`` what passed the gate."""

    def __init__(self) -> None:
        self._recent: deque[Altitude] = deque()
        self._rises: deque[_Rise] = deque()
        self.forget()

    def forget(self) -> None:
        """Start again: what was read before is of another bottom."""
        self._recent.clear()
        self._rises.clear()
        self._low_m, self._high_m, self._high_us = math.inf, -math.inf, 0
        self._is_rising = False
        self.is_seen = False
        """Whether there are waves at all."""
        self._height_m = self._period_s = self._floor_m = 0.0
        """The highest of the last waves, their period, and the least altitude that the next may bring."""
        self._is_within, self._kept_us = False, _KEPT_WAVES * _PERIOD_US

    def add(self, reading: Altitude, sigma_m: float) -> None:
        """Take one gated reading; ``sigma_m``: its noise."""
        recent, rises = self._recent, self._rises
        recent.append(reading)
        while reading.t_us - recent[0].t_us >= _MEAN_US:
            recent.popleft()
        level_m = math.fsum(each.value_m for each in recent) / len(recent)
        rise = self._risen(reading.t_us, level_m, min(_STEP_SIGMAS / math.sqrt(len(recent)), _STEP_MOST) * sigma_m)
        is_old = bool(rises) and reading.t_us - rises[0].crest_us > self._kept_us
        if is_old:
            rises.popleft()
        if rise is not None:
            rises.append(rise)
        if is_old or rise is not None:
            self._judge()
        self._is_within = self.is_seen and level_m >= self._floor_m

    def rate_mps(self, window_s: float) -> float:
        """The greatest rate that the waves alone give to a line through so many seconds."""
        if not self._is_within:
            return 0.0
        waves = window_s / self._period_s
        return self._height_m / window_s * min(_FACE * waves, _HALF_WAVE, _WHOLE_WAVES / waves)

    def _risen(self, t_us: int, level_m: float, step_m: float) -> _Rise | None:
        """Follow the altitude; return a rise once the altitude has come down from its crest."""
        if not self._is_rising:
            self._low_m = min(self._low_m, level_m)
            if level_m > self._low_m + step_m:
                self._is_rising, self._high_m, self._high_us = True, level_m, t_us
            return None
        if level_m > self._high_m:
            self._high_m, self._high_us = level_m, t_us
        if level_m >= self._high_m - step_m:
            return None
        rise = _Rise(self._high_us, self._low_m, self._high_m - self._low_m)
        self._is_rising, self._low_m = False, level_m
        return rise if rise.height_m <= _HIGHEST_M else None

    def _judge(self) -> None:
        """Whether the last rises are waves, and what they bound."""
        rises = self._rises
        if len(rises) < _FEWEST:
            self.is_seen = False
            return
        crests_us = [rise.crest_us for rise in rises]
        periods_us = sorted(map(sub, crests_us[1:], crests_us))
        period_us = periods_us[len(periods_us) // 2]
        self.is_seen, self._period_s = period_us <= _PERIOD_US, period_us * 1e-6
        self._kept_us = max(_KEPT_US, _KEPT_WAVES * min(period_us, _PERIOD_US))
        self._height_m = max(rise.height_m for rise in rises)
        deeper = _DEEPER if period_us <= _SWELL_US else _SWELL_DEEPER
        self._floor_m = min(rise.low_m for rise in rises) - deeper * self._height_m
