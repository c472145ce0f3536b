"""Fits of foreign logs: what the recorder does to them, and files that are wrong in a way that no coefficient alone explains."""

import math
import random

import pytest

from companion.core.hull.statics import Statics
from companion.tuning import fitted
from companion.tuning.fit import fit_vessel
from companion.tuning.voyages import Column, read_voyage
from sitl.plant import SimVessel, Water, WaterConfig
from tools.benches.cells.foreign_hulls import bare
from tools.benches.cells.trial_cells import turn_rate

PAIRS = (
    *((0.5, 0.5), (0.8, 0.8), (0.0, 0.0), (0.6, 0.3), (0.3, 0.6), (-0.4, -0.4), (0.5, -0.5), (-0.5, 0.5)),
    *((0.0, 0.0), (0.9, 0.6), (0.6, 0.9), (1.0, 1.0), (0.0, 0.0), (0.4, 0.0), (0.0, 0.4)),
)
"""Port, starboard: each for eight seconds."""
STEP_S = 0.05
COLUMNS = {name: Column(name) for name in ("time", "heading", "surge", "sway", "yaw_rate", "port", "starboard")}


def log_of(truth, file, *, commands_late_s=0.0, forward_m=0.0):
    """Sail the pairs twice in a current; write what a logger forward of the middle, late with the commands, keeps."""
    hull, water = SimVessel(truth), Water(WaterConfig(current_mps=0.2), random.Random("log"))
    rows, sent = ["time,heading,surge,sway,yaw_rate,port,starboard"], []
    for tick in range(round(2 * len(PAIRS) * 8.0 / STEP_S)):
        sent.append(PAIRS[int(tick * STEP_S / 8.0) % len(PAIRS)])
        for _ in range(2):
            water.step(0.5 * STEP_S)
            hull.step(0.5 * STEP_S, *sent[-1], rudder_port_rad=0.0, rudder_starboard_rad=0.0, water=water)
        cosine, sine = math.cos(hull.psi_rad), math.sin(hull.psi_rad)
        surge = cosine * hull.vn_mps + sine * hull.ve_mps
        sway = cosine * hull.ve_mps - sine * hull.vn_mps + forward_m * hull.r_radps
        port, starboard = sent[max(0, tick - round(commands_late_s / STEP_S))]
        told = (tick * STEP_S, hull.psi_rad, surge, sway, hull.r_radps, port, starboard)
        rows.append(",".join(f"{x:.5f}" for x in told))
    file.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return read_voyage(file, COLUMNS)


def changed(vessel, part, **values):
    return vessel.model_copy(update={part: getattr(vessel, part).model_copy(update=values)})


@pytest.mark.soak
def test_propellers_that_turn_the_hull_by_a_quarter_of_what_the_file_says_are_found_and_told(tmp_path):
    """Motion tells inertia and damping in yaw per moment only: all four are four times what the file says."""
    file = bare("otter", 0.3)
    truth = changed(file, "thruster", lateral_m=0.25 * file.thruster.lateral_m)
    fit = fit_vessel(file, log_of(truth, tmp_path / "log.csv"))
    new = fitted.fitted_vessel(fit)
    assert fit.turning == pytest.approx(4.0, rel=0.35)
    assert turn_rate(new, 0.5, 0.5) == pytest.approx(turn_rate(truth, 0.5, 0.5), rel=0.1)
    assert new.hull.m33_kgm2 == pytest.approx(4.0 * truth.hull.m33_kgm2, rel=0.2)
    assert fit.errors[2] < 0.1 < fit.errors_before[2]


@pytest.mark.soak  # a whole fit; the one before it is of the same kind of log
def test_a_log_late_with_its_commands_and_a_sensor_forward_of_the_middle_harm_nothing(tmp_path):
    truth = bare("otter", 0.3)
    file = changed(truth, "hull", xuu=1.4 * truth.hull.xuu, nrr=0.7 * truth.hull.nrr, m22_kg=1.3 * truth.hull.m22_kg)
    fit = fit_vessel(file, log_of(truth, tmp_path / "log.csv", commands_late_s=0.3, forward_m=0.4))
    new = fitted.fitted_vessel(fit)
    assert fit.values["velocity_late"] == pytest.approx(-0.3, abs=0.06)
    assert fit.values["heading_late"] == pytest.approx(-0.3, abs=0.06)
    assert fit.values["sensor_forward"] == pytest.approx(0.4, abs=0.1)
    assert fit.turning == 1.0
    for throttle in (0.3, 0.6, 0.9):
        right = Statics(truth).throttle_to_speed(throttle)
        assert Statics(new).throttle_to_speed(throttle) == pytest.approx(right, rel=0.05)
    assert turn_rate(new, 0.5, 0.5) == pytest.approx(turn_rate(truth, 0.5, 0.5), rel=0.1)
