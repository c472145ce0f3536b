"""Which suspect explains what the hull does: recursive likelihood ratios, one per suspect.

Wind and current push slowly, and each suspect is weighed with an estimate of that push beside it, so only what begins or
changes with the commands counts. A suspect whose effect is small against the weather's noise gathers no evidence.
Two sums are kept: one against a healthy boat, bounded and leaking, says whether there is anything (CUSUM); one among the
suspects, with heavy tails and without bounds since the suspicion began, says which.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.value import value

from .causes import Cause
from .residual import Sample
from .suspects import Suspect

_PUSH_TAU_S: Final = 6.0
"""The slow push is followed so quickly: a gust lasts about as long."""
_BACK_S: Final = 20.0
"""And forgotten so slowly: nothing pushes for ever."""
_WEATHER_TAU_S: Final = 25.0
"""The noise is that of the last few gusts."""
_CLIP: Final = 9.0
"""Variances that one sample can count for in the noise: a fault's first second must not drown the fault."""
_SETTLED_S: Final = 10.0
"""Low-passes and drift have settled."""
_ALIKE: Final = 2.0
"""Samples that say the same once: they lie closer than the low-pass."""
_MOST_STEP: Final = 6.0
"""Evidence of one sample: none decides alone."""
_MOST_RATIO: Final = 25.0
"""Variances beyond which a misfit is no worse."""
_TAILS: Final = 6.0
"""Misfits have heavy tails: model errors in a spin are no noise."""
_LEAK_S: Final = 20.0
"""A helm answers to gusts, so gusts look a little like a helm that does nothing: such evidence comes slowly, and leaks away."""
_NEAR: Final = 0.05
"""Share by which a suspect's own effect may be off."""
_MODEL: Final = 0.08
"""Share of the thrust by which a fitted model is off."""
_SUSPICION: Final = 6.0
"""From here on the drift is frozen and suspects are compared: what wind favours before must not count for the fault after it."""
_ENOUGH: Final = 30.0
"""What clean gales of hours reach under way, and half as much again; a lost thruster brings sixty in six seconds."""
_ENOUGH_ON_STATION: Final = 45.0
"""On station the thrust follows the gusts."""
_APART: Final = 4.0
"""Odds of fifty to one against the next cause."""
_HELD_S: Final = 3.0
"""A reversed propeller looks like a lost one while it stops."""
_GIVE_UP_S: Final = 40.0
"""What is not told apart by then was weather or something that is no suspect."""

Pair = tuple[float, float]


@value
class Bounds:
    """What this vessel's weather and sensors can do, in surge (N) and yaw (Nm)."""

    least: Pair
    """Least variance of what is unexplained."""
    first: Pair
    """And what is taken for it until the weather is known."""
    most: Pair
    """The greatest push that a suspect may need beside it."""
    lateral_m: float


class Weighing:
    """One vessel's; one call per sample."""

    def __init__(self, among: tuple[Suspect, ...], bounds: Bounds) -> None:
        self._among, self._bounds = among, bounds
        self.forget()

    def forget(self) -> None:
        self._seen_s, self._variance = 0.0, list(self._bounds.first)
        self._push = [0.0, 0.0]
        self._begin()

    def _begin(self) -> None:
        """No suspicion."""
        count = len(self._among)
        self._against, self._score = [0.0] * count, [0.0] * count
        self._pushes = [[0.0, 0.0] for _ in range(count)]
        self._suspected_s = self._held_s = 0.0

    @property
    def suspected(self) -> bool:
        """Something is unexplained that a suspect explains."""
        return self._suspected_s > 0.0

    def step(self, step_s: float, sample: Sample) -> Cause | None:
        """Weigh one sample; return the cause that it decides for."""
        self._seen_s += step_s
        if self._seen_s < _SETTLED_S:
            for axis in (0, 1):
                self._push[axis] += 0.5 * (sample.unexplained[axis] - self._push[axis])
            return None
        spread = self._spread(sample.thrust_n)
        self._weigh(step_s, sample, spread)
        self._follow(step_s, sample.unexplained)
        most = max(self._against)
        self._suspected_s = self._suspected_s + step_s if most > _SUSPICION else 0.0
        if not self._suspected_s:
            self._score = [0.0] * len(self._among)
        elif self._suspected_s > _GIVE_UP_S:
            self._begin()
        return self._decide(step_s, most, _ENOUGH_ON_STATION if sample.on_station else _ENOUGH)

    def _spread(self, thrust_n: float) -> Pair:
        """Variances of a healthy boat's samples."""
        off_n = _MODEL * thrust_n
        off_nm = off_n * self._bounds.lateral_m
        return self._variance[0] + off_n * off_n, self._variance[1] + off_nm * off_nm

    def _weigh(self, step_s: float, sample: Sample, spread: Pair) -> None:
        healthy = 0.0
        for axis in (0, 1):
            miss = sample.unexplained[axis] - self._push[axis]
            healthy += min(miss * miss / spread[axis], _MOST_RATIO)
        leak = 1.0 - step_s / _LEAK_S
        for k, effects in enumerate(sample.effects):
            if self._against[k] <= 0.0 and not self.suspected:
                self._pushes[k][:] = self._push
            bounded, tailed = self._misfit(step_s, sample.unexplained, effects, spread, self._pushes[k])
            gained = 0.5 * (healthy - bounded) / _ALIKE
            gained = max(-_MOST_STEP, min(_MOST_STEP, gained))
            self._against[k] = max(0.0, leak * self._against[k] + gained)
            self._score[k] -= 0.5 * tailed / _ALIKE

    def _misfit(self, step_s: float, unexplained: Pair, effects: Pair, spread: Pair, push: list[float]) -> Pair:
        """Minus twice the log-likelihood of one sample under one suspect, bounded and with heavy tails; its push follows."""
        bounded = tailed = 0.0
        for axis in (0, 1):
            miss = unexplained[axis] - effects[axis] - push[axis]
            near = _NEAR * effects[axis]
            wide = 1.0 + near * near / spread[axis]
            ratio, size = miss * miss / (wide * spread[axis]), math.log(wide)
            bounded += min(ratio + size, _MOST_RATIO)
            tailed += _TAILS * math.log1p(ratio / _TAILS) + size
            most, followed = self._bounds.most[axis], _carried(step_s, push[axis], miss)
            push[axis] = max(-most, min(most, followed))
        return bounded, tailed

    def _follow(self, step_s: float, unexplained: Pair) -> None:
        """The slow push and the weather, as a healthy boat would have them."""
        share = step_s / _WEATHER_TAU_S * (0.2 if self.suspected else 1.0)
        for axis in (0, 1):
            miss = unexplained[axis] - self._push[axis]
            variance = self._variance[axis]
            variance += share * (min(miss * miss, _CLIP * variance) - variance)
            self._variance[axis] = max(self._bounds.least[axis], variance)
            self._push[axis] = _carried(step_s, self._push[axis], miss)

    def _decide(self, step_s: float, most: float, enough: float) -> Cause | None:
        self._held_s = self._held_s + step_s if most > enough else 0.0
        if self._held_s < _HELD_S:
            return None
        score = self._score
        best = max(range(len(score)), key=score.__getitem__)
        cause = self._among[best].cause
        other = max(score[k] for k, suspect in enumerate(self._among) if suspect.cause is not cause)
        return cause if score[best] - other > _APART and self._against[best] > enough else None


def _carried(step_s: float, push: float, miss: float) -> float:
    return (1.0 - step_s / _BACK_S) * (push + step_s / _PUSH_TAU_S * miss)
