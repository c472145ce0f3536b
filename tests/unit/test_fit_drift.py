"""The current in a fit: as steady as the record says, through what is kept apart, and not made of a wandering compass or of gusts."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from companion.tuning.drifting import by_window, drift_change, precision_of
from companion.tuning.fit import ALONG, fit_vessel, unsteadied
from companion.tuning.fitted import care, fitted_vessel
from companion.tuning.hull_arrays import STEP_S
from companion.tuning.noise import Noise
from companion.tuning.problem import Problem
from companion.tuning.unknowns import unknowns_of
from companion.tuning.voyages import Stretch
from companion.tuning.windows import WINDOW_S, cut
from sitl.plant import SimVessel, Water, WaterConfig
from tools.benches.cells.control_cells import CALM
from tools.benches.cells.foreign_hulls import bare

PAIRS = ((0.5, 0.5), (0.8, 0.8), (0.0, 0.0), (0.6, 0.3), (0.3, 0.6), (0.5, -0.5), (0.0, 0.0), (0.9, 0.6), (1.0, 1.0))
"""Port, starboard: each for eight seconds."""


def sailed(seconds, water=CALM, source="a"):
    """A voyage of a bare otter, recorded without noise."""
    hull, sea, rows = SimVessel(bare("otter", 0.3)), Water(water, random.Random("drift")), []
    for tick in range(round(seconds / STEP_S)):
        port, starboard = PAIRS[int(tick * STEP_S / 8.0) % len(PAIRS)]
        cosine, sine = math.cos(hull.psi_rad), math.sin(hull.psi_rad)
        surge, sway = cosine * hull.vn_mps + sine * hull.ve_mps, cosine * hull.ve_mps - sine * hull.vn_mps
        rows.append((port, starboard, 0.0, hull.psi_rad, surge, sway, hull.r_radps))
        for _ in range(2):
            sea.step(0.5 * STEP_S)
            hull.step(0.5 * STEP_S, port, starboard, rudder_port_rad=0.0, rudder_starboard_rad=0.0, water=sea)
    port, starboard, rudder, psi, surge, sway, rate = np.array(rows).T
    return Stretch(source, 0.0, port, starboard, rudder, np.unwrap(psi), surge=surge, sway=sway, rate=rate)


def problem_of(stretches):
    windows, vessel = cut(stretches), bare("otter", 0.3)
    return Problem(vessel, windows, unknowns_of(vessel, windows), Noise.white(0.03, 0.03, 0.02))


@pytest.mark.parametrize(
    ("wander_mps", "least", "most"),
    [pytest.param(0.0, 0.01, 0.014, id="steady"), pytest.param(0.15, 0.05, 0.08, id="eddies")],
)
def test_a_record_tells_how_steady_its_current_is(wander_mps, least, most):
    problem = problem_of(
        [sailed(480.0, WaterConfig(current_mps=0.3, current_sigma_mps=wander_mps, current_tau_s=60.0))]
    )
    assert least <= drift_change(problem, np.zeros(problem.size)) <= most


def test_the_current_goes_on_through_windows_kept_apart_and_not_to_another_voyage():
    windows = cut([sailed(6 * WINDOW_S), sailed(3 * WINDOW_S, source="b")])
    links, ago = windows.only(np.array([1, 1, 0, 0, 1, 1, 1, 0, 1], dtype=bool)).links()
    assert links.tolist() == [1, 2, 3, 5]
    assert ago == pytest.approx([1.0, 3.0, 1.0, 2.0])


def test_a_compass_off_in_one_window_makes_sway_of_the_way_ahead_and_leaves_the_drift():
    problem = problem_of([sailed(8 * WINDOW_S)])
    theta, nuisance = problem.split(np.zeros(problem.size))
    moved = nuisance.copy()
    moved[5, 2] = 1.0
    before, after = (problem.modelled(theta[None], n[None])[:, :, 0] for n in (nuisance, moved))
    np.testing.assert_allclose(after[:, 1, 2] - before[:, 1, 2], -math.radians(2.0) * before[:, 0, 2], atol=2e-3)
    np.testing.assert_array_equal(np.delete(after, 2, axis=2), np.delete(before, 2, axis=2))


def test_a_gust_gives_way_in_its_window_alone():
    problem = problem_of([sailed(8 * WINDOW_S)])
    theta, nuisance = problem.split(np.zeros(problem.size))
    # some air in all, or its drag would come with the gust
    nuisance[6] = 1e-3
    moved = nuisance.copy()
    moved[6, 0] = 10.0
    before, after = (problem.modelled(theta[None], n[None])[:, :, 0] for n in (nuisance, moved))
    # it blows to the north, where the bow points at first
    assert after[20:40, 0, 0].mean() > before[20:40, 0, 0].mean() + 0.01
    np.testing.assert_array_equal(after[:, :, 1:], before[:, :, 1:])


@pytest.mark.soak
@pytest.mark.parametrize(
    ("wander_mps", "wider"), [pytest.param(0.0, False, id="steady"), pytest.param(0.2, True, id="eddies")]
)
def test_water_and_air_that_give_and_take_way_make_thrust_and_drag_less_sure(wander_mps, wider):
    """In gusts ways to rest were told up to a fifth too short, and nothing of it."""
    water = WaterConfig(current_mps=0.3, current_sigma_mps=wander_mps, current_tau_s=60.0)
    fit = fit_vessel(bare("otter", 0.3), [sailed(192.0, water)])
    assert (fit.unsteady > 2.0) is wider
    assert ("gave and took way" in care(fit)) is wider
    assert (fitted_vessel(fit).stopping_factor > 1.25) is wider


def test_what_goes_on_in_days_of_a_trial_is_steady_and_gusts_are_not():
    """By how far the current went from window to window: trials in 3 to 6 m/s of wind, and foreign boats in 9."""
    assert unsteadied(0.01) == unsteadied(0.028) == 1.0
    assert unsteadied(0.04) == unsteadied(0.056) > 2.0
    assert {"xu", "xuu", "ahead"} <= set(ALONG)
    assert not {"m33", "nr", "m22"} & set(ALONG)


def test_what_windows_tell_each_other_of_a_steady_current_makes_the_drag_surer():
    problem = problem_of([sailed(20 * WINDOW_S)])
    drag = [unknown.name for unknown in problem.unknowns].index("xu")

    def unsure(change_mps):
        at = problem.under(replace(problem.noise, drift=change_mps))
        says, _, places = by_window(at, np.zeros(at.size))
        return np.linalg.inv(precision_of(at, says, places))[drag, drag]

    assert unsure(0.01) < 0.95 * unsure(0.08)
