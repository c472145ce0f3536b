"""The chart is looked at along the way that will be sailed: round the corner and round the circle, not straight on."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.depth.grid import Sounding, build
from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, GuidedHeading, Orbit

FLAT = ("world.bottom.kind=flat", "world.bottom.depth_m=20")
"""The rocks are on the chart only, so that nothing else can stop the vessel."""


def chart(trip, *rocks):
    """Put rocks 2 m deep on the chart from now on (a plan onto one would be refused)."""
    frame = trip.world.surroundings.plant.frame
    soundings = [Sounding(*frame.to_geodetic(*rock), 2.0) for rock in rocks]
    trip.world.app.vehicle.parts.guard.set_map(build(soundings, pitch_m=1.0, spread_m=1.0))


def stops(trip):
    return any(text.startswith("Shallow water ahead (map 1.6 m)") for text in trip.texts)


def closest_m(trip, rocks, seconds):
    """Sail on; return the closest that the vessel came to a rock."""
    closest = math.inf
    for _ in range(round(20 * seconds)):
        trip.step()
        here = (trip.truth.north_m, trip.truth.east_m)
        closest = min(closest, *(math.dist(here, rock) for rock in rocks))
    return closest


def test_a_rock_beyond_a_corner_is_no_reason_to_stop(voyage):
    trip, rocks = voyage(*FLAT), [(45.0, 0.0), (46.0, 1.0), (46.0, -1.0)]
    trip.sail(1.5, (40.0, 0.0), (40.0, 60.0))
    chart(trip, *rocks)
    assert closest_m(trip, rocks, 60.0) > 3.0
    assert not stops(trip)
    assert trip.truth.east_m > 20.0


def test_a_rock_on_the_leg_after_the_corner_stops_it_in_time(voyage):
    trip, rocks = voyage(*FLAT), [(40.0, 14.0)]
    trip.sail(2.0, (40.0, 0.0), (40.0, 60.0))
    chart(trip, *rocks)
    assert closest_m(trip, rocks, 60.0) > 1.0, "the charted shoal reaches 1 m from the rock"
    assert stops(trip)
    assert trip.snapshot.mode is Mode.HOLD


@pytest.mark.parametrize(("rock", "stopped"), [((24.0, 0.0), False), ((0.0, 15.0), True)], ids=["outside", "on it"])
def test_on_a_circle_only_rocks_on_the_circle_stop_it(voyage, rock, stopped):
    trip = voyage(*FLAT)
    assert trip.ask(Arm(arm=True)).reason == ""
    lat, lon = (math.radians(value / 1e7) for value in trip.at(0.0, 0.0))
    assert trip.ask(Orbit(lat, lon, Circle(15.0), speed_mps=1.5)).reason == ""
    trip.run(60.0)
    chart(trip, rock)
    trip.run(75.0)
    assert stops(trip) == stopped


def test_steering_a_heading_looks_straight_on(voyage):
    trip, rocks = voyage(*FLAT), [(60.0, 0.0), (60.0, 1.0), (60.0, -1.0)]
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.ask(GuidedHeading(0.0, 2.0)).reason == ""
    chart(trip, *rocks)
    assert closest_m(trip, rocks, 60.0) > 2.0
    assert stops(trip)
