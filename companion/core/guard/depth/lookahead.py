"""Looking ahead of the keel: how fast the bottom closes, and what a map says along the way to come.

The closing rate is a straight line fitted to the gated readings of the last seconds; only what stands clear of the
sounder's own noise counts, so that a flat bottom never slows anybody. The map is sampled along the predicted way: the
present arc for a second, then the active leg (vessel-control §5.4).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Final

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast

from .input import Altitude
from .sea import Sea

StoppingDistance = Callable[[float], float]
"""Speed in m/s to the way in m that the vessel still makes once thrust is cut (or astern)."""
PathAhead = Callable[[float], Sequence[NorthEast]]
"""How far to look, m, to points (north, east) along the path that is being sailed, from abeam of the vessel on."""
DepthAt = Callable[[float, float], float | None]
"""(north, east) in the run's plane, m, to the depth or altitude there; None = unknown."""

_WINDOWS: Final = ((1.0, 5.0), (2.0, 4.0), (4.0, 3.5))
"""Length in s, and how many sigma a rate must stand clear of the noise: the short one sees a wall, the long one a slope."""
LONG_WINDOWS: Final = ((8.0, 4.0), (16.0, 4.0))
"""The same for a slope that is only to be known: a sounder of 1 Hz proves one of 1:50 no sooner."""
_LEAST_READINGS: Final = 4
"""A line through fewer is drawn by one false reading."""
_SPARSE_US: Final = 16_000_000
"""A slow sounder's last readings are taken for one line over so long: a reading each 5 s, or each 2 s with half of them lost."""
_SPARSE_SIGMAS: Final = 4.0
"""What such a line must stand clear of the noise by: as the others of its length."""
_ONE_GAP: Final = 0.7
"""A line of which one silence is a greater share than this is a line between two places. Two lost readings of four leave 0.6."""
_CARRIED_US: Final = 6_000_000
"""So long a proven rate stands where the readings are too few to prove one: three periods of a sounder of 0.5 Hz."""
_TRIM: Final = 100
"""Readings that are past the longest window are forgotten so many at a time."""
_ARC_S: Final = 1.0
"""A turn is taken to go on for so long; then the boat is taken to sail straight."""
_STEERED_MPS: Final = 0.5
"""Slower, the course over ground says nothing of where the boat is steered."""
_JOIN_M, _JOIN_S = 3.0, 1.5
_ASTRAY_RAD: Final = 0.6
"""More than a vessel's course differs from the chord of the tightest path that it can sail."""


