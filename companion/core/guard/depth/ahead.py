"""The guard's look-ahead: what closing rate, map and own memory ask for, the ladder of texts, and the way back.

Ladder: tell (the limit is near in time), slow (so that stopping fits into the water that is left), stop. The way back is the
track sailed, since its depth is known. Map and memory both warn, and neither contradicts the other: the least depth counts.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import EstimatedState, Severity
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.value import value

from ...hull.geometry import HullGeometry
from .config import DepthGuardConfig
from .grid import DepthGrid
from .input import Altitude, DepthInput, reading_sigma_m
from .lookahead import (
    LONG_WINDOWS,
    Ahead,
    ClosingRate,
    PathAhead,
    StoppingDistance,
    sample,
    slow_speed_mps,
)
from .lost import LostBottom
from .memory import DepthMemory
from .sea import Sea
from .ways import ways

_SLOW_MPS: Final = 0.1
"""Slower than this the way to stop takes no time that is worth reckoning."""
_UNDER_WAY_MPS: Final = 0.3
"""Slower than this nobody is told when the limit will be reached: the answer would be minutes, and wrong."""
_TRACK_M: Final = 2.0
"""The water just sailed is known good in steps of this: a cell of a fine chart."""
_MAP_LATENCY_S: Final = 0.2
"""Between two looks at the map at the slowest, five a second."""
_WAIT_M: Final = 0.015
_WAIT_S: Final = 0.1
"""Water that a stop may cost while it is confirmed, and how long waiting for the next look takes at most."""
_LEAK_MPS: Final = 0.03
"""So fast is a wait forgotten while no stop is asked for."""
_BLIND_WARN: Final = 3.0
"""Without a sounder the limit counts as near this many times earlier than it is told of otherwise."""
_REST: Final = 3
_REST_S: Final = 0.3
"""Looks, and at most how long they take at 10 Hz, for which clear water around is taken as still clear."""
_SOUNDED: Final = "sounded before"
_LATELY_US: Final = 5_000_000
"""A slope that was proven so shortly before the last reading is still being sailed up: on gentle ones noise hides it at times."""
_APPROACH_US: Final = 10_000_000
"""An approach is over when none has been seen for so long: a slow sounder's noise hides one for some seconds."""
_LONG_US: Final = 60_000_000
"""Of the bottom this long after the last reading its slope says nothing."""
_SLOPE_MPS: Final = 0.3
"""Slower, a slope is a change of depth over a way of nearly nothing."""
_NO_WORSE_M: Final = 0.1
"""Two soundings that differ by this may be of the same water."""


@value
class DepthLook:
    """What looking ahead asks for."""

    limit_m: float
    """What the altitude is held against: the least altitude plus what stopping uses up."""
    stop: bool = False
    by_place: bool = False
    """Chart or memory ask for the stop, alone or too."""
    slow_to_mps: float | None = None
    why: str = ""
    closing_mps: float = 0.0
    left_s: float | None = None
    """Time to the least altitude at this rate."""
    blind: bool = False
    """The sounder is silent, and the bottom was closing."""
    map_least_m: float | None = None
    """Least altitude that map or memory knows on the way; of the memory only what is too shallow."""


