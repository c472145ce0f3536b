"""Whether a sudden jump to much deeper water is believed: a second echo of a shoaling bottom looks the same for a while.

Doubted is a jump over a bottom that was closing, or where chart or memory know what was read before. The bottom's path is reckoned on by
its slope. What comes back near it ends the doubt; a second echo goes on closing at twice the slope or more, and stays doubted for as long
as it does. A true edge does not: the deep water is believed once that has shown itself over a bounded way, wherever the boat turns, and
at the latest after minutes in which nothing closed.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from mavlink_bridge.language.messages import EstimatedState

_WAY_M: Final = 10.0
"""Of deep water that does not close, before it is believed: a few boat's lengths."""
_ECHO_WAY_M: Final = 25.0
"""The same where the jump was to just about twice or thrice the depth: a second echo of a bottom that levels out looks like this."""
_WINDOW: Final = 1.5
"""Times that way are looked back: a slow sounder reads every three metres."""
_ECHO_OFF: Final = 0.15
"""Share by which a second echo may miss the multiple: the transducer's own depth in it, and noise."""
_ALONG_M: Final = 4.0
"""Along the course at the jump: over less the noise of the readings looks like a slope, and an echo cannot be told by it."""
_LONGEST_US: Final = 300_000_000
"""Of a doubt in which no echo was seen to close: a boat that lies there, or turns in circles, would never make the way."""
_STEP_M: Final = 0.3
"""A reading is kept for so much way: 37 m of it, the longest that is looked back, are 125 readings, at any speed."""
_KEPT: Final = 128
_FOLLOWS: Final = 0.5
"""Of the slope that an echo would have: a bottom that closes by less is not that echo."""
_LEAST_SHARE: Final = 0.25
"""Of the depth at the jump: less is not reckoned on, since no slope is known to go on for ever."""
_LEAST_M: Final = 1.0
"""Nor less than this: any echo is much deeper than nothing."""
_NEAR: Final = 1.6
"""Times what is reckoned here a reading may be at most to be the bottom again; less where an echo of it lies nearer: half way to that."""
_CONSISTENT: Final = 3
"""Readings near the reckoned path that end a doubt: one may be an echo of an echo."""
_AFTER_US: Final = 15_000_000
"""A slope that was sailed up when a jump was doubted is still known so long after the doubt."""
_PAUSE_S: Final = 5.0
"""A gap between two readings counts as no more way than this: the longest after which the one before still counts."""


