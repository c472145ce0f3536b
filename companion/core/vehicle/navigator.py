"""Modes: what each one makes the vessel do, what it needs to be entered, and what ends it.

The result of a mode is an *intent*: a leg to sail, a heading to steer, sticks to follow, or nothing (neutral). HOLD
keeps station where it was entered and becomes neutral without a position. Streams time out; commands stand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.messages import EstimatedState, Goto, Loiter, Mode, PlanState, Severity
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.requests import GuidedHeading, GuidedTarget, ManualInput, Orbit, Reposition
from mavlink_bridge.language.trials import NO_TRIAL, SeaTrial

from ..config import Config, param
from ..guide.leg import GuidanceReport, Leg
from ..trial import Trial, TrialArea, TrialConfig, TrialStanding
from .mission import Mission

_MANUAL: Final = Mode.MANUAL
_AUTO: Final = Mode.AUTO
_RTL: Final = Mode.RTL
_GUIDED: Final = Mode.GUIDED
_ACTIVE: Final = PlanState.ACTIVE
_UNDER_WAY: Final = (PlanState.ACTIVE, PlanState.COMPLETE)
_FOLLOW_M: Final = 6.0
"""A streamed position that moves within this of a vessel that keeps station is followed by station keeping."""
_NOWHERE: Final = "No home or rally point to return to any more: the boat stays here"


class ModeConfig(Config):
    """What a mode sails by when nothing else is said."""

    return_speed_mps: float = param(
        0.0, "RTL_SPEED", "Speed of the return; 0 = cruise speed", unit="m/s", ge=0.0, le=20.0
    )


@dataclass(frozen=True, slots=True)
class Steer:
    """Steer a heading (or course) at a speed, without a path."""

    psi_rad: float
    speed_mps: float
    course: bool = False


@dataclass(frozen=True, slots=True)
class Sticks:
    """Follow an operator's sticks: surge and yaw, each -1...1."""

    surge: float
    yaw: float


@dataclass(frozen=True, slots=True)
class Measured:
    """Follow a sea trial's sticks: the vessel's own, behind which depth guard, fence and failsafes stand as behind a leg."""

    surge: float
    yaw: float
    rudders_alone: bool = False


Intent = Leg | Steer | Sticks | Measured | None