class DepthAhead:
    """Holds the closing rate, the map, the memory and the track sailed over good water."""

    def __init__(self, config: DepthGuardConfig, memory: DepthMemory | None, geometry: HullGeometry) -> None:
        self._keel_m, self._beam_m = geometry.keel_m, geometry.beam_m
        self.map: DepthGrid | None = None
        self.utc_s = 0
        """Now, seconds since 1970; 0 = unknown. Whoever knows it sets it."""
        self._memory = memory
        self.correcting = False
        """A correction may use the water down to the lock; what was sounded there on the way in must not bar the way out."""
        self.configure(config)
        self._closing, self._trend, self._sea = ClosingRate(), ClosingRate(LONG_WINDOWS), Sea()
        self._lost, self._before = LostBottom(), LostBottom()
        """Reckoned on from the last altitude; and from before the readings that repeat themselves or are doubted."""
        self._slope = 0.0
        self._steepest_us = self._sloped_us = self._noted_us = -_LONG_US
        """When the slope was at its steepest of late, when there was one, and when there was a reading."""
        self._good_track: deque[NorthEast] = deque(maxlen=200)
        self._stopping = self._warned = self._blind = False
        self._rest = 0
        """Looks that the memory need not be asked for: it has just said that all around is clear."""
        self._looked_us, self._closed_us, self._waited_m = 0, 0, 0.0
        """Water that waiting for a stop to be confirmed has cost."""

    def configure(self, config: DepthGuardConfig) -> None:
        """Take new settings."""
        self._config = config
        self._datum_offset_m = config.datum_offset_m(self._keel_m)
        self._map_offset_m = config.map_offset_m(self._keel_m)
        self._sigma_m = config.input.sigma_m
        self._least_m, self._good_m = config.min_altitude_m, config.min_altitude_m + config.good_margin_m
        self._by_rate_too, self._by_map_too = config.rate_look_ahead, config.map_look_ahead
        self._warn_s = config.warn_s

    @property
    def closes(self) -> bool:
        """Whether the bottom is proven to close."""
        return self._rate.closing_mps > 0.0

    @property
    def _rate(self) -> ClosingRate:
        """What counts: the short lines; in waves, which hardly move them, the long ones where they prove more."""
        short, long = self._closing, self._trend
        return long if self._sea.is_seen and long.closing_mps > short.closing_mps else short

    @property
    def last_good(self) -> NorthEast | None:
        """Where the water was good last (north, east in m)."""
        return self._good_track[-1] if self._good_track else None

    def leads_back(self, state: EstimatedState | None, path_ahead: PathAhead | None, reach_m: float) -> bool:
        """Whether the path that is being sailed leads nearer to where the water was good last."""
        good, path = self.last_good, () if path_ahead is None else path_ahead(reach_m)
        if not path or good is None or state is None or state.x_m is None or state.y_m is None:
            return False
        north, east = path[-1][0] - state.x_m, path[-1][1] - state.y_m
        return north * (good[0] - state.x_m) + east * (good[1] - state.y_m) > 0.0

    def note(self, passed: Sequence[Altitude], speed_mps: float = 0.0) -> None:
        """Take the readings that passed the gate; several at once are a confirmed jump, which starts the rate anew."""
        if len(passed) > 1:
            self._closing.forget()
            self._trend.forget()
            self._sea.forget()
            self._slope = 0.0
        for reading in passed:
            sigma_m = reading_sigma_m(self._sigma_m, reading.value_m)
            self._sea.add(reading, sigma_m)
            self._closing.add(reading, sigma_m, self._sea)
            self._trend.add(reading, sigma_m, self._sea)
            self._noted_us = reading.t_us
        likely_mps = self._closing.likely_mps or self._trend.likely_mps
        if passed and likely_mps > 0.0 and speed_mps > _SLOPE_MPS:
            self._sloped_us = self._noted_us
            slope = likely_mps / speed_mps
            if slope >= self._slope or self._noted_us - self._steepest_us > _LATELY_US:
                self._slope, self._steepest_us = slope, self._noted_us

    def slope(self, t_us: int) -> float:
        """By how much the bottom rose for each metre sailed, as far as that was proven lately; 0 = it did not rise."""
        is_lately = self._noted_us - self._sloped_us <= _LATELY_US and t_us - self._noted_us <= _LONG_US
        return self._slope if is_lately else 0.0

    def known_altitude_m(self, state: EstimatedState | None) -> float | None:
        """Altitude here by chart or memory, the lesser; None = neither knows the place."""
        if state is None or state.lat_rad is None or state.lon_rad is None or not self._by_map_too:
            return None
        here_rad = state.lat_rad, state.lon_rad
        charted_m = None if self.map is None else self.map.depth_at(*here_rad)
        sounded_m = None if self._memory is None else self._memory.known_m(*here_rad, self.utc_s)
        known = [
            depth_m + offset_m
            for depth_m, offset_m in ((charted_m, self._map_offset_m), (sounded_m, self._datum_offset_m))
            if depth_m is not None
        ]
        return min(known, default=None)

    def look(
        self,
        now_us: int,
        state: EstimatedState | None,
        altitude_m: float | None,
        source: DepthInput,
        path_ahead: PathAhead | None,
        stopping_distance_fn: StoppingDistance | None,
    ) -> DepthLook:
        """Look ahead by closing rate and by map; the stricter counts."""
        self._keep_track(state, altitude_m)
        look = DepthLook(self._least_m)
        if state is None or stopping_distance_fn is None:
            return look
        if self._by_rate_too:
            look = self._by_sounder(
                look,
                now_us,
                state.sog_mps or 0.0,
                altitude_m=altitude_m,
                source=source,
                stopping_distance_fn=stopping_distance_fn,
            )
        if self._by_map_too:
            look = self._by_place(look, state, altitude_m, path_ahead, stopping_distance_fn)
        return look

    def _by_place(
        self,
        look: DepthLook,
        state: EstimatedState,
        altitude_m: float | None,
        path_ahead: PathAhead | None,
        stopping_distance_fn: StoppingDistance,
    ) -> DepthLook:
        """By chart and memory. In clear water the memory is asked at every fourth look only."""
        memory = self._memory
        self._rest -= 1
        if self.map is None and (memory is None or self._rest >= 0):
            return look
        speed_mps = state.sog_mps or 0.0
        reach_m = stopping_distance_fn(speed_mps) + (self._config.reaction_s + _MAP_LATENCY_S) * speed_mps + 1.0
        if memory is not None:
            config, cell_m = self._config, memory.geometry.cell_m
            allowed_m = config.minimum_margin_m if self.correcting else 0.0
            floor_m = config.min_altitude_m - allowed_m - self._datum_offset_m
            if memory.shoals_near(state, reach_m + cell_m + _REST_S * speed_mps, floor_m):
                look = self._by_memory(
                    look, memory, state, altitude_m=altitude_m, path_ahead=path_ahead, reach_m=reach_m
                )
            else:
                self._rest = _REST
        if self.map is not None:
            look = self._by_map(look, self.map, state, path_ahead, reach_m)
        return look

    def told(
        self, stopping: bool, look: DepthLook, state: EstimatedState | None, *, now_us: int = 0, goes_on: bool = False
    ) -> list[tuple[Severity, str]]:
        """What to tell about this look: once per approach, once per stop. ``goes_on``: the stop told of last is not over."""
        texts = self._told_of_approach(look.left_s, now_us)
        if look.blind and not self._blind:
            texts.append((Severity.WARNING, "Sounder lost while the bottom closes: going slow"))
        self._blind = look.blind
        if stopping and not self._stopping:
            texts.append((Severity.WARNING, f"Shallow water ahead ({look.why}): stopping{self._way_back(state)}"))
            if look.why.startswith(_SOUNDED):
                texts.append((Severity.NOTICE, "False shoal? USER_2 forgets 20 m around the boat"))
        self._stopping = stopping or (goes_on and self._stopping)
        return texts

    def _told_of_approach(self, left_s: float | None, now_us: int) -> list[tuple[Severity, str]]:
        """Once for each: noise interrupts one now and then, and a boat that lies at the limit is told of that, not of how near it is."""
        if left_s is None or left_s > 1.5 * self._warn_s:
            self._warned = self._warned and now_us - self._closed_us < _APPROACH_US
            return []
        self._closed_us = now_us
        if not 0.0 < left_s < self._warn_s or self._warned:
            return []
        self._warned = True
        return [(Severity.WARNING, f"Bottom closing: depth limit in {left_s:.0f} s")]

    def _by_sounder(
        self,
        look: DepthLook,
        now_us: int,
        speed_mps: float,
        altitude_m: float | None,
        source: DepthInput,
        stopping_distance_fn: StoppingDistance,
    ) -> DepthLook:
        """By the closing rate that is measured, or that was when the sounder fell silent."""
        config, closing_mps = self._config, self._rate.closing_mps
        if altitude_m is not None:
            now_m = altitude_m - closing_mps * source.lag_s(now_us)
            self._lost.seen(now_us, now_m, self._rate.likely_mps, speed_mps)
            if source.repeats:
                self._before.reckon(now_us, speed_mps)
            else:
                self._before.seen(now_us, now_m, self.slope(now_us) * speed_mps, speed_mps)
            if closing_mps > 0.0:
                look = self._by_rate(now_m, closing_mps, speed_mps, stopping_distance_fn)
            return self._confirmed(look, now_us)
        reckoned = (self._before if source.is_disputed else self._lost).reckon(now_us, speed_mps)
        if reckoned is None or source.out_of_reach or config.unknown_policy == "ignore":
            return look
        look = self._by_rate(*reckoned, speed_mps, stopping_distance_fn)
        if look.left_s is None or (look.left_s > _BLIND_WARN * config.warn_s and not self._blind):
            return replace(look, left_s=None)
        slow_mps = min(config.unknown_speed_mps, look.slow_to_mps or config.unknown_speed_mps)
        return replace(look, slow_to_mps=slow_mps, why="sounder lost over a closing bottom", blind=True)

    def _by_rate(
        self, now_m: float, closing_mps: float, speed_mps: float, stopping_distance_fn: StoppingDistance
    ) -> DepthLook:
        config = self._config
        run_s = stopping_distance_fn(speed_mps) / speed_mps if speed_mps > _SLOW_MPS else 0.0
        limit_m = config.min_altitude_m + closing_mps * (run_s + config.reaction_s)
        room_m = now_m - config.min_altitude_m
        slow_mps = None
        if speed_mps > config.slow_least_mps and room_m > 0.0:
            gradient = closing_mps * config.slow_share / speed_mps
            slow_mps = slow_speed_mps(room_m, gradient, stopping_distance_fn, config.reaction_s, speed_mps)
        slow_mps = None if slow_mps is None else max(slow_mps, config.slow_least_mps)
        why = f"closing {closing_mps:.2f} m/s"
        # At rest it is the noise, the tide or the heave that closes: no approach to tell of.
        left_s = room_m / closing_mps if speed_mps > _UNDER_WAY_MPS else None
        return DepthLook(
            limit_m=limit_m, stop=now_m < limit_m, slow_to_mps=slow_mps, why=why, closing_mps=closing_mps, left_s=left_s
        )

    def _confirmed(self, look: DepthLook, now_us: int) -> DepthLook:
        """Hold a stop back for as long as waiting costs next to no water: noise goes away by then, a slope does not."""
        dt_s, self._looked_us = min((now_us - self._looked_us) * 1e-6, _WAIT_S), now_us
        if not look.stop:
            self._waited_m = max(0.0, self._waited_m - _LEAK_MPS * dt_s)
            return look
        self._waited_m += look.closing_mps * dt_s
        return look if self._waited_m + look.closing_mps * _WAIT_S >= _WAIT_M else replace(look, stop=False)

    def _by_map(
        self, look: DepthLook, grid: DepthGrid, state: EstimatedState, path_ahead: PathAhead | None, reach_m: float
    ) -> DepthLook:
        config, plane = self._config, grid.plane(state)
        if plane is None:
            return look
        for way in ways(state, path_ahead, reach_m, 0.5 * grid.pitch_m):
            ahead = sample(plane, way, self._beam_m)
            if ahead.least_m is None:
                continue
            least_m = ahead.least_m + self._map_offset_m
            # From water that the map already calls shallow, the way to deeper water must stay open.
            leaving = ahead.here_m is not None and ahead.least_m >= ahead.here_m
            look = self._known(look, least_m, "map", stop=least_m < config.min_altitude_m and not leaving)
        return look

    def _by_memory(
        self,
        look: DepthLook,
        memory: DepthMemory,
        state: EstimatedState,
        altitude_m: float | None,
        path_ahead: PathAhead | None,
        reach_m: float,
    ) -> DepthLook:
        cell_m = memory.geometry.cell_m
        around, exact = memory.plane(state, math.ceil(self._beam_m / cell_m)), memory.plane(state, 0)
        for way in ways(state, path_ahead, reach_m, cell_m):
            near = sample(around, way, 0.0)
            if near.least_m is None:
                continue
            # The cells around each place err shallow; beside a shoal that must not bar every turn away from it, but what
            # lies on the way itself does.
            stop = not self._leaving(near, altitude_m) or not self._leaving(
                sample(exact, way, self._beam_m), altitude_m
            )
            look = self._known(look, near.least_m + self._datum_offset_m, _SOUNDED, stop=stop)
        return look

    def _leaving(self, ahead: Ahead, altitude_m: float | None) -> bool:
        """Whether the way gets no worse than it is here, on a shoal that is measured or remembered."""
        config = self._config
        if ahead.least_m is None:
            return True
        here = (altitude_m, None if ahead.here_m is None else ahead.here_m + self._datum_offset_m)
        here_m = min((known_m for known_m in here if known_m is not None), default=math.inf)
        return here_m < config.min_altitude_m and ahead.least_m + self._datum_offset_m >= here_m - _NO_WORSE_M

    @staticmethod
    def _known(look: DepthLook, least_m: float, source: str, *, stop: bool) -> DepthLook:
        """Note the least altitude that is known on the way, and stop for it."""
        if look.map_least_m is None or least_m < look.map_least_m:
            look = replace(look, map_least_m=least_m)
        if stop:
            look = replace(look, stop=True, by_place=True, why=look.why if look.stop else f"{source} {least_m:.1f} m")
        return look

    def _keep_track(self, state: EstimatedState | None, altitude_m: float | None) -> None:
        """Remember where the water was good, every two metres."""
        if state is None or state.x_m is None or state.y_m is None or altitude_m is None:
            return
        if altitude_m < self._good_m:
            return
        here = NorthEast((state.x_m, state.y_m))
        if not self._good_track or math.dist(self._good_track[-1], here) >= _TRACK_M:
            self._good_track.append(here)

    def _way_back(self, state: EstimatedState | None) -> str:
        if not self._good_track or state is None or state.x_m is None or state.y_m is None:
            return ""
        north, east = self._good_track[-1][0] - state.x_m, self._good_track[-1][1] - state.y_m
        if math.hypot(north, east) < _TRACK_M:
            return ""
        bearing = math.degrees(math.atan2(east, north)) % 360.0
        return f"; good water {math.hypot(north, east):.0f} m off on {bearing:03.0f}"
