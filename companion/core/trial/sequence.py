"""A sea trial as a state machine: announces each manoeuvre, sails it inside its area, comes back to the middle between them.

It starts at half throttle and takes the whole only when a person has confirmed. A manoeuvre that is disturbed (the edge comes near, a
sensor is lost for a moment) is repeated at most twice. It never resumes by itself: whatever ends it, ends it. One that ended
without an order still keeps the vessel about the middle, until the next order. Nothing here reaches an actuator: what comes out are
sticks, behind which failsafe, fence, depth guard and gate stand as behind an operator's.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Final

from pydantic import Field

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.trials import TRIAL_DONE, TRIAL_ENDED, TRIAL_RADIUS_M

from ..config import Config
from ..hull.handling import TURN_S
from .area import TrialArea
from .helm_sense import HelmSense
from .homing import MIDDLE, Homing
from .manoeuvres import NO_SPINS, Sailing, Seen, about_s, manoeuvres_of, towards, words_of

_ANNOUNCED_S: Final = 5.0
"""Time to look around and to press stop."""
_MOMENT_S: Final = 0.5
"""Of it, the last: several ticks, also of a slow computer, and the battery has recovered from the run before by then if it ever does."""
_REPEATS: Final = 2
"""What was disturbed twice more is left out."""
_UNCONFIRMED: Final = 0.5
"""Half throttle until a person has seen the boat obey."""
_AGAIN: Final = 0.75
"""Share of the throttle at which a disturbed manoeuvre is tried again: it did not fit into the area."""
_BACK_THROTTLE: Final = 0.4
"""The way back is not measured: it is made gently."""
_BLIND_S: Final = 1.0
"""A vessel that knows not where it is stops the trial within this."""
_COMPASS_S: Final = 1.2
"""A heading may be so old, one of a slow compass is: a course that stands in for it measures nothing, and is gone without way."""
LEAST_RADIUS_M: Final = 25.0
MOST_RADIUS_M: Final = 500.0
"""In less no steady run and its stop fit, from more the person who watches no longer sees the boat."""
_BACK_LONGEST_S: Final = 180.0
"""From the edge of the greatest area at the slowest hull's speed."""


class TrialConfig(Config):
    """What a person says of a trial."""

    radius_m: float = Field(TRIAL_RADIUS_M, ge=LEAST_RADIUS_M, le=MOST_RADIUS_M)
    """The circle around where it begins; nothing of it is sailed outside."""
    quick: bool = False
    """About 8 minutes instead of 20."""
    turn_s: float = TURN_S
    """Wind and current set a stopped vessel for so long; aboard it is what the fence is told."""


class TrialStanding(enum.Enum):
    """How a trial stands."""

    RUNNING = "running"
    DONE = "done"
    ENDED = "ended"


class _Phase(enum.Enum):
    BACK = "back"
    ANNOUNCED = "announced"
    SAILING = "sailing"


@dataclass(frozen=True, slots=True)
class TrialOutput:
    """Sticks of this tick, what is to be said, and how the trial stands."""

    surge: float
    yaw: float
    told: TrialStanding
    texts: tuple[str, ...] = ()
    alarms: tuple[str, ...] = ()
    """What calls for a person."""
    home: bool = False
    """To the middle, or about it: whoever has a law of its own may do that by it, better than these sticks do."""
    rudders_alone: bool = False
    """The helm turns the rudders and leaves the thrusters alike, where the vessel has rudders."""


