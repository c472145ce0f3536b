"""What speaks against a compass: thrust that moves the vessel elsewhere than her bow points, and turns that it tells otherwise.

Current and wind carry a vessel anywhere, but what they add does not change as her own thrust does. What does is her way through the
water, along the bow. So the changes of the velocity over ground are compared with those that the modelled way along the bow should
bring: with a right compass they go together, with a wrong one they go together too, but turned by as much as the compass is wrong.

What counts is what the fixes tell, not what is predicted from them: a prediction turns with the heading that is in question. Where they
tell no velocity, their places over some seconds do, beside those where the modelled way alone would have led to.

A compass that counts the wrong way round, or hardly at all, is right on one heading. It shows in each turn: a rate sensor and the course
through the water tell of one turn, the compass of another. One voice against it proves nothing, for that one may be wrong itself.
"""

from __future__ import annotations

import cmath
import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.messages import GpsFix
from mavlink_bridge.language.units import wrap_pi
from mavlink_bridge.language.value import value

from .borne_out import BorneOut

_MEAN_S: Final = 8.0
"""What changes slower than this is left to wind and current; a hull gains and loses its way within it."""
_COUNTS_S: Final = 12.0
"""So long a change counts: one acceleration and one stop."""
_LEAST: Final = 1.0
"""Changes of the way that must count, m2/s: half a metre a second for four seconds,"""
_LEAST_SEEN: Final = 0.5
"""and half of that must be seen over ground. A velocity without corrections has a noise of 0.3."""
_LEAST_BY_ROUGH: Final = 1.5
"""Rough places show more change that is none."""
_TOGETHER: Final = 0.92
"""Share of the changes over ground that the thrust must explain. Wrong compasses on five hulls had 0.97 and more in 12 m/s of wind;
sound ones, turned by more than the limit, 0.6 at most, when a current of 2 m/s set in within a tick."""
_OFF_RAD: Final = math.radians(50.0)
"""Sound compasses were off by up to 11 degrees, and by 27 when 18 m/s of wind set in."""
_FEWEST, _MOST = 0.4, 2.5
"""Times what the file says of the way: thrust and drag wrong by half. What moves a hull otherwise is a tow, the ground, an eddy."""
_HELD_S: Final = 1.5
"""It must look so for longer than a gust's onset lasts,"""
_HELD_BY_ROUGH_S: Final = 2.5
"""seen by rough places for longer: they blur a tug's pull, and all else that begins with the thrust, into one with it,"""
_STEADY_RAD: Final = math.radians(10.0)
"""and the angle must stay within this: a hull that a dead or reversed propeller spins goes off the model more and more."""
_SLOW_TOGETHER: Final = 0.75
"""A compass that creeps by degrees a second is another one at each change: they go together less,"""
_SLOW_OFF_RAD: Final = math.radians(60.0)
_SLOW_S: Final = 6.0
"""but for longer than all else: an eddy that is crossed turns within it."""
_ONCE_S: Final = 8.0
"""And for so long where the way bore the heading out before, and nothing has parted since: on a straight way the first change of thrust is
often a propeller that fails, whose own watch takes 5 to 10 s."""
_CREEPS_RAD: Final = math.radians(25.0)
"""Meanwhile it creeps so far itself."""
_BORNE_OUT_RAD: Final = math.radians(30.0)
"""A heading within this of the way is borne out. While that counts, what looks like a wrong one is a propeller."""
_LEAPS_COS: Final = 0.94
"""A heading that leaps by 20 degrees in one tick is another compass, or one that was set right: the past says nothing of it."""
_GAP_S: Final = 0.5
"""After a longer pause of the heading the changes are not known,"""
_NO_FIX_S: Final = 3.2
"""nor after a longer one of the fixes: three of the slowest receiver's."""
_SMOOTH_S: Final = 1.0
"""A velocity that is told without RTK is smoothed by so much, and the modelled one alike: five times a second its noise would hide
half a way."""
_SMOOTH_FIXES: Final = 1.5
"""Once a second by so many fixes: it would hide a whole way of a metre and a half a second."""
_ROUGH_M: Final = 0.12
"""Places that vary by more than RTK's, which is known to a decimetre also while it floats."""
_FINE_S: Final = 2.0
_ROUGH_S: Final = 5.0
"""Places make a velocity over so long: once a second, with half a metre from place to place, one of 0.13 m/s of noise."""
_JITTER_S: Final = 0.05
"""A fix that comes by its clock a little later is still within it."""
_FILLED: Final = 0.8
"""Over less than this share of it there are too few."""

