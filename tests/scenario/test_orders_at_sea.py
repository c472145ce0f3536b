"""What the boat does next, after orders in an order that nobody planned: measured as distance on the water, not as state."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.messages import Action, Mode, PlanState
from mavlink_bridge.language.requests import (
    Arm,
    GuidedHeading,
    GuidedTarget,
    ManualInput,
    PausePlan,
    PlanItem,
    PlanKind,
    Reposition,
    Result,
    SetMode,
    SetSpeed,
    StartPlan,
)
from sitl.sensors import nmea_writer

NO_DEPTH = "depth.enabled=false"
LOITER_TURNS = 18


def point(trip, north_m, east_m):
    return trip.world.surroundings.plant.frame.to_geodetic(north_m, east_m)


def away_m(trip, north_m, east_m):
    return math.hypot(trip.truth.north_m - north_m, trip.truth.east_m - east_m)


def guided(voyage, *overrides):
    trip = voyage(NO_DEPTH, *overrides)
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.mode(Mode.GUIDED).reason == ""
    return trip


def stream(trip, seconds, rate_hz, place):
    """Send ``place(seconds since the start)`` as set-points, and note how far the boat is from each."""
    every_us, until_us = round(1e6 / rate_hz), trip.world.now_us + round(seconds * 1e6)
    began_us, far_m = trip.world.now_us, []
    while trip.world.now_us < until_us:
        if trip.world.now_us % every_us == 0:
            target = place((trip.world.now_us - began_us) * 1e-6)
            trip.world.app.submit(GuidedTarget(*point(trip, *target)))
            far_m.append(away_m(trip, *target))
        trip.step()
    return far_m


@pytest.mark.parametrize("rate_hz", [2, 5, 10, 20])
def test_a_streamed_position_is_kept_like_any_other(voyage, rate_hz):
    trip = guided(voyage)
    far_m = stream(trip, 90.0, rate_hz, lambda t_s: (30.0, 0.0))
    assert max(far_m[len(far_m) // 2 :]) < 1.0
    assert not any("oscillates" in text for text in trip.texts)


@pytest.mark.parametrize("speed_mps", [0.4, 0.8, 1.2])
def test_a_streamed_position_that_moves_is_followed(voyage, speed_mps):
    trip = guided(voyage)
    far_m = stream(trip, 90.0, 5, lambda t_s: (20.0 + speed_mps * t_s, 0.0))
    assert max(far_m[3 * len(far_m) // 4 :]) < 6.0
    assert not any("oscillates" in text for text in trip.texts)


def test_a_stop_in_a_stream_of_velocities_stops_and_the_stream_goes_on(voyage):
    trip = guided(voyage)

    def send(seconds, body):
        for _ in range(round(seconds * 10)):
            trip.world.app.submit(body)
            trip.run(0.1)

    send(10.0, GuidedHeading(0.0, speed_mps=1.0, course=True, stream=True))
    send(12.0, GuidedHeading(None, speed_mps=0.0, stream=True))
    assert trip.snapshot.mode is Mode.GUIDED
    assert trip.snapshot.state.sog_mps < 0.15
    send(8.0, GuidedHeading(0.0, speed_mps=1.0, course=True, stream=True))
    assert trip.snapshot.state.sog_mps > 0.8
    assert not any("holding" in text.lower() for text in trip.texts)


def test_after_a_second_plan_the_boat_stays_where_that_one_ended(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(1.5, (30.0, 0.0))
    trip.until(lambda: trip.snapshot.progress.state is PlanState.COMPLETE, 60.0)
    trip.plan(1.5, (-10.0, 30.0))
    assert trip.ask(StartPlan(0)).reason == ""
    trip.until(lambda: trip.snapshot.progress.state is PlanState.COMPLETE, 120.0)
    trip.run(60.0)
    assert away_m(trip, -10.0, 30.0) < 3.0


def test_armed_elsewhere_it_holds_where_it_is_and_returns_to_there(voyage):
    trip = voyage(NO_DEPTH, "world.water.current_mps=0.5")
    trip.ask(Arm(arm=True))
    trip.run(10.0)
    trip.ask(Arm(arm=False))
    trip.run(120.0)
    here = trip.truth.north_m, trip.truth.east_m
    assert away_m(trip, 0.0, 0.0) > 40.0, "it has drifted"
    assert trip.ask(Arm(arm=True)).reason == ""
    trip.run(60.0)
    assert away_m(trip, *here) < 4.0
    assert trip.ask(Reposition(*point(trip, here[0] + 25.0, here[1]))).reason == ""
    trip.run(40.0)
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(60.0)
    assert away_m(trip, *here) < 4.0, "home is where it was armed"


def test_the_return_is_not_sailed_at_the_speed_of_an_earlier_order(voyage):
    trip = guided(voyage)
    trip.ask(Reposition(*point(trip, 60.0, 0.0), speed_mps=1.2))
    trip.run(45.0)
    trip.ask(Reposition(*point(trip, 62.0, 0.0), speed_mps=0.3))
    trip.run(10.0)
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(20.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(1.5, abs=0.2)
    assert trip.ask(SetSpeed(0.6)).reason == ""
    trip.run(10.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(0.6, abs=0.15), "an order given on the way counts"


def test_a_speed_ordered_on_the_way_home_goes_before_the_returns_own(voyage):
    """RTL_SPEED; entered anew, the return keeps its own again."""
    trip = guided(voyage, "modes.return_speed_mps=2.0")
    trip.ask(Reposition(*point(trip, 140.0, 0.0), speed_mps=2.5))
    trip.run(60.0)
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(15.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(2.0, abs=0.2)
    assert trip.ask(SetSpeed(0.7)).reason == ""
    trip.run(10.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(0.7, abs=0.15)
    assert trip.ask(SetSpeed()).reason == ""
    trip.run(10.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(2.0, abs=0.2)
    trip.ask(SetSpeed(0.7))
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(10.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(2.0, abs=0.2)


def test_a_speed_ordered_while_a_heading_is_steered_is_obeyed(voyage):
    trip = guided(voyage)
    assert trip.ask(GuidedHeading(0.0, speed_mps=2.0)).reason == ""
    trip.run(15.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(2.0, abs=0.2)
    assert trip.ask(SetSpeed(0.7)).reason == ""
    trip.run(15.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(0.7, abs=0.15)
    assert trip.ask(GuidedHeading(0.5)).reason == ""
    trip.run(10.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(0.7, abs=0.15), "another heading brings no speed of its own"
    assert trip.ask(SetSpeed()).reason == ""
    trip.run(15.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(1.5, abs=0.2), "cruise speed"


def test_a_stream_of_headings_keeps_its_own_speed(voyage):
    trip = guided(voyage)

    def steered(seconds):
        for _ in range(round(seconds * 5.0)):
            assert trip.ask(GuidedHeading(0.0, speed_mps=1.2, stream=True)).reason == ""
            trip.run(0.15)

    steered(10.0)
    assert trip.ask(SetSpeed(0.5)).reason == ""
    steered(10.0)
    assert trip.snapshot.state.sog_mps == pytest.approx(1.2, abs=0.2)


def test_slow_against_the_stream_is_not_stuck(voyage):
    """2.5 m/s against a boat of 3.1: what is left over is little, and a stop would lose 2.5 m/s."""
    trip = voyage(NO_DEPTH, "world.water.current_mps=2.5", "world.water.current_to_deg=180")
    trip.sail(1.0, (300.0, 0.0))
    trip.run(90.0)
    assert trip.snapshot.action is not Action.STOP
    assert not any("without speed" in text for text in trip.texts)
    assert trip.snapshot.state.sog_mps > 0.3


def test_a_receiver_with_coarse_steps_does_not_look_frozen_to_a_boat_that_keeps_station(voyage, monkeypatch):
    """Four decimals of a minute are steps of 18 cm; a boat that holds to 5 cm in a stream gives the same fix for long."""

    def coarse(angle_rad):
        parts = round(abs(math.degrees(angle_rad)) * 60.0 * 1e4) * 1000
        minutes, fraction = divmod(parts, 10**7)
        return minutes // 60, minutes % 60, fraction

    monkeypatch.setattr(nmea_writer, "_minutes", coarse)
    trip = voyage(NO_DEPTH, "world.water.current_mps=0.7", seed=5)
    trip.ask(Arm(arm=True))
    trip.run(560.0)
    assert not any("repeats" in text for text in trip.texts)
    assert "position_lost" not in trip.snapshot.causes


def test_a_part_of_a_plan_stays_a_part_after_a_pause(voyage):
    trip = voyage(NO_DEPTH)
    trip.plan(1.5, (20.0, 0.0), (40.0, 0.0), (80.0, 0.0))
    trip.ask(Arm(arm=True))
    assert trip.ask(StartPlan(0, last=2)).reason == ""
    trip.run(10.0)
    trip.ask(PausePlan(pause=True))
    trip.run(5.0)
    assert trip.ask(PausePlan(pause=False)).reason == ""
    trip.until(lambda: trip.snapshot.progress.state is PlanState.COMPLETE, 90.0)
    trip.run(20.0)
    assert away_m(trip, 40.0, 0.0) < 3.0
    assert trip.snapshot.progress.seq == 2


def test_an_order_that_is_repeated_does_not_begin_the_plan_again(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(1.5, (25.0, 0.0), (25.0, 15.0))
    trip.until(lambda: trip.snapshot.progress.state is PlanState.COMPLETE, 90.0)
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(20.0)
    assert trip.snapshot.progress.state is PlanState.COMPLETE
    assert away_m(trip, 25.0, 15.0) < 3.0
    assert trip.ask(StartPlan(0)).reason == "", "to sail it again is another order"
    trip.run(1.0)
    assert trip.snapshot.progress.state is PlanState.ACTIVE


def test_a_loiter_for_a_time_ends_though_its_mode_is_ordered_again_and_again(voyage):
    trip = voyage(NO_DEPTH)
    loiter = PlanItem(19, 3, 40.0, 0.0, 12.0, 0.0, *trip.at(25.0, 0.0), 0.0)
    trip.upload(PlanKind.MISSION, [loiter])
    trip.ask(Arm(arm=True))
    trip.ask(StartPlan(0))
    for _ in range(30):
        trip.world.app.submit(SetMode(Mode.AUTO))
        trip.run(5.0)
    assert trip.snapshot.progress.state is PlanState.COMPLETE


def test_a_loiter_that_leaves_toward_the_next_item_does(voyage):
    """MAV_CMD_NAV_LOITER_TURNS param2 = 1: the course at the end of the lap points at what follows."""
    courses = []
    for toward in (0.0, 1.0):
        trip = voyage(NO_DEPTH)
        items = [
            PlanItem(LOITER_TURNS, 3, 1.0, toward, 12.0, 0.0, *trip.at(30.0, 0.0), 0.0),
            PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, *trip.at(30.0, 120.0), 0.0),
        ]
        trip.upload(PlanKind.MISSION, items)
        trip.ask(Arm(arm=True))
        trip.ask(StartPlan(0))
        trip.until(lambda trip=trip: trip.snapshot.progress.seq == 1, 180.0)
        bearing = math.atan2(120.0 - trip.truth.east_m, 30.0 - trip.truth.north_m)
        courses.append(abs(math.remainder(bearing - trip.truth.psi_rad, math.tau)))
    assert courses[1] < math.radians(12.0) < courses[0]


def test_an_impossible_speed_is_refused_and_a_streamed_one_is_bounded(voyage):
    trip = guided(voyage)
    for body in (GuidedHeading(0.0, 20.0), Reposition(*point(trip, 50.0, 0.0), speed_mps=20.0)):
        reply = trip.ask(body)
        assert (reply.result, "outside 0" in reply.reason) == (Result.DENIED, True)
    for _ in range(250):
        trip.world.app.submit(GuidedHeading(0.0, speed_mps=20.0, stream=True))
        trip.run(0.1)
    before_m = trip.truth.north_m
    for _ in range(100):
        trip.world.app.submit(GuidedHeading(0.0, speed_mps=0.5, stream=True))
        trip.run(0.1)
        if trip.snapshot.state.sog_mps < 0.7:
            break
    assert trip.truth.north_m - before_m < 8.0, "it slows down at once"


def test_an_order_that_would_be_undone_at_once_is_refused_with_the_reason(voyage):
    trip = voyage(NO_DEPTH)
    trip.sail(1.0, (200.0, 0.0), after_s=10.0)
    trip.faults.heading_silent = True
    trip.until(lambda: "heading_lost" in trip.snapshot.causes, 60.0)
    trip.run(1.0)
    reply = trip.mode(Mode.AUTO)
    assert (reply.result, reply.reason) == (Result.REJECTED_NOW, "heading lost; Manual is obeyed")
    trip.faults.heading_silent = False
    trip.until(lambda: trip.snapshot.state.heading_valid, 20.0)
    trip.run(6.0)
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(5.0)
    assert trip.snapshot.mode is Mode.AUTO


def test_an_order_in_silence_lasts_for_the_time_that_a_station_may_be_silent(voyage):
    trip = voyage(NO_DEPTH, "operator.gcs_required=true")
    trip.run(1.0)
    trip.ask(Arm(arm=True, force=True))
    trip.plan(1.0, (200.0, 0.0))
    trip.until(lambda: "gcs_lost" in trip.snapshot.causes, 30.0)
    assert trip.ask(StartPlan(0)).reason == ""
    assert trip.snapshot.mode is Mode.AUTO
    assert "gcs_lost" not in trip.snapshot.causes
    assert trip.until(lambda: "gcs_lost" in trip.snapshot.causes, 6.0) > 4.8
    assert trip.snapshot.mode is Mode.HOLD


def test_with_the_sticks_in_hand_no_action_is_announced(voyage):
    trip = voyage(NO_DEPTH, "operator.gcs_required=true")
    trip.ask(Arm(arm=True, force=True))
    trip.mode(Mode.MANUAL)
    for _ in range(800):
        trip.world.app.submit(ManualInput(0.3, 0.0, 1))
        trip.run(0.1)
    assert not any(text.endswith(("HOLD", "RETURN")) for text in trip.texts)


@pytest.mark.parametrize("current_mps", [0.0, 0.3])
def test_a_new_course_is_turned_to_without_swinging_past(voyage, current_mps):
    """A quarter turn at 1.5 m/s, the second time across a current: it had been 8 degrees, the slip of the turn itself."""
    trip = guided(voyage, f"world.water.current_mps={current_mps}", "world.water.current_to_deg=90")
    assert trip.ask(GuidedHeading(0.0, 1.5, course=True)).reason == ""
    trip.run(30.0)
    assert abs(math.degrees(math.atan2(trip.truth.ve_mps, trip.truth.vn_mps))) < 1.5
    assert trip.ask(GuidedHeading(math.pi / 2.0, 1.5, course=True)).reason == ""
    most_rad = 0.0
    for _ in range(20 * 20):
        trip.step()
        most_rad = max(most_rad, trip.truth.psi_rad)
    assert math.degrees(most_rad) - 90.0 < 3.0
    assert abs(math.degrees(math.atan2(trip.truth.ve_mps, trip.truth.vn_mps)) - 90.0) < 1.5


def unreadable_line(trip, seconds):
    """The board's line brings more rubbish than anything else."""
    end_us = trip.world.now_us + round(seconds * 1e6)
    while trip.world.now_us < end_us:
        trip.world.app.actuators.board.receive(b"rubbish\n" * 5, trip.world.now_us)
        trip.step()


