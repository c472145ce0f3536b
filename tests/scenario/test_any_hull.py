"""Hulls that nobody tuned for, in a current of 0.5 m/s and 8 m/s of wind with gusts and waves: held by the law on the truth."""

import pytest

from companion.core.vehicle.config import VehicleConfig
from companion.core.vehicle.vehicle import Vehicle
from sitl.plant.library import load_vessel
from tools.benches.cells import control_cells as cells
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.foreign_hulls import bare
from tools.benches.cells.sensed import SensedState

BLOW = WATERS["0.5 m/s + 8 m/s"]


@pytest.mark.parametrize("munk", [0.5, 1.0])
def test_a_truthful_file_does_not_make_a_rudderless_boat_wander(munk):
    found, _ = cells.legs(Case(bare("otter", munk), BLOW, source=SensedState), 1.5, 50.0)
    assert found.finished
    assert found.rms < 0.16
    assert found.most < 0.6


@pytest.mark.soak
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("speed", [1.5, 2.5])
@pytest.mark.parametrize("munk", [0.5, 1.0])
@pytest.mark.parametrize("name", ["otter", "plant_b", "wamv"])
def test_rudderless_hulls_hold_legs_and_circles(name, munk, speed, seed):
    case = Case(bare(name, munk), BLOW, source=SensedState, seed=seed)
    legs, _ = cells.legs(case, speed)
    circle = cells.ring(case, 20.0, speed)
    assert legs.finished
    assert circle.finished
    assert legs.rms < (0.17 if speed == 1.5 else 0.5)
    assert circle.rms < 0.45


def test_the_lowered_top_speed_is_told_and_kept():
    """2.5 m/s ordered where the margins end at 1.8 m/s."""
    vessel = bare("otter", 1.0)
    run = Case(vessel, source=SensedState).loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(run.goto(100.0, 0.0), 2.5)
    fastest = 0.0
    while run.t_s < 40.0:
        run.tick(2.5)
        fastest = max(fastest, run.vessel.u_mps)
    assert 1.6 < fastest < 1.9


def test_the_lowered_top_speed_stands_in_the_operators_log():
    for munk, told in ((1.0, True), (0.0, False)):
        vehicle = Vehicle(VehicleConfig(), bare("otter", munk))
        assert (
            any(text.text.startswith("Top speed lowered from 3.1 to") for text in vehicle.controls.voice.take()) == told
        )


def test_a_hull_whose_propellers_and_rudders_are_odd_sails_as_straight_as_any_when_its_file_says_so():
    """Thrust with the 1.3rd power, starboard a fifth weaker, dead band 12 %, rudders 4 degrees off their middle."""
    otter = load_vessel("otter")
    thruster = {"exponent": 1.3, "starboard_share": 0.8, "dead_band": 0.12, "speed_loss": 0.05}
    odd = otter.model_copy(
        update={
            "thruster": otter.thruster.model_copy(update=thruster),
            "rudder": otter.rudder.model_copy(update={"offset_deg": 4.0}),
        }
    )
    found, _ = cells.legs(Case(odd, BLOW, source=SensedState), 1.5, 50.0)
    assert found.finished
    assert found.rms < 0.13
    assert found.most < 0.5
