"""The force model in arrays, by which a boat is fitted, is the one by which it is sailed."""

import math
import random

import numpy as np
import pytest

from companion.core.hull.statics import top_speed_mps
from companion.core.steer.yaw_loop import yaw_plant
from companion.tuning import hull_arrays
from companion.tuning.hull_arrays import STEP_S, Commands, Drawn, HullArrays, coefficients
from sitl.plant.hull import SimVessel
from sitl.plant.library import load_vessel, vessel_names
from tools.benches.cells.foreign_hulls import bare, launch

HULLS = {name: load_vessel(name) for name in vessel_names()} | {"bare": bare("otter", 1.0), "launch": launch()}
HULLS["odd"] = HULLS["otter"].model_copy(
    update={
        "thruster": HULLS["otter"].thruster.model_copy(
            update={"exponent": 1.3, "starboard_share": 0.8, "speed_loss": 0.05, "dead_band": 0.12}
        ),
        "rudder": HULLS["otter"].rudder.model_copy(update={"offset_deg": 4.0, "lift_shape": "half-sin-2"}),
        "hull": HULLS["otter"].hull.model_copy(update={"crossflow_cd": 0.8}),
    }
)


def propelled(**thruster):
    return HULLS["otter"].model_copy(update={"thruster": HULLS["otter"].thruster.model_copy(update=thruster)})


HULLS["astern otherwise"] = propelled(exponent=1.8, exponent_astern=1.2)
HULLS["by a table"] = propelled(curve=((-1.0, -1.0), (-0.5, -0.4), (0.0, 0.0), (0.3, 0.2), (0.6, 0.7), (1.0, 1.0)))


@pytest.mark.parametrize("name", HULLS)
def test_accelerations_are_those_of_the_force_model(name, monkeypatch):
    # a fit rounds the corner at which a rudder stalls, or it would stop there
    monkeypatch.setattr(hull_arrays, "_STALLING_RAD", 1e-9)
    vessel, dice = HULLS[name], random.Random(name)
    arrays, c = HullArrays(vessel), {k: np.full((1, 1), v) for k, v in coefficients(vessel).items()}
    model = SimVessel(vessel).model
    for _ in range(300):
        u, v, r = dice.uniform(-2, 3), dice.uniform(-1, 1), dice.uniform(-1, 1)
        port, starboard, angle = dice.uniform(-60, 100), dice.uniform(-60, 100), dice.uniform(-0.6, 0.6)
        thrust = np.array([port, starboard]).reshape(2, 1, 1)
        found = arrays.rates(c, tuple(np.full((1, 1), x) for x in (u, v, r)), (thrust, angle), (0.0, 0.0, 0.0))
        wanted = model.rates(
            u, v, r,
            thrust_port_n=port, thrust_starboard_n=starboard, rudder_port_rad=angle, rudder_starboard_rad=angle,
        )  # fmt: skip
        assert [float(np.squeeze(x)) for x in found] == pytest.approx(wanted, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", HULLS)
def test_a_minute_of_manoeuvres_ends_where_the_simulated_boat_does(name):
    vessel = HULLS[name]
    count = round(30.0 / STEP_S)
    port = np.array([0.6 if k < 300 else -0.4 for k in range(count)])
    starboard = np.array([0.6 if k % 200 < 100 else 0.2 for k in range(count)])
    rudder = np.array([0.3 * math.copysign(1.0, math.sin(k / 60.0)) for k in range(count)])
    for commands in (port, starboard, rudder):
        commands[:20] = 0.0  # a stretch begins with propellers and rudders as they are told to be: both at rest
    boat, seen = SimVessel(vessel), []
    for k in range(count):
        seen.append((boat.u_mps, boat.v_mps, boat.r_radps))
        for _ in range(3):
            boat.step(STEP_S / 3, port[k], starboard[k], rudder[k], rudder[k])
    c = {k: np.full((1, 1), v) for k, v in coefficients(vessel).items()}
    still = (np.zeros((1, 1)), np.zeros((1, 1)))
    told = Commands(port[:, None], starboard[:, None], rudder[:, None], np.zeros((count, 1)))
    found = HullArrays(vessel).sail(c, told, np.zeros((3, 1, 1)), still, np.zeros((2, 1, 1)))[:, :, 0, 0]
    off = np.sqrt(np.mean((found - np.array(seen)) ** 2, axis=0)) / np.maximum(np.std(np.array(seen), axis=0), 0.02)
    assert off.max() < 0.06


def test_a_yaw_rate_that_is_drawn_to_what_was_heard_stays_near_it_on_a_hull_that_turns_away_by_itself():
    """From the start alone a wave's push grows for the whole window, and a fit makes the hull steadier instead."""
    vessel, steps = bare("otter", 1.0), round(16.0 / STEP_S)
    heard = np.full((steps, 1), 0.02)
    ahead = Commands(*(np.full((steps, 1), x) for x in (0.8, 0.8, 0.0, 0.0)))
    c = {k: np.full((1, 1), v) for k, v in coefficients(vessel).items()}
    still, start = (np.zeros((1, 1)), np.zeros((1, 1))), np.zeros((3, 1, 1))
    start[0], start[2] = 2.0, 0.02
    alone, drawn = (
        HullArrays(vessel).sail(c, ahead, start, still, np.zeros((2, 1, 1)), drawn=each)[-1, 2, 0, 0]
        for each in (None, Drawn(heard, 3.0))
    )
    assert abs(alone) > 0.2
    assert abs(drawn) < 0.6 * abs(alone)


@pytest.mark.parametrize(("vessel", "away"), [(bare("otter", 1.0), True), (HULLS["otter"], False)])
def test_whether_a_hull_turns_away_by_itself_shows_in_its_linear_motion(vessel, away):
    assert (yaw_plant(vessel, 0.6 * top_speed_mps(vessel)).grows_per_s > 0.0) is away
