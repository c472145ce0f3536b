"""Whether a compass repeats one heading while the vessel turns, told by motion that a live one could not have missed; or says two in turn.

A boat at her berth, or on a calm straight line, may truly repeat a heading for minutes. So the same digits alone say nothing: a sensor's
turn rate, the course through the water, or where that is too slow to tell, the turn that was asked of thrusters and rudders must have gone
far beyond what any compass hides. A course that stays vouches for the compass against the other two.

One that hangs for a moment is not given up: what a rate sensor tells meanwhile is added to the digits that it repeats.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from mavlink_bridge.language.messages import EulerAngles, GpsFix
from mavlink_bridge.language.units import wrap_pi

_SAME_US: Final = 4_000_000
"""Nearly twice the period of the slowest compass that is used: it has told anew once at least."""
_ASKED_US: Final = 5_000_000
"""Where only what was asked for speaks against it, a compass of whole degrees on a heavy boat gets longer."""
_LATELY_US: Final = 1_500_000
"""A compass of whole degrees often tells the same for so long, and the turn rate that is made of it is still good."""
_SETTLE_US: Final = 2_500_000
"""After a turn the slip of the small hulls has died away by then, and the course points where the bow does."""
_WINDOW_US: Final = 10_000_000
"""A turn takes less. What adds up over longer is the offset of a rate sensor, or of a rudder that stands off."""
_LOOK_US: Final = 200_000
"""Ten seconds of angles are fifty values: a swing that is over sooner than this is no turn."""
_TURNED_RAD: Final = math.radians(25.0)
"""By a rate sensor: 2.5 degrees a second for ten seconds is more than any is off by."""
_COURSE_RAD: Final = math.radians(30.0)
"""By the course, whose noise at the least speed that counts is a few degrees, and which a shear line changes by 20."""
_ASKED_RAD: Final = math.radians(30.0)
"""By thrusters and rudders beyond what holds against wind: live compasses of whole degrees in calm and blow hide 2 degrees of it."""
_STEADY_RAD: Final = math.radians(15.0)
"""A course that stays within this tells that nothing turned."""
_COURSE_TAU_S: Final = 1.0
"""The velocity is smoothed by so much: the noise of five fixes, not yet a turn."""
_COURSE_AGE_US: Final = 2_000_000
"""Two fixes at 1 Hz."""
_MOVES_MPS: Final = 0.2
"""A boat that is tied, or on her trailer, does not turn for thrust. One that turns on the spot is moved by it, if only by so much."""
_PAUSE_S: Final = 1.5
"""A gap in what tells of the turn counts as no more than this."""
_HIDES_RAD: Final = math.radians(3.0)
"""Whole degrees and noise hide less of a turn,"""
_HANGS_RADPS: Final = math.radians(3.0)
"""and no rate sensor that is sold is off by so much: beyond both it is the compass that hangs."""
_HUNG_S: Final = 0.5
_HUNG_RAD: Final = math.radians(20.0)
"""Without a rate sensor, one that hung for so long, while so much of a turn was asked for,"""
_AS_ASKED: Final = (0.5, 2.5)
"""is believed when it shows this share of it: the file of the hull is wrong by half, and what was asked for began at the turn that hung."""

Digits = tuple[float | None, float | None]
"""What a compass says: the true heading, the magnetic one."""


class Swing:
    """How far an angle has swung within the last ten seconds."""

    def __init__(self) -> None:
        self._past: deque[tuple[int, float]] = deque()
        self.angle_rad = 0.0

    def clear(self) -> None:
        """Begin anew."""
        self._past.clear()
        self.angle_rad = 0.0

    def turn(self, t_us: int, by_rad: float) -> None:
        """Take a change of the angle."""
        past = self._past
        self.angle_rad += by_rad
        if past and t_us - past[-1][0] < _LOOK_US:
            return
        past.append((t_us, self.angle_rad))
        while t_us - past[0][0] > _WINDOW_US:
            past.popleft()

    @property
    def span_rad(self) -> float:
        """From one end of the swing to the other."""
        if not self._past:
            return 0.0
        angles = [angle for _, angle in self._past]
        return max(angles) - min(angles)


class _Course:
    """Where the vessel goes through the water, and how far that has swung."""

    def __init__(self) -> None:
        self.swing = Swing()
        self.clear()

    def clear(self) -> None:
        self.swing.clear()
        self.last_us: int | None = None
        self._drift: tuple[float, float] | None = None
        self._through: tuple[float, float] | None = None
        self._seen_us: int | None = None
        self._place: tuple[float | None, float | None] | None = None
        self._rad: float | None = None

    def take(self, fix: GpsFix, settled_us: int, drift_mps: tuple[float, float], least_mps: float) -> None:
        """Take a fix. ``settled_us``: from when on the course counts; ``least_mps``: the least speed through the water that does."""
        place = (fix.lat_rad, fix.lon_rad)
        if fix.sog_mps is None or fix.cog_rad is None or place == self._place:
            return
        self._place = place
        # A compass that is wrong teaches a wrong drift: the one before counts.
        north, east = self._drift = self._drift or drift_mps
        through = (fix.sog_mps * math.cos(fix.cog_rad) - north, fix.sog_mps * math.sin(fix.cog_rad) - east)
        if self._through is not None and self._seen_us is not None:
            share = min(max(fix.t_us - self._seen_us, 0) * 1e-6 / _COURSE_TAU_S, 1.0)
            (was_n, was_e), (north, east) = self._through, through
            through = (was_n + share * (north - was_n), was_e + share * (east - was_e))
        self._through, self._seen_us = through, fix.t_us
        if math.hypot(*through) < least_mps:
            return
        self.last_us = fix.t_us
        if fix.t_us < settled_us:
            return
        course_rad = math.atan2(through[1], through[0])
        self.swing.turn(fix.t_us, 0.0 if self._rad is None else wrap_pi(course_rad - self._rad))
        self._rad = course_rad


class RepeatWatch:
    """Watches the compass that is used."""

    def __init__(self) -> None:
        self._digits: Digits | None = None
        self._key: object = None
        self._since_us = self._last_us = 0
        self._rate_us: int | None = None
        self._moves = False
        self._rate, self._course, self._asked = Swing(), _Course(), Swing()
        self._told_us: int | None = None
        self._unshown_rad = 0.0
        """By how far the vessel has turned by a rate sensor since the digits changed."""
        self._rate_lies = False
        """Whether the compass last moved without the turn that the rate sensor told of."""
        self.hung_s = 0.0
        """For how long the heading was wrong, where digits that have just changed show that it was; else 0."""

    @property
    def is_same(self) -> bool:
        """Whether the last heading was the one before."""
        return self._last_us > self._since_us

    @property
    def tells_no_turn(self) -> bool:
        """Whether it has been the same for so long that no turn rate can be made of it."""
        return self._last_us - self._since_us > _LATELY_US

    @property
    def same_s(self) -> float:
        """For how long one heading has been repeated."""
        return (self._last_us - self._since_us) * 1e-6

    @property
    def hidden_rad(self) -> float:
        """How far the vessel has turned since the compass began to hang; 0 for one that lives, or has long been the same.

        That one is a matter of proof: the rate sensor may be the one that is wrong.
        """
        if not self.is_same or self._rate_lies or self.same_s >= _SAME_US * 1e-6:
            return 0.0
        return self._unshown_rad if abs(self._unshown_rad) > _HIDES_RAD + _HANGS_RADPS * self.same_s else 0.0

    def note_rate(self, t_us: int, r_radps: float) -> None:
        """Take what a sensor tells of the turn rate."""
        if self._told_us is not None:
            self._unshown_rad += r_radps * min(max((t_us - self._told_us) * 1e-6, 0.0), _PAUSE_S)
        self._told_us = t_us
        if not self.is_same:
            self._rate_us = None
            return
        if self._rate_us is not None:
            since_s = (t_us - self._rate_us) * 1e-6
            self._rate.turn(t_us, r_radps * min(max(since_s, 0.0), _PAUSE_S))
        self._rate_us = t_us

    def note_fix(self, fix: GpsFix, drift_mps: tuple[float, float], least_mps: float) -> None:
        """Take a fix, the drift, and the least speed through the water at which a course is one."""
        self._moves = fix.sog_mps is not None and fix.sog_mps > _MOVES_MPS
        if self.is_same:
            self._course.take(fix, self._since_us + _SETTLE_US, drift_mps, least_mps)

    def note_asked(self, t_us: int, dt_s: float, r_radps: float) -> None:
        """Take the turn rate that thrusters and rudders were asked for; of a boat that does not move it tells nothing."""
        if self.is_same and self._moves:
            self._asked.turn(t_us, r_radps * min(max(dt_s, 0.0), _PAUSE_S))

    def hear(self, key: object, angles: EulerAngles) -> str:
        """Take the heading of the source that is used; return what proves that it is repeated, in words, empty if nothing does."""
        digits: Digits = (angles.psi_rad, angles.psi_magnetic_rad)
        self.hung_s = 0.0
        if digits != self._digits or key != self._key:
            if key == self._key and self.is_same and self._shows_more(digits):
                self.hung_s = self.same_s
            self._digits, self._key, self._unshown_rad = digits, key, 0.0
            if self.is_same:
                self._forget()
            self._since_us = self._last_us = angles.t_us
            return ""
        self._last_us = angles.t_us
        return self._proof() if self._last_us - self._since_us >= _SAME_US else ""

    def _shows_more(self, digits: Digits) -> bool:
        """Whether new digits show that the heading was wrong while they were the same, and learn what the rate sensor is worth.

        By a turn that was asked for, and hidden; or because the turn that a rate sensor told of, and that was added, was none.
        """
        pairs = zip(digits, self._digits or digits, strict=True)
        moved_rad = next((wrap_pi(now - was) for now, was in pairs if now is not None and was is not None), 0.0)
        if self._told_us is not None and self._told_us > self._since_us:
            lied, hidden_rad = self._rate_lies, self.hidden_rad
            if abs(self._unshown_rad) > _HIDES_RAD:
                self._rate_lies = abs(moved_rad) < abs(wrap_pi(moved_rad - self._unshown_rad))
            return hidden_rad != 0.0 and self._rate_lies and not lied
        asked_rad, (least, most) = self._asked.angle_rad, _AS_ASKED
        if self.same_s < _HUNG_S or abs(asked_rad) < _HUNG_RAD:
            return False
        return least * abs(asked_rad) < math.copysign(moved_rad, moved_rad * asked_rad) < most * abs(asked_rad)

    def _forget(self) -> None:
        self._rate.clear()
        self._course.clear()
        self._asked.clear()
        self._rate_us = None

    def _proof(self) -> str:
        course = self._course
        if course.last_us is not None and self._last_us - course.last_us < _COURSE_AGE_US:
            swung_rad = course.swing.span_rad
            if swung_rad < _STEADY_RAD:
                return ""
            if swung_rad > _COURSE_RAD:
                return "while the vessel turns"
        if self._rate.span_rad > _TURNED_RAD:
            return "while the vessel turns"
        is_asked = self._last_us - self._since_us >= _ASKED_US and self._asked.span_rad > _ASKED_RAD
        return "though the vessel should turn" if is_asked else ""
