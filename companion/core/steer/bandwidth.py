"""How fast a heading loop may be at each speed, worked out from the vessel file: gains that leave margins at a stated delay.

The greatest bandwidth that keeps them is taken, with more damping or less integral where the settings' own leave too
little. Where none does, as on a hull without rudders that is directionally unstable, the gains with the best worst margin
are: there the lowest bandwidth is the one that lets the hull go. And the speed is found up to which the bars hold at all;
faster, the vessel is not sailed.
"""

from __future__ import annotations

import cmath
import functools
import math
from dataclasses import dataclass

from ..hull import Handling, VesselConfig
from .yaw_loop import DELAY_S, LoopJudge, LoopMargins, yaw_plant

GAIN_BAR_DB = 8.0
PHASE_BAR_DEG = 45.0
"""What every gain set must leave (vessel-control §4.6)."""
_WISH_DB, _WISH_DEG = 9.0, 49.7
_LEAST_DB, _LEAST_DEG = 8.5, 47.0
"""What is asked of the file's vessel, and what will do where that would cost a quarter of the bandwidth: the real one differs."""
_SLOWER = 0.75
"""A bandwidth this much below the wished one is not worth better margins."""
_POINTS = 8
"""Speeds of the schedule, evenly from rest to the greatest."""
_STEPS = 20
"""The greatest bandwidth is tried, and its twentieths down to a tenth."""
_STIFFER = (1.0, 1.2, 1.5, 2.0)
_INTEGRALS = (1.0, 0.3)
"""Factors on the damping and the integral, tried in this order where the settings' own leave too little."""
_REFINED = 8
"""Steps between two speeds of the table in which the limit is looked for."""
_AGREES = 0.15
"""The answer of a loop with one pole, by which every boat was sailed so far, stands where the whole loop differs no more."""
_PHASE_RAD = math.radians(47.0)
_GAIN = 10.0 ** (9.0 / 20.0)
"""9 dB: one more than the bar, for the steps of the frequencies."""
_FREQUENCIES = tuple(0.05 * 1.12**k for k in range(60))


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the settings ask of the heading loop."""

    most_radps: float
    """Greatest bandwidth."""
    zeta: float
    integral: float
    """Share of the proportional gain per second."""
    late_s: float = 0.0
    """Age of headings when they arrive, beside the delay that every set of gains bears."""


@dataclass(frozen=True, slots=True)
class HeadingGain:
    """Gains at one speed, and what they leave."""

    omega_radps: float
    stiffer: float
    """Factor on 2 zeta omega."""
    integral: float
    margins: LoopMargins

    @property
    def holds(self) -> bool:
        """Whether the bars are kept."""
        return self.leaves(GAIN_BAR_DB, PHASE_BAR_DEG)

    def leaves(self, gain_db: float, phase_deg: float) -> bool:
        return self.margins.gain_db >= gain_db and self.margins.phase_deg >= phase_deg

    def worth(self) -> float:
        """The margins over their bars, whichever is less."""
        return min(self.margins.gain_db / GAIN_BAR_DB, self.margins.phase_deg / PHASE_BAR_DEG)


@dataclass(frozen=True, slots=True)
class Schedule:
    """Gains over speed in equal steps from rest, and how fast the vessel may be sailed with them."""

    gains: tuple[HeadingGain, ...]
    step_mps: float
    steady_mps: float
    """Greatest speed through the water at which the bars hold."""
    lowered: bool
    """It is less than the hull's top speed."""

    @property
    def worst(self) -> HeadingGain:
        """Where the loop is nearest to its bars."""
        return min(self.gains, key=HeadingGain.worth)


@functools.lru_cache(maxsize=32)
def heading_schedule(vessel: VesselConfig, wishes: Wishes) -> Schedule:
    """Return the gains over speed. The same vessel and wishes are worked out once in a process."""
    handling = Handling(vessel)
    top_mps = handling.top_mps
    step_mps = top_mps / _POINTS
    gains = _table(handling, wishes, step_mps)
    bad = next((k for k, gain in enumerate(gains) if not gain.holds), None)
    if bad is None:
        return Schedule(gains, step_mps, top_mps, False)
    steady_mps = 0.5 * step_mps
    for part in range(1, _REFINED * bad + 1):
        mps = step_mps * part / _REFINED
        if mps > (bad - 1) * step_mps and not heading_gain(handling, wishes, mps).holds:
            break
        steady_mps = mps
    return Schedule(_table(handling, wishes, steady_mps / _POINTS), steady_mps / _POINTS, steady_mps, True)