class Navigator:
    """The mode machine. ``enter`` refuses with a reason and then changes nothing."""

    def __init__(self, config: ModeConfig, mission: Mission, manual_timeout_s: float) -> None:
        """``manual_timeout_s``: sticks older than this are neutral; the failsafe stops at the same age."""
        self.configure(config, manual_timeout_s)
        self.mission = mission
        self.mode = Mode.HOLD
        self._generation = -1
        self._leg: Leg | None = None
        self._hold: LatLon | None = None
        self._returns_by: object = None
        """What the place of a return was chosen from."""
        self._steer: Steer | None = None
        self._steer_us: int | None = None
        self._sticks: ManualInput | None = None
        self._sticks_us = self.awaited_us = 0
        self._speed_mps: float | None = None
        self._texts: list[tuple[Severity, str]] = []
        self.trial: Trial | None = None
        """The one under way, or over and still keeping the vessel about its middle."""
        self._middle: Leg | None = None
        self.stopping_m: Callable[[float], float] = abs
        """Way from a speed to rest, m; the vehicle knows a better one."""
        self.turns_at_rest, self.turns_away = True, False
        """Whether the hull turns on the spot; the vehicle knows."""

    def configure(self, config: ModeConfig, manual_timeout_s: float) -> None:
        """Take new settings."""
        self.config, self._manual_timeout_s = config, manual_timeout_s

    def drain_texts(self) -> tuple[tuple[Severity, str], ...]:
        if not self._texts:
            return ()
        texts, self._texts = tuple(self._texts), []
        return texts

    def enter(self, mode: Mode, state: EstimatedState) -> str:
        """Change mode. Return an empty string, or why not (and then nothing has changed)."""
        refusal = self._refusal(mode, state)
        if refusal:
            return refusal
        if mode is Mode.AUTO and self.mode is Mode.AUTO and self.mission.state in _UNDER_WAY:
            return ""  # asked again, a plan goes on where it is: a repeated order must not begin its loiter anew
        if self.mode is Mode.AUTO and mode is not Mode.AUTO:
            self.mission.pause()
        self.end_trial(f"{mode.value} ordered")
        if mode is Mode.MANUAL and self.mode is not mode:
            self.await_sticks(state.t_us)
        self.mode = mode
        self._leg = self._steer = self._steer_us = None
        if mode is Mode.AUTO:
            self._hold = None
            self.mission.resume()
        elif mode is Mode.RTL:
            self.mission.leave()
            self._speed_mps = None  # what an earlier guided order asked for says nothing of the way home
            self._return(state)
        elif mode is Mode.CIRCLE:
            self._sail(Loiter(-1, *_here(state)))
        else:
            self._hold = _here(state) if state.position_valid else None
        return ""

    def reposition(self, request: Reposition, state: EstimatedState) -> str:
        """Go to a point and stay there; a radius makes the stay a circle. Return a refusal or an empty string."""
        if not state.position_valid and request.lat_rad is None:
            return "no position: cannot hold here"
        target = (
            _here(state) if request.lat_rad is None or request.lon_rad is None else (request.lat_rad, request.lon_rad)
        )
        refusal = self._switch(Mode.GUIDED, state)
        if refusal:
            return refusal
        self._speed_mps = request.speed_mps
        if request.radius_m:
            self._sail(Loiter(-1, *target, figure=Circle(radius_m=request.radius_m)))
        elif request.lat_rad is None:
            self._sail(Loiter(-1, *target, figure=Hover()))
        else:
            self._sail(Goto(-1, *target, leg_from_here=True))
        return ""

    def orbit(self, request: Orbit, state: EstimatedState) -> str:
        """Loiter at once. Return a refusal or an empty string."""
        refusal = self._switch(Mode.CIRCLE, state)
        if refusal:
            return refusal
        point = (
            _here(state) if request.lat_rad is None or request.lon_rad is None else (request.lat_rad, request.lon_rad)
        )
        self._speed_mps = request.speed_mps
        self._sail(Loiter(-1, *point, figure=request.figure, turns=request.turns))
        return ""

    def steer(self, request: GuidedHeading, speed_mps: float, state: EstimatedState, now_us: int) -> str:
        """Steer a heading. A streamed one needs GUIDED already; a command enters it."""
        if self.mode is not Mode.GUIDED:
            if request.stream:
                return "not in Guided mode"
            refusal = self._switch(Mode.GUIDED, state)
            if refusal:
                return refusal
        if not state.heading_valid:
            return "no heading"
        psi_rad = request.psi_rad
        if psi_rad is None:
            assert state.psi_rad is not None
            psi_rad = state.psi_rad if self._steer is None or self._steer.course else self._steer.psi_rad
        self.end_trial("another order")
        self._leg = None
        self._steer = Steer(psi_rad, speed_mps, request.course)
        self._steer_us = now_us if request.stream else None
        return ""

    def target(self, request: GuidedTarget, state: EstimatedState, now_us: int) -> str:
        """Follow a streamed position. One that has been reached is kept like any other; it moves the anchor while it moves nearby."""
        if self.mode is not Mode.GUIDED:
            return "not in Guided mode"
        if not state.position_valid:
            return "no position"
        self._steer = None
        self._speed_mps = request.speed_mps
        point, old = (request.lat_rad, request.lon_rad), None if self._leg is None else self._leg.maneuver
        stays = isinstance(old, Loiter) and isinstance(old.figure, Hover)
        if old is None or not (stays or isinstance(old, Goto)) or point != (old.lat_rad, old.lon_rad):
            near = stays and inverse(*_here(state), *point)[0] < _FOLLOW_M
            self._sail(Loiter(-1, *point, figure=Hover()) if near else Goto(-1, *point, leg_from_here=True))
        self._steer_us = now_us
        return ""

    def begin_trial(self, request: SeaTrial, state: EstimatedState, area: TrialArea, turn_s: float) -> str:
        """Begin a sea trial here; ``turn_s`` is the fence's. Return a refusal or an empty string."""
        refusal = self.enter(Mode.GUIDED, state)
        if not refusal:
            self._generation -= 1
            self._middle = Leg(self._generation, Loiter(-1, *_here(state), figure=Hover()), None, None, self.speed_mps)
            config = TrialConfig(radius_m=request.radius_m, quick=request.quick, turn_s=turn_s)
            self.trial = Trial(config, state, area, turns_at_rest=self.turns_at_rest, turns_away=self.turns_away)
        return refusal

    @property
    def on_trial(self) -> bool:
        """Whether a sea trial is under way."""
        return self.trial is not None and self.trial.told is TrialStanding.RUNNING

    def confirm_trial(self) -> str:
        """A person allows the whole throttle. Return a refusal or an empty string."""
        if self.trial is None or self.trial.told is not TrialStanding.RUNNING:
            return NO_TRIAL
        self.trial.confirm()
        return ""

    def stop_trial(self) -> str:
        """A person ends a sea trial, or what keeps the vessel about the middle after one. Return a refusal or an empty string."""
        if self.trial is None:
            return NO_TRIAL
        self.end_trial("ordered")
        return ""

    def tell_trial(self) -> str:
        """Say how a sea trial stands. Return a refusal or an empty string."""
        if self.trial is None:
            return NO_TRIAL
        self._texts.append((Severity.NOTICE, self.trial.standing))
        return ""

    def abandon_trial(self, why: str, *, at_next: bool = False) -> None:
        """End a sea trial without an order, for good: the vessel stays about its middle. ``at_next``: before its next run."""
        if self.trial is not None and (self.trial.is_to_begin or not at_next):
            self.trial.abandon(why)

    def end_trial(self, why: str) -> None:
        """End a sea trial that is under way, for good; the vessel keeps station, or does what was ordered."""
        if self.trial is not None:
            self._texts += [(Severity.NOTICE, text) for text in self.trial.end(why)]
            self.trial, self._hold = None, None

    def _measure(self, now_us: int, state: EstimatedState, trial: Trial) -> Measured | Leg:
        """A manoeuvre's sticks, or the leg that leads to the middle between two and keeps the vessel there afterwards."""
        output = trial.step(now_us, state, self.stopping_m(state.sog_mps or 0.0))
        self._texts += [(Severity.NOTICE, text) for text in output.texts]
        self._texts += [(Severity.CRITICAL, text) for text in output.alarms]
        if output.home and self._middle is not None:
            return self._middle
        return Measured(output.surge, output.yaw, output.rudders_alone)

    def sticks(self, request: ManualInput, now_us: int) -> None:
        self._sticks, self._sticks_us = request, now_us

    def await_sticks(self, now_us: int) -> None:
        """Somebody takes the sticks: the first input may take as long as any later one, however long ago the one before let go."""
        self.awaited_us = now_us

    def stick_wait_s(self, now_us: int) -> float | None:
        """Seconds since the last stick input, or since somebody took the sticks; None when there never was one."""
        return None if self._sticks is None else (now_us - max(self._sticks_us, self.awaited_us)) * 1e-6

    def guided_age_s(self, now_us: int) -> float | None:
        """Seconds since the last streamed set-point, None when nothing is streamed."""
        return None if self._steer_us is None else (now_us - self._steer_us) * 1e-6

    def forget_hold(self) -> None:
        """Station keeping begins anew where the vessel is when it may move again."""
        leg, hold = self._leg, self._hold
        if leg is not None and (leg.maneuver.lat_rad, leg.maneuver.lon_rad) == hold:
            self._leg = None
        self._hold = None
        self.mission.take_end()

    def set_speed(self, speed_mps: float | None) -> None:
        """Take a speed for what is under way, until the next order brings its own; None returns to the default. A stream has its own."""
        self._speed_mps = speed_mps
        self.mission.set_speed(speed_mps)
        if self._steer is not None and self._steer_us is None:
            self._steer = replace(self._steer, speed_mps=self.speed_mps)

    @property
    def standing(self) -> Leg | Steer | None:
        """What was ordered and stands until the next order; None = a stream leads, or nothing."""
        return None if self._steer_us is not None else self._steer or self._leg

    @property
    def speed_mps(self) -> float:
        """The speed in force for the active leg."""
        if self.mode is _AUTO:
            return self.mission.speed_mps
        return self._speed_mps or (self.return_speed_mps if self.mode is _RTL else self.mission.config.cruise_speed_mps)

    @property
    def return_speed_mps(self) -> float:
        """The speed of a return that nobody has changed."""
        return self.config.return_speed_mps or self.mission.config.cruise_speed_mps

    def intent(self, now_us: int, state: EstimatedState) -> Intent:
        """Return what the mode wants done in this tick."""
        mode = self.mode
        if mode is _MANUAL:
            return self._manual(now_us)
        if mode is _AUTO:
            leg = self.mission.active(now_us, state)
            if leg is None:
                return self._station(state)
            self._hold = None  # where an earlier plan ended
            return leg
        if self.trial is not None:
            return self._measure(now_us, state, self.trial)
        if self._steer is not None and mode is _GUIDED:
            return self._steer
        if mode is _RTL:
            self._look_where_to(state)
        return self._leg or self._station(state)

    def advance(self, now_us: int, state: EstimatedState, report: GuidanceReport) -> None:
        """Take guidance's report: the plan moves on, a guided go-to ends in station keeping."""
        if self.mode is _AUTO:
            self.mission.advance(now_us, state, report)
            return
        leg = self._leg
        if leg is None:
            return
        if isinstance(leg.maneuver, Goto) and report.arrived:
            self._sail(Loiter(-1, leg.maneuver.lat_rad, leg.maneuver.lon_rad, figure=Hover()))
        elif isinstance(leg.maneuver, Loiter) and leg.maneuver.turns is not None and report.turns >= leg.maneuver.turns:
            self._leg = None
            self._hold = _here(state) if state.position_valid else None

    def _refusal(self, mode: Mode, state: EstimatedState) -> str:
        if mode in (Mode.MANUAL, Mode.HOLD):
            return ""
        if not state.position_valid:
            return f"{mode.value} needs a position"
        if mode is Mode.AUTO and not self.mission.total:
            return "no plan is loaded"
        if mode is Mode.RTL and self.mission.havens.nearest(state) is None:
            return "no home or rally point is known"
        return ""

    def _switch(self, mode: Mode, state: EstimatedState) -> str:
        return "" if self.mode is mode else self.enter(mode, state)

    def _return(self, state: EstimatedState) -> None:
        """Choose where to; a place to which the vessel is under way already is neither told nor begun again."""
        havens, old = self.mission.havens, None if self._leg is None else self._leg.maneuver
        self._returns_by = havens.key
        haven = havens.choose(state, self.speed_mps)
        if haven is None:
            self._texts.append((Severity.WARNING, _NOWHERE))
            self._leg, self._hold = None, _here(state)
        elif old is None or haven.point != (old.lat_rad, old.lon_rad):
            self._texts.append((Severity.NOTICE, f"Return to {haven.told}"))
            self._sail(Goto(-1, *haven.point, leg_from_here=True))

    def _look_where_to(self, state: EstimatedState) -> None:
        """Choose anew when home, rally points or fence have changed on the way; a vessel that has come to a place stays there."""
        is_under_way = self._leg is not None and isinstance(self._leg.maneuver, Goto)
        if is_under_way and state.position_valid and self._returns_by != self.mission.havens.key:
            self._return(state)

    def _sail(self, maneuver: Goto | Loiter) -> None:
        self.end_trial("another order")
        self._generation -= 1
        self._steer = self._steer_us = None
        self._leg = Leg(self._generation, maneuver, None, None, self.speed_mps)

    def _station(self, state: EstimatedState) -> Leg | None:
        """Station keeping where it began: in HOLD, when a stream has ended, and after a plan; that one's last point is where it ended."""
        if self.mode is _AUTO and self.mission.state is _ACTIVE:
            return None
        if self._hold is None and state.position_valid:
            self._hold = (self.mission.take_end() if self.mode is _AUTO else None) or _here(state)
        if self._hold is None:
            return None
        leg = self._leg
        if leg is None or (leg.maneuver.lat_rad, leg.maneuver.lon_rad) != self._hold:
            self._sail(Loiter(-1, *self._hold, figure=Hover()))
        return self._leg

    def _manual(self, now_us: int) -> Sticks | None:
        if self._sticks is None or (now_us - self._sticks_us) * 1e-6 > self._manual_timeout_s:
            return None
        return Sticks(self._sticks.surge, self._sticks.yaw)


def _here(state: EstimatedState) -> LatLon:
    assert state.lat_rad is not None
    assert state.lon_rad is not None
    return LatLon((state.lat_rad, state.lon_rad))