_LOOK_US: Final = 500_000
WINDOW_US: Final = 15_000_000
"""A turn and what it leaves behind take less; a rate sensor that is off by a degree a second is no witness for longer."""
_TURN_OFF_RAD: Final = math.radians(35.0)
"""A compass that a hull's iron turns by 15 degrees, and a rate sensor's share, are less apart in any turn;"""
_OFF_RADPS: Final = math.radians(1.0)
"""more, where the turn took longer: those that are sold are off by half of it;"""
_OFF_SHARE: Final = 0.05
"""more, where it was wider;"""
_LATE_S: Final = 2.0
"""and where it was quicker: a damped magnetic compass comes so late."""
_QUICK_US: Final = 4_000_000
"""Twice that after a turn nothing is left of it."""
_LEAP_RAD: Final = math.radians(20.0)
_LEAP_SHARE: Final = 2.5
"""Between two headings: further apart than this beside so many times the turn they leapt, and a turn since before tells nothing."""
_LEAST_TURN_RAD: Final = math.radians(20.0)
"""A sensor that tells of no turn may be dead."""
_MOST_RAD: Final = math.radians(150.0)
"""Towards half round a turn and a course are alike to either side."""
_NEARER_RAD: Final = math.radians(30.0)
"""So much nearer to the turn of the rate sensor than to the compass's the course must be: slip, and water that changes, are less."""
_WAY_MPS: Final = 0.5
"""A slower way through the water tells of no course: an eddy turns it."""
_GROUND_TAU_S: Final = 1.0
_HEARD_US: Final = 2_500_000
"""After a longer pause of the compass, or of the rate sensor, turns are not known."""
_GOES_WITH_RAD: Final = math.radians(60.0)
"""One that was given up is believed again after a turn of so much by the rate sensor,"""
_GOES_WITHIN_RAD: Final = math.radians(20.0)
"""from which it was off by no more than this: too little for one that is magnetised, counts double or the wrong way."""

_Pair = tuple[float, float]


@value
class SeenFix:
    """What a fix that was believed told of the reference point, north and east."""

    t_us: int
    """When it was valid."""
    at_m: _Pair
    """Where, less all leaps: where a vessel can have been, one after the other."""
    sigma_m: float
    """How much such places vary from one to the next."""
    mps: _Pair | None
    """Over ground; None where the receiver told nothing of it."""


