"""An order that was given while disarmed, and who arms afterwards: judged by where the boat goes, and by what is told."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, GuidedHeading, GuidedTarget, Orbit, Reply, Reposition, Result, SetMode
from mavlink_bridge.language.stations import Station
from tests.soaked import in_the_soak

NO_DEPTH = "depth.enabled=false"
FIRST, SECOND = Station(77, 190, "gcs", "10.0.0.7"), Station(255, 190, "gcs", "10.0.0.2")


def order(trip, body, station: Station | None) -> Reply:
    replies: list[Reply] = []
    trip.world.app.submit(body, replies.append, station=station)
    trip.until(lambda: bool(replies), 1.0)
    return replies[0]


def north(trip, away_m: float) -> tuple[float, float]:
    return trip.world.surroundings.plant.frame.to_geodetic(away_m, 0.0)


@pytest.mark.parametrize(
    ("left", "said"),
    [
        (lambda place: Reposition(*place), "Go-to 3000 m away"),
        (lambda place: Reposition(*place, radius_m=20.0), "Circle 3000 m away"),
        (lambda place: Orbit(*place), "Circle 3000 m away"),
        (lambda place: GuidedHeading(math.radians(90.0), 1.2), "Heading 90 deg at 1.2 m/s"),
        (lambda place: GuidedHeading(math.radians(90.0), 1.2, course=True), "Course 90 deg at 1.2 m/s"),
    ],
    ids=["go-to", "go-to with a radius", "orbit", "heading", "course"],
)
@pytest.mark.parametrize("armed_by", [SECOND, *in_the_soak(FIRST, None)], ids=["another", "who ordered", "from aboard"])
def test_it_is_told_to_who_ordered_it_and_dropped_when_another_arms(voyage, left, said, armed_by):
    trip = voyage(NO_DEPTH)
    assert order(trip, left(north(trip, 3000.0)), FIRST).reason == ""
    trip.run(12.0)
    assert order(trip, Arm(arm=True), armed_by).reason == ""
    trip.run(30.0)
    told = [text for text in trip.texts if text.startswith(said)]
    if armed_by is FIRST:
        assert told == [said]
        assert trip.distance_m > 10.0
    else:
        assert told == [f"{said}: order of station 77 over gcs dropped, holding here"]
        assert trip.snapshot.mode is Mode.HOLD
        assert trip.distance_m < 5.0
        assert order(trip, left(north(trip, 3000.0)), armed_by).reason == "", "ordered again it is obeyed"
        trip.run(30.0)
        assert trip.distance_m > 10.0


def test_an_order_from_aboard_is_not_a_stations(voyage):
    trip = voyage(NO_DEPTH)
    order(trip, Reposition(*north(trip, 200.0)), None)
    order(trip, Arm(arm=True), SECOND)
    trip.run(20.0)
    assert "Go-to 200 m away: order from aboard dropped, holding here" in trip.texts
    assert trip.distance_m < 5.0


def test_a_stream_goes_on_when_another_arms(voyage):
    """A computer sends set-points, and a person arms: whoever streams is there."""
    trip = voyage(NO_DEPTH)
    order(trip, SetMode(Mode.GUIDED), FIRST)
    for second in range(25):
        for _ in range(5):
            assert order(trip, GuidedTarget(*north(trip, 300.0)), FIRST).reason == ""
            trip.run(0.15)
        if second == 2:
            assert order(trip, Arm(arm=True), SECOND).reason == ""
    assert trip.snapshot.mode is Mode.GUIDED
    assert trip.distance_m > 10.0


def test_nothing_is_said_of_an_order_that_leads_nowhere(voyage):
    trip = voyage(NO_DEPTH)
    order(trip, Reposition(*north(trip, 300.0)), FIRST)
    order(trip, SetMode(Mode.GUIDED), SECOND)
    before = len(trip.texts)
    assert order(trip, Arm(arm=True), FIRST).result is Result.ACCEPTED
    trip.run(20.0)
    assert not [text for text in trip.texts[before:] if "away" in text or "dropped" in text]
    assert trip.distance_m < 5.0
