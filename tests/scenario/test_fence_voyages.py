"""The fence on the water: no overshoot, at any speed, in any weather, and a way back."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.language.requests import (
    Arm,
    EnableFence,
    PausePlan,
    PlanItem,
    PlanKind,
    Reposition,
    Result,
    SetMode,
    StartPlan,
)
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.soaked import in_the_soak
from tests.world_station import Helm

WEATHER = (
    "world.water.current_mps=0.5",
    "world.water.current_to_deg=0",
    "world.water.wind_mps=8",
    "world.water.wind_from_deg=180",
)


@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("weather", [(), WEATHER], ids=["calm", "0.5 m/s and 8 m/s behind"])
def test_row_60_nothing_crosses_the_fence(voyage, measured, speed_mps, weather):
    """Fault row 60, and must hold: no overshoot at 1.5 and 2.5 m/s (ArduRover 2.2 and 4.1 m)."""
    trip = voyage(*weather)
    trip.sail(speed_mps, (100.0, 0.0))
    assert trip.circle_fence(60.0).reason == "", "after the start, which it would refuse"
    furthest_m = 0.0
    for _ in range(20 * 75):
        trip.step()
        furthest_m = max(furthest_m, trip.distance_m)
    assert 45.0 < furthest_m < 60.0
    assert trip.snapshot.mode is Mode.HOLD
    assert any(text.startswith("Fence ahead: HOLD") for text in trip.texts)
    assert not trip.snapshot.fence.breached
    if speed_mps == 2.5 and not weather:
        measured(60, f"stops {60.0 - furthest_m:.1f} m inside at 2.5 m/s")


@pytest.mark.parametrize("action", ["hold", "stop"])
def test_the_brake_of_the_depth_guard_is_none_of_the_fences(voyage, action):
    """The fence cuts the thrust and coasts: reckoned with the brake, the stop ended 1.1 m outside."""
    stops = "failsafe.conditions.fence_ahead.action=" + action
    trip = voyage(stops, "depth.brake=true", "world.bottom.kind=flat", "world.bottom.depth_m=20")
    trip.sail(2.5, (100.0, 0.0))
    assert trip.circle_fence(60.0).reason == "", "after the start, which it would refuse"
    furthest_m = 0.0
    for _ in range(20 * 60):
        trip.step()
        furthest_m = max(furthest_m, trip.distance_m)
    assert 45.0 < furthest_m < 60.0
    assert not trip.snapshot.fence.breached


def test_a_fence_uploaded_around_a_vessel_outside_acts_at_once(voyage):
    """CVE-2024-30800 was the opposite."""
    trip = voyage()
    trip.sail(1.5, (100.0, 0.0), after_s=10.0)
    assert trip.circle_fence(20.0, -100.0, 0.0).reason == ""
    took_s = trip.until(lambda: trip.snapshot.action >= Action.HOLD, 1.0)
    assert took_s <= 0.1
    assert trip.snapshot.fence.breached
    assert trip.snapshot.fence.breach_type == 3
    assert trip.snapshot.mode is Mode.HOLD


def test_an_operator_sails_back_inside(voyage):
    trip = voyage()
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.circle_fence(30.0, 60.0, 0.0).reason == ""
    trip.until(lambda: trip.snapshot.fence.breached, 1.0)
    lat, lon = (math.radians(value / 1e7) for value in trip.at(60.0, 0.0))
    assert trip.ask(Reposition(lat, lon, speed_mps=1.5)).reason == ""
    trip.until(lambda: not trip.snapshot.fence.breached, 60.0)
    assert "Operator takes over: outside the fence" in trip.texts
    trip.until(lambda: trip.truth.north_m > 55.0, 60.0)
    assert "Inside the fence again" in trip.texts


def test_a_plan_that_passes_an_exclusion_is_held_before_it(voyage):
    trip = voyage()
    trip.sail(2.0, (120.0, 0.0))
    assert trip.circle_fence(15.0, 60.0, 0.0, inclusion=False).reason == ""
    nearest_m = math.inf
    for _ in range(20 * 60):
        trip.step()
        nearest_m = min(nearest_m, math.hypot(trip.truth.north_m - 60.0, trip.truth.east_m))
    assert nearest_m > 15.0
    assert trip.snapshot.mode is Mode.HOLD


def test_clearing_the_fence_frees_the_vessel(voyage):
    trip = voyage()
    trip.sail(1.5, (80.0, 0.0))
    assert trip.circle_fence(40.0).reason == ""
    trip.run(60.0)
    assert trip.snapshot.mode is Mode.HOLD
    assert trip.mode(Mode.AUTO).reason == "item 1 is 40 m outside the fence; FENCE_ENABLE=0 insists"
    assert trip.upload(PlanKind.FENCE, []).reason == ""
    assert trip.mode(Mode.AUTO).reason == ""
    trip.until(lambda: trip.distance_m > 70.0, 60.0)
    assert not any(isinstance(item, PlanItem) for item in trip.world.app.facade.plans.items(PlanKind.FENCE))


def test_an_order_to_go_on_does_not_cross_either(voyage):
    trip = voyage(*WEATHER)
    assert trip.circle_fence(60.0).reason == ""
    trip.sail(1.5, (58.8, 0.0))
    furthest_m = 0.0
    for second in range(120):
        trip.run(1.0)
        furthest_m = max(furthest_m, trip.distance_m)
        if second % 20 == 19 and trip.snapshot.mode is Mode.HOLD:
            trip.mode(Mode.AUTO)
    assert trip.texts.count("Fence ahead: HOLD") >= 2
    assert furthest_m < 60.0


def test_a_plan_that_leads_out_is_taken_told_and_not_started(voyage):
    """Stations send the plan first and the fence after it: neither upload is refused, the start is."""
    trip = voyage()
    assert trip.plan(1.5, (20.0, 0.0), (100.0, 0.0)).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.circle_fence(60.0).reason == ""
    trip.run(2.0)
    assert not any("outside the fence" in text for text in trip.texts), "a better fence may be on its way"
    trip.run(3.0)
    told = "Plan: item 2 is 40 m outside the fence; it will not be started"
    assert trip.texts.count(told) == 1
    for order in (StartPlan(0), SetMode(Mode.AUTO), PausePlan(pause=False)):
        reply = trip.ask(order)
        assert reply.result is Result.REJECTED_NOW
        assert reply.reason == "item 2 is 40 m outside the fence; FENCE_ENABLE=0 insists"
    trip.run(5.0)
    assert trip.snapshot.mode is Mode.HOLD
    assert trip.distance_m < 3.0
    assert trip.circle_fence(120.0).reason == ""
    assert trip.ask(StartPlan(0)).reason == ""
    trip.until(lambda: trip.distance_m > 10.0, 60.0)
    assert trip.texts.count(told) == 1


def test_a_vessel_in_auto_is_not_armed_for_a_plan_that_leads_out(voyage):
    trip = voyage()
    assert trip.plan(1.5, (20.0, 0.0), (100.0, 0.0)).reason == ""
    assert trip.mode(Mode.AUTO).reason == ""
    assert trip.circle_fence(60.0).reason == ""
    trip.run(1.0)
    assert "plan: item 2 is 40 m outside the fence" in trip.ask(Arm(arm=True)).reason
    assert "plan: item 2 is 40 m outside the fence" in trip.snapshot.health.prearm_reasons
    assert trip.ask(EnableFence(enable=False)).reason == ""
    trip.run(0.2)
    assert trip.ask(Arm(arm=True)).reason == ""


SET_OUT = ("world.water.current_to_deg=0", "world.water.wind_from_deg=180", "world.water.wind_mps=5")
SQUARE = [(-30.0, -50.0), (60.0, -50.0), (60.0, 50.0), (-30.0, 50.0)]
LEVELS = ("monitors.battery_low_v=12", "monitors.battery_critical_v=11", "monitors.battery_empty_v=10")


def lost_near_the_edge(*weather, fence=SQUARE, goal=(57.0, 0.0)):
    """Near the edge of a fence when the station falls silent for good; return her after the time in which she comes home."""
    helm = Helm("ardurover", "depth.enabled=false", "failsafe.gcs_then_s=20", *weather)
    assert helm.upload([(0, 5001, 4.0, 0, 0, 0, *helm.at(*corner), 0.0) for corner in fence], 1) == 0
    assert helm.command(400, 1.0) == 0
    lat, lon = helm.at(*goal)
    assert helm.command(192, -1.0, 1.0, 0.0, math.nan, lat / 1e7, lon / 1e7) == 0
    helm.run(60.0)
    assert helm.truth.north_m > 0.8 * goal[0]
    helm.present = False
    helm.run(110.0)
    return helm


@pytest.mark.parametrize("weather", [(), ("world.water.current_mps=0.3", *SET_OUT)], ids=["calm", "set out"])
def test_a_fence_that_is_near_does_not_take_away_the_return(weather):
    """Turning about she made 0.4 m towards the edge, was stopped, and lay 57 m from home for ever, told that she returned."""
    helm = lost_near_the_edge(*weather)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 3.0


def test_a_fence_that_is_near_does_not_take_away_a_return_by_order(voyage):
    """She was held as soon as she turned about, near an edge, and each order to return ended so."""
    trip = voyage("depth.enabled=false")
    trip.sail(1.5, (25.0, 0.0), after_s=25.0)
    assert trip.circle_fence(trip.distance_m + 2.7).reason == ""
    assert trip.mode(Mode.RTL).reason == ""
    trip.until(lambda: trip.distance_m < 3.0, 90.0)
    assert any(text.startswith("Fence ahead: HOLD") for text in trip.texts)
    assert not trip.snapshot.fence.breached


def test_a_return_that_leads_across_the_fence_waits_and_says_so():
    """The fence's stop is over, home lies behind an exclusion: she does not try again and again."""
    bar = [(20.0, -40.0), (30.0, -40.0), (30.0, 40.0), (20.0, 40.0)]
    helm = Helm("ardurover", "depth.enabled=false", "failsafe.gcs_then_s=20")
    assert helm.command(400, 1.0) == 0
    lat, lon = helm.at(60.0, 0.0)
    assert helm.command(192, -1.0, 1.0, 0.0, math.nan, lat / 1e7, lon / 1e7) == 0
    helm.run(60.0)
    assert helm.upload([(0, 5002, 4.0, 0, 0, 0, *helm.at(*corner), 0.0) for corner in bar], 1) == 0
    helm.present = False
    helm.run(200.0)
    assert 30.0 < helm.truth.north_m < 62.0
    assert helm.texts().count("Fence ahead: HOLD") == 1
    assert helm.texts().count("Return to home, ") <= 1
    assert "Fence across the way back: holding: order a go-to" in helm.texts()
    assert "order Return to go on" not in helm.texts(), "she would be stopped again"


