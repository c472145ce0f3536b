"""The vessel file against the published and the studied figures."""

import math

import pytest
from scipy.integrate import solve_ivp

from companion.core.hull import VesselConfig
from companion.core.hull.handling import Handling
from companion.core.hull.statics import (
    command_for_thrust,
    drag_n,
    stopping_distance_m,
    throttle_to_speed,
    thrust_n,
    top_speed_mps,
)
from sitl.plant.hull import SimVessel
from sitl.plant.library import load_vessel, vessel_names
from tools.benches.cells.depth_runs import under_way
from tools.benches.cells.drawn_hulls import KINDS, drawn
from tools.benches.cells.foreign_hulls import FOREIGN, any_hull

OTTER = load_vessel("otter")


@pytest.mark.parametrize(("command", "speed"), [(0.2, 0.32), (0.4, 0.94), (0.6, 1.63), (0.8, 2.35), (1.0, 3.09)])
def test_steady_speed_of_a_command(command, speed):
    hull = SimVessel(OTTER)
    for _ in range(3000):
        hull.step(0.02, command, command, 0.0, 0.0)
    assert hull.u_mps == pytest.approx(speed, abs=0.01)
    assert throttle_to_speed(OTTER, command) == pytest.approx(hull.u_mps, abs=0.005)


def to_rest(hull: SimVessel) -> float:
    """Let a hull run with its propellers told to stop; return how far, m."""
    while hull.u_mps > 0.001:
        hull.step(0.01, 0.0, 0.0, 0.0, 0.0)
    return hull.north_m


@pytest.mark.parametrize(("speed", "distance"), [(1.5, 3.5), (2.5, 5.0)])
def test_coasting_distance(speed, distance):
    """The studied figures are of a hull whose propellers stand still at once; those that turn run down first."""
    hull = SimVessel(OTTER)
    hull.place(surge_mps=speed)
    assert to_rest(hull) == pytest.approx(distance, abs=0.1)
    ran_down_m = 0.5 * OTTER.thruster.lag_s * speed
    assert stopping_distance_m(OTTER, speed) == pytest.approx(distance + ran_down_m, abs=0.06)


def lagging(name: str, lag_s: float) -> VesselConfig:
    vessel = any_hull(name)
    return vessel.model_copy(update={"thruster": vessel.thruster.model_copy(update={"lag_s": lag_s})})


COASTING = {
    **{name: any_hull(name) for name in (*vessel_names(), *FOREIGN)},
    **{
        f"{name}, lag {lag_s:g} s": lagging(name, lag_s) for name in ("otter", "wamv") for lag_s in (1.0, 2.0, 3.0, 5.0)
    },
    **{f"{kind} {seed}": drawn(kind, seed) for kind in KINDS for seed in range(6)},
}


@pytest.mark.parametrize("name", COASTING)
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_no_hull_coasts_farther_than_is_said(name, share):
    """From steady speed, propellers turning: while they run down they still push."""
    vessel = COASTING[name]
    speed = share * top_speed_mps(vessel)
    said_m = stopping_distance_m(vessel.model_copy(update={"stopping_factor": 1.0}), speed)
    assert 0.94 * said_m < to_rest(under_way(vessel, speed)) < said_m


def test_rudder_authority_grows_and_free_differential_shrinks():
    """Table 1.4 of the vessel study: rudders 24, 121 Nm and differential 69, 28 Nm at 1.0 and 2.5 m/s."""
    handling = Handling(OTTER)
    slow, fast = handling.authority(1.0), handling.authority(2.5)
    assert (slow.rudder_nm, fast.rudder_nm) == pytest.approx((24, 121), rel=0.03)
    assert (slow.differential_nm, fast.differential_nm) == pytest.approx((69, 28), rel=0.03)


def test_nomoto_gain_schedule():
    """1/K rises with speed, about 50 + 38 U Nm s."""
    handling = Handling(OTTER)
    for speed in (0.5, 1.5, 2.5):
        assert handling.yaw_damping(speed)[0] == pytest.approx(50 + 38 * speed, rel=0.1)


def test_full_rudder_turn_radius_in_the_simulator():
    """Steady turn with full rudder only: 5.3, 5.2 m at the commands of 1.5, 2.5 m/s."""
    for command, radius in ((0.562, 5.3), (0.84, 5.2)):
        hull = SimVessel(OTTER)
        for _ in range(4000):
            hull.step(0.01, command, command, OTTER.rudder.max_rad, OTTER.rudder.max_rad)
        assert math.hypot(hull.vn_mps, hull.ve_mps) / hull.r_radps == pytest.approx(radius, rel=0.05)


