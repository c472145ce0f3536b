"""What the water does under the vessel: two means of the velocity over ground less the one through the water.

``DriftFilter`` is the plain slow mean. It holds everything that the hull's file does not explain: current, wind, and what the file
says wrongly. Who watches over the vessel takes that one. ``CurrentFilter`` tells the last of the three apart. Who steers takes that.
"""

from __future__ import annotations

import math
from collections import deque
from copy import deepcopy
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.units import clamp

from .doubts.witness import SeenFix, ThrustWitness

_JOLT_S: Final = 1.2
"""What the samples say over this time is compared with the mean: longer than a turn's transient of sway lasts at full size."""
_JOLT_MPS: Final = 0.25
"""Beyond this much off the mean the water has changed: more than gusts, waves and turns leave in the samples."""
_QUICK_S: Final = 1.5
"""Time constant of the mean while it has that far to go."""
_TURNING_RADPS: Final = 0.12
"""7 degrees a second: what steering keeps straight in waves turns less."""
_SLIPS_S: Final = 2.5
"""After a turn the slip of the small hulls has died away by then."""
_SLIP_MPS: Final = 0.5
"""For so long after a turn faster than that the hull slips by up to this: that is no change of the water."""
_MODELLED_JOLT_MPS: Final = 0.2
_MODELLED_SLIP_MPS: Final = 0.4
"""The same two for samples that the slip by the file is taken off."""
_SURGE_COUNTS: Final = 0.3
"""In a turn: what a file says wrongly of thrust and drag makes a hull leap ahead there, along the bow."""
_SHARE_SIGMA: Final = 0.25
"""How wrong a file's speed through the water may well be: thrust and drag by half, each."""
_LEAST_SHARE, _MOST_SHARE = -2.0 / 3.0, 2.0
"""A third or thrice the speed: thrust and linear drag wrong by half, each. More is a tow or the ground."""
_NOISE: Final = 0.04
"""Of a corner's samples, m2/s: slip and gusts of 0.2 m/s that last for a second."""
_COUNTS_S: Final = 30.0
"""So much turning counts, half a dozen corners: what the hull makes of its thrust changes with trim, a battery that sags, weed."""
_CORNER_S: Final = 8.0
"""A course is a new one against the mean of this time: longer than a turn lasts, shorter than a leg."""
_CORNER_COS: Final = 0.9
"""... when it is 25 degrees off. Only then the share is learnt: on one course the bow turns because the water did."""
WAY_MPS: Final = 0.3
"""Below this way the course over ground is the noise of the position."""
_WITH_COS: Final = 0.6
"""A way within 53 degrees of where the bow points bears a heading out: slip, leeway and a current that is not known to half a metre a
second take it no further off."""
_NO_WAY_MPS: Final = 0.1
"""By the file a hull makes no way below this,"""
_ADRIFT_S: Final = 10.0
"""nor in truth, after so long of it: a file that is wrong by half has her at rest a few seconds too soon."""
_CARRIED_S: Final = 4.0
"""Time constant of the drift then: longer than a wave. On a trailer it was 12 m/s, and is no course after a quarter of a minute."""
_TAUGHT_S: Final = 20.0
"""A heading that thrust contradicts has taught a wrong water since the thrust began: that is found out sooner than this."""
_FITS_MPS: Final = 0.5
"""The water before that explains where thrust takes her if it is off by no more: at rest it makes half a way that counts as a course.
A compass that crept away has taught a wrong one for longer."""
_KEPT_S: Final = 5.0
_LATELY_S: Final = 60.0
"""So far back the water is remembered, at such intervals: that a propeller is lost is certain 10 to 40 s after it was."""

_Pair = tuple[float, float]
NOWHERE: _Pair = (0.0, 0.0)


def part_of(dt_s: float, tau_s: float) -> float:
    """Share of the way that a mean goes in one step."""
    return dt_s / tau_s if dt_s < tau_s else 1.0


def _gain(dt_s: float, tau_s: float, *, is_jolted: bool) -> float:
    """Share of the way that a mean of the water goes in one step."""
    if dt_s <= 0.0:
        return 0.0
    return part_of(dt_s, _QUICK_S if is_jolted and tau_s > _QUICK_S else tau_s)


def towards(mean: _Pair, sample: _Pair, part: float) -> _Pair:
    """The mean after a step of this share of the way."""
    return mean[0] + part * (sample[0] - mean[0]), mean[1] + part * (sample[1] - mean[1])


def _less_along(vector: _Pair, unit: _Pair, share: float) -> _Pair:
    """The vector with only this share of its part along a unit vector."""
    less = (1.0 - share) * (vector[0] * unit[0] + vector[1] * unit[1])
    return vector[0] - less * unit[0], vector[1] - less * unit[1]


