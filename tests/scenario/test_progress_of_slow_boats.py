"""A boat that turns slowly, or lies about its point, gets on in time and not in metres; one that is held on its leg is told of."""

from __future__ import annotations

import pytest

from companion.tuning.fitted import vessel_toml
from mavlink_bridge.language.requests import Arm, PlanItem, PlanKind, StartPlan
from tests.soaked import in_the_soak
from tools.benches.cells.foreign_hulls import launch, pontoon, single_screw

NO_DEPTH = "depth.enabled=false"
WAYPOINT, LOITER_TIME, CHANGE_SPEED = 16, 19, 178
CALM = ("world.water.current_mps=0", "world.water.wind_mps=0", "world.water.wave_height_m=0.1")


def told(trip):
    return [text for text in trip.texts if "no progress" in text]


def circled_and_held(voyage, tmp_path, hull, radius_m, speed_mps):
    """A waypoint, a circle about it, and a hover of two minutes 60 m from there."""
    (tmp_path / "boat.toml").write_text(vessel_toml(hull), encoding="utf-8")
    trip = voyage(NO_DEPTH, f"vessel='{tmp_path / 'boat.toml'}'", *CALM)
    there, hover = trip.at(0.0, 40.0), trip.at(10.0, -20.0)
    items = [
        PlanItem(CHANGE_SPEED, 2, 1.0, speed_mps, -1.0, 0.0, 0, 0, 0.0),
        PlanItem(WAYPOINT, 3, 0.0, 0.0, 0.0, 0.0, *there, 0.0),
        PlanItem(LOITER_TIME, 3, 90.0, 0.0, -radius_m, 1.0, *there, 0.0),
        PlanItem(LOITER_TIME, 3, 120.0, 0.0, 0.0, 0.0, *hover, 0.0),
    ]
    for reply in (trip.upload(PlanKind.MISSION, items), trip.ask(Arm(arm=True)), trip.ask(StartPlan(0))):
        assert reply.reason == ""
    trip.until(lambda: "plan complete" in trip.texts, 500.0)
    return trip


@pytest.mark.parametrize(
    ("hull", "radius_m"),
    [(single_screw, 5.0), (launch, 20.0), *in_the_soak((pontoon, 5.0))],
    ids=["one screw", "joining", "heavy"],
)
def test_a_sound_boat_that_turns_slowly_is_left_alone(voyage, tmp_path, hull, radius_m):
    """One of one screw was told three times: 62 m off while she turned for it, and 3 m off while she lay there and the time ran."""
    assert told(circled_and_held(voyage, tmp_path, hull(), radius_m, 1.2)) == []


def test_a_boat_that_a_rope_holds_on_its_leg_is_told_of(voyage):
    """On its track it was never told of: who lies on the line was taken for one that keeps a station."""
    trip = voyage(NO_DEPTH, "monitors.stuck_s=0", *CALM)
    trip.sail(1.0, (300.0, 0.0), after_s=40.0)
    hull = trip.world.surroundings.plant.vessel
    north_m, east_m = hull.north_m, hull.east_m
    end_s = trip.now_s + 40.0
    while trip.now_s < end_s:
        hull.place(north_m=north_m, east_m=east_m)
        trip.step()
    assert told(trip) == ["no progress for 20 s at item 1, 261 m to go"]