def test_half_the_step_changes_a_minutes_turn_by_little():
    """Integration error at 60 Hz against 1 kHz: under half a degree of heading after a 60 s turn."""
    headings = []
    for dt in (1 / 60, 0.001):
        hull, turned = SimVessel(OTTER), 0.0
        for _ in range(round(60 / dt)):
            hull.step(dt, 0.6, 0.5, 0.1, 0.1)
            turned += hull.r_radps * dt
        headings.append(turned)
    assert abs(headings[0] - headings[1]) < math.radians(0.5)


def test_bare_hull_needs_its_rudders():
    """Without rudders a small kick at 2.5 m/s grows into a turn; with rudders amidships it dies out."""
    rates = []
    for vessel in (OTTER, OTTER.model_copy(update={"rudder": OTTER.rudder.model_copy(update={"count": 0})})):
        hull = SimVessel(vessel)
        hull.place(surge_mps=2.5)
        hull.r_radps = 0.02
        for _ in range(3000):
            hull.step(0.02, 0.84, 0.84, 0.0, 0.0)
        rates.append(abs(hull.r_radps))
    assert rates[0] < 1e-4
    assert rates[1] > math.radians(3)


@pytest.mark.parametrize("name", vessel_names())
def test_every_shipped_vessel_inverts_its_thrust(name):
    vessel = load_vessel(name)
    for command in (-1.0, -0.5, 0.2, 0.7, 1.0):
        assert command_for_thrust(vessel, thrust_n(vessel, command)) == pytest.approx(command)
    assert drag_n(vessel, -1.0) == -drag_n(vessel, 1.0)


def test_faults_are_felt():
    hull = SimVessel(OTTER)
    hull.thruster_health[0] = 0.7
    hull.rudder_stuck_rad[1] = math.radians(10)
    for _ in range(500):
        hull.step(0.02, 0.6, 0.6, 0.0, 0.0)
    assert hull.thrust_n[0] == pytest.approx(0.7 * hull.thrust_n[1])
    assert hull.rudder_rad == pytest.approx([0.0, math.radians(10)])


def _steady_rate(vessel: VesselConfig, handling: Handling, speed_mps: float) -> float:
    """The turn of ``max_yaw_rate`` by a stiff solver of somebody else's."""
    each_n = drag_n(vessel, speed_mps) / 2.0
    half_n = handling.authority(speed_mps).differential_nm / (2.0 * vessel.thruster.lateral_m)
    hard_over = vessel.rudder.max_rad

    def rates(_: float, through: tuple[float, float]) -> tuple[float, float]:
        v, r = through
        return handling.model.rates(speed_mps, v, r, each_n + half_n, each_n - half_n, hard_over, hard_over)[1:]

    return float(solve_ivp(rates, (0.0, 10.0), (0.0, 0.0), method="LSODA", rtol=1e-8, atol=1e-10).y[1, -1])


_FAST = {
    "heavy to turn": (
        "plant_b",
        {
            "hull": {"m22_kg": 247.0, "m33_kgm2": 35.0, "yv": 163.0, "nr": 38.0, "nrr": 780.0, "munk": 0.8},
            "thruster": {"ahead_n": 160.0},
        },
    ),
    "well ruddered": (
        "otter",
        {
            "hull": {"m22_kg": 302.0, "m33_kgm2": 34.1, "yv": 117.0, "yvv": 316.0, "nrr": 340.0, "munk": 0.66},
            "thruster": {"ahead_n": 220.0, "astern_n": 70.0, "lateral_m": 0.76},
            "rudder": {"area_m2": 0.02, "lift_slope_per_rad": 4.6},
        },
    ),
    "bare": (
        "blueboat",
        {
            "hull": {"m22_kg": 70.0, "m33_kgm2": 2.0, "xuu": 5.5, "yv": 81.0, "yvv": 93.0, "munk": 0.92},
            "thruster": {"ahead_n": 71.0, "astern_n": 55.0, "lateral_m": 0.21},
        },
    ),
}
"""Hulls and figures of boats of 5 to 7 m/s: each ran away where her turn was stepped by a twentieth of a second."""


@pytest.mark.parametrize(("name", "figures"), _FAST.values(), ids=_FAST)
def test_the_turn_of_a_fast_boat_is_that_of_her_equations(name, figures):
    vessel = any_hull(name)
    vessel = vessel.model_copy(
        update={table: getattr(vessel, table).model_copy(update=values) for table, values in figures.items()}
    )
    handling = Handling(vessel)
    for eighths in range(9):  # where the table has its points
        speed_mps = handling.top_mps * eighths / 8.0
        steady = _steady_rate(vessel, handling, speed_mps)
        assert handling.max_yaw_rate(speed_mps) == pytest.approx(max(steady, 0.001), rel=0.01)
