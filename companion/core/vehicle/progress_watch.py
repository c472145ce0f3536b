"""Says when a plan makes no progress, for whatever cause, and when the boat is far off its track: nobody else looks at the whole.

DUNE told a course error of 15 m that lasted 10 s. A boat held by weed, by a current as fast as itself or by a rope still steers,
keeps its links and its position; only the distance to go tells.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import EstimatedState, PathControlState, Severity

from ..guide.output import GuidanceOutput
from ..hull import Handling

STALLED_US: Final = 20_000_000
"""Longer than a turn, stop or gust takes most boats; short enough to help before a drift matters."""
PATIENT_US: Final = 60_000_000
"""No boat is given longer, however slowly she turns; and so long has each whose bow comes round where she lies, about her point."""
AGAIN_US: Final = 60_000_000
"""The same trouble is told again so long after, while it lasts."""
STEP_M: Final = 1.0
"""Progress: nearer by so much. 0.05 m/s over 20 s, slower than any leg is meant to be sailed."""
OFF_TRACK_M: Final = 15.0
"""DUNE's course error."""
BACK_M: Final = 10.0
"""Two thirds of it: a boat that wavers about the border is told of once."""
OFF_TRACK_US: Final = 10_000_000
"""DUNE's time for it."""


def turning_us(handling: Handling) -> int:
    """How long a boat may come no nearer because she turns: once round. She may have to turn back, and is as far off again by then."""
    return round(2.0 * math.pi / handling.slow_turn_radps * 1e6)


class ProgressWatch:
    """Feed it each tick of a plan under way; ``rest`` at any other."""

    def __init__(self, turning_us: int = 0) -> None:
        """``turning_us``: what the boat's file says that a turn takes her."""
        self._stalled_us = min(max(STALLED_US, turning_us), PATIENT_US)
        self.rest()

    def rest(self) -> None:
        """No plan is being sailed, or nothing is to be gained: a station is kept, a time is waited for."""
        self._item: tuple[int, bool] | None = None
        self._best_m: float | None = None
        self._place: tuple[float, float] | None = None
        self._since_us = 0
        self._was_near = False
        self._off_us: int | None = None
        self._told_off = False

    def step(
        self, now_us: int, number: int, guided: GuidanceOutput, state: EstimatedState
    ) -> list[tuple[Severity, str]]:
        """Return what is to be told. ``number``: the item under way, from 0."""
        path = guided.path
        if guided.holds and (guided.arrived or guided.on_path):
            self.rest()
            return []
        if (number, guided.on_path) != self._item:
            self.rest()
            self._item, self._since_us = (number, guided.on_path), now_us
        texts = self._track(now_us, path)
        stalled_us = PATIENT_US if guided.holds else self._stalled_us
        if self._moves(state) if guided.on_path else self._comes_nearer(path.distance_m):
            self._since_us = now_us
        elif now_us - self._since_us >= stalled_us:
            self._since_us = now_us + AGAIN_US - stalled_us
            left = "" if path.distance_m is None else f", {path.distance_m:.0f} m to go"
            texts.append((Severity.WARNING, f"no progress for {stalled_us / 1e6:.0f} s at item {number}{left}"))
        return texts

    def _comes_nearer(self, distance_m: float | None) -> bool:
        best_m = self._best_m
        if distance_m is not None and (best_m is None or distance_m < best_m - STEP_M):
            self._best_m = distance_m
            return True
        return False

    def _moves(self, state: EstimatedState) -> bool:
        """Whether a boat on a closed figure has moved on at all."""
        if state.x_m is None or state.y_m is None:
            return False
        here, place = (state.x_m, state.y_m), self._place
        if place is not None and max(abs(here[0] - place[0]), abs(here[1] - place[1])) < STEP_M:
            return False
        self._place = here
        return True

    def _track(self, now_us: int, path: PathControlState) -> list[tuple[Severity, str]]:
        """Off the track for 10 s, after having been on it: the way to a track is not off it."""
        if path.cross_track_m is None:
            return []
        off_m = abs(path.cross_track_m)
        if off_m < BACK_M:
            self._was_near, self._off_us, self._told_off = True, None, False
        if off_m < OFF_TRACK_M or not self._was_near or self._told_off:
            return []
        self._off_us = now_us if self._off_us is None else self._off_us
        if now_us - self._off_us < OFF_TRACK_US:
            return []
        self._told_off = True
        return [(Severity.WARNING, f"off the track by {off_m:.0f} m")]
