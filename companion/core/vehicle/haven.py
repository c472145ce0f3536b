"""Where Return leads: to the nearest of home and the rally points that may be used.

Rally points lie in the store and outlive the voyage. One of another water is not sailed to by mistake, and one before which the fence
would stop the vessel is no place to come back to: outside it, or so near its edge that she cannot stop before it. They are passed over,
and told when rally points or a fence are loaded and when the vessel is armed. Home is the last resort, however it lies. A place whose
straight way leads across the fence is passed over while another lies open, unless that is very far: she would wait before the fence for
good. While a return is under way it is looked at again: one look from where an island's corner is in the way does not send her past an
open home. Distances are from where the vessel is.
Source: ArduPilot's AP_Rally (RALLY_LIMIT_KM; home is a choice as in Rover's RALLY_INCL_HOME = 1).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.messages import EstimatedState, Severity
from mavlink_bridge.language.points import LatLon

from ..guard.failsafe_words import capital
from ..guard.fence import Fence
from .plan_fence import SETTLE_US
from .plan_reach import MissionConfig, shown
from .voyage import LANDED_M

HOME: Final = "home"
_RALLY: Final = "rally point"
THERE_M: Final = 2.0
"""Nearer than this the vessel is there, as at a waypoint by default: no way is left that is worth a text or that a fence could stop."""
_ACROSS: Final = ": the fence is across the way"
_DETOUR: Final = 3.0
"""So many times the way to the nearest place one is worth that lies open: farther off, the last of a battery is spent on the way."""
_DETOUR_M: Final = 300.0
"""A detour of this length is always worth it: any boat sails it with what a critical battery still holds."""
_NEARER: Final = 0.5
"""Share of the way left that another place may be away to be changed to: turning about costs way, and a place is not left for a little."""
_STEADY_US: Final = 10_000_000
"""So long a way must have been open: at an island's corner it opens and shuts with each wave, for some seconds."""
_LOOKED_EVERY_US: Final = 5_000_000
"""Under way a look takes as long as one at rest, and a place that is nearer for ten seconds is seen three times."""
_ASKED_EVERY_US: Final = 500_000
"""A vessel that the fence has stopped makes no way; rally points and corners by the hundred take a part of a tick."""


@dataclass(frozen=True, slots=True)
class Haven:
    """A place to return to."""

    name: str
    """As a person calls it; rally points are counted from 1, as on a map."""
    point: LatLon
    away_m: float
    remark: str = ""
    """What the fence shuts off: a nearer place, or the way to this one; in words."""

    @property
    def told(self) -> str:
        """Where it is, and why no nearer place is returned to."""
        return f"{self.words}{self.remark}"

    @property
    def words(self) -> str:
        return f"{self.name}, {shown(self.away_m)}"