class _Jolt:
    """Tells when the water itself has changed: eddies, shear lines change it by more, and for longer, than a mean is slow for."""

    def __init__(self, least_mps: float, slip_mps: float) -> None:
        """``least_mps``: what the samples may be off; ``slip_mps``: those of a hull that has just turned."""
        self._least_mps, self._slip_mps = least_mps, slip_mps
        self._off = NOWHERE
        self._straight_s = 0.0

    def step(self, dt_s: float, off_mps: _Pair, r_radps: float, bow: _Pair) -> bool:
        """Take how far a sample is off the mean, NED, the turn rate (a turning hull slips sideways) and where the bow points."""
        self._straight_s = 0.0 if r_radps * r_radps > _TURNING_RADPS * _TURNING_RADPS else self._straight_s + dt_s
        turned = self._straight_s <= _SLIPS_S
        counted = _less_along(off_mps, bow, _SURGE_COUNTS) if turned else off_mps
        self._off = north, east = towards(self._off, counted, part_of(dt_s, _JOLT_S))
        least_mps = self._slip_mps if turned else self._least_mps
        return north * north + east * east > least_mps * least_mps


class DriftFilter:
    """Slow mean of (ground velocity - velocity through the water), NED; quick where the water itself has changed."""

    def __init__(self) -> None:
        self.mps: _Pair | None = None
        """North and east; None before the first sample."""
        self._seen_s = 0.0
        self._jolt = _Jolt(_JOLT_MPS, _SLIP_MPS)

    def step(self, dt_s: float, tau_s: float, *, sample_mps: _Pair, r_radps: float, bow: _Pair) -> None:
        """Take one sample, NED; a plain mean at first, then a first-order low-pass.

        ``r_radps``: a turning hull slips sideways. ``bow``: unit vector that it points along, NED.
        """
        mean = sample_mps if self.mps is None else self.mps
        self._seen_s += dt_s
        off_mps = (sample_mps[0] - mean[0], sample_mps[1] - mean[1])
        is_jolted = self._jolt.step(dt_s, off_mps, r_radps, bow)
        self.mps = towards(mean, sample_mps, _gain(dt_s, min(self._seen_s, tau_s), is_jolted=is_jolted))

    def carried(self, share: float, ground_mps: _Pair) -> None:
        """Go a share of the way to what carries a vessel that makes none."""
        self.mps = towards(self.mps or NOWHERE, ground_mps, share)


