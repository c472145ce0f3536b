"""The plan held against the fence: which items a started plan could not reach without leaving it.

A ground station sends the plan before the fence, so an upload is not refused for it; a start is. The check runs
a few legs a tick after either has changed, and is told once it has stood for a while. Items that switch the fence count:
what is sailed while it is off is not held against it. The distance to the fence changes by at most a metre a metre, so a
leg is walked in steps as long as the room there is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    EstimatedState,
    FenceEnable,
    Goto,
    Jump,
    Loiter,
    Maneuver,
    PlanSpecification,
    Severity,
)
from mavlink_bridge.language.points import NorthEast

from ..guard.depth.plan_legs import plan_legs
from ..guard.fence import Fence

LEGS_A_TICK: Final = 8
"""So that the largest plan costs no tick more than a small share of its period."""
SETTLE_US: Final = 3_000_000
"""So long a plan may wait for its fence (stations send one after the other) before anything is said."""
KEPT: Final = 64
"""More trespasses than anybody reads; the first ones decide."""
_STEP_M: Final = 0.5
"""Shortest step along a leg; a corner of the fence that is cut by less may be missed (it stops the vessel all the same)."""
_SLACK_M: Final = 0.01
"""Points on the edge itself count as inside."""


@dataclass(frozen=True, slots=True)
class Trespass:
    """An item that lies outside the fence by so many metres, or (0) whose way or figure leaves the fence."""

    seq: int
    outside_m: float

    @property
    def text(self) -> str:
        if self.outside_m > 0.0:
            return f"item {self.seq} is {max(self.outside_m, 0.1):.{0 if self.outside_m > 9.9 else 1}f} m outside the fence"
        return f"item {self.seq} leads out of the fence"


class PlanFence:
    """Keeps the check up to date. ``step`` each tick; ``renew`` and ``refusal`` when somebody wants to start."""

    def __init__(self, fence: Fence) -> None:
        self._fence = fence
        self._key: object = None
        self._scan: Iterator[Trespass | None] | None = None
        self._found: list[Trespass] = []
        self._plan = PlanSpecification()
        self._is_new = False
        self._tell_us: int | None = None
        self._told: Trespass | None = None

    def step(
        self, now_us: int, plan: PlanSpecification, state: EstimatedState, loiter_radius_m: float
    ) -> tuple[Severity, str] | None:
        """Go on with the check; return a text when something is to be said."""
        self.renew(plan, state, loiter_radius_m)
        if self._is_new:
            self._is_new, self._tell_us = False, now_us + SETTLE_US
        if self._scan is not None:
            self._go_on(LEGS_A_TICK)
        if self._scan is not None or self._tell_us is None or now_us < self._tell_us:
            return None
        self._tell_us = None
        found = self._found[0] if self._found else None
        if found is None or found == self._told:
            self._told = found
            return None
        self._told = found
        return Severity.WARNING, f"Plan: {found.text}; it will not be started"

    def renew(self, plan: PlanSpecification, state: EstimatedState, loiter_radius_m: float) -> None:
        """Begin anew when plan or fence are others than those looked at. A start may come in the tick in which its plan was loaded."""
        key = (plan, self._fence.version, self._fence.enabled, state.origin_lat_rad, state.origin_lon_rad)
        if key != self._key:
            self._begin(key, plan, state, loiter_radius_m)
            self._is_new = True

    def trespasses(self) -> tuple[Trespass, ...]:
        """Everything that is wrong with the plan, in its order. Finishes the check."""
        self._go_on(len(self._plan.maneuvers) * 2 + 1)
        return tuple(self._found)

    def refusal(self, state: EstimatedState, first: int, *, from_here: bool = True) -> str:
        """Return why the plan must not be started at item ``first``, or an empty string. Finishes the check.

        ``from_here``: look at the way that leads there too.
        """
        back = min((item.target_seq for item in self._plan.maneuvers if isinstance(item, Jump)), default=first)
        for found in self.trespasses():
            if found.seq >= min(first, back):
                return found.text
        return self._approach(state, first) if from_here else ""

    def _approach(self, state: EstimatedState, first: int) -> str:
        """Look at the way from where the vessel is; one that is outside already is on its way back in."""
        origin = _frame(state)
        if origin is None or state.x_m is None or state.y_m is None:
            return ""
        here = NorthEast((state.x_m, state.y_m))
        room_m = self._fence.distance_m(state, here)
        if room_m is None or room_m < 0.0:
            return ""
        for item in self._plan.maneuvers[first:]:
            if isinstance(item, FenceEnable) or not self._fence.enabled:
                return ""
            if isinstance(item, Goto | Loiter):
                way = (here, origin.to_local(item.lat_rad, item.lon_rad))
                # A loiter is joined on its figure: its centre may lie in an exclusion area.
                leaves = isinstance(item, Goto) and self._outside_m(state, way) is not None
                return f"the way from here to item {item.seq} leads out of the fence" if leaves else ""
        return ""

    def _begin(self, key: object, plan: PlanSpecification, state: EstimatedState, loiter_radius_m: float) -> None:
        self._key, self._plan, self._found = key, plan, []
        origin = _frame(state)
        switched = any(isinstance(item, FenceEnable) for item in plan.maneuvers)
        idle = origin is None or not plan.maneuvers or not (self._fence.enabled or switched)
        self._scan = None if origin is None or idle else self._look(plan.maneuvers, state, origin, loiter_radius_m)

    def _go_on(self, legs: int) -> None:
        for _ in range(legs):
            if self._scan is None:
                return
            try:
                found = next(self._scan)
            except StopIteration:
                self._scan = None
                return
            if found is not None and len(self._found) < KEPT:
                self._found.append(found)

    def _look(
        self, maneuvers: Sequence[Maneuver], state: EstimatedState, origin: LocalFrame, loiter_radius_m: float
    ) -> Iterator[Trespass | None]:
        """Yield for each leg what is wrong with it."""
        switches = [(item.seq, item.enable) for item in maneuvers if isinstance(item, FenceEnable)]
        round_it = {item.seq for item in maneuvers if isinstance(item, Loiter) and item.figure.goes_round}
        at_start = self._fence.enabled
        for leg in plan_legs(maneuvers, None, loiter_radius_m):
            on = next((enable for seq, enable in reversed(switches) if seq < leg.seq), at_start)
            points = tuple(origin.to_local(*point) for point in leg.points_rad) if on else ()
            if not points or self._outside_m(state, points) is None:
                yield None
            elif leg.seq in round_it:
                yield Trespass(leg.seq, 0.0)
            else:
                yield Trespass(leg.seq, max(-(self._fence.distance_m(state, points[-1]) or 0.0), 0.0))

    def _outside_m(self, state: EstimatedState, points: Sequence[NorthEast]) -> float | None:
        """How far outside a way is where it first leaves the fence; None when it does not."""
        for begin, end in zip(points[:-1] or points, points[1:] or points, strict=True):
            length_m, at_m = math.dist(begin, end), 0.0
            while True:
                share = at_m / length_m if length_m > 0.0 else 0.0
                point = NorthEast((begin[0] + (end[0] - begin[0]) * share, begin[1] + (end[1] - begin[1]) * share))
                room_m = self._fence.distance_m(state, point)
                if room_m is None:
                    return None
                if room_m < -_SLACK_M:
                    return -room_m
                if at_m >= length_m:
                    break
                at_m = min(at_m + max(room_m, _STEP_M), length_m)
        return None


def _frame(state: EstimatedState) -> LocalFrame | None:
    if state.origin_lat_rad is None or state.origin_lon_rad is None:
        return None
    return LocalFrame(state.origin_lat_rad, state.origin_lon_rad)