class Havens:
    """Home, the rally points, and which of them Return takes."""

    def __init__(self, config: MissionConfig, fence: Fence | None = None) -> None:
        """``fence`` None: nothing lies outside."""
        self.config = config
        self.home: LatLon | None = None
        self.rally: tuple[LatLon, ...] = ()
        self.coming_in: Callable[[float | None], tuple[float, float]] = lambda speed_mps: (speed_mps or 0.0, 0.0)
        """Speed of a return (None: the usual one), and the way beyond a place on which the vessel comes to rest; she knows a better one."""
        self._fence = fence
        self._looked_at: tuple[LatLon, ...] = ()
        self._key: object = None
        self._tell_us: int | None = None
        self._told = ""
        self._leads: tuple[object, LatLon] | None = None
        """Where the return leads that is under way or waits, and what it was chosen from."""
        self._keeps = False
        self._look_us = 0
        self._nearer: tuple[LatLon, int] | None = None
        """The place that is markedly nearer, and since when."""
        self._changed_to: tuple[LatLon, ...] = ()
        """Places that this return has changed to on its way: to none twice, or she might go to and fro."""
        self._changes, self._given_up = 0, ""
        """How often a place was given up, and the last one's name until it is told."""
        self._shut_off: tuple[object, bool] = None, False
        """What ``is_shut_off`` was last asked of, and the answer."""

    def nearest(self, state: EstimatedState, speed_mps: float | None = None) -> Haven | None:
        """Return where Return leads from here at a speed (None: the usual one); None without a position, or without a place.

        The nearest to which the way is open and no longer than a detour may be; where there is none, the nearest.
        """
        here = _here(state)
        shut: Haven | None = None
        if here is None:
            return None
        for place in self._in_turn(state, here):
            nearer = shut if shut is not None and shut.away_m < place.away_m else None
            is_across = self._is_across(state, place)
            if (is_across and nearer is not None) or self._objection(state, place, speed_mps):
                continue
            if nearer is not None and place.away_m > max(_DETOUR * nearer.away_m, _DETOUR_M):
                break
            if not is_across:
                return place if nearer is None else replace(place, remark=f"{_ACROSS} to {nearer.words}")
            shut = place
        last = shut or self._home_from(here)
        return replace(last, remark=_ACROSS) if last is not None and self._is_across(state, last) else last

    def choose(self, state: EstimatedState, speed_mps: float | None = None, *, keeps: bool = True) -> Haven | None:
        """The same for a return that begins, which ``key`` tells of a place that turns out to be markedly nearer.

        It keeps to its place while the way there is open, until ``begin_anew``. ``keeps`` False: a plan's, which the next does not keep to.
        """
        self._keeps, given_up = self._keeps and keeps, self._given_up
        place = self.nearest(state, speed_mps)
        self._leads, self._keeps = None if place is None else (self.key, place.point), keeps
        self._nearer, self._given_up = None, ""
        if place is None or not given_up or place.remark or place.name == given_up:
            return place
        return replace(place, remark=f": the way is open, and shorter than to {given_up}")

    def begin_anew(self) -> None:
        """Somebody has given an order: the next return takes what is nearest then."""
        self._leads, self._changed_to, self._given_up = None, (), ""

    def is_shut_off(self, state: EstimatedState) -> bool:
        """Whether the straight way to where Return leads goes across the fence: there, and to every other place."""
        key = (state.t_us // _ASKED_EVERY_US, self.key)
        if key != self._shut_off[0]:
            place = self.nearest(state)
            self._shut_off = key, place is not None and self._is_across(state, place)
        return self._shut_off[1]

    def step(self, now_us: int, state: EstimatedState) -> tuple[Severity, str] | None:
        """Look at rally points that were loaded, or that another fence stands about; return a text when one is passed over."""
        if not state.position_valid:
            return None
        self._look_again(now_us, state)
        key = self._about, self.config.rally_limit_km, state.origin_lat_rad, state.origin_lon_rad
        if self.rally is not self._looked_at:
            self._looked_at, self._key, self._told = self.rally, None, ""
        if key != self._key:
            self._key, self._tell_us = key, now_us + SETTLE_US
        if self._tell_us is None or now_us < self._tell_us:
            return None
        self._tell_us, told = None, self._told
        self._told = text = self._passed_over(state)
        return (Severity.WARNING, text) if text and text != told else None

    def at_arming(self, state: EstimatedState, *, home_stays: bool) -> Sequence[tuple[Severity, str]]:
        """What somebody who arms must know of the way back. ``home_stays``: it is no other place by this arming."""
        texts = [self._passed_over(state), self.far(state), self._stays(state) if home_stays else ""]
        return [(Severity.WARNING, text) for text in texts if text]

    def _stays(self, state: EstimatedState) -> str:
        here = _here(state)
        home = None if here is None else self._home_from(here)
        if home is None or home.away_m <= LANDED_M:
            return ""
        return f"home stays {shown(home.away_m)} away, at {degrees(home.point)}; Set Home moves it"

    def far(self, state: EstimatedState) -> str:
        """Say where Return leads when that is farther than a rally point may be; "" = it is not, or nobody set a limit."""
        place, limit_m = self.nearest(state), self._limit_m
        if place is None or limit_m is None or place.away_m <= limit_m:
            return ""
        return f"Return leads to {place.words} away"

    @property
    def key(self) -> object:
        """Equal as long as Return has the same places to choose from."""
        return self.home, self.rally, self._about, self.config.rally_limit_km, self._changes

    @property
    def _about(self) -> object:
        return None if self._fence is None else (self._fence.version, self._fence.enabled)

    @property
    def _limit_m(self) -> float | None:
        return self.config.rally_limit_km * 1000.0 or None

    def _in_turn(self, state: EstimatedState, here: LatLon) -> list[Haven]:
        """In which turn places are looked at: the nearest first, but before all the one that is kept.

        So a vessel between two of them does not go to and fro.
        """
        places, home = self._rally_points(here), self._home_from(here)
        if home is not None and self._outside_m(state, home.point) is None:
            places.append(home)
        kept = self._led_to if self._keeps else None
        return sorted(places, key=lambda place: (place.point != kept, place.away_m))

    @property
    def _led_to(self) -> LatLon | None:
        return None if self._leads is None or self._leads[0] != self.key else self._leads[1]

    def _look_again(self, now_us: int, state: EstimatedState) -> None:
        """Give the place up that a return leads to, for one to which the way has been open for a while and is markedly shorter."""
        if self._leads is None or now_us < self._look_us:
            return
        self._look_us = now_us + _LOOKED_EVERY_US
        led_to, found = self._markedly_nearer(state)
        if found is None or self._nearer is None or found != self._nearer[0]:
            self._nearer = None if found is None else (found, now_us)
        elif now_us - self._nearer[1] >= _STEADY_US:
            self._leads, self._nearer, self._changed_to = None, None, (*self._changed_to, found)
            self._changes, self._given_up = self._changes + 1, led_to

    def _markedly_nearer(self, state: EstimatedState) -> tuple[str, LatLon | None]:
        """Return the name of the place that a return leads to, and what is markedly nearer; None = nothing."""
        here, point = _here(state), self._led_to
        places = [] if here is None or point is None else self._in_turn(state, here)
        led_to = next((place for place in places if place.point == point), None)
        if led_to is None:
            return "", None
        if led_to.away_m <= LANDED_M:
            self._changed_to = ()  # she has come back: the next return is another
            return led_to.name, None
        within_m = _NEARER * led_to.away_m
        near = (place for place in places if place.away_m <= within_m and place.point not in self._changed_to)
        return led_to.name, next((place.point for place in near if not self._shuts_off(state, place)), None)

    def _shuts_off(self, state: EstimatedState, place: Haven) -> bool:
        return self._is_across(state, place) or bool(self._objection(state, place, None))

    def _is_across(self, state: EstimatedState, place: Haven) -> bool:
        """Whether the fence is across the straight way to a place."""
        return self._fence is not None and self._fence.crosses(state, place.point)

    def _passed_over(self, state: EstimatedState) -> str:
        here = _here(state)
        places = [] if here is None else self._rally_points(here)
        found = [(place.name, why) for place in places if (why := self._objection(state, place, None))]
        if not found:
            return ""
        (name, why), others = found[0], len(found) - 1
        return f"{capital(name)} {f'and {others} more are' if others else 'is'} not returned to: {why}"

    def _home_from(self, here: LatLon) -> Haven | None:
        return None if self.home is None else Haven(HOME, self.home, inverse(*here, *self.home)[0])

    def _rally_points(self, here: LatLon) -> list[Haven]:
        return [
            Haven(f"{_RALLY} {number}", point, inverse(*here, *point)[0]) for number, point in enumerate(self.rally, 1)
        ]

    def _objection(self, state: EstimatedState, place: Haven, speed_mps: float | None) -> str:
        """Why Return does not lead to a rally point; "" = it may, as to home always."""
        if place.name == HOME:
            return ""
        if self._limit_m is not None and place.away_m > self._limit_m:
            return f"{shown(place.away_m)} away, limit {shown(self._limit_m)} (RALLY_LIMIT_KM)"
        outside_m = self._outside_m(state, place.point)
        if outside_m is not None:
            return f"{max(outside_m, 1.0):.0f} m outside the fence"
        if self._fence is None or place.away_m < THERE_M:
            return ""
        short_m = self._fence.short_m(state, place.point, *self.coming_in(speed_mps))
        return "" if short_m is None else f"{max(short_m, 1.0):.0f} m too near the fence to stop there"

    def _outside_m(self, state: EstimatedState, point: LatLon) -> float | None:
        """How far outside the fence that acts a place lies; None = inside, or no fence."""
        room_m = None if self._fence is None else self._fence.room_m(state, point)
        return None if room_m is None or room_m >= 0.0 else -room_m


def degrees(place: LatLon) -> str:
    """A place as on a chart."""
    return f"{math.degrees(place[0]):.5f} {math.degrees(place[1]):.5f}"


def _here(state: EstimatedState) -> LatLon | None:
    return None if state.lat_rad is None or state.lon_rad is None else LatLon((state.lat_rad, state.lon_rad))
