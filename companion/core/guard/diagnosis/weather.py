"""What wind, current and sensors leave unexplained on a healthy boat: a slow push, noise about it, and how long that noise lasts."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.value import value

from .residual import Sample

Pair = tuple[float, float]

GALE_MPS: Final = 10.0
"""More wind than such boats are sent out in: what it does to the hull must never be taken for a fault."""
SETTLED_S: Final = 10.0
"""Low-passes and drift have settled."""
_PUSH_TAU_S: Final = 15.0
"""The slow push is followed so slowly: three gusts. What begins with a fault must not be taken for wind before the fault is told."""
_BACK_S: Final = 20.0
"""And forgotten so slowly: nothing pushes for ever."""
_WEATHER_TAU_S: Final = 25.0
"""The noise is that of the last few gusts."""
_PRIOR_S: Final = 6.0
"""What is taken for the noise at first counts as much as one gust that was seen."""
_SUSPICIOUS: Final = 0.2
"""While something is suspected the noise is followed so much more slowly: it may be the fault."""
_CLIP: Final = 9.0
"""Variances that one sample can count for in the noise: a fault's first second must not drown the fault."""
_MODEL: Final = 0.03
"""Share of the thrust by which a fitted model is off otherwise from moment to moment,"""
_MODEL_CHANGE: Final = 0.1
"""and of what has just been put on or taken off: what a model is off by for long is in the slow push already."""
_FILE: Final = 0.5
"""Of what a file is off by in her speed: so much of the thrust it is off by from moment to moment. Thrust is off by twice that share, and
most of it lasts. Of 80 sound boats with files wrong by half in every figure 11 were told of a thruster, with this and the bars of now 5."""
_TWICE: Final = 2.0
"""Samples that say the same once in quiet weather: they lie closer than the low-pass."""
_QUIET: Final = 0.72
"""How alike two neighbouring samples of white sensor noise are after the low-pass: exp(-SAMPLE_S / TAU_S)."""
_GUSTY: Final = 0.97
"""The slowest weather that can be told from the slow push."""
_QUIET_TIMES: Final = (1.0 + _QUIET) / (1.0 - _QUIET)
"""So many such neighbours say what one independent sample says: the sum of a geometric series of their likeness."""


_APART_S: Final = 2.0
"""Samples so far apart tell the noise's size anew: squares of neighbours that are ``_QUIET`` alike repeat themselves for
(1 + q) / (1 - q) = 3 samples, q the square of that, and weather lasts a little longer."""


@value
class Bounds:
    """What this vessel's weather and sensors can do, in surge (N) and yaw (Nm)."""

    least: Pair
    """Least variance of what is unexplained."""
    first: Pair
    """And what is taken for it until the weather is known."""
    most: Pair
    """The greatest push that a suspect may need beside it."""
    lever_m: float
    """Yaw moment over thrust when the model is off."""


@value
class HealthyNoise:
    """Of one sample of a healthy boat, in surge and yaw."""

    variance: Pair
    alike: Pair
    """So many such samples say the same once."""
    known: float
    """From so many independent samples the variance is known: misfits over it follow Student's law, not Gauss's."""


class Weather:
    """One vessel's; ``follow`` each sample."""

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self.forget()

    def forget(self) -> None:
        """Nothing is known."""
        self.seen_s = 0.0
        self.push = [0.0, 0.0]
        """Surge (N) and yaw (Nm) that last."""
        self._variance = list(self._bounds.first)
        self._both = [_QUIET * first for first in self._variance]
        self._last = [0.0, 0.0]
        self._thrust_n = 0.0
        """What has been asked for while the push was learnt."""

    def upset(self) -> None:
        """The water has changed: the push is found anew, the noise is what it was."""
        self.seen_s = 0.0

    @property
    def settled(self) -> bool:
        return self.seen_s >= SETTLED_S

    @property
    def gale_share(self) -> float:
        """The noise, as a share of that of a gale: the larger of surge and yaw."""
        found, first = self._variance, self._bounds.first
        return math.sqrt(max(found[0] / first[0], found[1] / first[1]))

    def noise(self, sample: Sample) -> HealthyNoise:
        """With the thrust of this sample, a file that is off as much, and a yaw moment that is off for the way aside."""
        model = max(_MODEL, _FILE * sample.file_off)
        off_n = model * sample.thrust_n + _MODEL_CHANGE * abs(sample.thrust_n - self._thrust_n)
        off_nm = math.hypot(off_n * self._bounds.lever_m, sample.aside_nm)
        variance = self._variance[0] + off_n * off_n, self._variance[1] + off_nm * off_nm
        known = max(1.0, self._known_s() / _APART_S)
        return HealthyNoise(variance, (self._alike(0), self._alike(1)), known)

    def _known_s(self) -> float:
        """So long a time stands behind the noise's size."""
        return min(_PRIOR_S + self.seen_s - SETTLED_S, _WEATHER_TAU_S)

    def _alike(self, axis: int) -> float:
        """Of what lasts, samples that are alike say (1 + phi) / (1 - phi) times less; of what comes and goes, less so: between them."""
        phi = max(_QUIET, min(_GUSTY, self._both[axis] / self._variance[axis]))
        times = (1.0 + phi) / (1.0 - phi) / _QUIET_TIMES
        return _TWICE * math.sqrt(times * math.sqrt(times))

    def follow(self, step_s: float, sample: Sample, suspicious: bool) -> None:
        """Take a sample as a healthy boat's."""
        self.seen_s += step_s
        share = step_s / min(self.seen_s, _PUSH_TAU_S)
        self._thrust_n += share * (sample.thrust_n - self._thrust_n)
        for axis, found in enumerate(sample.unexplained):
            if not self.settled:
                self.push[axis] += 0.5 * (found - self.push[axis])
                continue
            miss = found - self.push[axis]
            self._learn(step_s, axis, miss, suspicious)
            self.push[axis] = carried(step_s, self.push[axis], miss)

    def _learn(self, step_s: float, axis: int, miss: float, suspicious: bool) -> None:
        share = step_s / self._known_s()
        variance = self._variance[axis]
        most = _CLIP * variance
        variance += share * (_SUSPICIOUS if suspicious else 1.0) * (min(miss * miss, most) - variance)
        self._variance[axis] = max(self._bounds.least[axis], variance)
        if not suspicious:
            both = max(-most, min(most, miss * self._last[axis]))
            self._both[axis] += share * (both - self._both[axis])
        self._last[axis] = miss


def carried(step_s: float, push: float, miss: float) -> float:
    """A slow push one step later, when a sample missed it by so much."""
    return (1.0 - step_s / _BACK_S) * (push + step_s / _PUSH_TAU_S * miss)
