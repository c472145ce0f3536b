"""Thrust astern against the simulated hull: no boat makes more way than is reckoned, and none needs longer than is allowed."""

from __future__ import annotations

import pytest

from companion.core.hull import VesselConfig
from companion.core.hull.statics import stopping_distance_m, top_speed_mps
from companion.core.hull.stopping import Braking
from sitl.plant.library import load_vessel, vessel_names
from tools.benches.cells.depth_runs import under_way
from tools.benches.cells.drawn_hulls import KINDS, drawn
from tools.benches.cells.foreign_hulls import FOREIGN, any_hull

OTTER = load_vessel("otter")
BOATS = {
    **{name: any_hull(name) for name in (*vessel_names(), *FOREIGN)},
    **{f"{kind} {seed}": drawn(kind, seed) for kind in KINDS for seed in range(8)},
}
DT_S = 0.01


def best(vessel: VesselConfig) -> VesselConfig:
    """Without what the file adds for what is not known of it."""
    return vessel.model_copy(update={"stopping_factor": 1.0})


def braked(vessel: VesselConfig, speed_mps: float, least: float, braking: Braking) -> tuple[float, float]:
    """Brake as the guard does; return the way to rest, m, and how long the thrust was needed, s."""
    boat, allowed_s = under_way(vessel, speed_mps), braking.lasts_s(speed_mps)
    needed_s = 0.0
    while needed_s < allowed_s and boat.u_mps > braking.until_mps:
        boat.step(DT_S, least, least, 0.0, 0.0)
        needed_s += DT_S
    while boat.u_mps > 0.001:
        boat.step(DT_S, 0.0, 0.0, 0.0, 0.0)
    return boat.north_m, needed_s


@pytest.mark.parametrize("name", BOATS)
@pytest.mark.parametrize("least", [-1.0, -0.3, 0.0])
def test_no_boat_makes_more_way_than_is_reckoned_nor_needs_longer(name, least):
    vessel = best(BOATS[name])
    braking = Braking(vessel, least=least)
    for share in (0.1, 0.5, 0.9):
        speed = share * top_speed_mps(vessel)
        way_m, needed_s = braked(vessel, speed, least, braking)
        assert way_m < braking.way_m(speed)
        assert needed_s <= 0.9 * braking.lasts_s(speed)


@pytest.mark.parametrize("name", BOATS)
def test_without_thrust_astern_there_is_no_brake_and_coasting_is_reckoned(name):
    vessel = BOATS[name]
    speed = 0.5 * top_speed_mps(vessel)
    for braking in (Braking(vessel, least=0.0), Braking(vessel, (0.0, 0.0))):
        assert braking.lasts_s(speed) == 0.0
        assert braking.way_m(speed) == stopping_distance_m(vessel, speed)


def test_a_thruster_that_gives_little_makes_the_way_longer():
    whole, half = Braking(OTTER), Braking(OTTER, (0.0, 1.0))
    assert whole.way_m(2.0) < half.way_m(2.0) < stopping_distance_m(OTTER, 2.0)
    assert half.lasts_s(2.0) > whole.lasts_s(2.0)


def test_a_gate_that_lets_thrust_grow_slowly_is_waited_for():
    slow = Braking(OTTER, rate_per_s=2.0)
    assert Braking(OTTER).way_m(2.0) < slow.way_m(2.0) < stopping_distance_m(OTTER, 2.0)
    boat, thrust = under_way(OTTER, 2.0), 0.0
    while boat.u_mps > slow.until_mps:
        thrust = max(-1.0, thrust - 2.0 * DT_S)
        boat.step(DT_S, thrust, thrust, 0.0, 0.0)
    while boat.u_mps > 0.001:
        boat.step(DT_S, 0.0, 0.0, 0.0, 0.0)
    assert boat.north_m < slow.way_m(2.0)
