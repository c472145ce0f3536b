"""Where a fit comes to rest, held against SciPy's own solver, which takes a matrix of a few unknowns whole."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix

from companion.tuning.settle import Box, loss, settled


class Decay:
    """Three decaying curves that share a rate and have a height each, measured with spikes."""

    def __init__(self, seed=1):
        dice = np.random.default_rng(seed)
        self.t = np.linspace(0.0, 3.0, 40)
        self.told = np.stack([h * np.exp(-0.8 * self.t) for h in (1.0, 2.0, 0.5)]) / 0.05
        self.told += dice.normal(size=self.told.shape)
        self.told[0, 5], self.told[2, 30] = 80.0, -60.0

    def residuals(self, x):
        curves = np.stack([h * np.exp(-np.exp(x[0]) * self.t) for h in x[1:]]) / 0.05
        return (curves - self.told).ravel()

    def slopes(self, x):
        step = 1e-6
        return csr_matrix(
            np.stack([(self.residuals(x + step * e) - self.residuals(x)) / step for e in np.eye(4)], axis=1)
        )


def bounds(low=-np.inf, high=np.inf):
    return Box(np.array([low, -np.inf, -np.inf, -np.inf]), np.array([high, np.inf, np.inf, np.inf]))


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0, 0.0), (1.0, 5.0, -3.0, 9.0), (-3.0, 1.0, 1.0, 1.0)])
@pytest.mark.parametrize("low", [-np.inf, 0.0])
def test_it_rests_where_the_library_does_from_any_start_and_within_bounds(start, low):
    problem, steps = Decay(), []
    found = settled(problem, np.array(start), bounds(low), steps.append)
    right = least_squares(
        problem.residuals, [0.5, 1, 1, 1], bounds=(bounds(low).low, np.inf), loss="soft_l1", f_scale=2.0
    )
    assert loss(problem.residuals(found)) == pytest.approx(right.cost, abs=0.02)
    assert found == pytest.approx(right.x, abs=0.01)
    assert found[0] >= low
    assert steps == list(range(1, len(steps) + 1))


def test_what_is_held_at_both_ends_does_not_move():
    problem = Decay()
    found = settled(problem, np.array([9.0, 0.0, 0.0, 0.0]), bounds(-1.0, -1.0), lambda step: None)
    assert found[0] == -1.0
    assert found[2] > 1.0


def test_spikes_do_not_pull():
    clean = Decay()
    clean.told[0, 5], clean.told[2, 30] = clean.told[0, 4], clean.told[2, 29]
    at = [settled(p, np.zeros(4), bounds(), lambda step: None) for p in (clean, Decay())]
    assert at[1] == pytest.approx(at[0], abs=0.05)