class Trial:
    """One trial, valid where and when it was begun. ``step`` once per tick."""

    def __init__(
        self,
        config: TrialConfig,
        start: EstimatedState,
        area: TrialArea | None = None,
        *,
        turns_at_rest: bool = True,
        turns_away: bool = False,
    ) -> None:
        """``start`` holds position and heading: the area lies around it, the first run goes along its heading.

        ``turns_at_rest``: the hull turns on the spot; one that does not is spared the spins, which would only drift. ``turns_away``:
        left alone under way, she turns away by herself.
        """
        assert start.x_m is not None
        assert start.y_m is not None
        self.config = config
        self.area = area or TrialArea(NorthEast((start.x_m, start.y_m)), (config.radius_m,))
        self.manoeuvres = manoeuvres_of(quick=config.quick, turns_at_rest=turns_at_rest)
        self.confirmed = False
        self._heading = start.psi_rad or 0.0
        self._next, self._part, self._repeats = 0, 0, 0
        self._phase, self._since_us = _Phase.BACK, start.t_us
        self._homing = Homing(self.area, start.t_us, config.turn_s)
        self._sailing: Sailing | None = None
        self._sense = HelmSense(turns_away=turns_away)
        self._sticks = (0.0, 0.0)
        self._inward = False
        """The way towards the edge is taken off first, by the sticks: a law would turn round there at full speed."""
        self._seen_us = self._stepped_us = start.t_us
        self._alarms: list[str] = []
        self._texts: list[str] = [] if turns_at_rest else [f"Trial: {NO_SPINS}"]
        self._told = TrialStanding.RUNNING
        self._ordered = self._rests = False
        self.skipped: list[str] = []
        """Manoeuvres that were disturbed too often."""

    @property
    def told(self) -> TrialStanding:
        """How it stands."""
        return self._told

    def confirm(self) -> None:
        """A person saw the first manoeuvres and allows the whole throttle."""
        if not self.confirmed:
            self.confirmed = True
            self._texts.append("Trial: whole throttle allowed")

    def end(self, why: str) -> tuple[str, ...]:
        """End it by an order, for good: its sticks rest from now on. Return what is still to be said."""
        self.abandon(why)
        self._ordered = True
        texts, self._texts = tuple(self._texts), []
        return texts

    @property
    def is_to_begin(self) -> bool:
        """Whether the next manoeuvre begins in a moment: the thrusters have rested, and nothing of it has been asked for."""
        announced_s = (self._stepped_us - self._since_us) * 1e-6
        is_announced = self._told is TrialStanding.RUNNING and self._phase is _Phase.ANNOUNCED
        return is_announced and announced_s >= _ANNOUNCED_S - _MOMENT_S

    def abandon(self, why: str) -> None:
        """End it, for good; the vessel is still kept about the middle as long as it is stepped."""
        if self._told is TrialStanding.RUNNING:
            self._told = TrialStanding.ENDED
            self._texts.append(f"{TRIAL_ENDED}: {why}; {self._next} of {len(self.manoeuvres)} manoeuvres done")

    @property
    def progress(self) -> tuple[int, int]:
        """Manoeuvres done, and of how many."""
        return self._next, len(self.manoeuvres)

    @property
    def standing(self) -> str:
        """Say what is done, what is being done and what is left."""
        done, total = self.progress
        if self._told is not TrialStanding.RUNNING:
            return f"Trial {self._told.value}: {done} of {total} manoeuvres done{self._left_out()}"
        doing = {
            _Phase.BACK: "on the way back to the middle, next",
            _Phase.ANNOUNCED: "announced",
            _Phase.SAILING: "under way",
        }[self._phase]
        return (
            f"Trial: {done} of {total} done{self._left_out()}; {doing}: {words_of(self.manoeuvres[done])}"
            f"{self._half()}; {self._left()}"
        )

    def step(self, now_us: int, state: EstimatedState, stopping_m: float) -> TrialOutput:
        """Return what to do now. ``stopping_m``: the way that the vessel makes from its present speed to rest."""
        sticks, self._inward = (0.0, 0.0), False
        dt_s = (now_us - self._stepped_us) * 1e-6
        if dt_s > _BLIND_S:
            self.abandon("interrupted; a trial never goes on by itself")
        self._watch_helm(dt_s, state)
        self._stepped_us = now_us
        if self._told is TrialStanding.RUNNING:
            sticks = self._run(now_us, state, stopping_m)
        if self._told is not TrialStanding.RUNNING:
            sticks = self._keep(now_us, state)
        texts, self._texts = tuple(self._texts), []
        alarms, self._alarms = tuple(self._alarms), []
        back = self._told is not TrialStanding.RUNNING or self._phase is _Phase.BACK
        by_hand = back and self._homing.by_hand
        by_law = back and not (by_hand or self._inward or self._rests) and _here(state) is not None
        # while the law brings her home the sticks are not what is out
        self._sticks = (0.0, 0.0) if by_law else sticks
        return TrialOutput(
            *sticks, self._told, texts, alarms, home=by_law, rudders_alone=by_hand and self._homing.by_rudders
        )

    def _watch_helm(self, dt_s: float, state: EstimatedState) -> None:
        """A vessel that turns against her helm is neither tried nor kept: no law and no stick would bring her home."""
        surge, helm = self._sticks
        rate_radps, surge_mps, psi = state.r_radps, state.u_mps, state.psi_rad
        if rate_radps is None or surge_mps is None or psi is None:
            return
        ahead_mps = (state.current_n_mps or 0.0) * math.cos(psi) + (state.current_e_mps or 0.0) * math.sin(psi)
        self._sense.step(dt_s, surge=surge, helm=helm, r_radps=rate_radps, through_mps=surge_mps - ahead_mps)
        if self._sense.is_wrong and not self._rests:
            self.abandon("she turns against her helm")
            self._rest("Trial: leads changed over, or a rudder mirrored")

    def _rest(self, why: str) -> None:
        """Keep the vessel no longer: her sticks rest, by law and by hand, until an order."""
        self._rests = True
        self._alarms.append(f"{why}. Thrust off, she drifts: fetch her, or sail her by hand")

    def _keep(self, now_us: int, state: EstimatedState) -> tuple[float, float]:
        """It is over: look whether the law keeps the vessel about the middle, and do it by the sticks when not."""
        here = _here(state)
        if here is None or self._ordered or self._rests:
            self._homing.begin(now_us)
            return 0.0, 0.0
        if self._homing.step(now_us, state, here):
            self._texts.append("Trial: the vessel is driven off, and sailed back to the middle by the sticks")
        if self._homing.in_vain:
            self._rest("Trial: the sticks do not bring her back either")
            return 0.0, 0.0
        return self._homing.sticks(state, here) if self._homing.by_hand else (0.0, 0.0)

    def _run(self, now_us: int, state: EstimatedState, stopping_m: float) -> tuple[float, float]:
        here = _here(state)
        if here is None:
            if (now_us - self._seen_us) * 1e-6 > _BLIND_S:
                self.abandon("position or heading lost")
            return 0.0, 0.0
        self._seen_us = now_us
        if self.area.room_m(here) < 0.0:
            self.abandon("the vessel is outside its area")
            return 0.0, 0.0
        near = self._homing.edge_near(state, here, stopping_m)
        if self._phase is _Phase.SAILING:
            if near:
                self._disturbed(now_us, "the edge of the area is near")
            else:
                return self._sail(now_us, state)
        self._inward = near
        if near:
            return self._homing.inward(state, here)
        if self._phase is _Phase.ANNOUNCED:
            if (now_us - self._since_us) * 1e-6 < _ANNOUNCED_S:
                return 0.0, 0.0
            self._enter(_Phase.SAILING, now_us)
            self._begin(now_us, 0)
            return self._sail(now_us, state)
        return self._come_back(now_us, state, here)

    def _sail(self, now_us: int, state: EstimatedState) -> tuple[float, float]:
        assert self._sailing is not None
        assert state.psi_rad is not None
        t_s = (now_us - self._since_us) * 1e-6
        seen = Seen(t_s, state.psi_rad, state.r_radps or 0.0, surge_mps=state.u_mps or 0.0, heading_rad=self._heading)
        sticks = self._sailing.step(seen)
        if sticks is not None:
            return sticks
        if self._part + 1 < len(self.manoeuvres[self._next]):
            self._begin(now_us, self._part + 1)
            return self._sail(now_us, state)
        self._done(now_us)
        return 0.0, 0.0

    def _begin(self, now_us: int, part: int) -> None:
        self._part, self._since_us = part, now_us
        share = (1.0 if self.confirmed else _UNCONFIRMED) * _AGAIN**self._repeats
        self._sailing = Sailing(self.manoeuvres[self._next][part], share)

    def _done(self, now_us: int) -> None:
        self._next, self._repeats, self._sailing = self._next + 1, 0, None
        self._enter(_Phase.BACK, now_us)
        if self._next == len(self.manoeuvres):
            self._told = TrialStanding.DONE
            self._texts.append(f"{TRIAL_DONE}{self._left_out()}: fit it with companion tune vessel")

    def _disturbed(self, now_us: int, why: str) -> None:
        """The manoeuvre is given up for now, repeated at most twice."""
        name = words_of(self.manoeuvres[self._next])
        if self._repeats < _REPEATS:
            self._repeats += 1
            self._texts.append(f"Trial: {why}; {name} again")
            self._enter(_Phase.BACK, now_us)
            return
        self.skipped.append(name)
        self._texts.append(f"Trial: {why}; {name} left out")
        self._done(now_us)

    def _come_back(self, now_us: int, state: EstimatedState, here: NorthEast) -> tuple[float, float]:
        """Towards the middle; from there the next run goes where most room is, against the one before."""
        assert state.psi_rad is not None
        if (now_us - self._since_us) * 1e-6 > _BACK_LONGEST_S:
            self.abandon("the middle is not reached: current, wind or thrust")
            return 0.0, 0.0
        centre, away_m, reach_m = self.area.centre, self.area.away_m(here), self.area.reach_m(here)
        home = math.atan2(centre[1] - here[1], centre[0] - here[0])
        if self._homing.step(now_us, state, here):
            self._texts.append("Trial: the law does not bring the vessel back; the sticks do")
        if self._homing.by_hand:
            return self._homing.sticks(state, here)
        if self._next > 0 and away_m > MIDDLE * reach_m:
            helm = towards(home, state.psi_rad, state.r_radps or 0.0)
            return _BACK_THROTTLE * max(0.3, 1.0 - 1.5 * abs(helm)), helm
        # straight on through the middle: the far edge is furthest there
        self._heading = home if away_m > 0.15 * reach_m else state.psi_rad
        self._enter(_Phase.ANNOUNCED, now_us)
        done, total = self.progress
        self._texts.append(
            f"Trial {done + 1}/{total} in {_ANNOUNCED_S:.0f} s: {words_of(self.manoeuvres[done])}{self._half()}; {self._left()}"
        )
        return 0.0, 0.0

    def _half(self) -> str:
        return "" if self.confirmed else " (half throttle until confirmed)"

    def _left_out(self) -> str:
        return f", {len(self.skipped)} left out" if self.skipped else ""

    def _left(self) -> str:
        return f"about {max(1.0, about_s(self.manoeuvres[self._next :]) / 60.0):.0f} min left"

    def _enter(self, phase: _Phase, now_us: int) -> None:
        self._phase, self._since_us = phase, now_us
        if phase is _Phase.BACK:
            self._homing.begin(now_us)


def _here(state: EstimatedState) -> NorthEast | None:
    """Where the vessel is; None when too little is known to sail."""
    if state.x_m is None or state.y_m is None or state.psi_rad is None or state.sog_mps is None:
        return None
    if state.heading_age_s is None or state.heading_age_s > _COMPASS_S:
        return None
    return NorthEast((state.x_m, state.y_m))
