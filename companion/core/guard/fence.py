"""The geofence: polygons and circles, inclusion and exclusion, and a stop that begins early enough to end inside.

The way that stopping still takes is laid along the course over ground, where a vessel with thrust cut and rudders
centred goes; when it reaches the edge (less a margin), the fence asks for a stop. So the border is not crossed, where
an autopilot that acts on crossing overshoots by its stopping distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field, replace
from typing import Final

from pydantic import Field

from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState, FenceArea, Severity
from mavlink_bridge.language.points import LatLon, NorthEast
from mavlink_bridge.language.snapshot import FenceStatus
from mavlink_bridge.language.value import value

from ..config import Config, param
from ..hull.handling import TURN_S
from .fence_region import Region, build_region

_BREACH_BOUNDARY: Final = 3
"""FENCE_BREACH_BOUNDARY."""
_SAMPLE_M: Final = 0.5
"""Half of the shortest hull: no corner of a fence is stepped over by the way that is looked at."""
_UNDER_WAY_MPS: Final = 0.3
"""Above what a receiver shows of a vessel that keeps its place."""
_SIGHT_S: Final = 30.0
"""A stop is foretold when it is so near in time at the present speed: long enough to look and press a button."""
_TOLD_S: Final = 12.0
"""And told as a text when it is so near."""
_LOOK_TICKS: Final = 10
"""Ticks between two looks so far ahead: twice a second."""
_NEAR_M: Final = 0.25
"""The march has come to the edge: nearer than any receiver tells, and each further step would be shorter still."""
_AGAIN_US: Final = 10_000_000
"""What is told again sooner than this says nothing new: a vessel that lies on the edge is set to and fro across it."""
_INSIDE_M: Final = 0.5
"""And she is inside again for a person when no wave sets her out."""
_OPENS: Final = 0.2
"""A way that leads from the edge by this share of its length leads inward: twelve degrees, more than a course wavers."""
_STEPS: Final = 24
"""Steps of the march to the edge; each is as long as the water is clear, so a straight course needs two or three."""


STOPPING: Final = "stopping"
MANUAL: Final = "Manual goes on through it"
BY_HAND: Final = f"{MANUAL}; the sticks stop it, or order Hold"


class FenceConfig(Config):
    """How the fence acts; the areas themselves come by the mission protocol."""

    enabled: bool = param(True, "FENCE_ENABLE", "Keep inside the fence, when one is loaded")
    margin_m: float = param(1.0, "FENCE_MARGIN", "Stop this far before the edge", unit="m", ge=0, le=100)
    union: bool = param(
        False,
        "FENCE_UNION",
        "Inside any inclusion area is enough (off: inside all of them); areas to sail between must overlap by twice the margin",
    )
    reaction_s: float = Field(0.6, ge=0, le=5)
    """From a fix to a propeller that is told to stop: latency, tick, line (the propeller's lag is reckoned apart)."""
    turn_s: float = Field(TURN_S, ge=0, le=60)
    """Time to turn against wind and current and hold; the vessel is set by them as long."""


@value
class FenceFlags:
    """Of the fence; names as in the failsafe table."""

    fence_ahead: bool = False
    """On the present course the vessel can only just stop inside."""
    fence_breach: bool = False


@value
class FenceOutput:
    """One tick of the fence."""

    status: FenceStatus
    flags: FenceFlags = field(default_factory=FenceFlags)
    texts: tuple[tuple[Severity, str], ...] = ()


class Fence:
    """The loaded areas, whether they count, and the breach counter."""

    def __init__(self, config: FenceConfig) -> None:
        self._config = config
        self._areas: tuple[FenceArea, ...] = ()
        self._switched: bool | None = None
        self._region: Region | None = None
        self._origin: LatLon | None = None
        self._status = FenceStatus()
        self._asked = ""
        """What was told when the fence last asked for a stop."""
        self._asked_us = 0
        """When it last did."""
        self._told_out = False
        """That the vessel is outside is told, and not yet that she is inside again."""
        self._told = False
        self._stops_in_m: float | None = None
        self._looks = 0
        self._clear = FenceOutput(self._status)
        """What is said while nothing is judged."""
        self._renew()

    def _renew(self) -> None:
        """Work out what follows from the areas, the setting and the switch."""
        config = self._config
        on = config.enabled if self._switched is None else self._switched
        self.enabled = on and bool(self._areas)
        """Whether the fence acts: switched on and not empty."""
        self.version = (self._areas, config.union)
        """Equal as long as the areas mean the same."""
        self._margin_m, self._reaction_s, self._turn_s = config.margin_m, config.reaction_s, config.turn_s

    def configure(self, config: FenceConfig) -> None:
        """Take new settings; a switch by command stands until the setting itself changes."""
        if config.enabled != self._config.enabled:
            self._switched = None
        self._config = config
        self._region = None
        self._renew()

    def load(self, areas: Sequence[FenceArea]) -> None:
        """Replace all areas; a breach by the new ones shows at the next check. Empty = no fence."""
        self._areas = tuple(areas)
        self._region, self._told_out = None, False
        self._renew()

    def enable(self, on: bool) -> None:
        """Switch by command (DO_FENCE_ENABLE), until the next switch or change of the setting."""
        self._switched = on
        self._renew()

    @property
    def areas(self) -> tuple[FenceArea, ...]:
        """What is loaded, whether it counts or not."""
        return self._areas

    def distance_m(self, state: EstimatedState, point: NorthEast) -> float | None:
        """Signed distance from a point in the state's plane to the nearest edge, positive inside; None = no fence."""
        region = self._laid_out(state)
        return None if region is None else region.inside_m(point)

    def room_m(self, state: EstimatedState, place: LatLon) -> float | None:
        """The same for a place in rad while the fence acts; None = no fence that acts, or no plane yet."""
        if not self.enabled or state.origin_lat_rad is None or state.origin_lon_rad is None:
            return None
        return self.distance_m(state, LocalFrame(state.origin_lat_rad, state.origin_lon_rad).to_local(*place))

    def short_m(
        self, state: EstimatedState, place: LatLon, speed_mps: float, stopping_distance_m: float
    ) -> float | None:
        """How much too near to the edge a place lies to be come to straight from here; None = not at all, or no fence that acts.

        ``stopping_distance_m``: from ``speed_mps``, beyond the place. The fence would ask for a stop before the vessel is there.
        """
        region = self._laid_out(state) if self.enabled else None
        if region is None or self._origin is None or state.x_m is None or state.y_m is None:
            return None
        there = LocalFrame(*self._origin).to_local(*place)
        course_rad = math.atan2(there[1] - state.y_m, there[0] - state.x_m)
        _, *ends = self._way(state, course_rad, max(0.0, stopping_distance_m + speed_mps * self._reaction_s))
        short_m = self._margin_m - min(map(region.inside_m, _along(there, ends[0]) + _along(there, ends[1])))
        return short_m if short_m > 0.0 else None

    def crosses(self, state: EstimatedState, place: LatLon) -> bool:
        """Whether the straight way from here to a place leads out of the fence that acts; from outside: out again."""
        region = self._laid_out(state) if self.enabled else None
        if region is None or self._origin is None or state.x_m is None or state.y_m is None:
            return False
        here, there = NorthEast((state.x_m, state.y_m)), LocalFrame(*self._origin).to_local(*place)
        return region.leads_out(here, NorthEast((there[0] - here[0], there[1] - here[1])))

    def check(
        self,
        state: EstimatedState,
        stopping_distance_m: float,
        straight_m: float | None = None,
        *,
        by_hand: bool = False,
    ) -> FenceOutput:
        """Hold the vessel and the way it needs to stop against the fence.

        ``stopping_distance_m``: at the present speed. ``straight_m``: how far the vessel is going to keep its course; None =
        it turns already. ``by_hand``: manual control goes on whatever the fence asks, so no stop is promised.
        """
        region = self._laid_out(state) if self.enabled else None
        if region is None or state.x_m is None or state.y_m is None:
            return self._nothing()
        here = NorthEast((state.x_m, state.y_m))
        inside_m = region.inside_m(here)
        texts: list[tuple[Severity, str]] = []
        self._note_breach(state.t_us, inside_m, texts)
        stop = inside_m >= 0.0 and self._must_stop(
            region, here, inside_m, state=state, stopping_distance_m=stopping_distance_m
        )
        if stop:
            asks = BY_HAND if by_hand else STOPPING
            if asks != self._asked or state.t_us - self._asked_us > _AGAIN_US:
                texts.append((Severity.WARNING, f"Fence in {inside_m:.1f} m: {asks}"))
            self._asked, self._asked_us = asks, state.t_us
        ahead_m = None if stop or inside_m < 0.0 else straight_m
        texts += self._foretell(region, here, state, stopping_distance_m, straight_m=ahead_m, by_hand=by_hand)
        return FenceOutput(self._status, FenceFlags(stop, self._status.breached), tuple(texts))

    def _foretell(
        self,
        region: Region,
        here: NorthEast,
        state: EstimatedState,
        stopping_distance_m: float,
        *,
        straight_m: float | None,
        by_hand: bool,
    ) -> list[tuple[Severity, str]]:
        """Say after how much more way on this course the fence will ask for a stop."""
        texts: list[tuple[Severity, str]] = []
        self._looks += 1
        if self._looks % _LOOK_TICKS == 1:
            speed_mps, course_rad = _motion(state)
            found = None
            if straight_m is not None and course_rad is not None and speed_mps > _UNDER_WAY_MPS:
                sight_m = min(speed_mps * _SIGHT_S, straight_m)
                run_m = stopping_distance_m + speed_mps * self._reaction_s
                found = self._stops_in(region, here, self._way(state, course_rad, run_m), sight_m)
                if found == 0.0:  # this way leads inward, or the stop would be asked for by now
                    found = None
            self._stops_in_m = found
            if found is None:
                self._told = False
            elif not self._told and found < speed_mps * _TOLD_S:
                self._told = True
                by_itself, sticks = f"Stops in {found:.0f} m: fence", f"Fence: {MANUAL}; stop within {found:.0f} m"
                texts.append((Severity.WARNING, sticks if by_hand else by_itself))
        self._status = replace(self._status, stops_in_m=None if straight_m is None or by_hand else self._stops_in_m)
        return texts

    def _way(self, state: EstimatedState, course_rad: float, run_m: float) -> tuple[NorthEast, NorthEast, NorthEast]:
        """Direction of the course, and from where a stop begins: its end, and where wind and current have set it."""
        heading = NorthEast((math.cos(course_rad), math.sin(course_rad)))
        run = NorthEast((run_m * heading[0], run_m * heading[1]))
        drift = (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        return heading, run, NorthEast((run[0] + drift[0] * self._turn_s, run[1] + drift[1] * self._turn_s))

    def _stops_in(
        self, region: Region, here: NorthEast, way: tuple[NorthEast, NorthEast, NorthEast], sight_m: float
    ) -> float | None:
        """March along the course, each step as long as the clear water around both ends of a stop; None = nothing in sight."""
        heading, *ends = way
        gone_m = 0.0
        for _ in range(_STEPS):
            at = (here[0] + heading[0] * gone_m, here[1] + heading[1] * gone_m)
            clear_m = min(region.inside_m(NorthEast((at[0] + end[0], at[1] + end[1]))) for end in ends) - self._margin_m
            if clear_m <= _NEAR_M:
                return gone_m
            gone_m += clear_m
            if gone_m > sight_m:
                return None
        return None

    def _nothing(self) -> FenceOutput:
        self._asked, self._told, self._told_out = "", False, False
        self._stops_in_m = None
        if self._status is not self._clear.status:
            self._status = FenceStatus(breach_count=self._status.breach_count)
            self._clear = FenceOutput(self._status)
        return self._clear

    def _note_breach(self, t_us: int, inside_m: float, texts: list[tuple[Severity, str]]) -> None:
        old = self._status
        breached = inside_m < 0.0
        count, since_us = old.breach_count, old.breach_t_us if breached else 0
        if breached and not old.breached:
            count, since_us = count + 1, t_us
            if not self._told_out:
                texts.append((Severity.CRITICAL, f"Outside the fence by {-inside_m:.1f} m"))
            self._told_out = True
        elif self._told_out and inside_m > _INSIDE_M:
            texts.append((Severity.INFO, "Inside the fence again"))
            self._told_out = False
        kind = _BREACH_BOUNDARY if breached else 0
        self._status = FenceStatus(breached, count, kind, since_us, None if math.isinf(inside_m) else inside_m)

    def _must_stop(
        self,
        region: Region,
        here: NorthEast,
        inside_m: float,
        state: EstimatedState,
        stopping_distance_m: float,
    ) -> bool:
        speed_mps, course_rad = _motion(state)
        if course_rad is None:
            return False
        run_m = stopping_distance_m + speed_mps * self._reaction_s
        run = NorthEast((run_m * math.cos(course_rad), run_m * math.sin(course_rad)))
        # A vessel that keeps its place already is not set any more.
        turn_s = self._turn_s if speed_mps > _UNDER_WAY_MPS else 0.0
        set_by = NorthEast(((state.drift_n_mps or 0.0) * turn_s, (state.drift_e_mps or 0.0) * turn_s))
        margin_m = self._margin_m
        if inside_m > run_m + math.hypot(*set_by) + margin_m:
            return False
        way, least_m = _along(here, run), min(margin_m, inside_m)
        if min(map(region.inside_m, way)) < least_m:
            return True
        end_m = min(map(region.inside_m, _along(way[-1], set_by)))
        if end_m >= least_m:
            return False
        # A vessel that makes way inward against wind and current is set out by them when she stops, and the farther in the later.
        later = NorthEast(
            (way[-1][0] + _SAMPLE_M * math.cos(course_rad), way[-1][1] + _SAMPLE_M * math.sin(course_rad))
        )
        return min(map(region.inside_m, _along(later, set_by))) < end_m + _OPENS * _SAMPLE_M

    def _laid_out(self, state: EstimatedState) -> Region | None:
        if not self._areas or state.origin_lat_rad is None or state.origin_lon_rad is None:
            return None
        origin = LatLon((state.origin_lat_rad, state.origin_lon_rad))
        if self._region is None or origin != self._origin:
            self._region = build_region(self._areas, LocalFrame(*origin), self._config.union)
            self._origin = origin
        return self._region


def _motion(state: EstimatedState) -> tuple[float, float | None]:
    """Speed in m/s and direction in rad that the vessel goes; from rest it is the bow's."""
    if state.vx_mps is not None and state.vy_mps is not None:
        speed_mps = math.hypot(state.vx_mps, state.vy_mps)
        if speed_mps > 0.1:
            return speed_mps, math.atan2(state.vy_mps, state.vx_mps)
    return 0.0, state.psi_rad


def _along(start: NorthEast, way: NorthEast) -> list[NorthEast]:
    """Points along a straight way, its end the last."""
    count = max(1, math.ceil(math.hypot(*way) / _SAMPLE_M))
    return [NorthEast((start[0] + way[0] * i / count, start[1] + way[1] * i / count)) for i in range(1, count + 1)]
