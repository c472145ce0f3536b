"""Which suspect explains what the hull does: recursive likelihood ratios, one per suspect.

Wind and current push slowly, and each suspect is weighed with an estimate of that push beside it, so only what begins or
changes with the commands counts. A suspect whose effect is small against the weather's noise gathers no evidence.
Two sums are kept: one against a healthy boat, bounded and leaking, says whether there is anything (CUSUM); one among the
suspects, with heavy tails and fading, says which.
"""

from __future__ import annotations

import math
from typing import Final, assert_never

from .causes import Cause
from .residual import Sample
from .suspects import Suspect
from .weather import Bounds, HealthyNoise, Pair, Weather, carried

_MOST_STEP: Final = 6.0
"""Evidence of one sample: none decides alone."""
_MOST_RATIO: Final = 25.0
"""Variances beyond which a misfit is no worse."""
_TAILS: Final = 6.0
"""Misfits have heavy tails: model errors in a spin are no noise."""
_LEAK_S: Final = 20.0
"""A helm answers to gusts, so gusts look a little like a helm that does nothing: such evidence comes slowly, and leaks away."""
_SCORE_S: Final = 10.0
"""Suspects are compared over this time: what favoured one before the fault must not count for ever."""
_NEAR: Final = 0.05
"""Share by which a suspect's own effect may be off."""
_SUSPICION: Final = 6.0
"""From here on the drift is frozen and suspects are compared: what wind favours before must not count for the fault after it."""
_ENOUGH: Final = 12.0
"""Thirty hours of gale and blow reach 0.63 of it under way. It was 20, of which they reached 0.38."""
_ENOUGH_ON_STATION: Final = 60.0
"""On station the thrust follows the gusts: there hours of gale reach fifty-three."""
_QUIET: Final = 0.6
"""In quiet water it takes so much of that: there is no gust that could be it."""
_HELM: Final = 1.25
"""A helm that answers gusts looks most like one that does nothing."""
_AGAINST: Final = 0.8
"""And so much, in any weather, for what works the wrong way: no gust turns a boat against its helm."""
_APART: Final = 4.0
"""Odds of fifty to one against the next cause, as soon as there is enough; the longer one stays ahead, the less it needs."""
_SURE, _LESS = 8.5, 0.6
"""Odds of five thousand to one: from there on this share of the evidence will do under way. A gust fits several causes about as badly:
in clean water what is so far ahead has half of what is enough at most. On station it has all of it: there thrust follows the gust."""
_HELD_S: Final = 3.0
"""A reversed propeller looks like a lost one while it stops,"""
_SEEN_S: Final = 1.0
"""and nothing else looks like another fault while it sets in: two samples say so."""
_GIVE_UP_S: Final = 40.0
"""What is not told apart by then was weather or something that is no suspect."""


