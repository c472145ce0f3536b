"""How steady the current of a record is: asked of the record itself.

A drift that may change freely from window to window swallows what a hull's drag and thrust make of its speed, all the more where the
receiver is noisy and the hull slow; one that may not change at all makes drag and thrust of the tide. The likeliest change is the one
under which the record has the greatest evidence (MacKay, Bayesian interpolation): fit and what it costs to be so free.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from .problem import DRIFT_SD, NUISANCES, Problem
from .settle import weight

Array = Any

_TRIED: Final = (0.01, 0.014, 0.02, 0.028, 0.04, 0.056, 0.08)
"""m/s from one window to the next. The least lets a current go 0.1 m/s its own way in half an hour; the most is a tidal race."""
_DRIFTS: Final = (3, 4)
"""Of a window's own unknowns; the others are its start, what its compass is off by, and its gust."""


def drift_change(problem: Problem, x: Array) -> float:
    """Return the likeliest change of the current from one window to the next, m/s, with the fit near ``x``."""
    says, scores, places = by_window(problem, x)
    matrix, score = _together(problem, says, places), np.zeros(_size(problem))
    np.add.at(score, places, scores)
    towards = matrix @ _at(problem, x) - score
    return max(_TRIED, key=lambda change: _evidence(problem, change, matrix, towards))


def _size(problem: Problem) -> int:
    return len(problem.unknowns) + len(_DRIFTS) * problem.windows.count


def _at(problem: Problem, x: Array) -> Array:
    theta, nuisance = problem.split(x)
    return np.concatenate([theta, nuisance[list(_DRIFTS)].ravel()])


def _evidence(problem: Problem, change: float, matrix: Array, towards: Array) -> float:
    """Logarithm of the record's likelihood, up to a constant, with all unknowns integrated out."""
    links, _ = problem.windows.links()
    precision = matrix + believed(problem, change)
    fit = towards @ np.linalg.solve(precision, towards)
    return float(0.5 * fit - 0.5 * np.linalg.slogdet(precision)[1] - len(_DRIFTS) * len(links) * np.log(change))


def believed(problem: Problem, change: float) -> Array:
    """Precision of the unknowns and then of the drifts north and east before the record: their priors, and a current so slow."""
    links, ago = problem.windows.links()
    count, windows = len(problem.unknowns), problem.windows.count
    steps = np.zeros((len(links), windows))
    size = DRIFT_SD / (change * np.sqrt(ago))
    steps[np.arange(len(links)), links], steps[np.arange(len(links)), links - 1] = size, -size
    found = np.eye(_size(problem))
    for first in (count, count + windows):
        found[first : first + windows, first : first + windows] += steps.T @ steps
    return found


def precision_of(problem: Problem, says: Array, places: Array) -> Array:
    """Precision of the unknowns and then of the drifts, with the record."""
    return believed(problem, problem.noise.drift) + _together(problem, says, places)


def _together(problem: Problem, says: Array, places: Array) -> Array:
    """What all windows say of the unknowns and the drifts: their shares of the normal matrix, each in its place."""
    found = np.zeros((_size(problem), _size(problem)))
    for share, here in zip(says, places, strict=True):
        found[np.ix_(here, here)] += share
    return found


def by_window(problem: Problem, x: Array) -> tuple[Array, Array, Array]:
    """What each window says of the unknowns and its own drift, its other unknowns taken out: its share of the normal matrix, its
    score, and where these stand among all unknowns and drifts.
    """
    theta, nuisance = problem.split(x)
    common, own = problem.differences(x)
    off = np.nan_to_num(problem.noise.whiten(problem.off(x)))
    count, windows, says, scores, places = len(theta), problem.windows.count, [], [], []
    for k in range(windows):
        root = np.sqrt(weight(off[:, :, k].ravel()))
        slopes = np.concatenate([common[:, :, k].reshape(-1, count), own[:, :, k].reshape(-1, NUISANCES)], axis=1)
        a, e = _without_others(slopes * root[:, None], off[:, :, k].ravel() * root, count, nuisance[:, k])
        says.append(a.T @ a)
        scores.append(a.T @ e)
        places.append(np.concatenate([np.arange(count), [count + k, count + windows + k]]))
    return np.stack(says), np.stack(scores), np.stack(places)


def _without_others(slopes: Array, left: Array, count: int, own: Array) -> tuple[Array, Array]:
    """Slopes by the unknowns and the drifts, and residuals, without what the window's other unknowns can bear."""
    others = [k for k in range(NUISANCES) if k not in _DRIFTS]
    columns = [count + k for k in others]
    q, _ = np.linalg.qr(np.concatenate([slopes[:, columns], np.eye(len(others))]))
    kept = np.delete(slopes, columns, axis=1)
    a, e = np.concatenate([kept, np.zeros((len(others), kept.shape[1]))]), np.concatenate([left, own[others]])
    return a - q @ (q.T @ a), e - q @ (q.T @ e)
