"""A boat that gets nowhere says so (unit/test_progress_watch.py); one that is on its way is left alone, on the water."""

from __future__ import annotations

NO_DEPTH = "depth.enabled=false"


def test_a_boat_on_its_way_says_nothing(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(1.5, (60.0, 0.0), (60.0, 40.0), after_s=90.0)
    assert not [text for text in trip.texts if "progress" in text or "off the track" in text]