class Weighing:
    """One vessel's; one call per sample."""

    def __init__(self, among: tuple[Suspect, ...], bounds: Bounds) -> None:
        self._among, self._bounds = among, bounds
        self._weather = Weather(bounds)
        self.forget()

    def forget(self) -> None:
        """Another arming, or a time without position or heading."""
        self._weather.forget()
        self._begin()
        self.opinion: frozenset[Cause] | None = None
        """The causes that may be behind what the hull does; empty when it is healthy, None before the weather is known."""

    def _begin(self) -> None:
        """No suspicion."""
        count = len(self._among)
        self._against, self._score = [0.0] * count, [0.0] * count
        self._pushes = [[0.0, 0.0] for _ in range(count)]
        self._suspected_s = self._held_s = 0.0
        self._base = _ENOUGH

    @property
    def suspected(self) -> bool:
        """Something is unexplained that a suspect explains."""
        return self._suspected_s > 0.0

    def _opinion(self) -> frozenset[Cause]:
        scores = self._odds()
        best = max(scores)
        return frozenset(
            one.cause
            for one, against, score in zip(self._among, self._against, scores, strict=True)
            if against > self._enough(one.cause) and score > best - _APART
        )

    def _odds(self) -> list[float]:
        """What speaks for each suspect, less what spoke against it before."""
        return [score - one.rare for one, score in zip(self._among, self._score, strict=True)]

    def _enough(self, cause: Cause) -> float:
        """The evidence that it takes in this weather."""
        match cause:
            case Cause.WEAK | Cause.REVERSED | Cause.PORT_WEAK | Cause.STARBOARD_WEAK | Cause.SLIP:
                return self._base
            case Cause.RUDDERS_STILL:
                return self._base * _HELM
            case Cause.PORT_REVERSED | Cause.STARBOARD_REVERSED | Cause.SWAPPED | Cause.RUDDERS_REVERSED:
                return self._base * _AGAINST
            case _:
                assert_never(cause)

    def step(self, step_s: float, sample: Sample) -> Cause | None:
        """Weigh one sample; return the cause that it decides for."""
        if sample.upset:
            self._weather.upset()
            self._begin()
            self.opinion = frozenset()
        if not self._weather.settled:
            self._weather.follow(step_s, sample, suspicious=False)
            return None
        self._weigh(step_s, sample, self._weather.noise(sample))
        self._weather.follow(step_s, sample, self.suspected)
        self._suspected_s = self._suspected_s + step_s if max(self._against) > _SUSPICION else 0.0
        if not self._suspected_s:
            self._score = [0.0] * len(self._among)
        elif self._suspected_s > _GIVE_UP_S:
            self._begin()
        weather = max(_QUIET, min(self._weather.gale_share, 1.0))
        self._base = weather * (_ENOUGH_ON_STATION if sample.on_station else _ENOUGH)
        self.opinion = self._opinion()
        return self._decide(step_s, sample)

    def _weigh(self, step_s: float, sample: Sample, noise: HealthyNoise) -> None:
        healthy = self._healthy(sample, noise)
        leak, fade = 1.0 - step_s / _LEAK_S, 1.0 - step_s / _SCORE_S
        for k, effects in enumerate(sample.effects):
            if self._against[k] <= 0.0 and not self.suspected:
                self._pushes[k][:] = self._weather.push
            bounded, tailed = self._misfit(step_s, sample.unexplained, effects, noise, self._pushes[k])
            gained = max(-_MOST_STEP, min(_MOST_STEP, 0.5 * (healthy - bounded)))
            self._against[k] = max(0.0, leak * self._against[k] + gained)
            self._score[k] = fade * self._score[k] - 0.5 * tailed

    def _healthy(self, sample: Sample, noise: HealthyNoise) -> float:
        """Minus twice the log-likelihood of one sample of a boat that has nothing, bounded."""
        found = 0.0
        for axis in (0, 1):
            miss = sample.unexplained[axis] - self._weather.push[axis]
            found += min(_odd(miss * miss / noise.variance[axis], noise.known), _MOST_RATIO) / noise.alike[axis]
        return found

    def _misfit(self, step_s: float, unexplained: Pair, effects: Pair, noise: HealthyNoise, push: list[float]) -> Pair:
        """The same under one suspect, bounded and with heavy tails; its push follows."""
        bounded = tailed = 0.0
        for axis in (0, 1):
            miss = unexplained[axis] - effects[axis] - push[axis]
            near, variance, alike = _NEAR * effects[axis], noise.variance[axis], noise.alike[axis]
            wide = 1.0 + near * near / variance
            ratio, size = miss * miss / (wide * variance), math.log(wide)
            bounded += min(_odd(ratio, noise.known) + size, _MOST_RATIO) / alike
            tailed += (_TAILS * math.log1p(ratio / _TAILS) + size) / alike
            most, followed = self._bounds.most[axis], carried(step_s, push[axis], miss)
            push[axis] = max(-most, min(most, followed))
        return bounded, tailed

    def _leaves_n(self, sample: Sample, suspect: int) -> float:
        """The surge force that a suspect and the weather beside it leave unexplained."""
        return abs(sample.unexplained[0] - sample.effects[suspect][0] - self._pushes[suspect][0])

    def _decide(self, step_s: float, sample: Sample) -> Cause | None:
        score, among, on_station = self._odds(), self._among, sample.on_station
        best = max(range(len(score)), key=score.__getitem__)
        cause = among[best].cause
        ahead = score[best] - max(score[k] for k, suspect in enumerate(among) if suspect.cause is not cause)
        is_enough = self._against[best] > self._enough(cause) * (1.0 if on_station else _share_needed(ahead))
        is_any = is_enough or any(
            against > self._enough(one.cause) for one, against in zip(among, self._against, strict=True)
        )
        # A boat on a tow rope is pulled with the force of a gale and more by what no thruster gives.
        is_towed = self._leaves_n(sample, best) > self._bounds.most[0]
        self._held_s = self._held_s + step_s if is_any and not is_towed else 0.0
        if not is_enough or self._held_s < _least_s(cause):
            return None
        return cause if ahead > _APART * _HELD_S / self._held_s else None


def _odd(ratio: float, known: float) -> float:
    """Minus twice the log-likelihood of a misfit, squared over a variance that is known from so few independent samples.

    A boat that has met three gusts has not met the greatest: five of their sigmas are no proof.
    """
    return (known + 1.0) * math.log1p(ratio / known)


def _least_s(cause: Cause) -> float:
    """So long something must be wrong until it is told of this."""
    is_little = cause in (Cause.WEAK, Cause.PORT_WEAK, Cause.STARBOARD_WEAK, Cause.SLIP)
    return _HELD_S if is_little else _SEEN_S


def _share_needed(ahead: float) -> float:
    """Share of the evidence that a cause needs which is so far ahead of the next one."""
    share = 1.0 - (1.0 - _LESS) * (ahead - _APART) / (_SURE - _APART)
    return max(_LESS, min(share, 1.0))
