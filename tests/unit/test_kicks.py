"""Kicks over the rudder: one ends with the way that it brings, the next waits until that is taken back; the helm goes over easily."""

import math

import pytest

from companion.core.hull import ForceModel, VesselConfig
from companion.core.steer.allocation import Allocator
from companion.core.steer.kicks import Kicks, eased
from mavlink_bridge.language.messages import Desired
from mavlink_bridge.language.units import wrap_pi
from sitl.plant import SimVessel
from sitl.plant.library import load_vessel
from tools.benches.cells.foreign_hulls import launch, single_screw

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


def _turning_nm(vessel: VesselConfig, port: float, starboard: float, rudder_rad: float) -> float:
    """The moment on a resting hull, by the plant."""
    hull = SimVessel(vessel)
    for _ in range(200):  # the propellers come up; the hull is held
        hull.place()
        hull.step(0.02, port, starboard, rudder_rad, rudder_rad)
    return hull.model.actuator_forces((0.0, 0.0, 0.0), (hull.thrust_n[0], hull.thrust_n[1]), rudder_rad)[1]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_two_propellers_go_ahead_together_where_their_rudders_turn_her_harder_than_their_difference(side):
    vessel = launch()
    allocator = Allocator(vessel, ForceModel(vessel))
    turned_nm = []
    for may_kick in (False, True):
        given = allocator.allocate(0.0, side * 600.0, 0.0, flow_mps=0.0, may_kick=may_kick)
        turned_nm.append(side * _turning_nm(vessel, given.thruster_port, given.thruster_starboard, given.rudder_rad))
    assert turned_nm[1] > 1.3 * turned_nm[0]
    assert turned_nm[1] == pytest.approx(600.0, rel=0.1)


def test_no_more_thrust_than_the_turn_needs_and_none_where_the_difference_does_as_well():
    boat, default = launch(), load_vessel("otter")
    for vessel, yaw_nm in ((boat, 200.0), (default, 200.0)):
        allocator = Allocator(vessel, ForceModel(vessel))
        kicked, not_kicked = (allocator.allocate(0.0, yaw_nm, 0.0, flow_mps=0.0, may_kick=can) for can in (True, False))
        assert kicked == not_kicked
    assert Kicks(default, ForceModel(default)).race_nm == 0.0


@pytest.mark.parametrize(
    ("firmness", "off_rad", "brings"), [(1.0, 1.0, True), (1.0, -1.0, True), (1.0, 0.2, False), (0.5, 1.0, False)]
)
def test_all_thrust_goes_over_the_rudders_only_in_strong_wind_with_the_bow_far_off(firmness, off_rad, brings):
    boat, psi_rad = Kicks(launch(), ForceModel(launch())), 3.0
    wanted = Desired(wrap_pi(psi_rad + off_rad), 0.0, brake=True, gentle=True, firmness=firmness)
    for _ in range(30):
        boat.far(TICK_S, wanted, psi_rad)
    assert not boat.brings_round, "a gust that turns the bow is over by then"
    for _ in range(60):
        boat.far(TICK_S, wanted, psi_rad)
    assert boat.brings_round is brings
    boat.far(TICK_S, wanted, None)
    assert not boat.brings_round