class CurrentFilter:
    """The current, NED, told apart from what the hull's file says wrongly of the speed through the water.

    Velocity over ground = current + (1 + share) * velocity through the water by the file. Means of both velocities are kept, slow
    and quick as the drift's; their difference is the current. The share is what fits the turns: there the velocity over ground
    changes by (1 + share) times the other, and the water has not changed. So the first corner tells them apart, and a file that is
    wrong by half no longer passes for a current that jumps at each corner. On one course they cannot be told apart: there the vessel
    turns her bow as the water turns, and what she makes over ground stays.
    """

    def __init__(self) -> None:
        self.share = 0.0
        """What the hull makes more through the water than its file says, over what the file says."""
        self._ground: _Pair | None = None
        self._through = NOWHERE
        self._seen_s = 0.0
        self._jolt = _Jolt(_MODELLED_JOLT_MPS, _MODELLED_SLIP_MPS)
        self._course = NOWHERE
        self._fit = self._weight = 0.0
        """Sums over the turns: of how the changes of both velocities go together, and of the square of the one by the file."""

    @property
    def mps(self) -> _Pair:
        """North and east."""
        (north, east), made = self._ground or NOWHERE, 1.0 + self.share
        return north - made * self._through[0], east - made * self._through[1]

    def by_file(self, ground_mps: _Pair, bow: _Pair) -> _Pair:
        """Return the surge and sway through the water, as the file would have them, that a velocity over ground, NED, means."""
        current, (cos, sin) = self.mps, bow
        north, east = ground_mps[0] - current[0], ground_mps[1] - current[1]
        return (north * cos + east * sin) / (1.0 + self.share), east * cos - north * sin

    def step(
        self, dt_s: float, tau_s: float, *, ground_mps: _Pair, bow: _Pair, through_mps: _Pair, r_radps: float
    ) -> None:
        """Take one sample.

        ``ground_mps``: velocity over ground, NED. ``bow``: unit vector that the hull points along, NED. ``through_mps``: surge and
        sway through the water by the file. ``r_radps``: turn rate. ``tau_s``: time constant that the current ends at.
        """
        (cos, sin), (surge, sway) = bow, through_mps
        made, through = (ground_mps[0] + sway * sin, ground_mps[1] - sway * cos), (surge * cos, surge * sin)
        if self._ground is None:
            self._ground, self._through = made, through
        self._seen_s += dt_s
        changed = (made[0] - self._ground[0], made[1] - self._ground[1])
        by_file = (through[0] - self._through[0], through[1] - self._through[1])
        if self._has_turned(dt_s, ground_mps):
            self._learn(dt_s, changed, by_file)
        whole = 1.0 + self.share
        off_mps = (changed[0] - whole * by_file[0], changed[1] - whole * by_file[1])
        is_jolted = self._jolt.step(dt_s, off_mps, r_radps, bow)
        gain = _gain(dt_s, min(self._seen_s, tau_s), is_jolted=is_jolted)
        self._ground = (self._ground[0] + gain * changed[0], self._ground[1] + gain * changed[1])
        self._through = (self._through[0] + gain * by_file[0], self._through[1] + gain * by_file[1])

    def carried(self, share: float, ground_mps: _Pair) -> None:
        """As the drift's; on which courses she goes does not tell what her file says wrongly."""
        self._ground = towards(self._ground or NOWHERE, ground_mps, share)
        self._through = towards(self._through, NOWHERE, share)

    def _has_turned(self, dt_s: float, ground_mps: _Pair) -> bool:
        """True from when the course leaves that of the last seconds until the new one has become that."""
        part, (north, east) = part_of(dt_s, _CORNER_S), self._course
        self._course = (north + part * (ground_mps[0] - north), east + part * (ground_mps[1] - east))
        now_mps, mean_mps = math.hypot(*ground_mps), math.hypot(*self._course)
        along = self._course[0] * ground_mps[0] + self._course[1] * ground_mps[1]
        return min(now_mps, mean_mps) > WAY_MPS and along < _CORNER_COS * now_mps * mean_mps

    def _learn(self, dt_s: float, changed: _Pair, by_file: _Pair) -> None:
        """Least squares, drawn to a file that is right; the last turns count."""
        keep = 1.0 - part_of(dt_s, _COUNTS_S)
        more_n, more_e = changed[0] - by_file[0], changed[1] - by_file[1]
        self._fit = keep * self._fit + dt_s * (by_file[0] * more_n + by_file[1] * more_e)
        self._weight = keep * self._weight + dt_s * (by_file[0] * by_file[0] + by_file[1] * by_file[1])
        share = self._fit / (self._weight + _NOISE / (_SHARE_SIGMA * _SHARE_SIGMA))
        self.share = clamp(share, _LEAST_SHARE, _MOST_SHARE)