@pytest.mark.parametrize(
    ("hull", "out_m"), [("otter", 0.5), ("blueboat", 4.0), *in_the_soak(("otter", 4.0), ("blueboat", 0.5))]
)
def test_wind_and_current_that_set_outward_do_not_bar_the_way_inward(voyage, hull, out_m):
    """A short run inward and a long set outward ended nearer the edge than she was: sixteen orders to return, and 2 m gained."""
    trip = voyage("depth.enabled=false", f'vessel="{hull}"', "world.water.current_mps=0.4", *SET_OUT)
    trip.sail(1.5, (60.0, 0.0), after_s=60.0)
    assert trip.circle_fence(trip.distance_m - out_m).reason == ""
    trip.run(3.0)
    assert trip.snapshot.fence.breached
    assert trip.mode(Mode.RTL).reason == ""
    trip.texts.clear()
    trip.until(lambda: trip.distance_m < 5.0, 90.0)
    assert len([text for text in trip.texts if "ence" in text]) <= 4


def test_a_boat_that_lies_on_the_edge_does_not_chatter(voyage):
    trip = voyage("depth.enabled=false", "world.water.current_mps=0.3", *SET_OUT)
    trip.sail(1.5, (30.0, 0.0), after_s=45.0)
    assert trip.mode(Mode.HOLD).reason == ""
    trip.run(10.0)
    assert trip.circle_fence(trip.distance_m).reason == ""
    trip.run(120.0)
    assert len([text for text in trip.texts if "ence" in text]) <= 15


