"""What a record presses against a bound is told as well as what lies between them: left as the file has it, it would bend all else."""

import tomllib

import numpy as np
import pytest

from companion.core.hull import VesselConfig
from companion.core.trial import TrialConfig
from companion.tuning.fit import fit_vessel
from companion.tuning.fitted import vessel_toml, with_values
from companion.tuning.hull_arrays import Commands, coefficients
from companion.tuning.unknowns import FitUnknown, unknowns_of
from companion.tuning.voyages import read_voyage
from companion.tuning.windows import Windows
from sitl.plant import WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.trial_cells import sail_trial, wrong

SEA = WaterConfig(current_mps=0.4, wind_mps=5.0, wave_height_m=0.15)


def test_a_value_at_its_bound_is_told_and_not_known():
    munk = FitUnknown("munk", 0.3, 0.3, relative=False, low=-1.0, high=7.0 / 3.0)
    assert munk.told(0.1)
    assert not munk.known(-1.0, 0.1)
    assert munk.known(0.0, 0.1)
    assert not munk.told(0.9)


@pytest.mark.soak  # a whole fit; the next one finds another value that a file has wrong by all
def test_a_hull_without_a_munk_moment_is_found_from_a_file_that_has_one(tmp_path):
    """Sway inertia and damping came out a quarter and a half too small: the file's moment was left in, and they made up for it."""
    truth, file = load_vessel("blueboat"), tmp_path / "trial.csv"
    start = wrong(truth, 3)
    assert start.hull.munk > 0.2
    sail_trial(truth, SEA, TrialConfig(radius_m=80.0, quick=True), file, belief=start, seed=2, source=SensedState(2))
    fit, right = fit_vessel(start, read_voyage(file)), coefficients(truth)
    assert fit.values["munk"] < 0.1
    for name, rel in (("m22", 0.15), ("yvv", 0.3), ("m33", 0.1), ("ahead", 0.05)):
        assert fit.values[name] == pytest.approx(right[name], rel=rel), name


def test_thrust_that_is_lost_with_way_is_found_from_a_file_that_knows_nothing_of_it(tmp_path):
    """It had gone into drag, exponent and pull, each of them called known: half of the intervals were wrong."""
    otter, file = load_vessel("otter"), tmp_path / "trial.csv"
    truth = otter.model_copy(update={"thruster": otter.thruster.model_copy(update={"speed_loss": 0.12})})
    sail_trial(truth, SEA, TrialConfig(radius_m=80.0, quick=True), file, belief=otter, seed=1, source=SensedState(1))
    fit, right = fit_vessel(otter, read_voyage(file)), coefficients(truth)
    assert fit.values["speed_loss"] == pytest.approx(0.12, abs=0.03)
    for name, rel in (("ahead", 0.05), ("xu", 0.15), ("xuu", 0.15), ("exponent", 0.03)):
        assert fit.values[name] == pytest.approx(right[name], rel=rel), name


def a_window():
    """One of 10 s; a fit's unknowns ask no more of a record than what kind of velocities it holds."""
    steps = 200
    return Windows(
        Commands(*(np.zeros((steps, 1)) for _ in range(4))),
        measured=np.zeros((steps, 3, 1)),
        starts=np.zeros(1),
        follows=np.zeros(1, dtype=bool),
        voyage=np.zeros(1, dtype=int),
        smoothed=np.zeros(1, dtype=bool),
        age_s=np.zeros((steps, 1)),
        by_fix=np.zeros(1, dtype=bool),
    )


@pytest.mark.parametrize("side", ["low", "high"])
def test_no_fit_writes_a_file_that_is_refused(side):
    """Of the starboard thruster's share a file allows 0.3 to 3, of a rudder's offset 20 degrees; a fit went a little, or far, beyond."""
    otter = load_vessel("otter")
    values = {each.name: float(each.value(getattr(each, side))) for each in unknowns_of(otter, a_window())}
    written = VesselConfig.model_validate(tomllib.loads(vessel_toml(with_values(otter, values))))
    assert 0.3 <= written.thruster.starboard_share <= 3.0
    assert abs(written.rudder.offset_deg) <= 20.0


def test_a_hull_whose_turning_is_damped_by_its_square_alone_can_be_fitted():
    """It had no width to look in: a division by zero instead of a fit."""
    otter = load_vessel("otter")
    still = otter.model_copy(update={"hull": otter.hull.model_copy(update={"nr": 0.0, "nur": 0.0, "nrr": 20.0})})
    assert all(each.low < each.high for each in unknowns_of(still, a_window()))
