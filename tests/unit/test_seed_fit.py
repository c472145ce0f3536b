"""Gains of the seed's law after a fit: they hold at every corner, and python-control says the same of the fitted file."""

import numpy as np
import pytest

from companion.core.steer import SteeringConfig
from companion.tuning.fit import Fit
from companion.tuning.fit_page import page
from companion.tuning.fitted import corners, gains_for
from companion.tuning.hull_arrays import coefficients
from companion.tuning.margins import loop_margins, seed_loop
from companion.tuning.seed_fit import seed_gains_for
from companion.tuning.unknowns import FitUnknown
from sitl.plant.library import load_vessel
from tests.unit.test_fitted_gains import fit_of
from tools.benches.cells.foreign_hulls import bare, launch

STEERING = SteeringConfig()


def test_they_leave_what_python_control_finds_too():
    vessel = load_vessel("otter")
    found = seed_gains_for(fit_of(vessel, "area", 0.2), vessel, STEERING)
    assert found is not None
    assert found.whole
    for speed, best, worst in zip(found.speeds, found.best, found.worst, strict=True):
        right = loop_margins(seed_loop(STEERING, vessel, speed, found.heading), speed, 0.15)
        assert best.gain_db == pytest.approx(right.gain_db, abs=1.0)
        # half a tick of delay on all of the loop, where control delays the derivative alone
        assert right.phase_deg - 4.0 < best.phase_deg < right.phase_deg + 1.0
        assert 8.0 <= worst.gain_db <= best.gain_db
        assert 45.0 <= worst.phase_deg <= best.phase_deg
    assert f"kp = {found.heading.kp:g}" in found.toml
    assert "at the worst corner" in found.words


def test_what_is_unsure_costs_gain():
    vessel = launch()
    sure, unsure = (seed_gains_for(fit_of(vessel, "area", sigma), vessel, STEERING) for sigma in (0.02, 0.5))
    assert sure is not None
    assert unsure is not None
    assert (unsure.heading.kp, unsure.heading.kd) < (sure.heading.kp, sure.heading.kd)


def test_a_hull_that_turns_away_by_itself_is_told_up_to_which_speed_they_hold():
    vessel = bare("otter", 1.0)
    found = seed_gains_for(fit_of(vessel, "m33", 0.3), vessel, STEERING)
    assert found is None or not found.whole
    if found is not None:
        assert f"up to {found.speeds[-1]:.1f} m/s only" in found.words


def test_a_corner_takes_with_it_what_hangs_on_a_value_that_is_at_its_bound():
    """Added mass up and damping down stand for one thing: where damping may fall no further, the mass rises no further."""
    vessel = load_vessel("otter")
    start = coefficients(vessel)
    mass = FitUnknown("m22", start["m22"], 0.4, relative=True)
    damping = FitUnknown("nur", 0.0, 10.0, relative=False, low=0.0, high=5.0)
    fit = Fit(
        vessel, {"m22": start["m22"], "nur": 0.0}, {"m22": 0.2, "nur": 5.0}, known={"m22": True, "nur": True},
        unknowns=[mass, damping], covariance=np.array([[0.26, -0.5], [-0.5, 1.0]]),
        errors=(0.1, 0.1, 0.1), errors_before=(0.1, 0.1, 0.1),
    )  # fmt: skip
    most = max(end.hull.m22_kg for end in corners(fit))
    assert most < start["m22"] * np.exp(0.4 * 0.25)
    assert min(end.hull.m22_kg for end in corners(fit)) < 0.75 * start["m22"]


def test_what_the_record_does_not_tell_moves_with_what_hangs_on_it():
    vessel = load_vessel("otter")
    start = coefficients(vessel)
    told, open_ = (FitUnknown(name, start[name], 0.5, relative=True) for name in ("m22", "yv"))
    fit = Fit(
        vessel, {"m22": start["m22"]}, {"m22": 0.2}, known={"m22": True},
        unknowns=[told], untold=[open_], covariance=np.array([[0.25, 0.25], [0.25, 0.25]]),
        errors=(0.1, 0.1, 0.1), errors_before=(0.1, 0.1, 0.1),
    )  # fmt: skip
    for end in corners(fit):
        assert end.hull.m22_kg / start["m22"] == pytest.approx(end.hull.yv / start["yv"], rel=1e-3)


def test_the_page_shows_the_gains_of_both_laws_with_their_margins():
    vessel = load_vessel("otter")
    fit = fit_of(vessel, "area", 0.2)
    rows = np.zeros((10, 3, 1))
    fit.samples.update(times=np.arange(10.0)[:, None], measured=rows, modelled=rows, before=rows)
    seed, model = seed_gains_for(fit, vessel, STEERING), gains_for(fit, vessel, STEERING)
    assert seed is not None
    shown = page(fit, vessel, [("top speed", "3", "3")], gains=model, seed=seed, source="a trial")
    assert f"kp = {seed.heading.kp:g}" in shown
    assert f"<td>{model.gains[-1][0]:.4g}</td>" in shown
    assert shown.count("worst corner of what is known") == 2
    assert "None on the grid" in page(fit, vessel, [], gains=model, seed=None, source="a trial")
