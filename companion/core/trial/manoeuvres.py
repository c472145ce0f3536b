"""The manoeuvres of a sea trial: what sticks each one gives, and when it is over. Pure: state and time in, sticks out.

Sticks are shares of full thrust and of full helm, as an operator's are, so that a hull's own answer is what is recorded.
Where a run is to be straight, a light hand on the helm keeps the heading. Speed runs and coasting tell drag and thrust,
zig-zags and circles damping and the Munk moment (Nomoto; IMO MSC.137(76) names the 10/10 and 20/20 zig-zag), the spin the yaw
damping at rest, rest the drift.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, assert_never

from mavlink_bridge.language.units import clamp, wrap_pi

_HELM_PER_RAD: Final = 0.9
_HELM_PER_RADPS: Final = 0.9
"""A light hand: half helm at 30 degrees off, on every hull that steers at all."""
_MOST_HELM: Final = 0.5
"""Half helm leaves the thrust that holds the speed."""
_STOPPED_MPS: Final = 0.1
"""Slower is the water's own motion."""
_SHORT_S: Final = 1.5
"""Two means of the speed, this one"""
_LONG_S: Final = 4.0
"""and this one, agree when it is steady."""
_SETTLED: Final = 0.01
"""Speeds that differ by less are one: the steady speeds are to be found within 5 %."""
_LEARNT_S: Final = 4.0
"""A settled run has told its speed after so long, and the rest of its time is saved."""
_LONGEST_S: Final = 60.0
"""No manoeuvre is waited for longer, whatever it waits for."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What a manoeuvre goes by."""

    t_s: float
    """Since it began."""
    psi_rad: float
    r_radps: float
    surge_mps: float
    """Over ground."""
    heading_rad: float
    """The heading of the run that it belongs to."""


@dataclass(frozen=True, slots=True)
class Run:
    """Straight at a throttle."""

    throttle: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Coast:
    """All stop, until the way is off."""

    seconds: float


@dataclass(frozen=True, slots=True)
class CrashStop:
    """Full astern until the way is off."""

    throttle: float


@dataclass(frozen=True, slots=True)
class ZigZag:
    """Helm over until the heading has changed by so much, then over to the other side, so many times."""

    throttle: float
    helm: float
    change_rad: float
    times: int


@dataclass(frozen=True, slots=True)
class Turn:
    """Helm held until the bow has turned by so much."""

    throttle: float
    helm: float
    turn_rad: float


Manoeuvre = Run | Coast | CrashStop | ZigZag | Turn


def words(manoeuvre: Manoeuvre) -> str:
    """Say what comes."""
    match manoeuvre:
        case Run(throttle=throttle):
            if throttle == 0.0:
                return "rest: the drift"
            return f"straight at {abs(100 * throttle):.0f} %{' astern' if throttle < 0.0 else ''}"
        case Coast():
            return "all stop, coasting"
        case CrashStop():
            return "crash stop, full astern"
        case ZigZag(change_rad=change, throttle=throttle):
            return f"zig-zag of {math.degrees(change):.0f} degrees at {100 * throttle:.0f} %"
        case Turn(throttle=throttle, helm=helm):
            side = "starboard" if helm > 0.0 else "port"
            return f"spin to {side}" if throttle == 0.0 else f"circle to {side} at {100 * throttle:.0f} %"
        case _ as never:
            assert_never(never)


def words_of(group: tuple[Manoeuvre, ...]) -> str:
    """Say what comes, of manoeuvres that follow each other without a break."""
    return ", then ".join(words(manoeuvre) for manoeuvre in group)


def longest_s(manoeuvre: Manoeuvre) -> float:
    """The time after which it ends at the latest."""
    match manoeuvre:
        case Run(seconds=seconds) | Coast(seconds=seconds):
            return seconds
        case CrashStop():
            return 15.0
        case ZigZag() | Turn():
            return _LONGEST_S
        case _ as never:
            assert_never(never)


_USUAL_TURN_S: Final = 30.0
"""For what is told of the time left: a half turn at half throttle,"""
_USUAL_STOP_S: Final = 8.0
"""and a stop."""
_BETWEEN_S: Final = 18.0
"""The way back to the middle and the announcement."""


def about_s(groups: Sequence[tuple[Manoeuvre, ...]]) -> float:
    """How long groups of manoeuvres take, with the ways between them, on a boat of two to five metres."""
    return math.fsum(_BETWEEN_S + math.fsum(map(_usual_s, group)) for group in groups)


def _usual_s(manoeuvre: Manoeuvre) -> float:
    match manoeuvre:
        case Run(seconds=seconds) | Coast(seconds=seconds):
            return seconds
        case CrashStop():
            return _USUAL_STOP_S
        case ZigZag() | Turn():
            return _USUAL_TURN_S
        case _ as never:
            assert_never(never)


class _Steady:
    """Tells when a run has settled: its speed, smoothed shortly and longer, is the same. In a sea that never comes, and the run lasts."""

    def __init__(self) -> None:
        self._means: list[float] | None = None
        self._t_s = self._same_s = 0.0

    def step(self, t_s: float, surge_mps: float) -> bool:
        dt_s, self._t_s = t_s - self._t_s, t_s
        if self._means is None:
            self._means = [surge_mps, surge_mps]
        for k, tau_s in enumerate((_SHORT_S, _LONG_S)):
            self._means[k] += min(1.0, dt_s / tau_s) * (surge_mps - self._means[k])
        same = t_s > _LONG_S and abs(self._means[0] - self._means[1]) < _SETTLED * abs(self._means[1])
        self._same_s = self._same_s + dt_s if same else 0.0
        return self._same_s > _LEARNT_S