def test_manual_without_sticks_is_no_hand_at_the_sticks():
    """ "Ground station lost: RETURN" was told, and the boat drifted on in Manual."""
    helm = Helm("ardurover", "depth.enabled=false", "failsafe.gcs_then_s=20", "world.water.current_mps=0.3")
    assert helm.command(400, 1.0) == 0
    assert helm.command(176, 1.0, 0.0) == 0
    helm.run(40.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) > 8.0
    helm.present = False
    helm.run(90.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 3.0


def test_sticks_that_fall_silent_with_the_station_are_no_hand_either():
    """The laptop under the steering hand died: "Manual control lost: STOP", and she was set out to sea, for good."""
    helm = Helm("ardurover", "depth.enabled=false", "failsafe.gcs_then_s=20", "world.water.current_mps=0.3", *SET_OUT)
    assert helm.command(176, 1.0, 0.0) == 0
    assert helm.command(400, 1.0) == 0
    for _ in range(400):
        helm.send(dialect.MAVLink_manual_control_message(1, 500, 0, 750, 0, 0))
        helm.run(0.1)
    out_m = math.hypot(helm.truth.north_m, helm.truth.east_m)
    assert out_m > 15.0
    helm.present = False
    helm.run(20.0)
    assert helm.world.snapshot.mode is Mode.MANUAL
    assert helm.world.snapshot.action is Action.STOP
    assert "RETURN in 10 s: ground station lost" in helm.texts()
    helm.send(dialect.MAVLink_manual_control_message(1, 500, 0, 750, 0, 0))
    helm.run(0.2)
    assert helm.world.snapshot.action < Action.HOLD, "a stick that is heard again is obeyed"
    helm.run(110.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 3.0