class WaterMeans:
    """Both means, fed alike, what they were, and whether the heading that they are fed with can be right."""

    def __init__(self) -> None:
        self._drift, self._current = DriftFilter(), CurrentFilter()
        self._witness = ThrustWitness()
        self._before: deque[tuple[DriftFilter, CurrentFilter]] = deque(maxlen=round(_LATELY_S / _KEPT_S))
        self._kept_s = _KEPT_S
        self._adrift_s = 0.0
        """For how long she has made no way, without a heading."""
        self._is_guess = False
        """Whether the water is only what thrust showed of it as it proved a heading wrong, and no heading has been believed since."""

    @property
    def drift_mps(self) -> tuple[float, float] | tuple[None, None]:
        """North and east; None before the first sample."""
        return self._drift.mps or (None, None)

    @property
    def known_mps(self) -> _Pair:
        """The drift, north and east; one that was never found counts as none."""
        return self._drift.mps or NOWHERE

    def through_mps(self, ground_mps: _Pair) -> _Pair:
        """Return the velocity through the water, NED, that a velocity over ground, NED, means.

        By the current: what the drift holds of a file that is wrong turns with the vessel.
        """
        (north, east), (current_n, current_e) = ground_mps, self._current.mps
        return north - current_n, east - current_e

    def goes_against(self, psi_rad: float, ground_mps: _Pair, least_mps: float) -> bool:
        """Whether a vessel makes way through the water, at this speed at least, elsewhere than a heading points.

        One that makes as much way over ground where it points is left: the water was met with the compass that is in question.
        """
        (ground_n, ground_e), (north, east) = ground_mps, self.through_mps(ground_mps)
        cos, sin = math.cos(psi_rad), math.sin(psi_rad)
        made_mps, over_mps = math.hypot(north, east), math.hypot(ground_n, ground_e)
        if made_mps < least_mps or north * cos + east * sin >= _WITH_COS * made_mps:
            return False
        return over_mps < least_mps or ground_n * cos + ground_e * sin < _WITH_COS * over_mps

    def lose_heading(self, dt_s: float, ground_mps: _Pair | None, modelled_mps: _Pair | None) -> None:
        """There is none: what thrust made before tells nothing of the next one.

        Of a vessel without way all that moves her is the water, and which way she points does not matter. Else a drift that was learnt
        on a trailer stands for ever: at rest it makes way through the water, which contradicts each compass. One that is a guess is no
        better than what carries a vessel that may still make a little way.
        """
        self._witness.clear()
        if ground_mps is None or modelled_mps is None or math.hypot(*modelled_mps) > _NO_WAY_MPS:
            self._adrift_s = 0.0
            return
        self._adrift_s += dt_s
        if self._drift.mps is not None and (self._is_guess or self._adrift_s >= _ADRIFT_S):
            for mean in (self._drift, self._current):
                mean.carried(part_of(dt_s, _CARRIED_S), ground_mps)

    @property
    def current_mps(self) -> tuple[float, float] | tuple[None, None]:
        """North and east; None before the first sample."""
        return (None, None) if self._drift.mps is None else self._current.mps

    @property
    def made_share(self) -> float:
        """What the hull makes more through the water than its file says, over what the file says."""
        return self._current.share

    def step(
        self, dt_s: float, tau_s: float, *, ground_mps: _Pair, bow: _Pair, through_mps: _Pair, r_radps: float
    ) -> None:
        """Take one sample, as ``CurrentFilter`` does."""
        self._is_guess = False
        (north, east), (cos, sin), u_mps = ground_mps, bow, through_mps[0]
        sample_mps = (north - u_mps * cos, east - u_mps * sin)
        self._drift.step(dt_s, tau_s, sample_mps=sample_mps, r_radps=r_radps, bow=bow)
        self._current.step(dt_s, tau_s, ground_mps=ground_mps, bow=bow, through_mps=through_mps, r_radps=r_radps)
        self._kept_s += dt_s
        if self._kept_s >= _KEPT_S:
            self._kept_s = 0.0
            self._before.append(deepcopy((self._drift, self._current)))

    def turned_by_rad(
        self, dt_s: float, *, ground_mps: _Pair, bow: _Pair, through_mps: _Pair, told: SeenFix | None
    ) -> float | None:
        """Return how far off the heading thrust moves the vessel, where that proves it wrong: what it taught of the water is taken back.

        ``told``: the fix that is new at this tick.
        """
        off_rad = self._witness.step(dt_s, bow=bow, through_mps=through_mps, told=told)
        if off_rad is not None:
            self._witness.clear()
            self.take_back(_TAUGHT_S)
            self._fit(ground_mps, (math.cos(off_rad), math.sin(off_rad)), bow=bow, through_mps=through_mps)
        return off_rad

    def _fit(self, ground_mps: _Pair, turned: _Pair, *, bow: _Pair, through_mps: _Pair) -> None:
        """Keep the water if it explains the way with the bow turned so; else the wrong bow made it, and it begins anew by this way."""
        (cos, sin), (north, east) = turned, bow
        bow = (north * cos - east * sin, north * sin + east * cos)
        current = CurrentFilter()
        current.step(0.0, 1.0, ground_mps=ground_mps, bow=bow, through_mps=through_mps, r_radps=0.0)
        if math.dist(current.mps, self._current.mps) <= _FITS_MPS:
            return
        self._drift, self._current, self._is_guess = DriftFilter(), current, True
        self._drift.carried(1.0, current.mps)
        self._before.clear()

    def take_back(self, seconds: float) -> None:
        """The heading was wrong for so long: take the water as it was before that."""
        age_s = self._kept_s
        while len(self._before) > 1 and age_s < seconds:
            self._before.pop()
            age_s += _KEPT_S
        if self._before:
            self._drift, self._current = deepcopy(self._before[-1])
        self._kept_s = 0.0

    def recall(self, state: EstimatedState) -> tuple[EstimatedState, _Pair | None]:
        """Take the water as it was up to a minute ago: what was learnt since is thrust that was not there.

        Return the state with that water, and the surge and sway through it that the vessel must have now, m/s; None where nothing is known.
        """
        vn, ve, psi = state.vx_mps, state.vy_mps, state.psi_rad
        if not self._before or vn is None or ve is None or psi is None:
            return state, None
        while len(self._before) > 1:
            self._before.pop()
        self._drift, self._current = deepcopy(self._before[0])
        through_mps = self._current.by_file((vn, ve), (math.cos(psi), math.sin(psi)))
        return self._as_known(state), through_mps

    def _as_known(self, state: EstimatedState) -> EstimatedState:
        (drift_n, drift_e), (current_n, current_e) = self.drift_mps, self.current_mps
        return replace(
            state,
            drift_n_mps=drift_n,
            drift_e_mps=drift_e,
            current_n_mps=current_n,
            current_e_mps=current_e,
            made_share=self.made_share,
        )