def _table(handling: Handling, wishes: Wishes, step_mps: float) -> tuple[HeadingGain, ...]:
    under_way = tuple(heading_gain(handling, wishes, k * step_mps) for k in range(1, _POINTS + 1))
    # where nothing turns the boat at rest no gain holds or fails there, and those of steerage way stand
    return (heading_gain(handling, wishes, 0.0) if handling.model.turns_at_rest else under_way[0], *under_way)


def heading_gain(handling: Handling, wishes: Wishes, speed_mps: float) -> HeadingGain:
    """Return the gains at one speed through the water."""
    trial = _Trial(handling, wishes, speed_mps)
    omegas = [wishes.most_radps * step / _STEPS for step in range(_STEPS, 1, -1)]
    wished = enough = None
    for omega in omegas:
        gain = trial.gain(omega)
        if enough is None and gain.leaves(_LEAST_DB, _LEAST_DEG):
            enough = gain
        if gain.leaves(_WISH_DB, _WISH_DEG):
            wished = gain
            break
    if enough is not None:
        best = wished if wished and wished.omega_radps >= _SLOWER * enough.omega_radps else enough
        as_ever = trial.gain(trial.one_pole(omegas) or omegas[-1])
        agrees = abs(as_ever.omega_radps / best.omega_radps - 1.0) <= _AGREES
        return as_ever if agrees and as_ever.leaves(_LEAST_DB, _LEAST_DEG) else best
    every = [
        trial.gain(omega, stiffer, factor * wishes.integral)
        for factor in _INTEGRALS
        for stiffer in _STIFFER
        for omega in omegas
    ]
    # under way a weak loop is swung by every corner, at rest nothing hurries it
    firm = [gain for gain in every if speed_mps > 0.0 and gain.leaves(_WISH_DB, _WISH_DEG)]
    return max(firm, key=lambda gain: gain.omega_radps) if firm else max(every, key=HeadingGain.worth)


def plain_margins(handling: Handling, wishes: Wishes, omega_radps: float, speed_mps: float) -> LoopMargins:
    """Return what a bandwidth leaves with damping and integral as the settings have them."""
    return _Trial(handling, wishes, speed_mps).gain(omega_radps).margins


class _Trial:
    """Gains tried on one vessel at one speed."""

    def __init__(self, handling: Handling, wishes: Wishes, speed_mps: float) -> None:
        vessel, hull = handling.vessel, handling.vessel.hull
        self._wishes = wishes
        self._inertia = hull.turning_kgm2
        self._counted = max(handling.yaw_damping(speed_mps)[0], 0.0)
        self._lag_s = max(vessel.thruster.lag_s if handling.model.lateral_m else 0.0, vessel.helm_lag_s)
        self._delay_s = DELAY_S + wishes.late_s
        self._judge = LoopJudge(yaw_plant(vessel, speed_mps), self._delay_s)

    def gain(self, omega: float, stiffer: float = 1.0, integral: float | None = None) -> HeadingGain:
        """Judge one bandwidth, with the settings' damping and integral or others."""
        inertia, wishes = self._inertia, self._wishes
        share = wishes.integral if integral is None else integral
        kp = inertia * omega * omega
        kd = max(2.0 * wishes.zeta * omega * stiffer * inertia - self._counted, 0.0)
        return HeadingGain(omega, stiffer, share, self._judge.margins(kp, share * kp, kd))

    def one_pole(self, omegas: list[float]) -> float:
        """The greatest bandwidth that a hull of one pole would allow, behind one lag; 0 when none."""
        damping, wishes = self._counted / self._inertia, self._wishes
        for omega in omegas:
            if _holds(damping, self._lag_s, omega, wishes, self._delay_s):
                return omega
        return 0.0


def _holds(damping: float, lag_s: float, omega: float, wishes: Wishes, delay_s: float) -> bool:
    """True when the loop, per unit of inertia, keeps both margins."""
    kp = omega * omega
    kd = max(2.0 * wishes.zeta * omega - damping, 0.0)
    last_size, last_phase = math.inf, 0.0
    for w in _FREQUENCIES:
        s = complex(0.0, w)
        loop = (
            (kp + kp * wishes.integral / s + kd * s) / (s * (s + damping)) / (1.0 + s * lag_s) * cmath.exp(-s * delay_s)
        )
        size, phase = abs(loop), cmath.phase(loop)
        phase -= 2.0 * math.pi if phase > 0.0 else 0.0
        if last_size > 1.0 >= size and phase < -math.pi + _PHASE_RAD:
            return False
        if last_phase > -math.pi >= phase and size > 1.0 / _GAIN:
            return False
        last_size, last_phase = size, phase
    return True