def test_manual_with_an_unreadable_actuator_line_is_not_said_to_be_obeyed(voyage):
    """It was: the sticks then moved nothing, without a word, until the line cleared."""
    trip = guided(voyage)
    unreadable_line(trip, 3.0)
    assert trip.ask(SetMode(Mode.GUIDED)).reason == "actuator line unreadable"
    assert trip.mode(Mode.MANUAL).reason == ""
    unreadable_line(trip, 0.2)
    assert "Manual: sticks move nothing until the actuator line is readable" in trip.texts
    trip.run(4.0)
    trip.texts.clear()
    assert trip.mode(Mode.MANUAL).reason == ""
    trip.run(0.2)
    assert not any("sticks" in text for text in trip.texts)


def test_a_disarmed_boat_with_an_unreadable_actuator_line_is_not_said_to_obey_manual(voyage):
    trip = voyage(NO_DEPTH)
    unreadable_line(trip, 3.0)
    assert "Manual" not in trip.ask(Reposition(*point(trip, 30.0, 0.0))).reason


def test_a_position_that_is_back_says_for_how_long_it_must_be(voyage):
    trip = guided(voyage)
    trip.faults.no_fix = True
    trip.run(5.0)
    assert trip.mode(Mode.GUIDED).reason == "position lost; Manual is obeyed"
    trip.faults.no_fix = False
    trip.until(lambda: trip.snapshot.state.position_valid, 5.0)
    trip.run(3.2)
    assert trip.mode(Mode.GUIDED).reason == "position is back for 3 of 5 s; Manual is obeyed"
