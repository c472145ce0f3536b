"""What a fit takes for noise: each motion's own rhythm is taken out, and a window that pulls the fit to itself counts for what it is."""

import numpy as np
import pytest

from companion.tuning.fit import _clear_of_itself
from companion.tuning.noise import Noise

ROWS, WINDOWS = 72, 60
TURNING = np.broadcast_to(9.0 * np.sin(0.2 * np.arange(ROWS))[:, None, None], (ROWS, 3, WINDOWS))
"""What a helm does that nobody doubts."""


def drawn(keep, spread):
    """Noise (rows, windows) that keeps so much of itself from row to row."""
    dice = np.random.default_rng(1)
    found = np.empty((ROWS, WINDOWS))
    found[0] = dice.normal(size=WINDOWS)
    for k in range(1, ROWS):
        found[k] = keep * found[k - 1] + np.sqrt(1.0 - keep * keep) * dice.normal(size=WINDOWS)
    return spread * found


def test_what_a_slow_receiver_repeats_from_row_to_row_is_taken_out_of_all_three_motions():
    off = np.stack([drawn(0.7, 0.10), drawn(0.85, 0.15), drawn(0.5, 0.03)], axis=1)
    noise = Noise.of(off, TURNING - off)
    clear = noise.whiten(off)
    for part, keep in enumerate((0.7, 0.85, 0.5)):
        assert noise.rhythm[part, 0] == pytest.approx(keep, abs=0.1)
        left = clear[8:, part]
        assert left.std() == pytest.approx(1.0, abs=0.15)
        assert abs((left[1:] * left[:-1]).mean()) < 0.1
        # before the first rows nothing is known, and they are as wide as the whole
        assert clear[:8, part].std() == pytest.approx(1.0, abs=0.2)


def test_slopes_are_whitened_as_residuals_are():
    off = np.stack([drawn(0.7, 0.10), drawn(0.85, 0.15), drawn(0.5, 0.03)], axis=1)
    noise = Noise.of(off, TURNING - off)
    together = noise.whiten(np.stack([off, 2.0 * off], axis=2))
    np.testing.assert_allclose(together[:, :, 1], 2.0 * noise.whiten(off), rtol=1e-9)


def test_white_noise_has_no_rhythm():
    off = np.ones((ROWS, 3, 2))
    np.testing.assert_allclose(Noise.white(0.5, 0.25, 0.1).whiten(off)[5, :, 0], [2.0, 4.0, 10.0])


def test_a_window_in_which_the_helm_only_answers_the_sea_is_hardly_believed():
    off = np.stack([drawn(0.7, 0.10), drawn(0.85, 0.15), drawn(0.5, 0.03)], axis=1)
    helm = np.where(np.arange(WINDOWS) < 30, 0.3, 0.02) * np.sin(0.2 * np.arange(ROWS))[:, None]
    told = Noise.of(off, np.broadcast_to(helm[:, None], off.shape) - off).told
    assert told is not None
    assert told[:30].min() > 0.7
    assert told[30:].max() < 0.1


def test_where_nothing_was_heard_nothing_is_off_and_a_slow_receiver_has_no_rhythm():
    off = np.stack([drawn(0.0, 0.10), drawn(0.0, 0.15), drawn(0.5, 0.03)], axis=1)
    off[np.arange(ROWS) % 5 != 0, :2] = np.nan
    noise = Noise.of(off, TURNING - off)
    assert not noise.rhythm[:2].any()
    assert noise.spread[:2] == pytest.approx([0.10, 0.15], rel=0.1)
    clear = noise.whiten(off)
    assert (np.isfinite(clear[:, 0]).all(axis=1) == (np.arange(ROWS) % 5 == 0)).all()
    assert np.isfinite(clear[:, 2]).all()


def test_a_window_that_is_nearly_all_that_is_known_is_not_taken_for_nothing_known():
    """A jackknife without it would say that its coefficient is not known at all; by its own residual it would be too sure."""
    says = np.stack([np.diag([95.0, 10.0]), *[np.diag([0.5, 10.0])] * 8])
    scores = np.stack([np.array([2.0, 3.0])] * 9)
    inverse = np.linalg.inv(np.eye(2) + says.sum(axis=0))
    found = _clear_of_itself(says, scores, inverse)
    own = 1.0 - 95.0 * inverse[0, 0]
    assert found[0, 0] == pytest.approx(2.0 / np.sqrt(own))
    assert found[0, 1] == pytest.approx(3.0 / np.sqrt(1.0 - 10.0 * inverse[1, 1]))
