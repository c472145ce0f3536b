"""Real pinnacles, sounded once and drifted off: none is forgotten, and who comes back is stopped before it (security trial, line 14)."""

from __future__ import annotations

import math
import random

import pytest

from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.language.requests import Arm, StartPlan
from tools.figures import row

LIMIT_M = 4.0
PINNACLES = 200


def drawn(seed):
    """A rock in deep water, and how the boat comes upon it: (overrides, speed, drift time, least depth)."""
    chance = random.Random(f"pinnacle/{seed}")
    deep_m, top_m, radius_m = chance.uniform(12.0, 30.0), chance.uniform(1.0, 3.4), chance.uniform(2.0, 6.0)
    aside_m = chance.uniform(-0.3, 0.3) * radius_m
    rock = f"{{north_m=30.0, east_m={aside_m}, radius_m={radius_m}, height_m={deep_m - top_m}}}"
    overrides = (
        "world.bottom.slope={gradient=0.0}",
        f"world.bottom.depth_m={deep_m}",
        f"world.bottom.mounds=[{rock}]",
        f"world.water.current_mps={chance.uniform(0.02, 0.4)}",
        f"world.water.current_to_deg={chance.uniform(0.0, 360.0)}",
    )
    return overrides, chance.uniform(0.8, 2.5), chance.uniform(20.0, 160.0)


def shoals(trip):
    """Middles of the remembered cells that are too shallow, in metres north and east."""
    memory = trip.world.app.vehicle.parts.guard.memory
    frame, found = trip.world.surroundings.plant.frame, []
    for lat_rad, lon_rad, cell in memory.known():
        if cell.robust_m(max(0.05, 0.005 * abs(cell.mean_m))) < LIMIT_M - 0.2:
            found.append(frame.to_local(lat_rad, lon_rad)[:2])
    return found


def sounded_once(voyage, seed):
    """Sail over the rock, be stopped, drift: (what was sounded too shallow, what of it is forgotten); None: it was not met."""
    overrides, speed_mps, drift_s = drawn(seed)
    trip = voyage(*overrides, seed=seed)
    trip.sail(speed_mps, (100.0, 0.0))
    while trip.snapshot.action < Action.HOLD and trip.truth.north_m < 50.0:
        trip.step()
    if trip.snapshot.action < Action.HOLD:
        return None
    trip.run(8.0)
    sounded, until_s = set(shoals(trip)), trip.now_s + drift_s
    while sounded and trip.now_s < until_s:
        trip.run(4.0)
        sounded |= set(shoals(trip))
    trip.world.app.vehicle.parts.guard.memory.close_cell()
    return trip, sounded, sounded - set(shoals(trip))


@pytest.mark.parametrize("seed", [1, pytest.param(9, marks=pytest.mark.soak)])
def test_a_pinnacle_sounded_once_and_drifted_off_stops_who_comes_back(voyage, seed):
    trip, sounded, forgotten = sounded_once(voyage, seed)
    assert sounded
    assert not forgotten
    comes_back(trip, sounded)


def comes_back(trip, sounded):
    """From some way off towards what was sounded: stopped with its name, before the top is under the keel again."""
    trip.ask(Arm(arm=False))
    north_m = math.fsum(place[0] for place in sounded) / len(sounded)
    east_m = math.fsum(place[1] for place in sounded) / len(sounded)
    bearing = math.atan2(trip.truth.east_m - east_m, trip.truth.north_m - north_m)
    away = north_m + 30.0 * math.cos(bearing), east_m + 30.0 * math.sin(bearing)
    trip.plan(1.5, away, (north_m, east_m))
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.ask(StartPlan(0)).reason == ""
    before = len(trip.texts)
    trip.until(lambda: any("sounded before" in text for text in trip.texts[before:]), 150.0)
    trip.run(10.0)
    assert trip.snapshot.mode is Mode.HOLD


@pytest.mark.soak
def test_none_of_two_hundred_pinnacles_is_forgotten(voyage):
    met = forgotten = seed = 0
    while met < PINNACLES:
        seed += 1
        found = sounded_once(voyage, seed)
        if found is not None and found[1]:
            met += 1
            forgotten += bool(found[2])
    print(row(f"pinnacles forgotten of {met}", forgotten, "", 0.0))
    assert forgotten == 0