class _Places:
    """The last places, and where the modelled way alone would have led to by then: what both make of a velocity."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, complex, complex]] = deque()

    def take(self, told: SeenFix, led_m: complex) -> tuple[complex, complex] | None:
        """Return the slopes of both over the last seconds, m/s: alike in lag. None while there are few."""
        t_s, seen, over_s = told.t_us * 1e-6, self._seen, _ROUGH_S if told.sigma_m > _ROUGH_M else _FINE_S
        seen.append((t_s, complex(*told.at_m), led_m))
        while t_s - seen[0][0] > over_s + _JITTER_S:
            seen.popleft()
        if t_s - seen[0][0] < _FILLED * over_s:
            return None
        mean_s = math.fsum(each[0] for each in seen) / len(seen)
        weight = math.fsum((each[0] - mean_s) * (each[0] - mean_s) for each in seen)
        made = through = 0j
        for then_s, at_m, led_m in seen:
            share = (then_s - mean_s) / weight
            made, through = made + share * at_m, through + share * led_m
        return made, through


class _Standing:
    """For how long a contradiction has stood: the way goes with the thrust, and steadily elsewhere."""

    def __init__(self, together: float, off_rad: float, strays_rad: float) -> None:
        """``together``: share that the thrust must explain. ``off_rad``: less is none. ``strays_rad``: how far the angle may change."""
        self._together, self._least_rad, self._strays_rad = together, off_rad, strays_rad
        self._since_rad = self.stood_s = 0.0

    def end(self) -> None:
        """There is none."""
        self.stood_s = 0.0

    def step(self, dt_s: float, off_rad: float, together: float) -> float:
        """Take the angle, and how well both go together; return for how long, s."""
        if together <= self._together or abs(off_rad) < self._least_rad:
            self.stood_s = 0.0
            return 0.0
        strays_rad = abs(math.remainder(off_rad - self._since_rad, math.tau))
        if self.stood_s <= 0.0 or strays_rad > self._strays_rad:
            self.stood_s, self._since_rad = 0.0, off_rad
        self.stood_s += dt_s
        return self.stood_s


class ThrustWitness:
    """Watches the heading that is steered by; one call per tick with a compass that is believed."""

    def __init__(self) -> None:
        self._bow = 0j
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._told: SeenFix | None = None
        self._fix_us: int | None = None
        self._borne_out = BorneOut()
        self._begin()

    def _begin(self) -> None:
        self._led = self._last = 0j
        self._places = _Places()
        self._smoothed: tuple[complex, complex] | None = None
        self._ground: complex | None = None
        self._through = self._both = 0j
        self._own = self._made = 0.0
        self._clear = _Standing(_TOGETHER, _OFF_RAD, _STEADY_RAD)
        self._slow = _Standing(_SLOW_TOGETHER, _SLOW_OFF_RAD, _CREEPS_RAD)

    def step(self, dt_s: float, *, bow: _Pair, through_mps: _Pair, told: SeenFix | None) -> float | None:
        """Return by how much the way is off the heading, clockwise, once it is certain that it is.

        ``bow``: unit vector of the heading, NED. ``through_mps``: modelled surge and sway, at the moment that the fix of the tick before
        was valid. ``told``: the fix that is new at this tick.
        """
        before, self._bow = self._bow, complex(*bow)
        leapt = (before.conjugate() * self._bow).real < _LEAPS_COS
        if leapt or not 0.0 < dt_s < _GAP_S:
            self.clear()
        last, self._told = self._told, told
        return None if last is None else self._take(last, complex(*through_mps) * self._bow)

    def _take(self, told: SeenFix, through: complex) -> float | None:
        since_s = 0.0 if self._fix_us is None else (told.t_us - self._fix_us) * 1e-6
        if not 0.0 < since_s < _NO_FIX_S:
            self._begin()
            since_s = 0.0
        self._fix_us = told.t_us
        self._led += 0.5 * since_s * (self._last + through)
        self._last = through
        is_plain = told.sigma_m > _ROUGH_M
        if told.mps is None:
            made = self._places.take(told, self._led)
        else:
            part = min(since_s / _SMOOTH_S, 1.0 / _SMOOTH_FIXES) if is_plain else 1.0
            made = self._smooth(part, complex(*told.mps))
        if made is None:
            return None
        self._compare(since_s, *made)
        self._borne_out.step(since_s, self._bow, *made)
        return self._judged(since_s, is_rough=told.mps is None and is_plain)

    def _smooth(self, part: float, ground: complex) -> tuple[complex, complex]:
        was_ground, was_through = self._smoothed or (ground, self._last)
        self._smoothed = was_ground + part * (ground - was_ground), was_through + part * (self._last - was_through)
        return self._smoothed

    def _compare(self, dt_s: float, ground: complex, through: complex) -> None:
        """Take both velocities at a fix."""
        if self._ground is None:
            self._ground, self._through = ground, through
        changed, by_thrust = ground - self._ground, through - self._through
        keep = 1.0 - dt_s / _COUNTS_S
        self._both = keep * self._both + dt_s * by_thrust.conjugate() * changed
        self._own = keep * self._own + dt_s * abs(by_thrust) * abs(by_thrust)
        self._made = keep * self._made + dt_s * abs(changed) * abs(changed)
        self._ground += dt_s / _MEAN_S * changed
        self._through += dt_s / _MEAN_S * by_thrust

    def _judged(self, dt_s: float, *, is_rough: bool) -> float | None:
        off_rad, both = cmath.phase(self._both), abs(self._both)
        fits = self._own >= _LEAST and _FEWEST * self._own < both < _MOST * self._own
        fits = fits and both * both >= (_LEAST_BY_ROUGH if is_rough else _LEAST_SEEN) * self._own
        together = both * both / (self._own * self._made) if fits else 0.0
        if together > _TOGETHER and abs(off_rad) < _BORNE_OUT_RAD:
            self._borne_out.renew()
        if self._borne_out or not fits:
            self._clear.end()
            self._slow.end()
            return None
        once = self._borne_out.once
        held_s = _ONCE_S if once else _HELD_BY_ROUGH_S if is_rough else _HELD_S
        is_clear = self._clear.step(dt_s, off_rad, together) >= held_s
        is_slow = self._slow.step(dt_s, off_rad, together) >= (_ONCE_S if once else _SLOW_S)
        return off_rad if is_clear or is_slow else None


@dataclass(frozen=True, slots=True)
class _Look:
    """What was known at one moment."""

    t_us: int
    turned_rad: float
    """By the rate sensor, since whenever."""
    off_rad: float
    """How much more the compass has turned."""
    quick_radps: float
    """The quickest turn just before."""
    ground: complex | None
    """Velocity over ground, NED."""
    drift: complex
    """What the water did, as far as known."""


class TurnWitness:
    """Watches how one compass goes along with turns."""

    def __init__(self) -> None:
        self._past: deque[_Look] = deque()
        self._psi_rad: float | None = None
        self._heard_us = 0
        self._rate_us: int | None = None
        self._turned_rad = self._heard_rad = self._off_rad = 0.0
        self._quick: deque[tuple[int, float]] = deque()
        self._ground: complex | None = None
        self._fix_us = 0
        self._drift = 0j

    def note_rate(self, t_us: int, r_radps: float) -> None:
        """Take what a sensor tells of the turn rate."""
        since_us, self._rate_us = None if self._rate_us is None else t_us - self._rate_us, t_us
        if since_us is None or not 0 <= since_us < _HEARD_US:
            self._begin()
            return
        self._turned_rad += r_radps * since_us * 1e-6
        quick = self._quick
        while quick and quick[-1][1] <= abs(r_radps):
            quick.pop()
        quick.append((t_us, abs(r_radps)))
        while t_us - quick[0][0] > _QUICK_US:
            quick.popleft()

    def note_fix(self, fix: GpsFix, drift_mps: _Pair) -> None:
        """Take a fix and what is thought of the water."""
        if fix.sog_mps is None or fix.cog_rad is None:
            return
        ground, share = cmath.rect(fix.sog_mps, fix.cog_rad), (fix.t_us - self._fix_us) * 1e-6 / _GROUND_TAU_S
        before = ground if self._ground is None else self._ground
        self._ground, self._fix_us = before + min(max(share, 0.0), 1.0) * (ground - before), fix.t_us
        self._drift = complex(*drift_mps)

    def hear(self, t_us: int, psi_rad: float) -> bool | None:
        """Take a heading. True: rate sensor and course contradict it. False: it went along with a wide turn. None: nobody knows."""
        before, silent_us = self._psi_rad, t_us - self._heard_us
        if psi_rad == before and silent_us < _HEARD_US:
            return None  # one that hangs is another's matter
        step_rad = 0.0 if before is None else self._turned_rad - self._heard_rad
        apart_rad = 0.0 if before is None else wrap_pi(psi_rad - before - step_rad)
        self._psi_rad, self._heard_us, self._heard_rad = psi_rad, t_us, self._turned_rad
        if silent_us >= _HEARD_US or abs(apart_rad) > _LEAP_RAD + _LEAP_SHARE * abs(step_rad):
            self._begin()
            return None
        self._off_rad += apart_rad
        if self._rate_us is None or t_us - self._rate_us > _HEARD_US:
            return None
        return self._look(t_us) if not self._past or t_us - self._past[-1].t_us >= _LOOK_US else None

    def _begin(self) -> None:
        self._past.clear()
        self._quick.clear()

    def _look(self, t_us: int) -> bool | None:
        quick_radps = self._quick[0][1] if self._quick else 0.0
        now = _Look(
            t_us, self._turned_rad, self._off_rad, quick_radps=quick_radps, ground=self._ground, drift=self._drift
        )
        past = self._past
        while past and t_us - past[0].t_us > WINDOW_US:
            past.popleft()
        contradicts = any(_contradicts(before, now) for before in past)
        goes_along = any(_goes_along(before, now) for before in past)
        past.append(now)
        if contradicts:
            return True
        return False if goes_along else None


def _goes_along(before: _Look, now: _Look) -> bool:
    turned_rad, off_rad = now.turned_rad - before.turned_rad, now.off_rad - before.off_rad
    return abs(turned_rad) > _GOES_WITH_RAD and abs(off_rad) < _GOES_WITHIN_RAD


def _contradicts(before: _Look, now: _Look) -> bool:
    turned_rad, off_rad = now.turned_rad - before.turned_rad, now.off_rad - before.off_rad
    if not _LEAST_TURN_RAD < abs(turned_rad) < _MOST_RAD:
        return False
    allowed_rad = _TURN_OFF_RAD + _OFF_RADPS * (now.t_us - before.t_us) * 1e-6 + _OFF_SHARE * abs(turned_rad)
    if abs(off_rad) < allowed_rad + _LATE_S * (before.quick_radps + now.quick_radps):
        return False
    if before.ground is None or now.ground is None:
        return False
    # A compass that is wrong teaches a wrong drift: the one before counts, and where that is wrong itself, none must say the same.
    return all(
        _bears_out(before.ground - drift, now.ground - drift, turned_rad, off_rad) for drift in (before.drift, 0j)
    )


def _bears_out(was: complex, now: complex, turned_rad: float, off_rad: float) -> bool:
    """Whether a course turned as the rate sensor tells, and not as the compass does."""
    if min(abs(was), abs(now)) < _WAY_MPS:
        return False
    course_rad = cmath.phase(now * was.conjugate())
    if not _LEAST_TURN_RAD < abs(course_rad) < _MOST_RAD or course_rad * turned_rad < 0.0:
        return False
    by_compass_rad = abs(wrap_pi(course_rad - turned_rad - off_rad))
    return abs(wrap_pi(course_rad - turned_rad)) + _NEARER_RAD < by_compass_rad
