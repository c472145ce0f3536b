"""Where a vessel stays when its plan has ended: at the last point, as after a go-to, and not where it happened to be within reach of it."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.requests import Arm, PlanItem, PlanKind, StartPlan
from tests.soaked import in_the_soak

from .conftest import CHANGE_SPEED, JUMP, WAYPOINT, Voyage

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


HERE_M = (15.0, 0.0)
RETURN = 20


def item(command: int, *params: float, at: tuple[int, int] = (0, 0)) -> PlanItem:
    return PlanItem(command, 3 if any(at) else 2, *(*params, 0.0, 0.0, 0.0, 0.0)[:4], *at, 0.0)


@pytest.mark.parametrize(
    ("east_m", "repeats"),
    [((0.0,), -1), ((0.0, 0.0), -1), ((0.0, 0.0), 200)],
    ids=["one point", "two equal", "two hundred times"],
)
def test_a_plan_that_jumps_back_to_where_the_boat_is_keeps_her_there(voyage, east_m, repeats):
    """'Stay here' as ArduPilot's users write it. A leg of no length pointed north: she sailed there until the battery ended it."""
    trip = voyage("depth.enabled=false", "world.water.current_mps=0.3", "world.water.current_to_deg=90")
    items = [item(WAYPOINT, at=trip.at(HERE_M[0], HERE_M[1] + east)) for east in east_m]
    assert trip.upload(PlanKind.MISSION, [*items, item(JUMP, 0.0, repeats)]).reason == ""
    assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
    trip.run(40.0)
    began, farthest_m = len(trip.texts), 0.0
    while trip.now_s < 150.0:
        trip.step()
        farthest_m = max(farthest_m, math.dist((trip.truth.north_m, trip.truth.east_m), HERE_M))
    assert farthest_m < 2.0
    assert trip.texts[began:] == []


@pytest.mark.parametrize("vessel", ["plant_b", *in_the_soak("otter")])
def test_a_closed_patrol_is_sailed_through_its_first_point(voyage, vessel):
    """She braked to 0.46 m/s there in each lap: its last point is its first one, and the jump led back to where she was."""
    trip = voyage("depth.enabled=false", f"vessel={vessel}")
    first = (20.0, 0.0)
    points = [item(WAYPOINT, at=trip.at(*at)) for at in (first, (60.0, 0.0), (60.0, 30.0), (20.0, 30.0), first)]
    speed = item(CHANGE_SPEED, 1.0, 1.5, -1.0)
    assert trip.upload(PlanKind.MISSION, [speed, *points, item(JUMP, 1.0, -1.0)]).reason == ""
    assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
    trip.run(30.0)
    least_mps, laps = 9.0, 0
    while trip.now_s < 300.0:
        trip.step()
        least_mps = min(least_mps, math.hypot(trip.truth.vn_mps, trip.truth.ve_mps))
        laps += trip.snapshot.progress.reached.count(1)
    assert laps >= 2
    assert least_mps > 0.8


def test_a_way_home_in_a_loop_ends_at_home(voyage):
    trip = voyage("depth.enabled=false")
    items = [item(WAYPOINT, at=trip.at(*HERE_M)), item(RETURN), item(JUMP, 1.0, -1.0)]
    assert trip.upload(PlanKind.MISSION, items).reason == ""
    assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
    trip.run(90.0)
    for _ in range(40):
        trip.run(1.0)
        assert trip.distance_m < 1.5


@pytest.mark.parametrize("leads_off", [False, True], ids=["from home", "after a point"])
def test_a_loop_at_home_tells_the_way_home_while_there_is_one(voyage, leads_off):
    """It said "return to home, 0 m" each second for ever: on a slow link there was room for nothing else."""
    trip = voyage("depth.enabled=false", "world.water.current_mps=0.3", "world.water.current_to_deg=90")
    off = [item(WAYPOINT, at=trip.at(*HERE_M))] if leads_off else []
    assert trip.upload(PlanKind.MISSION, [*off, item(RETURN), item(JUMP, float(len(off)), -1.0)]).reason == ""
    assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
    trip.run(90.0)
    told = [text for text in trip.texts if "return to home" in text]
    assert 1 <= len(told) <= 2, told


def test_a_loop_with_a_way_home_tells_it_each_time(voyage):
    trip = voyage("depth.enabled=false")
    items = [item(WAYPOINT, at=trip.at(*HERE_M)), item(RETURN), item(JUMP, 0.0, -1.0)]
    assert trip.upload(PlanKind.MISSION, items).reason == ""
    assert [trip.ask(body).reason for body in (Arm(arm=True), StartPlan(0))] == ["", ""]
    trip.run(120.0)
    assert sum("return to home" in text for text in trip.texts) >= 3