class ClosingRate:
    """How fast the altitude falls, m/s, as far as the readings prove it."""

    def __init__(self, windows: Sequence[tuple[float, float]] = _WINDOWS) -> None:
        self._lines = [_Line(round(seconds * 1e6), sigmas) for seconds, sigmas in windows]
        self._entries: list[tuple[int, int, int, int, int]] = []
        """Time of each reading, and the sums over all before it: times, values, squared times, times by values.

        In whole microseconds since the first and micrometres, so that adding for days leaves no rounding behind.
        """
        self._sums = (0, 0, 0, 0)
        self._t0_us = self._proven_us = 0
        self._closing_mps = 0.0
        self.likely_mps = 0.0
        """As fast as this, one sigma on the shallow side; 0 unless it is proven that the bottom closes."""

    @property
    def closing_mps(self) -> float:
        """At least this fast; 0 when the bottom is level, falls away, or nothing is proven."""
        return self._closing_mps

    def forget(self) -> None:
        """Start again: after a gap or a confirmed jump the line would bridge what was never measured."""
        for line in self._lines:
            line.first = 0
        self._entries.clear()
        self._sums = (0, 0, 0, 0)
        self._closing_mps = self.likely_mps = 0.0

    def add(self, reading: Altitude, sigma_m: float, sea: Sea | None = None) -> None:
        """Take one gated reading; ``sigma_m``: its noise; ``sea``: the waves, whose heave proves nothing. None: there are none."""
        entries = self._entries
        if not entries:
            self._t0_us = reading.t_us
        t_us, value_um = reading.t_us - self._t0_us, round(reading.value_m * 1e6)
        t, a, tt, ta = self._sums
        entries.append((t_us, t, a, tt, ta))
        self._sums = t, a, tt, ta = t + t_us, a + value_um, tt + t_us * t_us, ta + t_us * value_um
        closing_mps = likely_mps = 0.0
        for line in self._lines:
            first, since_us = line.first, t_us - line.window_us
            while entries[first][0] < since_us:
                first += 1
            line.first = first
            count = len(entries) - first
            if count < _LEAST_READINGS:
                continue
            # The least-squares line through the readings of this window, from what the sums have grown by in it.
            _, t_before, a_before, tt_before, ta_before = entries[first]
            times = t - t_before
            rise = count * (ta - ta_before) - times * (a - a_before)
            spread = count * (tt - tt_before) - times * times
            if rise >= 0 or spread <= 0:
                continue
            fall_mps = -(rise / spread)
            doubt_mps = sigma_m / math.sqrt(spread / count * 1e-12)
            heave_mps = 0.0 if sea is None else sea.rate_mps(line.window_us * 1e-6)
            proven_mps = fall_mps - line.sigmas * doubt_mps - heave_mps
            if proven_mps > closing_mps:
                closing_mps, likely_mps = proven_mps, fall_mps + doubt_mps
        if count < _LEAST_READINGS:
            closing_mps, likely_mps = self._of_few(t_us, sigma_m, sea)
        elif closing_mps > 0.0:
            self._proven_us = t_us
        self._closing_mps, self.likely_mps = closing_mps, likely_mps
        if first >= _TRIM:
            self._trim(min(first, len(entries) - _LEAST_READINGS))

    def _of_few(self, t_us: int, sigma_m: float, sea: Sea | None) -> tuple[float, float]:
        """The rate that is proven, and the likely one, where even the longest window holds too few readings for its line.

        By the middle of the slopes between each two of the last readings, the flatter of two: one false echo among them,
        which passes a slow sounder's gate, does not draw it.
        """
        newest = self._newest()
        span_us = newest[-1][0] - newest[0][0]
        gap_us = max((after[0] - before[0] for before, after in pairwise(newest)), default=0)
        if len(newest) < _LEAST_READINGS or span_us > _SPARSE_US or gap_us > _ONE_GAP * span_us:
            is_carried = self._closing_mps > 0.0 and t_us - self._proven_us <= _CARRIED_US
            return (self._closing_mps, self.likely_mps) if is_carried else (0.0, 0.0)
        falls_mps = sorted((a[1] - b[1]) / (b[0] - a[0]) for a, b in combinations(newest, 2) if b[0] > a[0])
        fall_mps = falls_mps[(len(falls_mps) - 1) // 2]
        middle_us = math.fsum(each[0] for each in newest) / len(newest)
        doubt_mps = sigma_m / math.hypot(*((each[0] - middle_us) * 1e-6 for each in newest))
        heave_mps = 0.0 if sea is None else sea.rate_mps(span_us * 1e-6)
        proven_mps = fall_mps - _SPARSE_SIGMAS * doubt_mps - heave_mps
        if proven_mps <= 0.0:
            return 0.0, 0.0
        self._proven_us = t_us
        return proven_mps, fall_mps + doubt_mps

    def _newest(self) -> list[tuple[int, int]]:
        """Times in us and values in um of the newest readings, as many as a line takes."""
        sums = [*(entry[2] for entry in self._entries[-_LEAST_READINGS:]), self._sums[1]]
        times_us = [entry[0] for entry in self._entries[-_LEAST_READINGS:]]
        return [(time_us, after - before) for time_us, (before, after) in zip(times_us, pairwise(sums), strict=True)]

    def _trim(self, past: int) -> None:
        """Forget readings that are past the longest window, the last one."""
        del self._entries[:past]
        for line in self._lines:
            line.first -= past


class _Line:
    """One of the windows: how long, how sure, and where it begins now."""

    __slots__ = ("first", "sigmas", "window_us")

    def __init__(self, window_us: int, sigmas: float) -> None:
        self.window_us = window_us
        self.sigmas = sigmas
        self.first = 0
        """Index of the oldest reading in the window."""


def slow_speed_mps(
    room_m: float, gradient: float, stopping_distance_fn: Callable[[float], float], reaction_s: float, top_mps: float
) -> float | None:
    """Greatest speed that stops within ``room_m`` of altitude on this gradient (rise per metre sailed); None = any.

    By bisection, since the stopping distance is only given as a function.
    """

    def needed_m(speed_mps: float) -> float:
        return gradient * (stopping_distance_fn(speed_mps) + reaction_s * speed_mps)

    if needed_m(top_mps) <= room_m:
        return None
    low, high = 0.0, top_mps
    for _ in range(12):
        middle = 0.5 * (low + high)
        if needed_m(middle) <= room_m:
            low = middle
        else:
            high = middle
    return low


def way_ahead(
    state: EstimatedState, path_ahead: Sequence[NorthEast] | None, reach_m: float, step_m: float
) -> list[NorthEast]:
    """Points along the predicted way, every ``step_m`` out to ``reach_m``: the present arc, then the path beyond it.

    Without a path: straight on along the course after the arc. Empty without a position.
    """
    if state.x_m is None or state.y_m is None:
        return []
    here = NorthEast((state.x_m, state.y_m))
    arc, course_rad = _arc(state, here, min(reach_m, _ARC_S * (state.sog_mps or 0.0)), step_m)
    points = [here, *arc]
    left_m = reach_m - step_m * len(arc)
    for target in _beyond(path_ahead or (), step_m * len(arc)):
        if left_m <= 0.0:
            break
        left_m = _march(points, target, left_m, step_m)
    if not path_ahead and course_rad is not None:
        north, east = points[-1]
        far = NorthEast((north + left_m * math.cos(course_rad), east + left_m * math.sin(course_rad)))
        _march(points, far, left_m, step_m)
    return points


def strays(state: EstimatedState, path_ahead: Sequence[NorthEast]) -> bool:
    """Whether a vessel under way is not about to sail the path: its mean course of the coming second leads elsewhere."""
    speed_mps, course_rad = state.sog_mps or 0.0, state.cog_rad
    if speed_mps < _STEERED_MPS or course_rad is None or state.x_m is None or state.y_m is None:
        return False
    near_m = max(_JOIN_M, _JOIN_S * speed_mps)
    for north, east in path_ahead:
        north, east = north - state.x_m, east - state.y_m
        if math.hypot(north, east) >= near_m:
            mean_rad = course_rad + 0.5 * _ARC_S * (state.r_radps or 0.0)
            return abs(math.remainder(math.atan2(east, north) - mean_rad, 2.0 * math.pi)) > _ASTRAY_RAD
    return False


def _arc(
    state: EstimatedState, start: NorthEast, length_m: float, step_m: float
) -> tuple[list[NorthEast], float | None]:
    """Points of the present turn and the course at its end."""
    course_rad = state.cog_rad if state.cog_rad is not None and (state.sog_mps or 0.0) > 0.2 else state.psi_rad
    if course_rad is None or not state.sog_mps:
        return [], course_rad
    turn_per_m = (state.r_radps or 0.0) / state.sog_mps
    north, east = start
    points = []
    for _ in range(math.floor(length_m / step_m)):
        course_rad += 0.5 * turn_per_m * step_m
        north, east = north + step_m * math.cos(course_rad), east + step_m * math.sin(course_rad)
        course_rad += 0.5 * turn_per_m * step_m
        points.append(NorthEast((north, east)))
    return points, course_rad


def _beyond(path: Sequence[NorthEast], skip_m: float) -> list[NorthEast]:
    """A path without its first ``skip_m``, which the vessel has behind it when the arc ends; at least its last point."""
    for i in range(1, len(path)):
        (north, east), end = path[i - 1], path[i]
        length_m = math.dist(path[i - 1], end)
        if length_m > skip_m:
            share = skip_m / length_m
            begin = NorthEast((north + share * (end[0] - north), east + share * (end[1] - east)))
            return [begin, *path[i:]]
        skip_m -= length_m
    return list(path[-1:])


def _march(points: list[NorthEast], target: NorthEast, left_m: float, step_m: float) -> float:
    """Append points toward ``target``, its own included when in reach; return the reach that is left, m."""
    north, east = points[-1]
    gap_m = math.hypot(target[0] - north, target[1] - east)
    reach_m = min(gap_m, left_m)
    for i in range(1, math.ceil(reach_m / step_m) + 1):
        share = min(i * step_m, reach_m) / gap_m
        points.append(NorthEast((north + share * (target[0] - north), east + share * (target[1] - east))))
    return left_m - gap_m


@dataclass(frozen=True, slots=True)
class Ahead:
    """What a map says of the way to come."""

    here_m: float | None
    """Altitude on the map where the vessel is."""
    least_m: float | None
    """Least altitude along the way; None = nothing known there."""
    where: NorthEast | None = None
    unknown: bool = False
    """Some of the way is outside the map."""


def sample(depth_at: DepthAt, points: Sequence[NorthEast], half_width_m: float) -> Ahead:
    """Least value along the points and ``half_width_m`` to either side of them."""
    least_m: float | None = None
    where: NorthEast | None = None
    unknown = False
    for i, point in enumerate(points):
        before = points[i - 1] if i else points[0]
        for at in _across(before, point, half_width_m):
            value_m = depth_at(*at)
            if value_m is None:
                unknown = True
            elif least_m is None or value_m < least_m:
                least_m, where = value_m, point
    here_m = depth_at(*points[0]) if points else None
    return Ahead(here_m, least_m, where, unknown)


def _across(before: NorthEast, point: NorthEast, half_width_m: float) -> tuple[NorthEast, ...]:
    north, east = point[0] - before[0], point[1] - before[1]
    length = math.hypot(north, east)
    if length == 0.0 or half_width_m == 0.0:
        return (point,)
    side_n, side_e = -east / length * half_width_m, north / length * half_width_m
    to_side = NorthEast((point[0] + side_n, point[1] + side_e))
    return (point, to_side, NorthEast((point[0] - side_n, point[1] - side_e)))
