"""A fit takes each fix as its receiver told it: a slow receiver and a late compass teach what fast ones do."""

import csv
import math

import numpy as np
import pytest

from companion.core.trial import TrialConfig
from companion.tuning.fit import fit_vessel
from companion.tuning.hull_arrays import STEP_S, coefficients
from companion.tuning.voyages import read_voyage
from companion.tuning.windows import cut
from sitl.plant import WaterConfig
from sitl.sensors import SimulatedSensors
from tools.benches.cells.foreign_hulls import any_hull
from tools.benches.cells.sensed import LATE_S, SensedState
from tools.benches.cells.trial_cells import sail_trial, wrong

SLOW = SimulatedSensors(depth_hz=0.0, grade="ideal", fix_hz=1.0)


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    file = tmp_path_factory.mktemp("trial") / "trial.csv"
    eyes = SensedState(1, SLOW, heading_late_s=LATE_S)
    truth = any_hull("crooked")
    sail_trial(truth, WaterConfig(), TrialConfig(radius_m=80.0, quick=True), file, belief=wrong(truth, 1), source=eyes)
    return file


def test_each_fix_stands_once_at_the_step_after_it_with_its_age(record):
    (stretch,) = read_voyage(record)
    came = np.flatnonzero(np.isfinite(stretch.surge))
    assert set(np.diff(came)) == {round(1.0 / STEP_S)}
    assert stretch.age_s is not None
    assert (np.isfinite(stretch.age_s) == np.isfinite(stretch.surge)).all()
    assert np.ptp(stretch.age_s[came]) < 1e-3
    assert 0.0 <= stretch.age_s[came[0]] < STEP_S
    with record.open(newline="") as file:
        told = [row for row in csv.DictReader(file) if row["fix_n_mps"]]
    speeds = [math.hypot(float(row["fix_n_mps"]), float(row["fix_e_mps"])) for row in told]
    assert np.hypot(stretch.surge, stretch.sway)[came] == pytest.approx(speeds[: len(came)], abs=1e-6)


def taught(record, seed):
    return fit_vessel(wrong(any_hull("crooked"), seed), read_voyage(record))


@pytest.mark.soak  # a whole fit takes a quarter of a minute; that of a fast receiver stands for it (test_fit_bounds.py)
def test_a_slow_receiver_and_a_late_compass_teach_thrust_drag_and_turning(record):
    right, fit = coefficients(any_hull("crooked")), taught(record, 1)
    for name in ("xu", "xuu", "nr", "nrr", "m22", "m33", "ahead", "astern", "exponent", "area"):
        assert fit.values[name] == pytest.approx(right[name], rel=0.08), name


@pytest.mark.soak
def test_it_does_not_matter_how_wrong_the_file_was(record):
    one, other = taught(record, 1), taught(record, 2)
    for name in ("xu", "xuu", "nrr", "ahead", "exponent", "area"):
        assert one.values[name] == pytest.approx(other.values[name], rel=0.03), name


def test_records_with_and_without_fixes_go_together(record, tmp_path):
    old = tmp_path / "old.csv"
    lines = [line.rsplit(",", 3)[0] for line in record.read_text().splitlines()]
    old.write_text("\n".join(lines) + "\n")
    windows = cut([*read_voyage(record), *read_voyage(old)])
    assert windows.by_fix.any()
    assert (windows.by_fix != windows.smoothed).all()
