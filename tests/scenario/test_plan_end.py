"""Where a vessel stays when its plan has ended: at the last point, as after a go-to, and not where it happened to be within reach of it."""

from __future__ import annotations

import math

from .conftest import Voyage

LAST_M = (40.0, 20.0)


def off_m(trip: Voyage) -> float:
    return math.dist((trip.truth.north_m, trip.truth.east_m), LAST_M)


def ended(voyage, *water: str) -> Voyage:
    trip = voyage("depth.enabled=false", *water)
    trip.sail(1.5, (40.0, 0.0), LAST_M)
    trip.until(lambda: "plan complete" in trip.texts, 120.0)
    return trip


def test_no_item_is_shown_that_the_plan_does_not_have(voyage):
    trip = voyage("depth.enabled=false")
    shown = set()

    def complete() -> bool:
        progress = trip.world.snapshot.progress
        shown.add((progress.seq, progress.total))
        return "plan complete" in trip.texts

    trip.sail(1.5, (40.0, 0.0), LAST_M)
    trip.until(complete, 120.0)
    assert all(seq < total for seq, total in shown), shown


def test_a_vessel_stays_at_the_last_point_of_its_plan(voyage):
    """It stayed where it was first within the acceptance radius: 2 m short of the point, for good."""
    trip = ended(voyage)
    trip.run(60.0)
    assert off_m(trip) < 0.6
