"""The plan executor: which manoeuvre is active, when it is done, what comes next.

It knows items, jumps, speeds, durations and turns; it does not steer. ``active`` hands guidance a ``Leg``; ``advance``
takes guidance's report back. A loiter's duration counts from reaching its path, and an approach that never gets there
is ended by a cap, so that no plan hangs for ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.figures import Hover
from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.messages import (
    ChangeSpeed,
    Delay,
    EstimatedState,
    FenceEnable,
    Goto,
    Jump,
    Loiter,
    Maneuver,
    Noted,
    PlanSpecification,
    PlanState,
    ReturnHome,
    SetHome,
    Severity,
)
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.units import wrap_pi

from ..guide.leg import GuidanceReport, Leg
from .haven import THERE_M, Havens
from .plan_reach import MissionConfig

Effect = SetHome | FenceEnable | Noted
"""Items that act on the vessel at once instead of being sailed."""
News = tuple[tuple[int, ...], tuple[Effect, ...]]
"""Items reached, effects due."""
_NOTHING: Final[News] = ((), ())
_ACTIVE: Final = PlanState.ACTIVE
_DAY_S: Final = 86_400.0
"""Times of day come again after so long."""
_MISSED_S: Final = 3_600.0
"""A time of day that is past by less was meant for today; by more, for tomorrow."""
_EXIT_RAD: Final = 0.15
"""A circle is left where it points to the next item within 9 degrees: the corner that is left over is sailed in a moment."""
_STAY_US: Final = 1_000_000
"""A loop that takes less has no way: it is station keeping, stays so long each time round, and fills no link with its items."""
BEGINS_ANEW: Final = "the new plan begins at its first item: what comes before the current one is another"
GOES_ON: Final = "the new plan goes on at its current item, which is another: its leg begins here"
ANOTHER: Final = "the new plan begins at its first item: the place in the old one was left"


class Mission:
    """Executes one plan. Time and position come as arguments; nothing here raises on a plan's contents."""

    def __init__(self, config: MissionConfig, havens: Havens | None = None) -> None:
        self.config = config
        self.havens = havens or Havens(config)
        self.plan = PlanSpecification()
        self.total = 0
        """Items of the plan."""
        self.state = PlanState.NO_MISSION
        self.seq = 0
        self.is_changed = False
        """Whether the current item was changed since it was begun: that it was near then says nothing of where it is now."""
        self._is_left = False
        """Whether the vessel has left its place in the plan since it was begun; another plan then begins at its first item."""
        self.utc_s_of_day: float | None = None
        """Set by the vessel each tick while UTC is known; delays until a time of day wait for it."""
        self._last: int | None = None
        self._leg: Leg | None = None
        self._generation = 0
        self._jumps: dict[int, int] = {}
        self._lap_us: dict[int, int] = {}
        """When each jump was last taken, less the stays until then: what its loop takes of its own."""
        self._stayed_us = 0
        self._stay_us = 0
        """How long the item that comes next, then the one that is sailed, stays at least."""
        self._speed_mps: float | None = None
        self._begun_us: int | None = None
        self._until_us: int | None = None
        """When a delay until a time of day is over; None until UTC is known."""
        self._over_turns: float | None = None
        """Laps at which a loiter was over that leaves toward the next item."""
        self._limit_s: float | None = None
        self._on_path_us: int | None = None
        self._arrived_us: int | None = None
        self._sailed_to: LatLon | None = None
        self._returned_to: LatLon | None = None
        """Place that was told last."""
        self._returns_by: object = None
        """What the place was chosen from, on a way home."""
        self._ended_at: LatLon | None = None
        """Point of the last item, when it was one to stay at and was reached."""
        self._reached: list[int] = []
        self._effects: list[Effect] = []
        self._texts: list[tuple[Severity, str]] = []

    def configure(self, config: MissionConfig) -> None:
        """Take new settings; they count from the next leg on."""
        self.config = self.havens.config = config

    @property
    def home(self) -> LatLon | None:
        """Home, rad; None = not known."""
        return self.havens.home

    @home.setter
    def home(self, place: LatLon | None) -> None:
        self.havens.home = place

    def load(self, plan: PlanSpecification, *, is_armed: bool = True) -> bool:
        """Replace the plan. One that is under way or paused goes on where it is if that still means the same, else from the start.

        Disarmed, or where the place was left, only the same plan goes on. Returns whether it goes on.
        """
        old, seq = self.plan, self.seq
        was_begun = self.state in (PlanState.ACTIVE, PlanState.PAUSED)
        in_place = is_armed and not self._is_left
        means_same = plan.goes_on_from(old, seq) if in_place else plan.maneuvers == old.maneuvers
        goes_on = was_begun and bool(plan.maneuvers) and means_same
        self.plan, self.total = plan, len(plan.maneuvers)
        self._last = None
        if not plan.maneuvers:
            self._forget(PlanState.NO_MISSION)
        elif not goes_on:
            self._forget(PlanState.ACTIVE if self.state is PlanState.ACTIVE else PlanState.NOT_STARTED)
            if was_begun and seq:
                self._texts.append((Severity.WARNING, BEGINS_ANEW) if in_place else (Severity.NOTICE, ANOTHER))
        else:
            self._jumps = {number: done for number, done in self._jumps.items() if plan.has_same(old, number)}
            if seq < self.total and not plan.has_same(old, seq):
                self._leg, self._sailed_to, self.is_changed = None, None, True
                self._texts.append((Severity.WARNING, GOES_ON))
            self._look_onward()
        return goes_on

    def start(self, first: int | None = None, last: int | None = None) -> str:
        """Run from ``first`` (None: from the current item; a plan that runs goes on as it is) to ``last`` (None: the end).

        Return an empty string or why not.
        """
        if not self.plan.maneuvers:
            return "no plan is loaded"
        if first is not None and not 0 <= first < self.total:
            return f"item {first} is outside the plan's {self.total} items"
        if last is not None and not (first or 0) <= last < self.total:
            return f"last item {last} is outside the plan"
        if self.state is PlanState.COMPLETE and first is None:
            first = 0
        if first is not None:
            self._forget(PlanState.ACTIVE)
            self.seq = first
        self._last, self._is_left = last, False
        if self.state is PlanState.ACTIVE:
            self._look_onward()
        else:
            self.state, self._leg = PlanState.ACTIVE, None
        return ""

    def resume(self) -> None:
        """Go on where the plan stood, to the last item that was asked for; a complete one begins again."""
        self.start(last=self._last)

    def _look_onward(self) -> None:
        """Begin a leg again whose next one has changed: how it ends belongs to what follows."""
        leg = self._leg
        if leg is not None and isinstance(leg.maneuver, Goto) and leg.following != self._following():
            self._leg = None

    def pause(self) -> None:
        if self.state is PlanState.ACTIVE:
            self.state = PlanState.PAUSED
            self._leg = self._sailed_to = None

    def leave(self) -> None:
        """The vessel goes home, or is armed anew: its place means something to this plan only, until the plan goes on."""
        self._is_left = True

    def set_current(self, seq: int, *, reset: bool = False) -> str:
        """Make ``seq`` the current item. Return an empty string or why not."""
        if not 0 <= seq < self.total:
            return f"item {seq} is outside the plan's {self.total} items"
        if reset or self.state is PlanState.COMPLETE:
            self._jumps.clear()
            if self.state is PlanState.COMPLETE:
                self.state = PlanState.NOT_STARTED
        if self._last is not None and seq > self._last:
            self._last = None
        self.seq, self.is_changed = seq, False
        self._leg = self._sailed_to = None
        self._stay_us = 0
        return ""

    @property
    def speed_mps(self) -> float:
        """The speed in force: the active item's own, else the plan's or the operator's, else cruise speed."""
        own = self._leg.maneuver.speed_mps if self._leg is not None else None
        return own or self._speed_mps or self.config.cruise_speed_mps

    def set_speed(self, speed_mps: float | None) -> None:
        """Change the speed until the plan's next speed item; None returns to cruise speed."""
        self._speed_mps = speed_mps

    def active(self, now_us: int, state: EstimatedState) -> Leg | None:
        """Return the leg to sail now, or None when the plan is not running, is done, or has no position to start from."""
        if self.state is not _ACTIVE:
            return None
        if self._returns_by is not None and state.position_valid and self._returns_by != self.havens.key:
            self._leg = self._sailed_to = None
        if self._leg is None and state.position_valid:
            self._next_leg(now_us, state)
        return self._leg

    def advance(self, now_us: int, state: EstimatedState, report: GuidanceReport) -> None:
        """Take guidance's report on the active leg; finish the item when its condition holds."""
        leg = self._leg
        if leg is None or self.state is not _ACTIVE:
            return
        if self._on_path_us is None and report.on_path:
            self._on_path_us = now_us
        if self._arrived_us is None and report.arrived:
            self._arrived_us = now_us
        if self._done(now_us, state, leg, report):
            self._finish(leg)

    def take_end(self) -> LatLon | None:
        """Return and forget the point at which a plan that has ended is to stay; None where its last item named none that was reached."""
        point, self._ended_at = self._ended_at, None
        return point if self.state is PlanState.COMPLETE else None

    def drain(self) -> News:
        """Return and forget the items reached and the effects due since the last call."""
        if not (self._reached or self._effects):
            return _NOTHING
        result = tuple(self._reached), tuple(self._effects)
        self._reached, self._effects = [], []
        return result

    def drain_texts(self) -> Sequence[tuple[Severity, str]]:
        """Return and forget the texts for the operator since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def _forget(self, state: PlanState) -> None:
        self.state = state
        self.seq, self.is_changed = 0, False
        self._leg = None
        self._jumps.clear()
        self._lap_us.clear()
        self._stay_us = 0
        self._speed_mps = self._sailed_to = self._returned_to = None

    def _next_leg(self, now_us: int, state: EstimatedState) -> None:
        """Work off items that are not sailed until one is; a plan of jumps alone ends."""
        for _ in range(4 * self.total + 4):
            if self.seq >= self.total or (self._last is not None and self.seq > self._last):
                self._complete()
                return
            item = self.plan.maneuvers[self.seq]
            sailed = self._sailed(item, state)
            if sailed is not None:
                self._begin(now_us, state, sailed)
                return
            self._apply(now_us, item)
        self._complete()

    def _apply(self, now_us: int, item: Maneuver) -> None:
        if isinstance(item, Jump):
            done = self._jumps.get(item.seq, 0)
            if item.repeats < 0 or done < item.repeats:
                self._jumps[item.seq] = done + 1
                self.seq = item.target_seq
                self._look_for_way(now_us, item.seq)
                return
            self._jumps[item.seq] = 0
        elif isinstance(item, ChangeSpeed):
            self._speed_mps = item.speed_mps
        elif isinstance(item, ReturnHome):
            self._texts.append((Severity.WARNING, f"item {item.seq}: no home or rally point to return to, passed over"))
        elif isinstance(item, SetHome | FenceEnable | Noted):
            self._effects.append(item)
        self._reached.append(self.seq)
        self.seq += 1

    def _sailed(self, item: Maneuver, state: EstimatedState) -> Goto | Loiter | None:
        if isinstance(item, Goto | Loiter):
            return item
        here = None if state.lat_rad is None or state.lon_rad is None else LatLon((state.lat_rad, state.lon_rad))
        if isinstance(item, Delay) and here is not None:
            lat, lon = self._sailed_to or here
            return Loiter(item.seq, lat, lon, figure=Hover(), duration_s=item.duration_s)
        if isinstance(item, ReturnHome):
            haven = self.havens.choose(state, self.speed_mps, keeps=False)
            if haven is not None:
                if haven.point != self._returned_to or not (self._stay_us or haven.away_m < THERE_M):
                    self._texts.append((Severity.NOTICE, f"item {item.seq}: return to {haven.told}"))
                self._returned_to = haven.point
                return Goto(item.seq, *haven.point)
        return None

    def _look_for_way(self, now_us: int, jump: int) -> None:
        """A jump is taken: where its loop had no way since the last time, the vessel stays at the next item."""
        lap_us, before_us = now_us - self._stayed_us, self._lap_us.get(jump)
        self._lap_us[jump] = lap_us
        if before_us is not None and lap_us - before_us < _STAY_US:
            self._stay_us = _STAY_US

    def _begin(self, now_us: int, state: EstimatedState, maneuver: Goto | Loiter) -> None:
        self._generation += 1
        if isinstance(maneuver, Goto) and self._stay_us:
            maneuver = replace(maneuver, hold_s=max(maneuver.hold_s, self._stay_us * 1e-6))
        speed = maneuver.speed_mps or self.speed_mps
        self._leg = Leg(self._generation, maneuver, self._sailed_to, self._following(), speed)
        self._begun_us, self._on_path_us, self._arrived_us = now_us, None, None
        self._until_us = self._over_turns = None
        self._returns_by = self.havens.key if isinstance(self.plan.maneuvers[self.seq], ReturnHome) else None
        assert state.lat_rad is not None
        assert state.lon_rad is not None
        distance_m, _ = inverse(state.lat_rad, state.lon_rad, maneuver.lat_rad, maneuver.lon_rad)
        self._limit_s = self.config.approach_factor * distance_m / speed + self.config.approach_extra_s

    def _following(self) -> Goto | Loiter | None:
        if self._last is not None and self.seq >= self._last:
            return None
        for item in self.plan.maneuvers[self.seq + 1 :]:
            if isinstance(item, Goto | Loiter):
                return item
            if isinstance(item, Jump | Delay | ReturnHome):
                return None
        return None

    def _done(self, now_us: int, state: EstimatedState, leg: Leg, report: GuidanceReport) -> bool:
        item = leg.maneuver
        if isinstance(item, Goto):
            if self._arrived_us is not None:
                return now_us - self._arrived_us >= item.hold_s * 1e6
            return self._overdue(now_us, item.seq, "waypoint")
        if self._on_path_us is None:
            return self._overdue(now_us, item.seq, "loiter")
        if now_us - self._on_path_us < self._stay_us:
            return False
        delay = self.plan.maneuvers[item.seq] if item.seq < self.total else None
        if isinstance(delay, Delay) and delay.until_utc_s_of_day is not None:
            return self._waited(now_us, delay.until_utc_s_of_day)
        if not (
            (item.turns is not None and report.turns >= item.turns)
            or (item.duration_s is not None and now_us - self._on_path_us >= item.duration_s * 1e6)
        ):
            return False
        return not item.exit_toward_next or self._heads_on(state, leg, report.turns)

    def _heads_on(self, state: EstimatedState, leg: Leg, turns: float) -> bool:
        """Whether a loiter that is over has come round to the way to the next item; after one more lap it ends anyhow."""
        onward, course = leg.following, state.psi_rad if state.cog_rad is None else state.cog_rad
        if onward is None or course is None or state.lat_rad is None or state.lon_rad is None:
            return True
        if self._over_turns is None:
            self._over_turns = turns
        _, bearing = inverse(state.lat_rad, state.lon_rad, onward.lat_rad, onward.lon_rad)
        return abs(wrap_pi(bearing - course)) < _EXIT_RAD or turns - self._over_turns >= 1.0

    def _waited(self, now_us: int, until_s: float) -> bool:
        """Whether a time of day has come: the next one, unless the last was missed by less than an hour."""
        if self._until_us is None and self.utc_s_of_day is not None:
            ahead_s = (until_s - self.utc_s_of_day + _MISSED_S) % _DAY_S - _MISSED_S
            self._until_us = now_us + round(ahead_s * 1e6)
        return self._until_us is not None and now_us >= self._until_us

    def _overdue(self, now_us: int, seq: int, what: str) -> bool:
        if self._begun_us is None or self._limit_s is None or now_us - self._begun_us < self._limit_s * 1e6:
            return False
        text = f"item {seq}: {what} not reached in {self._limit_s:.0f} s (APPR_FACTOR), skipped"
        self._texts.append((Severity.WARNING, text))
        return True

    def _finish(self, leg: Leg) -> None:
        item = leg.maneuver
        point = LatLon((item.lat_rad, item.lon_rad))
        self._sailed_to = point if isinstance(item, Goto) else None
        is_there = self._on_path_us is not None if isinstance(item, Loiter) else self._arrived_us is not None
        self._reached += [self.seq] if is_there else []
        goes_round = isinstance(item, Loiter) and not isinstance(item.figure, Hover)
        self._ended_at = point if is_there and not goes_round else None
        self._leg, self._returns_by, self.is_changed = None, None, False
        self._stayed_us, self._stay_us = self._stayed_us + self._stay_us, 0
        self.seq += 1

    def _complete(self) -> None:
        self.state = PlanState.COMPLETE
        self.seq = max(0, self.total - 1) if self._last is None else self._last
        self._last = None
        self._leg = None
        self._jumps.clear()
        self._texts.append((Severity.INFO, "plan complete"))
