"""Where Return leads: never to a rally point of another water or behind a fence, and it says where."""

from __future__ import annotations

import math
import re

import pytest

from companion.io.keeping.store import MemoryStore
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.requests import Arm, PlanItem, PlanKind, SetHomePosition, SetParameter, StartPlan
from tests.soaked import in_the_soak
from tests.world_station import Helm

NO_DEPTH = "depth.enabled=false"
RALLY, SET_MODE, ARM, AUTO = 5100, 176, 400, 10.0
OTHER_WATER, NEAR = (60_000.0, 0.0), (50.0, 0.0)


def rally(trip, *places):
    """Upload rally points, and wait for what is told of them."""
    items = [PlanItem(RALLY, 3, 0.0, 0.0, 0.0, 0.0, *trip.at(*place), 0.0) for place in places]
    assert trip.upload(PlanKind.RALLY, items).reason == ""
    trip.texts.clear()
    trip.run(4.0)


def told(trip, words):
    return [text for text in trip.texts if words in text]


def test_a_lost_station_brings_the_boat_home_and_not_to_yesterdays_rally_point():
    """It sailed for the rally point of another water, 60 km off, with home 15 m away."""
    helm = Helm("ardurover", NO_DEPTH, "failsafe.gcs_then_s=10")
    assert helm.upload([(3, RALLY, 0.0, 0.0, 0.0, 0.0, *helm.at(*OTHER_WATER), 0.0)], 2) == 0
    assert helm.upload([(3, 16, 0.0, 0.0, 0.0, math.nan, *helm.at(-60.0, 0.0), 0.0)]) == 0
    assert helm.command(SET_MODE, 1.0, AUTO) == 0
    assert helm.command(ARM, 1.0) == 0
    helm.run(25.0)
    assert helm.truth.north_m < -15.0
    helm.present = False
    helm.run(90.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 5.0
    assert "Return to home, " in helm.texts()


def test_a_rally_point_of_another_water_is_told_at_the_upload_at_the_start_and_at_arming(voyage):
    store, words = MemoryStore(), "not returned to: 60 km away, limit 5000 m (RALLY_LIMIT_KM)"
    trip = voyage(NO_DEPTH, store=store)
    rally(trip, NEAR, OTHER_WATER)
    assert told(trip, words) == [f"Rally point 2 is {words}"]
    again = voyage(NO_DEPTH, store=store)
    again.run(4.0)
    assert told(again, words) == [f"Rally point 2 is {words}"]
    again.texts.clear()
    assert again.ask(Arm(arm=True)).reason == ""
    again.run(1.0)
    assert told(again, words) == [f"Rally point 2 is {words}"]
    assert again.mode(Mode.RTL).reason == ""
    again.run(1.0)
    assert told(again, "Return to home, 0 m")


def test_the_nearest_of_rally_points_and_home_is_taken(voyage):
    trip = voyage(NO_DEPTH)
    rally(trip, NEAR, (300.0, 0.0))
    assert not told(trip, "not returned to")
    trip.sail(2.0, (60.0, 0.0), after_s=25.0)
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(60.0)
    assert told(trip, "Return to rally point 1, ")
    assert abs(trip.truth.north_m - 50.0) < 5.0


@pytest.mark.parametrize("limit_km", [0.0, 100.0])
def test_somebody_who_means_it_sails_to_a_far_rally_point(voyage, limit_km):
    trip = voyage(NO_DEPTH)
    assert trip.ask(SetParameter("RALLY_LIMIT_KM", limit_km)).reason == ""
    rally(trip, (59_000.0, 0.0))
    assert not told(trip, "not returned to")
    assert trip.ask(SetHomePosition(*trip.world.surroundings.plant.frame.to_geodetic(-60_000.0, 0.0))).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(20.0)
    assert told(trip, "Return to rally point 1, 59 km")
    assert trip.truth.north_m > 10.0


@pytest.mark.parametrize("inclusion", [True, False], ids=["outside the fence", "in a forbidden area"])
def test_a_rally_point_that_the_fence_shuts_off_is_passed_over(voyage, inclusion):
    """The boat sailed for it to the fence and stayed there."""
    trip = voyage(NO_DEPTH)
    rally(trip, (120.0, 0.0))
    trip.sail(2.0, (70.0, 0.0), after_s=35.0)
    fence = trip.circle_fence(90.0) if inclusion else trip.circle_fence(20.0, 120.0, 0.0, inclusion=False)
    assert fence.reason == ""
    trip.run(4.0)
    assert told(trip, f"Rally point 1 is not returned to: {30 if inclusion else 20} m outside the fence")
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(70.0)
    assert told(trip, "Return to home, ")
    assert trip.distance_m < 5.0


@pytest.mark.parametrize(("north_m", "short_m"), [(87.5, 1), (89.5, 3)])
def test_a_rally_point_just_inside_the_fence_is_passed_over(voyage, north_m, short_m):
    """The fence stopped the boat before it, and she lay in Hold there with home free."""
    trip = voyage(NO_DEPTH)
    trip.sail(2.0, (60.0, 0.0), after_s=30.0)
    assert trip.circle_fence(90.0).reason == ""
    rally(trip, (north_m, 0.0))
    assert told(trip, f"Rally point 1 is not returned to: {short_m} m too near the fence to stop there")
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(70.0)
    assert told(trip, "Return to home, ")
    assert trip.snapshot.mode is Mode.RTL
    assert trip.distance_m < 5.0


@pytest.mark.parametrize(
    ("at", "fence"),
    [((85.5, 0.0), (90.0,)), ((40.0, 0.0), (20.0, 40.0, 22.2, False))],
    ids=["edge ahead", "edge beside"],
)
def test_a_rally_point_that_the_fence_lets_the_boat_reach_is_taken(voyage, at, fence):
    trip = voyage(NO_DEPTH)
    trip.sail(2.0, (60.0, 0.0), after_s=30.0)
    assert trip.circle_fence(*fence).reason == ""
    rally(trip, at)
    assert not told(trip, "not returned to")
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(70.0)
    assert told(trip, "Return to rally point 1, ")
    assert trip.snapshot.mode is Mode.RTL
    assert math.dist((trip.truth.north_m, trip.truth.east_m), at) < 3.0


def clear(trip):
    assert trip.upload(PlanKind.RALLY, []).reason == ""


def fence(trip):
    assert trip.circle_fence(112.0).reason == ""


def limit(trip):
    assert trip.ask(SetParameter("RALLY_LIMIT_KM", 0.01)).reason == ""


@pytest.mark.parametrize(
    ("change", "by_plan"),
    [(clear, False), (fence, True), (limit, False), *in_the_soak((clear, True), (fence, False), (limit, True))],
)
def test_what_changes_on_the_way_back_leads_elsewhere(voyage, change, by_plan):
    """She sailed on to the point that was deleted, or to the fence, and lay in Hold there."""
    trip = voyage(NO_DEPTH)
    rally(trip, (140.0, 0.0))
    if by_plan:
        items = [PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, *trip.at(85.0, 0.0), 0.0), PlanItem(20, 2, *[0.0] * 4, 0, 0, 0.0)]
        assert trip.upload(PlanKind.MISSION, items).reason == ""
        assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
        trip.until(lambda: bool(told(trip, "return to rally point 1, ")), 100.0)
    else:
        trip.sail(2.0, (100.0, 0.0), after_s=45.0)
        assert trip.mode(Mode.RTL).reason == ""
    trip.run(1.0)
    assert told(trip, "eturn to rally point 1, ")
    trip.texts.clear()
    change(trip)
    trip.run(110.0)
    assert len(told(trip, "eturn to home, ")) == 1
    assert trip.snapshot.mode is (Mode.AUTO if by_plan else Mode.RTL)
    assert trip.distance_m < 5.0


