"""A sea trial as a state machine: announces each manoeuvre, sails it inside its circle, comes back to the middle between them.

It starts at half throttle and takes the whole only when a person has confirmed. A manoeuvre that is disturbed (the edge comes near, a
sensor is lost for a moment) is repeated at most twice. It never resumes by itself: whatever ends it, ends it. Nothing here reaches
an actuator: what comes out are sticks, behind which failsafe, fence, depth guard and gate stand as behind an operator's.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Final

from pydantic import Field

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.units import clamp

from ..config import Config
from .manoeuvres import QUICK, WHOLE, Manoeuvre, Sailing, Seen, longest_s, towards, words_of

_ANNOUNCED_S: Final = 5.0
_REPEATS: Final = 2
_UNCONFIRMED: Final = 0.5
_AGAIN: Final = 0.75
"""Share of the throttle at which a disturbed manoeuvre is tried again: it did not fit into the circle."""
_BACK_THROTTLE: Final = 0.4
_MIDDLE: Final = 0.35
"""Share of the radius within which a manoeuvre may begin."""
_LOOK_S: Final = 2.0
"""The edge is near when the vessel would be there in this time, besides its way to stop."""
_FARTHER: Final = 1.5
"""The way to stop is taken so much longer than the file says: that the file is not right is why the trial is held."""
_INWARD: Final = 1.0
"""Throttle by which the way towards the edge is taken off."""
_ACROSS: Final = 0.3
"""Cosine between bow and edge below which neither ahead nor astern helps: the bow is turned first."""
_LEAST_HELM: Final = 0.3
"""More helm would leave too little of the thrust for the way back."""
_MARGIN_M: Final = 4.0
_BLIND_S: Final = 1.0
_LEAST_RADIUS_M: Final = 25.0
_BACK_LONGEST_S: Final = 180.0


class TrialConfig(Config):
    """What a person says of a trial."""

    radius_m: float = Field(80.0, ge=_LEAST_RADIUS_M, le=500.0)
    """The circle around where it begins; nothing of it is sailed outside."""
    quick: bool = False
    """About 8 minutes instead of 20."""


class Told(enum.Enum):
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
    told: Told
    texts: tuple[str, ...] = ()
    home: bool = False
    """Between two manoeuvres: whoever has a law of its own may bring the vessel to the middle by it, better than these sticks do."""


class Trial:
    """One trial, valid where and when it was begun. ``step`` once per tick."""

    def __init__(self, config: TrialConfig, start: EstimatedState) -> None:
        """``start`` holds position and heading: the circle lies around it, the first run goes along its heading."""
        assert start.x_m is not None
        assert start.y_m is not None
        self.config = config
        self.centre = (start.x_m, start.y_m)
        self.manoeuvres: tuple[tuple[Manoeuvre, ...], ...] = QUICK if config.quick else WHOLE
        self.confirmed = False
        self._heading = start.psi_rad or 0.0
        self._next, self._part, self._repeats = 0, 0, 0
        self._phase, self._since_us = _Phase.BACK, start.t_us
        self._sailing: Sailing | None = None
        self._seen_us = self._stepped_us = start.t_us
        self._texts: list[str] = []
        self._told = Told.RUNNING
        self.skipped: list[str] = []
        """Manoeuvres that were disturbed too often."""

    def confirm(self) -> None:
        """A person saw the first manoeuvres and allows the whole throttle."""
        if not self.confirmed:
            self.confirmed = True
            self._texts.append("Trial: whole throttle allowed")

    def end(self, why: str) -> tuple[str, ...]:
        """End it, for good; return what is still to be said."""
        self._finish(why)
        texts, self._texts = tuple(self._texts), []
        return texts

    def _finish(self, why: str) -> None:
        if self._told is Told.RUNNING:
            self._told = Told.ENDED
            self._texts.append(f"Trial ended: {why}; {self._next} of {len(self.manoeuvres)} manoeuvres done")

    @property
    def progress(self) -> tuple[int, int]:
        """Manoeuvres done, and of how many."""
        return self._next, len(self.manoeuvres)

    def step(self, now_us: int, state: EstimatedState, stopping_m: float) -> TrialOutput:
        """Return what to do now. ``stopping_m``: the way that the vessel makes from its present speed to rest."""
        sticks = (0.0, 0.0)
        if (now_us - self._stepped_us) * 1e-6 > _BLIND_S:
            self._finish("interrupted; a trial never goes on by itself")
        self._stepped_us = now_us
        if self._told is Told.RUNNING:
            sticks = self._run(now_us, state, stopping_m)
        if self._told is not Told.RUNNING:
            sticks = (0.0, 0.0)
        texts, self._texts = tuple(self._texts), []
        home = self._told is Told.RUNNING and self._phase is _Phase.BACK
        return TrialOutput(*sticks, self._told, texts, home)

    def _run(self, now_us: int, state: EstimatedState, stopping_m: float) -> tuple[float, float]:
        if state.x_m is None or state.y_m is None or state.psi_rad is None or state.sog_mps is None:
            if (now_us - self._seen_us) * 1e-6 > _BLIND_S:
                self._finish("position or heading lost")
            return 0.0, 0.0
        self._seen_us = now_us
        away_m = math.hypot(state.x_m - self.centre[0], state.y_m - self.centre[1])
        if away_m > self.config.radius_m:
            self._finish("the vessel is outside its circle")
            return 0.0, 0.0
        near = self._edge_near(state, away_m, stopping_m)
        if self._phase is _Phase.SAILING:
            if near:
                self._disturbed(now_us, "the edge of the circle is near")
            else:
                return self._sail(now_us, state)
        if near:  # the way off first, then back
            return self._inward(state)
        if self._phase is _Phase.ANNOUNCED:
            if (now_us - self._since_us) * 1e-6 < _ANNOUNCED_S:
                return 0.0, 0.0
            self._enter(_Phase.SAILING, now_us)
            self._begin(now_us, 0)
            return self._sail(now_us, state)
        return self._come_back(now_us, state, away_m)

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
        if self._next == len(self.manoeuvres):
            self._told = Told.DONE
            skipped = f", {len(self.skipped)} left out" if self.skipped else ""
            self._texts.append(f"Trial done{skipped}: fit it with companion tune vessel")
            return
        self._enter(_Phase.BACK, now_us)

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

    def _come_back(self, now_us: int, state: EstimatedState, away_m: float) -> tuple[float, float]:
        """Towards the middle; from there the next run goes where most room is, against the one before."""
        assert state.x_m is not None
        assert state.y_m is not None
        assert state.psi_rad is not None
        if (now_us - self._since_us) * 1e-6 > _BACK_LONGEST_S:
            self._finish("the middle of the circle is not reached: current, wind or thrust")
            return 0.0, 0.0
        home = math.atan2(self.centre[1] - state.y_m, self.centre[0] - state.x_m)
        if self._next > 0 and away_m > _MIDDLE * self.config.radius_m:
            helm = towards(home, state.psi_rad, state.r_radps or 0.0)
            return _BACK_THROTTLE * max(0.3, 1.0 - 1.5 * abs(helm)), helm
        # straight on through the middle: the far edge is furthest there
        self._heading = home if away_m > 0.15 * self.config.radius_m else state.psi_rad
        self._enter(_Phase.ANNOUNCED, now_us)
        manoeuvre = self.manoeuvres[self._next]
        left_s = math.fsum(longest_s(m) for group in self.manoeuvres[self._next :] for m in group)
        self._texts.append(
            f"Trial {self._next + 1}/{len(self.manoeuvres)} in {_ANNOUNCED_S:.0f} s: {words_of(manoeuvre)}"
            f"{'' if self.confirmed else ' (half throttle until confirmed)'}; {left_s / 60.0:.0f} min left at most"
        )
        return 0.0, 0.0

    def _inward(self, state: EstimatedState) -> tuple[float, float]:
        """Thrust away from the edge, whichever end of the vessel points there."""
        assert state.x_m is not None
        assert state.y_m is not None
        assert state.psi_rad is not None
        home = math.atan2(self.centre[1] - state.y_m, self.centre[0] - state.x_m)
        ahead = math.cos(home - state.psi_rad)
        helm = towards(home, state.psi_rad, state.r_radps or 0.0)
        if abs(ahead) < _ACROSS:
            return _INWARD * _ACROSS, helm
        helm = clamp(helm, -_LEAST_HELM, _LEAST_HELM)
        return (_INWARD, helm) if ahead > 0.0 else (-_INWARD, 0.0)

    def _edge_near(self, state: EstimatedState, away_m: float, stopping_m: float) -> bool:
        """Whether the vessel could not stop before the edge if it went on for a moment."""
        assert state.x_m is not None
        assert state.y_m is not None
        speed = state.sog_mps or 0.0
        if speed < 0.1 or away_m < 0.1:
            return False
        north, east = state.vx_mps or 0.0, state.vy_mps or 0.0
        outward = ((state.x_m - self.centre[0]) * north + (state.y_m - self.centre[1]) * east) / (away_m * speed)
        if outward <= 0.0:
            return False
        return away_m + outward * (_FARTHER * stopping_m + speed * _LOOK_S) > self.config.radius_m - _MARGIN_M

    def _enter(self, phase: _Phase, now_us: int) -> None:
        self._phase, self._since_us = phase, now_us
