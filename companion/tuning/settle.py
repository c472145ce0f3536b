"""Where a problem of least squares comes to rest: Levenberg and Marquardt's steps, with a soft loss and within bounds.

A voyage's unknowns stand in an arrow: a few are common to all windows, each window has its own. The matrix of the normal equations
is some hundreds wide and solved whole within milliseconds, so each step is the exact one. SciPy's solver for sparse problems
searches a plane only, and stopped where the way to rest was still a third of its interval from where it ended (Nocedal and Wright,
Numerical Optimization, 10.3; damping after Nielsen 1999).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

Array = Any

_SOFT: Final = 2.0
"""Residuals, in spreads, from which on what is far off counts by its size and no more by its square."""
_SETTLED: Final = 0.02
"""Of the logarithm of likelihood: nothing stands further than a fifth of its spread from where it would end."""
_MOST_STEPS: Final = 40
_FIRST_DAMPING: Final = 1e-3
_MOST_DAMPING: Final = 1e6
"""Steps are then too short to matter: what is left is rounding."""
_MORE: Final = 8.0
_LEAST_SHARE: Final = 0.1
"""How fast damping grows after a step that gained nothing, and how fast it may fall after a good one."""
_CALM_STEPS: Final = 2
_TINY: Final = 1e-12


class Residuals(Protocol):
    """What is off at a point, in spreads, and how that changes with each unknown (sparse)."""

    def residuals(self, x: Array) -> Array: ...
    def slopes(self, x: Array) -> Any: ...


@dataclass(frozen=True, slots=True)
class Box:
    """What each unknown stays within."""

    low: Array
    high: Array

    def keep(self, x: Array) -> Array:
        return np.clip(x, self.low, self.high)

    def free(self, x: Array, score: Array) -> Array:
        """Which unknowns are not held by a bound that they push against."""
        return ~(((x <= self.low) & (score > 0.0)) | ((x >= self.high) & (score < 0.0)))


def settled(problem: Residuals, x: Array, bounds: Box, step_done: Callable[[int], None]) -> Array:
    """Return the point within the bounds, from ``x`` on, where no step makes the loss of the residuals less."""
    x = bounds.keep(x)
    off = problem.residuals(x)
    damping, calm = _FIRST_DAMPING, 0
    for step in range(1, _MOST_STEPS + 1):
        step_done(step)
        hill = _Hill.at(x, off, problem.slopes(x), bounds)
        # a step that leads nowhere finite gains nothing either
        gain = -1.0
        while not gain > 0.0 and damping < _MOST_DAMPING:
            new, hoped = hill.step(damping, bounds)
            new_off = problem.residuals(new)
            gain = loss(off) - loss(new_off)
            damping *= _damping_by(gain / hoped)
        if not gain > 0.0:
            break
        x, off = new, new_off
        calm = calm + 1 if gain < _SETTLED else 0
        if calm == _CALM_STEPS:
            break
    return x


def _damping_by(kept: float) -> float:
    """Factor of the damping after a step that kept so much of what it promised."""
    return max(_LEAST_SHARE, 1.0 - (2.0 * min(kept, 1.0) - 1.0) ** 3) if kept > 0.0 else _MORE


def loss(off: Array) -> float:
    """Half the sum of squares, but of sizes where they are large (pseudo-Huber)."""
    return float(_SOFT**2 * np.sum(np.sqrt(1.0 + (off / _SOFT) ** 2) - 1.0))


def weight(off: Array) -> Array:
    """What a residual counts against one of a straight sum of squares: the soft loss counts what is far off for less."""
    return np.asarray((1.0 + (off / _SOFT) ** 2) ** -0.5)


@dataclass(frozen=True, slots=True)
class _Hill:
    """The loss near a point: its gradient, and a curvature that is nowhere less than its own."""

    x: Array
    score: Array
    curve: Array
    free: Array

    @staticmethod
    def at(x: Array, off: Array, slopes: Any, bounds: Box) -> _Hill:
        counts = weight(off)
        score = slopes.T @ (off * counts)
        curve = np.asarray((slopes.T @ slopes.multiply(counts[:, None]).tocsr()).todense())
        return _Hill(x, score, curve, bounds.free(x, score))

    def step(self, damping: float, bounds: Box) -> tuple[Array, float]:
        """Where a damped step leads, and what it should gain."""
        free = self.free
        inner = self.curve[np.ix_(free, free)]
        move = np.zeros_like(self.x)
        sizes = np.diag(inner)
        damped = inner + damping * np.diag(np.maximum(sizes, _TINY * sizes.max(initial=1.0)))
        move[free] = -np.linalg.solve(damped, self.score[free])
        new = bounds.keep(self.x + move)
        move = new - self.x
        return new, max(float(-self.score @ move - 0.5 * move @ self.curve @ move), _TINY)
