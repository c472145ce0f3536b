"""A boat that held its point and is carried off it says so, once at ten metres and again at each doubling."""

import math

import pytest

from mavlink_bridge.language.figures import Hover
from mavlink_bridge.language.messages import Loiter
from sitl.plant.library import load_vessel
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.sensed import SensedState


def carried(thrust_share, seconds):
    """Hold a point in wind and current, with less and less thrust from 20 s on: [(metres off, text)], and the greatest distance."""
    run = Case(load_vessel("otter"), WATERS["0.5 m/s + 8 m/s"], source=SensedState).loop()
    run.place(0.0, 0.0, math.pi, 0.0)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))
    told, most_m = [], 0.0
    while run.t_s < seconds:
        if run.t_s > 20.0:
            run.vessel.thruster_health[:] = [thrust_share, thrust_share]
        run.tick(1.0)
        off_m = math.hypot(run.vessel.north_m, run.vessel.east_m)
        most_m = max(most_m, off_m)
        told += [(off_m, text) for _, text in run.guidance.drain_texts() if text.startswith("carried")]
    return told, most_m


def test_it_is_told_at_ten_metres_and_at_each_doubling():
    told, most_m = carried(0.0, 100.0)
    assert most_m > 40.0
    assert [off_m for off_m, _ in told] == pytest.approx([10.0, 20.0, 40.0], rel=0.1)
    assert told[0][1] == "carried 10 m off its point; it goes on trying"


@pytest.mark.parametrize(("leap_m", "seconds"), [(15.0, 1.5), (19.0, 8.0)])
def test_a_position_that_leaps_is_no_boat_that_is_carried(leap_m, seconds):
    """Told 0.8 s later as "carried 16 m off its point": no boat goes so far in a second."""
    run = Case(load_vessel("otter"), WATERS["0.5 m/s + 8 m/s"], source=SensedState).loop()
    run.place(0.0, 0.0, math.pi, 0.0)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))
    texts = []
    while run.t_s < 60.0:
        run.source.sensors.faults.jump_north_m = leap_m if 30.0 <= run.t_s < 30.0 + seconds else 0.0
        run.tick(1.0)
        texts += [text for _, text in run.guidance.drain_texts()]
    assert not any(text.startswith("carried") for text in texts)
    (told,) = [text for text in texts if text.startswith("position leapt to")]
    assert "look at the receiver" in told


def test_a_boat_that_holds_its_point_has_nothing_to_say():
    assert carried(1.0, 120.0)[0] == []


def test_the_way_to_the_point_is_not_told():
    run = Case(load_vessel("otter"), WATERS["calm"], source=SensedState).loop()
    run.place(60.0, 0.0, math.pi, 0.0)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))
    while run.t_s < 20.0:
        run.tick(1.0)
    assert not any(text.startswith("carried") for _, text in run.guidance.drain_texts())
