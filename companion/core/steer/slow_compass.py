"""What a compass that speaks seldom costs the heading loop: the age that the law reckons with beside the sensor's own."""

from __future__ import annotations

from collections import deque
from typing import Final

_WATCH_US: Final = 2_000_000
_WATCHES: Final = 3
"""The longest wait for news in each of three times 2 s, the shortest of the three: a gap or two is no rhythm."""
_SILENT_S: Final = 2.5
"""A compass that is waited for longer than this is silent, not slow: it is not believed then, and nothing is steered by it."""
_BORNE_S: Final = 0.5
"""A heading each half second, its differences as turn rate, is within the delay that all gains bear."""
DIFFERENCED_S: Final = 0.25
"""Age where no sensor tells the turn rate: the filter that makes one of headings is so late, and passes their noise on to the thrusters.
Without it a launch, and a boat whose thrusters differ, swung from side to side until their thrust was cut."""
_COSTS: Final = 1.5
"""Age for each second beyond it: a heading that is kept is half of its period old, a turn rate from two of them all of it."""
_STEP_S: Final = 0.25
"""In steps: gains that change for a hundredth would be worked out for nothing."""
_MOST_S: Final = 0.75
"""A compass that is heard less than once a second is not steered by the better for gains that are still lower."""


class SlowCompass:
    """Watches how often there is news of the heading. While it is steered by, gains only become gentler: a compass that takes over
    under way, or an arming soon after the start, must not wait for them, and each change takes a slow computer a second.
    """

    def __init__(self) -> None:
        self.late_s = 0.0
        """What it costs, s."""
        self.wait_s = 0.0
        """How long one mostly waits for news."""
        self._waits: deque[float] = deque(maxlen=_WATCHES)
        self.pause()

    def pause(self) -> None:
        """Begin anew when it is watched again; what is known stands."""
        self._longest_s = 0.0
        self._until_us: int | None = None
        self._waits.clear()

    def step(self, now_us: int, waited_s: float | None, *, is_steered: bool) -> bool:
        """Take, once a tick, for how long there has been no news of the heading; True when ``late_s`` has changed."""
        if waited_s is None or waited_s > _SILENT_S:
            self.pause()
            return False
        if self._until_us is None:
            self._until_us = now_us + _WATCH_US
        self._longest_s = max(self._longest_s, waited_s)
        if now_us < self._until_us:
            return False
        self._waits.append(self._longest_s)
        self._longest_s, self._until_us = 0.0, now_us + _WATCH_US
        if len(self._waits) < _WATCHES:
            return False
        wait_s = min(self._waits)
        late_s = _STEP_S * round(_COSTS * max(0.0, wait_s - _BORNE_S) / _STEP_S)
        # a turn rate that falls silent under way costs no pause for new gains
        is_reckoned = late_s > 0.0 or not is_steered
        if wait_s > 0.0 and is_reckoned:
            late_s = min(late_s + DIFFERENCED_S, _MOST_S)
        if late_s == self.late_s or (is_steered and late_s < self.late_s):
            return False
        self.wait_s, self.late_s = wait_s, late_s
        return True
