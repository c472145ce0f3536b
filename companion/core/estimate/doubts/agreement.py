"""Whether a receiver's places go where its own speed leads.

One that repeats one place, or stays about it, while its speed leads away is none. A place that creeps away, or a speed in the wrong unit,
is seen in a minute: one of the two is wrong then, and which is not known. So it is only told.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from mavlink_bridge.language.messages import GpsFix

from ..antenna import Pair
from ..config import POSITION_SIGMA_M
from .receiver_way import ReceiverWay
from .witness import SeenFix

_LOOK_US: Final = 5_000_000
"""Nothing that is looked for is faster, and what is told must have looked so twice."""
_WINDOW_US: Final = 90_000_000
"""Longer than a plain receiver's places wander to and fro, shorter than the noise of a speed needs to add up."""
_APART_M: Final = 15.0
"""Places without corrections wander by 6 m within a minute and a half, and step by as much beside a wall."""
_APART_SHARE: Final = 0.2
"""Of the way that the speed leads: what a slow receiver misses of the turns is less."""
_TWICE: Final = 2
"""One look may fall into a step beside a wall."""

_SLACK_M: Final = 1.0
_SIGMAS: Final = 3.0
"""A place has moved when it lies farther off than this metre and so many spreads of its kind of fix."""
_STAYS: Final = 0.2
"""And than this share of the way by the receiver's own speed: one whose speed is told in knots moves by half of it."""
_FAR: Final = 5.0
"""Slacks of that way after which a place that has not moved is stuck. A sound one has moved after one and a quarter."""
_LEADS_MPS: Final = 0.4
"""What a receiver at rest tells as speed, always in one direction, is less."""

_LIVELY_US: Final = 30_000_000
"""A receiver that pins its place at rest does so within seconds: one that has told ever new places at rest for so long does not."""
_PINNED_US: Final = 3_000_000
"""A place that stood for so long was pinned, or hung: three periods of the slowest receiver."""


_Seen = tuple[int, complex, complex]


class PlaceAgainstSpeed:
    """One receiver; call once for each fix that is believed."""

    def __init__(self) -> None:
        self.is_apart = False
        """Whether both disagree."""
        self._way = ReceiverWay()
        self._begin()

    def _begin(self) -> None:
        self._past: deque[_Seen] = deque()
        self._led = 0j
        self._looks = 0

    def step(self, told: SeenFix) -> str:
        """Take a fix; return what to say, empty for nothing."""
        way = self._way.since(told.t_us, told.mps)
        if way is None:
            self._begin()
        else:
            self._led += way
        if told.mps is None:
            return ""
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


class FrozenWatch:
    """A receiver that repeats one position or one UTC while the vessel moves, or stays about one place that its own speed leads from."""

    def __init__(self) -> None:
        self._last: tuple[float | None, float | None] | None = None
        self._since_us = self._changed_us = 0
        self._last_utc_us: int | None = None
        self._led = False
        """Whether its own speed has led from the place that it repeats."""
        self._lively_us = 0
        """For how long it has told ever new places at rest."""
        self._stuck = _Stuck()
        self.text = ""
        """What to say of it."""
        self.back = ""
        """What to say when it is not so any more."""

    def same_for_s(self, fix: GpsFix, at: Pair, velocity: Pair | None, *, moving: bool, told: bool) -> float:
        """Seconds that the position has been the same; of a vessel at rest it counts only if it was ``told`` of before.

        And then only of one that has told a speed, or told ever new places at rest: on her ropes a vessel does not move, whatever her
        thrusters should make of it. ``at``: where the fix is, m; ``velocity``: what it tells of it, m/s.
        """
        here = (fix.lat_rad, fix.lon_rad)
        repeated_utc = fix.utc_us is not None and fix.utc_us == self._last_utc_us
        self._last_utc_us = fix.utc_us
        is_new = here != self._last
        if is_new:
            self._note_new(fix.t_us, moving=moving)
        goes_on = told and (self._led or self._lively_us >= _LIVELY_US)
        if is_new or not (moving or repeated_utc or goes_on):
            self._last, self._led = here, False
            self._since_us = fix.t_us
        self._led = self._led or (velocity is not None and math.hypot(*velocity) > _LEADS_MPS)
        same_s = (fix.t_us - self._since_us) * 1e-6
        slack_m = _SLACK_M + _SIGMAS * POSITION_SIGMA_M[fix.fix_type]
        stuck_s = self._stuck.step(fix.t_us, at, velocity, slack_m=slack_m, told=told)
        if told and same_s > stuck_s:  # with the last digit that changes it is over
            self._stuck.forget()
        self.text = f"Receiver {'repeats' if same_s >= stuck_s else 'stays about'} one position while moving"
        self.back = "Receiver's position moves again" if is_new else "Receiver repeats one position at rest: believed"
        return max(same_s, stuck_s)

    def _note_new(self, t_us: int, *, moving: bool) -> None:
        """Take that the place is another than the one before."""
        since_us, self._changed_us = t_us - self._changed_us, t_us
        if since_us > _PINNED_US:
            self._lively_us = 0
        elif not moving:
            self._lively_us += since_us


class _Stuck:
    """Where a place was at first, and how far the speed has led from there."""

    def __init__(self) -> None:
        self._own_way = ReceiverWay()
        self._first: complex | None = None
        self._first_us = 0
        self._far_us: int | None = None
        self._led = 0j

    def forget(self) -> None:
        """Begin anew with the next fix."""
        self._first = self._far_us = None

    def step(self, t_us: int, at: Pair, velocity: Pair | None, *, slack_m: float, told: bool) -> float:
        """Return for how long the speed has led so far away that the place should have moved, s."""
        way = self._own_way.since(t_us, velocity)
        if way is None or self._first is None:
            return self._begin(t_us, at)
        self._led += way
        led_m, moved_m = abs(self._led), abs(complex(*at) - self._first)
        if not (told and self._far_us is not None and moved_m < 2.0 * slack_m):
            if led_m < _LEADS_MPS * (t_us - self._first_us) * 1e-6 or moved_m > slack_m + _STAYS * led_m:
                return self._begin(t_us, at)
            if led_m > _FAR * slack_m and self._far_us is None:
                self._far_us = t_us
        return 0.0 if self._far_us is None else (t_us - self._far_us) * 1e-6

    def _begin(self, t_us: int, at: Pair) -> float:
        self._first, self._first_us, self._far_us, self._led = complex(*at), t_us, None, 0j
        return 0.0