def test_home_that_is_set_on_the_way_back_is_sailed_to(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(2.0, (60.0, 0.0), after_s=30.0)
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(2.0)
    trip.texts.clear()
    assert trip.ask(SetHomePosition(*trip.world.surroundings.plant.frame.to_geodetic(60.0, 40.0))).reason == ""
    trip.run(70.0)
    assert len(told(trip, "Return to home, ")) == 1
    assert math.dist((trip.truth.north_m, trip.truth.east_m), (60.0, 40.0)) < 3.0


def test_a_boat_that_has_returned_stays_when_rally_points_change(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(2.0, (60.0, 0.0), after_s=30.0)
    rally(trip, NEAR)
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(30.0)
    trip.texts.clear()
    clear(trip)
    trip.run(30.0)
    assert not told(trip, "Return")
    assert abs(trip.truth.north_m - 50.0) < 3.0


def test_rally_points_behind_the_fence_are_told_when_they_are_loaded(voyage):
    trip = voyage(NO_DEPTH)
    assert trip.circle_fence(60.0).reason == ""
    rally(trip, (0.0, 80.0), NEAR, (120.0, 0.0))
    assert told(trip, "Rally point 1 and 1 more are not returned to: 20 m outside the fence")


def test_home_outside_the_fence_is_the_last_resort(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(2.0, (60.0, 0.0), after_s=30.0)
    assert trip.circle_fence(40.0, 60.0, 0.0).reason == ""
    rally(trip, (90.0, 0.0))
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(1.0)
    assert told(trip, "Return to rally point 1, ")
    rally(trip)
    assert trip.mode(Mode.HOLD).reason == ""
    trip.texts.clear()
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(1.0)
    assert told(trip, "Return to home, "), "as without a fence: there is nothing else"


CRITICAL = ("monitors.battery_critical_v=11", "world.water.current_mps=0.2", "world.water.wind_mps=4")
POLYGON_OUT, REPOSITION = 5002, 192


def sent_out(hull, *options, to):
    """A boat of some hull that keeps station out there, its battery sound."""
    helm = Helm("ardurover", NO_DEPTH, f'vessel="{hull}"', "failsafe.gcs_then_s=10", *options)
    helm.world.surroundings.plant.board.set_voltage(13.0)
    assert helm.command(ARM, 1.0) == 0
    lat, lon = helm.at(*to)
    assert helm.command(REPOSITION, -1.0, 1.0, 0.0, math.nan, lat / 1e7, lon / 1e7) == 0
    helm.run(100.0)
    assert math.dist((helm.truth.north_m, helm.truth.east_m), to) < 5.0
    return helm


def forbid(helm, *areas):
    rows = [(0, POLYGON_OUT, float(len(area)), 0, 0, 0, *helm.at(*corner), 0.0) for area in areas for corner in area]
    assert helm.upload(rows, 1) == 0


def box(south_m, north_m, west_m, east_m):
    return [(south_m, west_m), (north_m, west_m), (north_m, east_m), (south_m, east_m)]


def rally_at(helm, *places):
    assert helm.upload([(3, RALLY, 0.0, 0.0, 0.0, 0.0, *helm.at(*place), 0.0) for place in places], 2) == 0


@pytest.mark.parametrize(
    ("hull", "what"),
    [("otter", "battery"), *in_the_soak(("wamv", "station"), ("blueboat", "station"), ("wamv", "battery"))],
)
def test_a_place_behind_an_island_is_passed_over_while_another_lies_open(hull, what):
    """She lay before the island for good, until "Battery empty: STOP", and home was open all the while."""
    helm = sent_out(hull, *CRITICAL, to=(80.0, 0.0))
    forbid(helm, box(50.0, 75.0, 15.0, 30.0))
    rally_at(helm, (60.0, 45.0))
    helm.gcs.clear()
    if what == "battery":
        helm.world.surroundings.plant.board.set_voltage(10.5)
    else:
        helm.present = False
    helm.run(200.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 5.0
    said = helm.texts().replace("\n", "")
    assert said.count("Return to ") == 1
    assert re.search(r"Return to home, \d+ m: the fence is across the way to rally point 1, \d+ m", said)


@pytest.mark.parametrize("hull", ["otter", *in_the_soak("wamv", "blueboat")])
def test_a_boat_on_a_detour_turns_for_home_when_the_way_there_opens(hull):
    """The corner of an island was 1 m in the way home: she sailed for a rally point until her battery was empty."""
    helm = sent_out(hull, *CRITICAL, to=(80.0, 20.0))
    forbid(helm, box(30.0, 55.0, -15.0, 15.0))
    rally_at(helm, (80.0, 315.0))
    helm.gcs.clear()
    helm.world.surroundings.plant.board.set_voltage(10.5)
    helm.run(240.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 5.0
    said = helm.texts().replace("\n", "")
    assert said.count("Return to ") == 2
    assert re.search(r"Return to rally point 1, \d+ m: the fence is across the way to home, \d+ m", said)
    assert re.search(r"Return to home, \d+ m: the way is open, and shorter than to rally point 1", said)


def test_a_plan_that_returns_turns_for_home_when_the_way_there_opens(voyage):
    trip = voyage(NO_DEPTH)
    assert trip.circle_fence(14.0, 42.0, 0.0, inclusion=False).reason == ""
    rally(trip, (80.0, 315.0))
    way = [PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, *trip.at(*place), 0.0) for place in ((0.0, 60.0), (80.0, 20.0))]
    assert trip.upload(PlanKind.MISSION, [*way, PlanItem(20, 2, *[0.0] * 4, 0, 0, 0.0)]).reason == ""
    assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
    trip.until(lambda: bool(told(trip, "return to rally point 1, ")), 200.0)
    trip.run(200.0)
    assert trip.distance_m < 5.0
    assert len(told(trip, "return to ")) == 2
    assert told(trip, ": the way is open, and shorter than to rally point 1")


@pytest.mark.parametrize("hull", ["wamv", *in_the_soak("otter")])
def test_a_boat_near_home_does_not_sail_for_a_place_far_away(hull):
    """82 m from home she went for a rally point 3 km off, on the last of her battery; she waits before the island, told."""
    helm = sent_out(hull, *CRITICAL, to=(80.0, 20.0))
    forbid(helm, box(30.0, 55.0, -40.0, 15.0))
    rally_at(helm, (80.0, 3_000.0))
    helm.gcs.clear()
    helm.world.surroundings.plant.board.set_voltage(10.5)
    helm.run(120.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 90.0
    assert re.search(r"Return to home, \d+ m: the fence is across the way", helm.texts().replace("\n", ""))


def test_a_boat_that_is_held_before_the_fence_goes_where_a_way_opens():
    """Nothing but the nearest place was ever looked at."""
    helm = sent_out("otter", *CRITICAL, to=(80.0, 0.0))
    forbid(helm, box(30.0, 50.0, -15.0, 15.0))
    helm.present = False
    helm.run(90.0)
    assert helm.truth.north_m > 50.0, "home lies behind the island: she waits"
    assert "Fence ahead: HOLD" in helm.texts() or "(holding: fence ahead)" in helm.texts()
    helm.world.app.vehicle.controls.load_rally((rad(helm, 80.0, -120.0),))
    helm.run(200.0)
    assert math.dist((helm.truth.north_m, helm.truth.east_m), (80.0, -120.0)) < 5.0
    said = helm.texts().replace("\n", "")
    assert re.search(r"Return to rally point 1, \d+ m: the fence is across the way to home, \d+ m", said)


def rad(helm, north_m, east_m):
    return LatLon(helm.world.surroundings.plant.frame.to_geodetic(north_m, east_m))


def test_a_home_far_away_is_told_when_it_is_set_and_at_arming(voyage):
    trip = voyage(NO_DEPTH)
    far = trip.world.surroundings.plant.frame.to_geodetic(*OTHER_WATER)
    assert trip.ask(SetHomePosition(*far)).reason == ""
    trip.run(0.2)
    assert len(told(trip, "Return leads to home, 60 km away")) == 1
    assert trip.ask(Arm(arm=True)).reason == ""
    trip.run(0.2)
    assert len(told(trip, "Return leads to home, 60 km away")) == 2