class Sailing:
    """One manoeuvre under way. ``step`` gives (surge, yaw) or None when it is over."""

    def __init__(self, manoeuvre: Manoeuvre, share: float) -> None:
        """``share`` scales throttles ahead and astern: half until a person has confirmed."""
        self._manoeuvre, self._share = manoeuvre, share
        self._side, self._legs = 1.0, 0
        self._turned_rad, self._last_rad = 0.0, 0.0
        self._moved = False
        self._began = False
        self._steady = _Steady()

    def step(self, seen: Seen) -> tuple[float, float] | None:
        manoeuvre, share = self._manoeuvre, self._share
        if seen.t_s > longest_s(manoeuvre):
            return None
        if self._began:
            self._turned_rad += wrap_pi(seen.psi_rad - self._last_rad)
        self._began, self._last_rad = True, seen.psi_rad
        match manoeuvre:
            case Run(throttle=0.0):
                return 0.0, 0.0
            case Run(throttle=throttle):
                if self._steady.step(seen.t_s, seen.surge_mps):
                    return None
                return throttle * share, _straight(seen, astern=throttle < 0.0)
            case Coast():
                return None if seen.t_s > 2.0 and abs(seen.surge_mps) < 0.05 else (0.0, 0.0)
            case CrashStop(throttle=throttle):
                self._moved = self._moved or seen.surge_mps > 2.0 * _STOPPED_MPS
                stopped = seen.surge_mps < _STOPPED_MPS and (self._moved or seen.t_s > 3.0)
                return None if stopped else (-throttle * share, 0.0)
            case ZigZag(throttle=throttle, helm=helm, change_rad=change, times=times):
                off = wrap_pi(seen.psi_rad - seen.heading_rad)
                if self._side * off > change:
                    self._side, self._legs = -self._side, self._legs + 1
                return None if self._legs > times else (throttle * share, self._side * helm)
            case Turn(throttle=throttle, helm=helm, turn_rad=turn):
                return None if abs(self._turned_rad) > turn else (throttle * share, helm)
            case _ as never:
                assert_never(never)


def _straight(seen: Seen, *, astern: bool) -> float:
    # going astern the hull runs away from its heading faster than a light hand mends it: only the turning is damped
    off = 0.0 if astern else wrap_pi(seen.heading_rad - seen.psi_rad)
    return clamp(_HELM_PER_RAD * off - _HELM_PER_RADPS * seen.r_radps, -_MOST_HELM, _MOST_HELM)


def towards(heading_rad: float, psi_rad: float, r_radps: float) -> float:
    """Helm that brings the bow to a heading, between manoeuvres."""
    return clamp(_HELM_PER_RAD * wrap_pi(heading_rad - psi_rad) - _HELM_PER_RADPS * r_radps, -_MOST_HELM, _MOST_HELM)


_Z10, _Z20 = math.radians(10.0), math.radians(20.0)

QUICK: Final[tuple[tuple[Manoeuvre, ...], ...]] = (
    (Run(0.0, 12.0),),
    (Run(0.35, 14.0), Coast(12.0)),
    (Run(0.65, 12.0), CrashStop(1.0)),
    (Run(0.35, 8.0), Run(0.95, 9.0), Coast(16.0)),
    (Run(-0.5, 8.0), Run(0.5, 5.0)),
    (Run(0.5, 5.0), ZigZag(0.5, 0.5, _Z20, 5)),
    (Run(0.8, 4.0), ZigZag(0.8, 0.4, _Z10, 6), Coast(10.0)),
    (Run(0.5, 5.0), Turn(0.5, 0.6, math.tau), Turn(0.5, -0.6, math.tau)),
    (Turn(0.0, 0.6, math.tau), Turn(0.0, -0.35, math.tau)),
    (Run(0.0, 12.0),),
)
"""About eight minutes with the ways between. Those in one pair of brackets follow each other without a break."""

WHOLE: Final[tuple[tuple[Manoeuvre, ...], ...]] = (
    *QUICK,
    (Run(0.5, 16.0), Coast(16.0)),
    (Run(0.8, 12.0), Coast(16.0)),
    (Run(0.2, 18.0), Run(0.5, 10.0), CrashStop(0.6)),
    (Run(0.35, 6.0), ZigZag(0.35, 0.6, _Z20, 5)),
    (Run(0.9, 4.0), ZigZag(0.9, 0.25, _Z10, 6), CrashStop(1.0)),
    (Run(0.5, 5.0), ZigZag(0.5, 0.3, _Z10, 6)),
    (Run(0.8, 4.0), Turn(0.8, 0.35, 1.5 * math.tau), Turn(0.8, -0.35, 1.5 * math.tau)),
    (Turn(0.3, 1.0, math.tau), Turn(0.3, -1.0, math.tau)),
    (Turn(0.0, -1.0, math.tau), Turn(0.0, 0.25, math.pi), Turn(0.0, 0.8, math.tau), Turn(0.0, -0.8, math.tau)),
    (Run(-0.8, 6.0), Run(0.5, 4.0), Run(-0.3, 10.0)),
    (Run(1.0, 8.0), Coast(16.0)),
    (Run(0.0, 15.0),),
)
"""About twenty."""


def manoeuvres_of(*, quick: bool, turns_at_rest: bool = True) -> tuple[tuple[Manoeuvre, ...], ...]:
    """The plan of a trial: groups that follow each other without a break. Without ``turns_at_rest`` spins are left out."""
    groups = QUICK if quick else WHOLE
    if turns_at_rest:
        return groups
    kept = (tuple(one for one in group if not _is_spin(one)) for group in groups)
    return tuple(group for group in kept if group)


def _is_spin(manoeuvre: Manoeuvre) -> bool:
    return isinstance(manoeuvre, Turn) and manoeuvre.throttle == 0.0


NO_SPINS: Final = "spins are left out: this hull does not turn without way on"
