"""What a compass that speaks seldom costs the heading loop: the age that the law reckons with beside the sensor's own."""

from __future__ import annotations

from collections import deque
from typing import Final

_WATCH_US: Final = 5_000_000
_WATCHES: Final = 3
"""The longest wait for news in each of three times 5 s, the shortest of the three: a gap or two is no rhythm."""
_BORNE_S: Final = 0.5
"""A heading each half second, its differences as turn rate, is within the delay that all gains bear."""
_COSTS: Final = 1.5
"""Age for each second beyond it: a heading that is kept is half of its period old, a turn rate from two of them all of it."""
_FINE_S: Final = 0.2
"""A rhythm that changes by less is the same: gains that change for nothing would be told of."""


class SlowCompass:
    """Watches how often there is news of the heading."""

    def __init__(self) -> None:
        self.late_s = 0.0
        """What it costs, s."""
        self.wait_s = 0.0
        """How long one mostly waits for news."""
        self._longest_s = 0.0
        self._waits: deque[float] = deque(maxlen=_WATCHES)
        self._until_us: int | None = None

    def step(self, now_us: int, waited_s: float | None) -> bool:
        """Take, once a tick, for how long there has been no news of the heading, None while it is lost; True when ``late_s`` has changed.

        A compass that is lost has no rhythm, and keeps the one that it had.
        """
        if waited_s is None:
            self._longest_s, self._until_us = 0.0, None
            return False
        if self._until_us is None:
            self._until_us = now_us + _WATCH_US
        self._longest_s = max(self._longest_s, waited_s)
        if now_us < self._until_us:
            return False
        self._waits.append(self._longest_s)
        self._longest_s, self._until_us = 0.0, now_us + _WATCH_US
        self.wait_s = min(self._waits)
        late_s = max(0.0, _COSTS * (self.wait_s - _BORNE_S))
        if abs(late_s - self.late_s) < _FINE_S:
            return False
        self.late_s = late_s
        return True
