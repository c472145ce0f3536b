"""A plan that lies far away is not sailed by mistake: judged by where the boat goes, and by what it says."""

from __future__ import annotations

import re

import pytest

from companion.io.keeping.store import MemoryStore
from mavlink_bridge.language.messages import Mode, PlanState
from mavlink_bridge.language.requests import (
    Arm,
    Orbit,
    PausePlan,
    PlanItem,
    PlanKind,
    Reposition,
    Result,
    SetCurrent,
    SetHomePosition,
    SetMode,
    SetParameter,
    StartPlan,
)

NO_DEPTH = "depth.enabled=false"
FAR = (1_200_000.0, 0.0)


def word(trip) -> float:
    """The number that the vessel's own text offers."""
    found = [match[1] for text in trip.texts if (match := re.search(r"PLAN_FAR_OK=(\d+)", text))]
    return float(found[-1])


def stays(trip, seconds=20.0) -> bool:
    trip.run(seconds)
    return trip.distance_m < 5.0


@pytest.mark.parametrize("points", [[FAR], [(20.0, 0.0), (20.0, 8_000.0)], [(1_100.0, 0.0)]])
@pytest.mark.parametrize("how", [StartPlan(0), SetMode(Mode.AUTO), PausePlan(pause=False)])
def test_it_is_not_started_and_both_numbers_are_told(voyage, points, how):
    trip = voyage(NO_DEPTH)
    assert trip.plan(1.5, *points).result is Result.ACCEPTED, "an upload is warned of, never refused"
    trip.run(1.0)
    assert any("too far" in text for text in trip.texts)
    assert trip.ask(Arm(arm=True)).reason == "", "arming does not look"
    reply = trip.ask(how)
    assert reply.result is Result.REJECTED_NOW
    assert re.search(r"limit (1000|5000) m \(MIS_DIST_\w+\)", reply.reason)
    assert re.search(r"(1200 km|8000 m|1100 m)", reply.reason)
    assert stays(trip)


def test_the_word_lets_this_one_plan_sail_and_dies_with_it(voyage):
    trip = voyage(NO_DEPTH)
    trip.plan(1.5, (1_100.0, 0.0))
    trip.ask(Arm(arm=True))
    trip.run(1.0)
    assert trip.ask(SetParameter("PLAN_FAR_OK", word(trip) + 1)).result is Result.DENIED
    assert trip.ask(StartPlan(0)).result is Result.REJECTED_NOW
    assert trip.ask(SetParameter("PLAN_FAR_OK", word(trip))).reason == ""
    assert trip.ask(StartPlan(0)).reason == ""
    trip.run(20.0)
    assert trip.distance_m > 15.0
    trip.mode(Mode.HOLD)
    trip.plan(1.5, (1_200.0, 0.0))
    assert trip.world.app.facade.params.get("PLAN_FAR_OK").value == 0.0
    assert trip.ask(StartPlan(0)).result is Result.REJECTED_NOW
    trip.plan(1.5, (1_100.0, 0.0))
    assert trip.ask(StartPlan(0)).result is Result.REJECTED_NOW, "the first word is dead"


def test_the_word_survives_a_restart_with_its_plan(voyage):
    store = MemoryStore()
    trip = voyage(NO_DEPTH, store=store)
    trip.plan(1.5, (1_100.0, 0.0))
    trip.run(1.0)
    trip.ask(SetParameter("PLAN_FAR_OK", word(trip)))
    again = voyage(NO_DEPTH, store=store)
    again.ask(Arm(arm=True))
    assert again.ask(StartPlan(0)).reason == ""


def test_a_stored_plan_of_another_place_is_told_when_the_place_is_known(voyage):
    store = MemoryStore()
    voyage(NO_DEPTH, store=store).plan(1.5, FAR)
    again = voyage(NO_DEPTH, store=store)
    assert any("too far" in text for text in again.texts)


def test_armed_in_auto_far_from_the_plan_it_holds(voyage):
    trip = voyage(NO_DEPTH)
    trip.plan(1.5, (20.0, 0.0))
    assert trip.mode(Mode.AUTO).reason == ""
    trip.plan(1.5, FAR)
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.snapshot.mode is Mode.HOLD
    assert stays(trip)


