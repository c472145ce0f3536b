"""The shoal that stopped the vessel last: where the limit lies, on which course it was met, and what a stop is still good for there.

A stop takes off the way that a vessel makes of her own; against wind and current it does nothing, and lets her drift. So one that keeps
her station is not stopped for what lies ahead. One that is ordered away backs out on the track that she came by, which is known to be
deep, before she turns. What is measured below the lock stops her all the same. While no depth is read, nothing is known of the water
beyond the limit, and no way leads over it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import EstimatedState, Severity
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.value import value

from ..backing import BackingOut, Come
from .ahead import DepthLook
from .config import DepthGuardConfig
from .lookahead import PathAhead, StoppingDistance
from .ways import own_way, ways

STILL_MPS: Final = 0.5
"""Way of her own below this is what keeping a station takes: thrust astern takes it off within a metre or two."""
_PATH_M: Final = 10.0
"""So far along it a path shows whether it leads away: beyond the turn of every shipped hull."""
_NEARER_M: Final = 1.0
"""More than a position wavers from fix to fix."""
_AWAY_M: Final = 0.5
"""So much farther off at its end a path leads away: along the shoal no boat has room to turn either, and 87 degrees are not along."""
_WIDE_M: Final = 50.0
"""So far to either side of her course a shoal is taken to lie: farther off nobody has looked, with a sounder or without."""
_FORGET_M: Final = 100.0
"""A depth that is read so far away is of another place, and so is the next one that is missed."""
_BEYOND_M: Final = 0.5
"""From beyond the limit she may not go farther on than a position wavers."""
_LOOK_M: Final = 1.0
"""The way is looked at in steps of this, and so far beyond where she would lie."""
BLIND: Final = "nothing is known of the way ahead: sounder silent"
_COURSE_MPS: Final = 0.3
"""Slower, the course over ground is where she drifts; the bow says what she was about to do."""


@value
class Going:
    """What the vessel is about, beside the path that she sails."""

    keeps_station: bool = False
    """The law in force holds a place, and she is at it."""
    turns_at_rest: bool = False
    """She can turn where she lies."""


AT_SEA: Final = Going()
"""What nobody has said more of."""


@value
class Judged:
    """What is left of a stop."""

    stop: bool
    back_rad: float | None = None
    """She backs out, with the bow held there; None: she sails as ordered."""


class MetShoal:
    """The last one, and how far the vessel has come since."""

    def __init__(self) -> None:
        self._from = NorthEast((0.0, 0.0))
        """Where she was stopped."""
        self._limit: NorthEast | None = None
        """Where the least altitude is reckoned to lie; None: no sounder found it, or it has been passed."""
        self._course: tuple[float, float] | None = None
        """Towards it, north and east; None: none was met."""
        self._is_told = False
        self.minds_silence = True
        """A sounder that falls silent is acted on."""
        self._least_m = self._reaction_s = 0.0
        self._runs_out = False
        """She still has the way of the stop."""
        self._backing = BackingOut()

    def configure(self, config: DepthGuardConfig) -> None:
        """Take new settings."""
        self.minds_silence = config.enabled and config.rate_look_ahead and config.unknown_policy != "ignore"
        self._least_m, self._reaction_s = config.min_altitude_m, config.reaction_s

    def meet(self, state: EstimatedState | None, altitude_m: float | None, look: DepthLook, slope: float) -> None:
        """Note the shoal that stops her now, with so much water under the keel (None: as much as ``look`` reckons), on a bottom
        that rises by ``slope`` for each metre.
        """
        if state is None:
            return
        room_m = 0.0 if look.left_s is None else look.left_s * look.closing_mps
        if altitude_m is not None:
            room_m = altitude_m - self._least_m
        is_under_way = state.cog_rad is not None and (state.sog_mps or 0.0) > _COURSE_MPS
        course_rad = state.cog_rad if is_under_way else state.psi_rad
        if course_rad is None or state.x_m is None or state.y_m is None:
            return
        self._course = north, east = math.cos(course_rad), math.sin(course_rad)
        self._from = NorthEast((state.x_m, state.y_m))
        left_m = max(room_m, 0.0) / slope if slope > 0.0 else 0.0
        # What a chart knows it goes on knowing without a sounder.
        is_sounded = look.closing_mps > 0.0 or not look.by_place
        self._limit = None if not is_sounded else NorthEast((state.x_m + left_m * north, state.y_m + left_m * east))
        self._runs_out = True
        self._backing.arm()
        self._is_told = False

    def look(
        self,
        look: DepthLook,
        state: EstimatedState | None,
        path_ahead: PathAhead | None,
        stopping_distance_fn: StoppingDistance | None,
        *,
        is_good: bool | None,
    ) -> tuple[DepthLook, list[tuple[Severity, str]]]:
        """What looking ahead asks for, and what to say of it. ``is_good``: the water that is read here; None: no depth is read,
        and she is stopped before a way leads over the limit.
        """
        come = None if self._limit is None else _way(state, self._from)
        if come is None or state is None:
            return look, []
        if is_good is not None:
            self._forget(state, math.hypot(*come), is_good=is_good)
            return look, []
        if not self.minds_silence or stopping_distance_fn is None:
            return look, []
        speed_mps = state.sog_mps or 0.0
        reach_m = stopping_distance_fn(speed_mps) + self._reaction_s * speed_mps + _LOOK_M
        found = ways(state, path_ahead, reach_m, _LOOK_M)
        if not look.stop and any(self.bars(state, point) for way in found for point in way):
            look = replace(look, stop=True, why="reckoned, sounder silent")
        return look, self._told(math.hypot(*come))

    def _told(self, come_m: float) -> list[tuple[Severity, str]]:
        """Once for each stop, near it."""
        if self._is_told or come_m > _WIDE_M:
            return []
        self._is_told = True
        return [(Severity.WARNING, BLIND[0].upper() + BLIND[1:])]

    def _forget(self, state: EstimatedState, come_m: float, *, is_good: bool) -> None:
        """A limit that has been passed in good water, or lies far away, is none any more."""
        beyond = None if self._limit is None else _way(state, self._limit)
        is_passed = is_good and beyond is not None and self._towards(beyond) > 0.0 and self._across(beyond) <= _WIDE_M
        if is_passed or come_m > _FORGET_M:
            self._limit = None

    def bars(self, state: EstimatedState | None, point: NorthEast) -> bool:
        """Whether the straight way to a point leads over the limit."""
        here = None if self._limit is None else _way(state, self._limit)
        if here is None or self._limit is None:
            return False
        there = point[0] - self._limit[0], point[1] - self._limit[1]
        before_m, beyond_m = self._towards(here), self._towards(there)
        if beyond_m <= max(before_m + _BEYOND_M, 0.0):
            return False
        share = max(-before_m, 0.0) / (beyond_m - before_m)
        crossed = here[0] + share * (there[0] - here[0]), here[1] + share * (there[1] - here[1])
        return self._across(crossed) <= _WIDE_M

    def judge(
        self, state: EstimatedState | None, path_ahead: PathAhead | None, going: Going, *, stop: bool, by_place: bool
    ) -> Judged:
        """Say what is left of a stop that the look ahead asks for. ``by_place``: chart or memory ask for it too."""
        if state is None or state.x_m is None or state.y_m is None:
            return Judged(stop)
        own_mps = own_way(state)
        is_still = math.hypot(*own_mps) <= STILL_MPS
        towards_mps = self._towards(own_mps)
        come = self._come(state)
        has_room = self._backing.follow(come)
        self._runs_out = self._runs_out and not has_room and towards_mps > STILL_MPS
        if going.keeps_station:
            self._backing.pause()
            return Judged(stop and not is_still and not self._runs_out)
        if self._course is None or not going.turns_at_rest or not self._leads_away(state, path_ahead):
            return Judged(stop)
        back_rad = math.atan2(self._course[1], self._course[0]) if self._backing.goes_on(state, come) else None
        spared = is_still or (not by_place and (back_rad is not None or towards_mps <= STILL_MPS))
        return Judged(stop and not spared, back_rad)

    @property
    def goes_astern(self) -> bool:
        """She backs out, and it has not been given up."""
        return self._backing.began_at is not None

    def _come(self, state: EstimatedState) -> Come:
        """How far she has come since the stop, and where her bow is."""
        way = (state.x_m or 0.0) - self._from[0], (state.y_m or 0.0) - self._from[1]
        bow_rad = state.psi_rad
        bow = None if bow_rad is None else self._towards((math.cos(bow_rad), math.sin(bow_rad)))
        over_ground = (state.vx_mps or 0.0, state.vy_mps or 0.0)
        return Come(math.hypot(*way), self._towards(way), self._towards(over_ground), bow)

    def _leads_away(self, state: EstimatedState, path_ahead: PathAhead | None) -> bool:
        """Whether the path that is being sailed leads back from the shoal, and nowhere nearer to it. While she backs out it is
        held against where she began: the path begins abeam of her, which is nearer to the shoal the farther astern she is.
        """
        path = () if path_ahead is None else path_ahead(_PATH_M)
        if not path:
            self._backing.pause()
            return False
        began_at = self._backing.began_at
        here = began_at or (state.x_m or 0.0, state.y_m or 0.0)
        ways_m = [self._towards((north - here[0], east - here[1])) for north, east in path]
        away_m, nearer_m = (_AWAY_M, _NEARER_M) if began_at is None else (0.0, 2.0 * _NEARER_M)
        leads_away = ways_m[-1] < -away_m and max(ways_m) < nearer_m
        if not leads_away:
            self._backing.redirect()
        return leads_away

    def _towards(self, way: tuple[float, float]) -> float:
        """The part of a way, north and east, that leads towards the shoal."""
        north, east = self._course or (0.0, 0.0)
        return way[0] * north + way[1] * east

    def _across(self, way: tuple[float, float]) -> float:
        """How far a way leads to either side of the course towards the shoal."""
        north, east = self._course or (0.0, 0.0)
        return abs(way[1] * north - way[0] * east)


def _way(state: EstimatedState | None, origin: NorthEast) -> tuple[float, float] | None:
    """The way from a place to where the vessel is; None = not known."""
    if state is None or state.x_m is None or state.y_m is None:
        return None
    return state.x_m - origin[0], state.y_m - origin[1]