class DeepJump:
    """One doubted jump, from ``begins`` until ``takes`` ends it. Distances are below the transducer, m."""

    def __init__(self) -> None:
        self.is_doubted = self.is_proven = False
        """Not both: what was doubted and is proven is believed."""
        self._from_m = self._slope = self._times = 0.0
        self._dir = (0.0, 0.0)
        self._along_m = self._across_m = 0.0
        """How far the vessel is along the course that it had at the jump, and to starboard of it, from there."""
        self._last_us = self._quiet_us = 0
        self._near = 0
        """Readings in a row that were not deep."""
        self._ended_us: int | None = None
        self._deep: deque[tuple[float, float, float]] = deque(maxlen=_KEPT)
        """Way along the course and across it, and distance, of the doubted readings."""

    def begin(self, since_us: int, was_m: float, now_m: float, slope: float) -> None:
        """Doubt a jump from ``was_m``, read at ``since_us``, to ``now_m``; ``slope``: by how much the bottom was rising for each metre."""
        self.is_doubted, self.is_proven = True, False
        self._from_m, self._slope, self._times = was_m, slope, now_m / was_m
        self._dir, self._along_m, self._across_m, self._near = (0.0, 0.0), 0.0, 0.0, 0
        self._last_us = self._quiet_us = since_us
        self._deep.clear()

    def end(self) -> None:
        """What is read now is believed."""
        if self.is_doubted:
            self.is_doubted, self._ended_us = False, self._last_us

    def slope_before(self, t_us: int) -> float:
        """The slope that was known when a doubt ended that is over by now, shortly ago; else 0."""
        ended_us = self._ended_us
        return self._slope if ended_us is not None and t_us - ended_us <= _AFTER_US else 0.0

    def refuses(self, t_us: int, now_m: float, state: EstimatedState | None) -> bool:
        """Take a reading while a jump is doubted; return whether it is part of it and not to be believed yet."""
        since_s, self._last_us = (t_us - self._last_us) * 1e-6, t_us
        if self._dir == (0.0, 0.0):
            self._dir = _course(state)
        along_mps, across_mps = self._speeds_mps(state)
        self._along_m += along_mps * min(max(since_s, 0.0), _PAUSE_S)
        self._across_m += across_mps * min(max(since_s, 0.0), _PAUSE_S)
        if now_m <= self.reckoned_m * min(math.sqrt(self._times), _NEAR):
            self._near += 1
            return self._near < _CONSISTENT
        self._near = 0
        if not self._deep or self._away_m(self._deep[-1]) >= _STEP_M:
            self._deep.append((self._along_m, self._across_m, now_m))
        self.is_proven = self._proves()
        self.is_doubted = not self.is_proven
        if self.is_proven:
            self._ended_us = None
        return self.is_doubted

    @property
    def reckoned_m(self) -> float:
        """What is reckoned to be below the transducer here, if the bottom goes on as it did."""
        return max(self._from_m - self._slope * self._along_m, _LEAST_SHARE * self._from_m, _LEAST_M)

    def _speeds_mps(self, state: EstimatedState | None) -> tuple[float, float]:
        """Along the course at the jump, and to starboard of it."""
        if state is None:
            return 0.0, 0.0
        (north, east), vx_mps, vy_mps = self._dir, state.vx_mps, state.vy_mps
        if (north, east) == (0.0, 0.0) or vx_mps is None or vy_mps is None:
            return state.sog_mps or 0.0, 0.0
        return vx_mps * north + vy_mps * east, vy_mps * north - vx_mps * east

    def _away_m(self, place: tuple[float, float, float]) -> float:
        return math.hypot(self._along_m - place[0], self._across_m - place[1])

    def _proves(self) -> bool:
        """Whether the deep readings have been sailed over far enough, or heard long enough, and do not close as an echo would."""
        times, nearest = self._times, max(round(self._times), 2)
        is_multiple = nearest <= 3 and abs(times - nearest) <= _ECHO_OFF * nearest
        way_m = _ECHO_WAY_M if is_multiple else _WAY_M
        near = [place for place in self._deep if self._away_m(place) <= _WINDOW * way_m]
        if self._closes([(along_m, deep_m) for along_m, _, deep_m in near]):
            self._quiet_us = self._last_us
            return False
        return self._last_us - self._quiet_us >= _LONGEST_US or max(map(self._away_m, near), default=0.0) >= way_m

    def _closes(self, near: list[tuple[float, float]]) -> bool:
        """Whether readings rise along the course at the jump as an echo of the slope would. Off that course nobody knows the slope."""
        ways = [along_m for along_m, _ in near]
        if not near or self._slope == 0.0 or max(ways) - min(ways) < _ALONG_M:
            return False
        return _rise(near) >= _FOLLOWS * self._times * self._slope


def _course(state: EstimatedState | None) -> tuple[float, float]:
    """North and east of the course over ground; nothing where nobody knows it."""
    if state is None or state.vx_mps is None or state.vy_mps is None:
        return 0.0, 0.0
    speed_mps = math.hypot(state.vx_mps, state.vy_mps)
    return (state.vx_mps / speed_mps, state.vy_mps / speed_mps) if speed_mps > 0.0 else (0.0, 0.0)


def _rise(places: list[tuple[float, float]]) -> float:
    """By how much the bottom rises for each metre along: the least-squares line."""
    count = len(places)
    mean_m, deep_m = math.fsum(x for x, _ in places) / count, math.fsum(y for _, y in places) / count
    spread = math.fsum((x - mean_m) * (x - mean_m) for x, _ in places)
    return -math.fsum((x - mean_m) * (y - deep_m) for x, y in places) / spread if spread > 0.0 else 0.0
