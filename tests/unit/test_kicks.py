"""Kicks over the rudder: one ends with the way that it brings, the next waits until that is taken back; the helm goes over easily."""

import math

import pytest

from companion.core.hull import ForceModel
from companion.core.steer.kicks import Kicks, eased
from mavlink_bridge.language.messages import Desired
from tools.benches.cells.foreign_hulls import single_screw

ON_STATION = Desired(1.0, 0.0, gentle=True)
TICK_S = 0.05


def kicks(**thruster):
    vessel = single_screw()
    vessel = vessel.model_copy(update={"thruster": vessel.thruster.model_copy(update=thruster)})
    return Kicks(vessel, ForceModel(vessel))


def test_a_kick_ends_when_it_has_brought_way_and_the_next_waits_until_that_is_taken_back():
    boat = kicks()
    assert boat.may(TICK_S, ON_STATION, -0.05)
    assert not boat.may(TICK_S, ON_STATION, -0.2)
    assert not boat.may(TICK_S, ON_STATION, -0.01)
    assert not boat.may(TICK_S, ON_STATION, 0.02), "nor within two seconds of the last"
    assert boat.may(3.0, ON_STATION, 0.02)


def test_strong_wind_takes_back_more_and_off_station_nothing_is_held_back():
    boat, windy = kicks(), Desired(1.0, 0.0, gentle=True, firmness=1.0)
    assert boat.may(TICK_S, windy, -0.3)
    assert not boat.may(TICK_S, windy, -0.5)
    assert boat.may(TICK_S, Desired(1.0, 1.0), -0.5)


@pytest.mark.parametrize(("astern_n", "can"), [(100.0, True), (5.0, False)])
def test_a_screw_that_hardly_pushes_astern_cannot(astern_n, can):
    assert kicks(astern_n=astern_n).can is can


def test_from_stop_to_stop_the_rudder_takes_longer_than_a_second():
    angle, seconds = -math.radians(30.0), 0.0
    while angle < math.radians(30.0):
        angle, seconds = eased(TICK_S, math.radians(30.0), angle), seconds + TICK_S
    assert 1.0 < seconds < 2.5
