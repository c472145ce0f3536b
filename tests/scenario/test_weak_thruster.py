"""A propeller that is lost or full of weed is told in words within 15 s of thrust; clean rough water is not."""

import math

import pytest

from companion.core.guard.propulsion import PropulsionWatch
from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import Loiter
from sitl.plant import WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.control_loop import TICK_S
from tools.benches.cells.foreign_hulls import bare, launch
from tools.benches.cells.sensed import SensedState

HULLS = {
    "otter": load_vessel("otter"),
    "blueboat": load_vessel("blueboat"),
    "bare": bare("otter", 0.5),
    "launch": launch(),
}
GALE = WaterConfig(wind_mps=10.0, gust_share=0.25, wave_height_m=0.3, current_mps=0.3)
BLOW = WATERS["0.5 m/s + 8 m/s"]


def told_after_s(hull, water, figure, mps, seconds, fault=None, seed=1, fault_s=30.0):
    """(seconds after the fault, what was found); None when nothing was."""
    run = Case(HULLS[hull], water, seed=seed, source=SensedState).loop()
    run.place(15.0, 0.0, math.pi / 2.0, 0.0)
    watch = PropulsionWatch(HULLS[hull])
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=figure), mps)
    while run.t_s < seconds:
        if fault is not None and run.t_s > fault_s:
            run.vessel.thruster_health[fault[0]] = fault[1]
        run.tick(mps)
        weak = watch.step(TICK_S, run.state, run.sent)
        if any(weak):
            return run.t_s - fault_s, weak
    return None


@pytest.mark.parametrize("fault", [(0, 0.0), (1, 0.3)], ids=["port dead", "weed to starboard"])
@pytest.mark.parametrize("water", [WATERS["calm"], BLOW], ids=["calm", "blow"])
def test_it_is_found_under_way_on_its_side(water, fault):
    found = told_after_s("otter", water, Circle(radius_m=20.0), 1.5, 50.0, fault)
    assert found is not None
    seconds, weak = found
    assert 0.0 < seconds <= 15.0
    assert weak == (fault[0] == 0, fault[0] == 1)


def test_rough_water_is_no_weed():
    assert told_after_s("otter", GALE, Hover(), 1.0, 120.0) is None
    assert told_after_s("otter", GALE, Circle(radius_m=10.0), 1.5, 90.0) is None


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("hull", HULLS)
@pytest.mark.parametrize(
    ("figure", "mps"), [(Hover(), 1.0), (Circle(radius_m=10.0), 1.5), (Circle(radius_m=25.0), 2.5)]
)
def test_an_hour_of_rough_water_on_every_hull_is_no_weed(hull, figure, mps, seed):
    assert told_after_s(hull, GALE, figure, mps, 3600.0, seed=seed) is None


def test_the_operator_is_told_which_side_and_the_boat_sails_on(voyage):
    trip = voyage("depth.enabled=false")
    trip.sail(1.5, (200.0, 0.0), after_s=20.0)
    trip.world.surroundings.plant.vessel.thruster_health[0] = 0.0
    trip.run(15.0)
    assert any(text.startswith("Port thruster gives much less than it is told to") for text in trip.texts)
    assert "thruster_weak" in trip.snapshot.causes
    assert trip.snapshot.armed
    assert trip.snapshot.mode.name == "AUTO"


def test_the_row_may_stop_it_instead(voyage):
    trip = voyage("depth.enabled=false", "failsafe.thruster_action='stop'")
    trip.sail(1.5, (200.0, 0.0), after_s=20.0)
    trip.world.surroundings.plant.vessel.thruster_health[1] = 0.0
    trip.run(16.0)
    assert trip.snapshot.output.thruster_port == trip.snapshot.output.thruster_starboard == 0.0
