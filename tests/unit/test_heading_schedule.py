"""Gains over speed for any hull: directionally unstable, without rudders, with slow propellers. Judged by python-control."""

import math
from importlib.util import find_spec

import pytest

import config as shipped
from companion.cli import main
from companion.core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from companion.core.steer.gain_check import gains_problem
from companion.core.steer.law import ModelConfig, SteeringConfig, lowered_text
from companion.core.steer.model import ModelController
from companion.core.steer.yaw_loop import LoopJudge, yaw_plant
from sitl.plant.library import load_vessel, vessel_names
from tests.conftest import require
from tests.soaked import in_the_soak
from tools.benches.cells.foreign_hulls import bare, launch, rudderless, single_screw
from tools.benches.cells.trial_cells import wrong

HAS_CONTROL = find_spec("control") is not None
HULLS = {f"{name}, no rudders, munk {munk}": bare(name, munk) for name in vessel_names() for munk in (0.0, 0.5, 1.0)}
HULLS |= {name: load_vessel(name) for name in vessel_names()} | {"launch": launch()}


OFTEN = [name for name in HULLS if not name.endswith("munk 0.5")]


@pytest.mark.parametrize("name", [*OFTEN, *in_the_soak(*(name for name in HULLS if name not in OFTEN))])
def test_margins_hold_up_to_the_speed_that_is_sailed(name):
    """8 dB and 45 degrees by python-control between the table's speeds too; the hull may be sailed at some speed at all."""
    from companion.tuning.margins import heading_margins

    require(HAS_CONTROL, "python-control")
    vessel = HULLS[name]
    fastest = ModelController(SteeringConfig(), vessel).steady_mps
    # slower, the straight part of the inverse thrust law (allocation) doubles the gain of the smallest thrusts
    speeds = tuple(fastest * share for share in (0.3, 0.6, 0.88))
    found = heading_margins(SteeringConfig(), vessel, "model", speeds=speeds)
    assert len(found) == len(speeds)
    for margins in found:
        assert margins.gain_db > GAIN_BAR_DB - 0.4, margins
        assert margins.phase_deg > PHASE_BAR_DEG - 1.5, margins


@pytest.mark.parametrize("name", ["otter, no rudders, munk 1.0", "otter", "launch"])
def test_the_vessels_own_judge_agrees_with_python_control(name):
    from companion.tuning.margins import loop_margins, model_loop

    require(HAS_CONTROL, "python-control")
    vessel = HULLS[name]
    controller = ModelController(SteeringConfig(), vessel)
    for speed in (0.5, 1.5):
        ours = LoopJudge(yaw_plant(vessel, speed)).margins(*controller.heading_gains(speed))
        theirs = loop_margins(model_loop(SteeringConfig(), vessel, speed), speed, 0.15)
        assert ours.gain_db == pytest.approx(theirs.gain_db, abs=0.5)
        assert ours.phase_deg == pytest.approx(theirs.phase_deg, abs=2.0)


def test_an_unstable_loop_is_told_from_a_stable_one():
    """At 2.5 m/s the bare hull with the whole Munk moment turns away by itself: a weak law cannot hold it."""
    plant = yaw_plant(bare("otter", 1.0), 2.5)
    assert plant.unstable_poles == 1
    weak, strong = LoopJudge(plant).margins(8.0, 1.0, 40.0), LoopJudge(plant).margins(150.0, 5.0, 190.0)
    assert weak.gain_db == 0.0
    assert strong.gain_db > 0.0


def test_the_top_speed_is_lowered_where_nothing_holds_and_said():
    for name, vessel in HULLS.items():
        controller = ModelController(SteeringConfig(), vessel)
        told = lowered_text(controller.steady_mps, controller.top_mps)
        assert bool(told) == (controller.steady_mps < 0.99 * controller.top_mps), name
        assert controller.steady_mps > 0.8
    assert ModelController(SteeringConfig(), HULLS["otter"]).steady_mps == pytest.approx(3.09, abs=0.01)


def test_a_single_screw_that_nothing_turns_at_rest_keeps_its_top_speed():
    """Without way on and without race a rudder gives no moment: no margin fails there, and none holds."""
    controller = ModelController(SteeringConfig(), single_screw())
    assert controller.steady_mps == pytest.approx(controller.top_mps)


def test_slow_propellers_do_not_judge_a_boat_that_steers_by_rudders():
    gains = ModelController(SteeringConfig(), launch()).schedule.gains
    assert gains[4].omega_radps > 1.0
    assert gains[0].omega_radps < 0.8, "at rest the propellers are all there is"


def test_a_settings_bandwidth_is_the_upper_limit():
    controller = ModelController(SteeringConfig(model=ModelConfig(heading_bandwidth=1.0)), load_vessel("otter"))
    inertia = 42.6 - 12.25**2 / 162.5
    assert math.sqrt(controller.heading_gains(1.5)[0] / inertia) <= 1.0 + 1e-9


def test_check_runs_the_margins_and_says_what_it_finds(tmp_path, capsys):
    assert main(["check", str(shipped.path("sim.toml"))]) == 0
    told = capsys.readouterr().out
    assert "heading     at least 12 dB and 50 deg" in told
    assert "lowered" not in told
    text = shipped.path("vessels/otter.toml").read_text(encoding="utf-8")
    text = text.replace("munk = 0.5", "munk = 1.0").replace("count = 2\narea_m2", "count = 0\narea_m2")
    (tmp_path / "bare.toml").write_text(text, encoding="utf-8")
    hull = f"vessel='{tmp_path / 'bare.toml'}'"
    assert main(["check", str(shipped.path("sim.toml")), "--set", hull]) == 0
    assert "Top speed lowered from 3.1 to 1.8 m/s" in capsys.readouterr().out


def test_a_boat_with_one_screw_and_a_rudder_may_be_steered_at_all():
    """Its gains had been refused as unstable: at rest there is no loop."""
    assert gains_problem(SteeringConfig(), single_screw()) == ""


def test_a_speed_that_wants_more_damping_is_not_steered_at_half_the_bandwidth():
    """The best margins of all are a weak loop's; what leaves enough of them and holds the bow firmer is taken (it fell from 0.73
    to 0.32 rad/s between two speeds of the table)."""
    schedule = ModelController(SteeringConfig(), wrong(rudderless(), 45)).schedule
    speeds = zip(schedule.gains, schedule.gains[1:], strict=False)
    kept = [
        after.omega_radps / before.omega_radps
        for before, after in speeds
        if before.leaves(8.5, 47.0) and after.leaves(8.5, 47.0)
    ]
    assert len(kept) >= 5
    assert min(kept) > 0.7