def test_a_plan_changed_under_way_for_one_far_away_is_not_sailed(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(1.5, (60.0, 0.0), after_s=15.0)
    trip.plan(1.5, (20.0, 0.0), FAR)
    trip.run(40.0)
    assert trip.snapshot.mode is Mode.HOLD
    assert trip.distance_m < 60.0
    assert trip.ask(SetCurrent(1)).reason == ""


@pytest.mark.parametrize("paused", [False, True], ids=["under way", "paused"])
def test_a_current_item_that_was_moved_far_away_is_not_sailed(voyage, paused):
    trip = voyage(NO_DEPTH)
    trip.sail(1.5, (20.0, 0.0), (60.0, 0.0), after_s=25.0)
    assert trip.snapshot.progress.seq == 2
    if paused:
        trip.mode(Mode.HOLD)
    trip.plan(1.5, (20.0, 0.0), FAR)
    trip.run(5.0)
    assert paused or trip.snapshot.mode is Mode.HOLD
    assert "too far" in trip.mode(Mode.AUTO).reason
    trip.run(30.0)
    assert trip.distance_m < 70.0


def returned(voyage, *, anew):
    """At home after a plan that was left at its second point; ``anew``: disarmed, and armed again."""
    trip = voyage(NO_DEPTH, "mission.first_distance_m=300")
    trip.sail(2.5, (20.0, 0.0), (60.0, 0.0), (100.0, 0.0), after_s=20.0)
    assert trip.snapshot.progress.seq == 2
    trip.mode(Mode.RTL)
    trip.run(30.0)
    if anew == "disarmed":
        trip.ask(Arm(arm=False))
    elif anew == "armed again":
        trip.mode(Mode.HOLD)
        trip.ask(Arm(arm=False))
        trip.ask(Arm(arm=True))
    return trip


@pytest.mark.parametrize("anew", ["", "disarmed", "armed again"])
def test_another_plan_with_the_same_way_out_begins_at_its_first_item_at_home(voyage, anew):
    trip = returned(voyage, anew=anew)
    assert trip.plan(2.5, (20.0, 0.0), (0.0, 60.0), (0.0, 100.0)).reason == ""
    trip.run(1.0)
    assert trip.snapshot.progress.seq == 0
    assert any("begins at its first item" in text for text in trip.texts)
    if anew == "disarmed":
        trip.ask(Arm(arm=True))
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(3.0)
    assert trip.snapshot.progress.seq == 1, "the way out first"


def test_the_same_plan_goes_on_where_it_was_after_the_way_home(voyage):
    trip = returned(voyage, anew="disarmed")
    assert trip.plan(2.5, (20.0, 0.0), (60.0, 0.0), (100.0, 0.0)).reason == ""
    trip.run(1.0)
    assert trip.snapshot.progress.seq == 2


@pytest.mark.parametrize("paused", [False, True], ids=["under way", "paused"])
def test_a_moved_item_beyond_the_first_distance_is_sailed_under_way_alone(voyage, paused):
    trip = voyage(NO_DEPTH, "mission.first_distance_m=300")
    trip.sail(2.5, (20.0, 0.0), (60.0, 0.0), after_s=20.0)
    assert trip.snapshot.progress.seq == 2
    if paused:
        trip.mode(Mode.HOLD)
    trip.plan(2.5, (20.0, 0.0), (900.0, 0.0))
    trip.run(2.0)
    assert any("its leg begins here" in text for text in trip.texts)
    assert ("MIS_DIST_1WP" in trip.mode(Mode.AUTO).reason) is paused
    assert trip.snapshot.mode is (Mode.HOLD if paused else Mode.AUTO)


def test_a_plan_uploaded_again_while_paused_goes_on_where_it_was(voyage):
    trip = voyage(NO_DEPTH, "mission.first_distance_m=50")
    trip.sail(2.5, (40.0, 0.0), (100.0, 0.0), (100.0, 100.0), after_s=35.0)
    seq = trip.snapshot.progress.seq
    assert seq >= 2, "beyond the first point"
    trip.mode(Mode.HOLD)
    trip.run(3.0)
    there_m = trip.distance_m
    for last in ((100.0, 100.0), (100.0, 120.0)):
        assert trip.plan(2.5, (40.0, 0.0), (100.0, 0.0), last).reason == ""
        trip.run(1.0)
        assert (trip.snapshot.progress.state, trip.snapshot.progress.seq) == (PlanState.PAUSED, seq)
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(6.0)
    assert trip.snapshot.progress.seq >= seq
    assert trip.distance_m > there_m, "on, not back to the first point"


def test_a_plan_that_has_begun_goes_on_wherever_it_was_paused(voyage):
    trip = voyage(NO_DEPTH, "mission.first_distance_m=50", "mission.leg_distance_m=400", "mission.cruise_speed_mps=2.5")
    trip.sail(2.5, (20.0, 0.0), (220.0, 0.0), after_s=40.0)
    assert 60.0 < trip.distance_m < 160.0
    trip.mode(Mode.HOLD)
    trip.run(5.0)
    assert trip.mode(Mode.AUTO).reason == "", "it lies on the leg that it was sailing"
    trip.ask(Arm(arm=False))
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.mode(Mode.AUTO).reason == ""
    assert trip.snapshot.progress.state is PlanState.ACTIVE


def test_hold_return_and_a_go_to_within_a_leg_never_ask(voyage):
    trip = voyage(NO_DEPTH, "mission.first_distance_m=50")
    trip.plan(1.5, FAR)
    trip.ask(Arm(arm=True))
    far = trip.world.surroundings.plant.frame.to_geodetic(300.0, 0.0)
    for body in (Reposition(*far), SetMode(Mode.HOLD), SetMode(Mode.MANUAL), SetMode(Mode.RTL)):
        assert trip.ask(body).reason == ""


@pytest.mark.parametrize("order", [Reposition, Orbit])
@pytest.mark.parametrize("armed", [False, True])
def test_a_target_farther_than_a_leg_is_refused_unless_it_is_nearer_home(voyage, order, armed):
    trip = voyage(NO_DEPTH)
    place = trip.world.surroundings.plant.frame.to_geodetic
    if armed:
        trip.ask(Arm(arm=True))
    refused = trip.ask(order(*place(200_000.0, 0.0)))
    assert refused.result is Result.DENIED
    assert refused.reason == "the target is 200 km away, limit 5000 m; MIS_DIST_WPS=<metres> allows it"
    assert stays(trip)
    assert trip.ask(order(*place(4_900.0, 0.0))).reason == ""
    assert trip.ask(SetParameter("MIS_DIST_WPS", 20_000.0)).reason == ""
    assert trip.ask(order(*place(15_000.0, 0.0))).reason == ""


def test_a_far_target_nearer_home_is_a_way_back(voyage):
    trip = voyage(NO_DEPTH)
    place = trip.world.surroundings.plant.frame.to_geodetic
    trip.ask(SetHomePosition(*place(-30_000.0, 0.0)))
    assert trip.ask(Reposition(*place(-20_000.0, 0.0))).reason == ""
    assert trip.ask(Reposition(*place(20_000.0, 0.0))).result is Result.DENIED


def test_an_item_nearer_home_is_a_way_back(voyage):
    trip = voyage(NO_DEPTH, "mission.first_distance_m=50", "mission.leg_distance_m=110")
    trip.plan(1.5, (10.0, 0.0))
    trip.ask(Arm(arm=True))
    trip.ask(Reposition(*trip.world.surroundings.plant.frame.to_geodetic(100.0, 0.0)))
    trip.until(lambda: trip.distance_m > 85.0, 120.0)
    assert trip.ask(StartPlan(0)).reason == ""


LOITER_TIME, RACETRACK, EIGHT = 19, 31000, 35


@pytest.mark.parametrize(
    ("items", "said"),
    [
        ([(LOITER_TIME, 600.0, 0.0, 4000.0)], "item 0 reaches from its middle 4000 m, limit 1000 m (MIS_DIST_1WP)"),
        ([(RACETRACK, 600.0, 9000.0, 50.0)], "item 0 reaches from its middle 4550 m"),
        ([(EIGHT, 8000.0, 500.0, 600.0)], "item 0 reaches from its middle"),
        (
            [(LOITER_TIME, 600.0, 0.0, 40.0), (LOITER_TIME, 600.0, 0.0, 4000.0)],
            "item 1 measures 8000 m, limit 5000 m (MIS_DIST_WPS)",
        ),
    ],
    ids=["circle", "racetrack", "figure-eight", "later"],
)
def test_a_figure_as_large_as_a_bay_is_asked_for(voyage, items, said):
    """Its middle is where the boat lies: a radius of 4000 for 40 takes her as far away as a plan of another place."""
    trip = voyage(NO_DEPTH)
    plan = [PlanItem(command, 3, *params, 0.0, *trip.at(0.0, 0.0), 0.0) for command, *params in items]
    assert trip.upload(PlanKind.MISSION, plan).result is Result.ACCEPTED
    assert trip.ask(Arm(arm=True)).reason == ""
    trip.run(1.0)
    reply = trip.ask(StartPlan(0))
    assert reply.result is Result.REJECTED_NOW
    assert said in reply.reason
    assert trip.ask(SetParameter("PLAN_FAR_OK", word(trip))).reason == ""
    assert trip.ask(StartPlan(0)).reason == ""
