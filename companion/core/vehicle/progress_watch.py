"""Says when a plan makes no progress, for whatever cause, and when the boat is far off its track: nobody else looks at the whole.

DUNE told a course error of 15 m that lasted 10 s. A boat held by weed, by a current as fast as itself or by a rope still steers,
keeps its links and its position; only the distance to go tells.
"""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import EstimatedState, PathControlState, Severity

STALLED_US: Final = 20_000_000
"""Longer than any turn, stop or gust takes; short enough to help before a drift matters."""
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


class ProgressWatch:
    """Feed it each tick of a plan under way; ``rest`` at any other."""

    def __init__(self) -> None:
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
        self, now_us: int, number: int, path: PathControlState, state: EstimatedState
    ) -> list[tuple[Severity, str]]:
        """Return what is to be told. ``number``: the item under way, from 0."""
        if path.on_path and path.orbit_radius_m is None and path.eight is None:
            self.rest()
            return []
        if (number, path.on_path) != self._item:
            self.rest()
            self._item, self._since_us = (number, path.on_path), now_us
        texts = self._track(now_us, path)
        if self._gains(path, state):
            self._since_us = now_us
        elif now_us - self._since_us >= STALLED_US:
            self._since_us = now_us + AGAIN_US - STALLED_US
            left = "" if path.distance_m is None else f", {path.distance_m:.0f} m to go"
            texts.append((Severity.WARNING, f"no progress for 20 s at item {number}{left}"))
        return texts

    def _gains(self, path: PathControlState, state: EstimatedState) -> bool:
        """Whether the boat has come nearer, or on a closed figure has moved on at all."""
        if path.on_path:
            return self._moves(state)
        distance_m, best_m = path.distance_m, self._best_m
        if distance_m is not None and (best_m is None or distance_m < best_m - STEP_M):
            self._best_m = distance_m
            return True
        return False

    def _moves(self, state: EstimatedState) -> bool:
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
