"""What a boat does after the depth guard has stopped her: she keeps her station, backs out when ordered away, and tells the truth."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from mavlink_bridge.language.messages import Action, GuardState, Mode
from mavlink_bridge.language.requests import Arm, Reposition, SetHomePosition, StartPlan
from tests.soaked import in_the_soak

KEEL_M = 0.35
SLOPE = (
    "world.bottom.mounds=[]",
    "world.bottom.depth_m=8.35",
    "world.bottom.slope.bearing_deg=0",
    "world.bottom.slope.start_m=40",
    "world.bottom.slope.gradient=0.25",
)
"""Level for 40 m, long enough for any speed, then 1 in 4 up to the shore."""
LEVEL = ("world.bottom.mounds=[]", "world.bottom.slope.gradient=0", "world.bottom.depth_m=5.35")
ASTERN_OF_HER = (20.0, 0.0)


def setting(current_mps):
    return f"world.water.current_mps={current_mps}", "world.water.current_to_deg=0"


def stopped(voyage, *world, hull="otter", speed_mps=1.5):
    """A boat at the moment in which the look-ahead stops her on the slope, on item 1 of her plan."""
    trip = voyage(f"vessel='{hull}'", *SLOPE, *world)
    assert trip.ask(SetHomePosition(None, None)).reason == ""
    trip.sail(speed_mps, (120.0, 0.0), (120.0, 60.0))
    trip.until(lambda: trip.snapshot.action is Action.STOP, 100.0)
    return trip


def order(trip, way):
    if way is not Mode.GUIDED:
        return trip.mode(way).reason
    return go_to(trip, *ASTERN_OF_HER)


def least_altitude(trip, seconds):
    least_m = math.inf
    for _ in range(round(20 * seconds)):
        trip.step()
        least_m = min(least_m, trip.truth.depth_m - KEEL_M)
    return least_m


@pytest.mark.parametrize(
    ("hull", "current_mps", "wait_s"),
    [("otter", 0.2, 1.0), ("blueboat", 0.3, 4.0), *in_the_soak(("blueboat", 0.2, 1.0), ("otter", 0.0, 8.0))],
)
@pytest.mark.parametrize("way", [Mode.HOLD, Mode.RTL, *in_the_soak(Mode.GUIDED)])
def test_an_order_soon_after_the_stop_keeps_her_off_the_shoal(voyage, hull, current_mps, wait_s, way):
    """The set carried her on: each order was accepted and stopped again within a second, and she was aground after 90 s."""
    trip = stopped(voyage, *setting(current_mps), hull=hull)
    trip.run(wait_s)
    assert order(trip, way) == ""
    assert least_altitude(trip, 45.0) >= 4.0
    assert trip.snapshot.mode is way
    assert trip.snapshot.action < Action.HOLD
    if way is not Mode.HOLD:
        assert trip.truth.north_m < 40.0, "she has backed out, turned, and sails away"


@pytest.mark.parametrize("hull", ["otter", *in_the_soak("blueboat", "wamv")])
@pytest.mark.parametrize("off_astern_deg", [60.0, *in_the_soak(85.0)])
def test_an_order_that_leads_obliquely_back_is_sailed_without_dithering(voyage, hull, off_astern_deg):
    """At 60 degrees she changed between astern and ahead 71 times in 80 s, two metres from where she was stopped."""
    trip = stopped(voyage, hull=hull)
    trip.run(4.0)
    here = trip.truth
    angle_rad = math.radians(180.0 + off_astern_deg)
    assert go_to(trip, here.north_m + 60.0 * math.cos(angle_rad), here.east_m + 60.0 * math.sin(angle_rad)) == ""
    backed = []
    for _ in range(20 * 60):
        trip.step()
        backed.append(trip.truth.u_mps < -0.1)
    assert sum(before != now for before, now in pairwise(backed)) <= 2, "astern once, then ahead"
    assert math.dist((here.north_m, here.east_m), (trip.truth.north_m, trip.truth.east_m)) > 25.0
    assert trip.snapshot.action < Action.HOLD


@pytest.mark.parametrize("wait_s", [3.0, *in_the_soak(8.0)])
def test_thrusters_that_push_the_wrong_way_do_not_drive_her_on_while_she_backs_out(voyage, wait_s):
    """Nothing stopped her before she was below the limit: 2.35 m, and locked."""
    trip = stopped(voyage, "world.bottom.slope.gradient=0.33")
    trip.run(wait_s)
    trip.world.surroundings.plant.vessel.thruster_health[:] = [-1.0, -1.0]
    assert trip.mode(Mode.RTL).reason == ""
    assert least_altitude(trip, 30.0) >= 3.85


@pytest.mark.parametrize("dead", [0, *in_the_soak(1)])
def test_a_boat_that_does_not_go_astern_gives_it_up(voyage, dead):
    """With one thruster dead she lay where she was for as long as anybody looked, with Return in force and nothing told."""
    trip = stopped(voyage, "world.bottom.slope.gradient=0.33")
    trip.run(2.0)
    trip.world.surroundings.plant.vessel.thruster_health[dead] = 0.0
    assert trip.mode(Mode.RTL).reason == ""
    assert least_altitude(trip, 60.0) >= 3.5
    assert trip.snapshot.action is Action.STOP, "what remains takes her no way back, and she is told so"


@pytest.mark.parametrize("above_m", [0.05, *in_the_soak(0.1, 0.2)])
def test_passing_the_limit_does_not_stop_a_boat_that_backs_out(voyage, above_m):
    """She was ordered back at 4.04 m, stopped at the limit of 4.00 m while she already slowed, and was aground a minute later."""
    trip = stopped(voyage, *setting(0.3))
    trip.until(lambda: trip.truth.depth_m - KEEL_M < 4.0 + above_m, 60.0)
    assert trip.mode(Mode.RTL).reason == ""
    assert least_altitude(trip, 60.0) >= 3.7
    assert trip.snapshot.mode is Mode.RTL
    assert trip.truth.north_m < 40.0


@pytest.mark.parametrize("seed", [1, *in_the_soak(2, 3)])
def test_a_long_swell_over_a_level_bottom_leaves_a_boat_on_her_station(voyage, seed):
    """It lets her down as fast as a slope would; stopped for that within a minute, she drifted until somebody looked."""
    swell = ("world.water.wave_height_m=1.5", "world.water.wave_period_s=12")
    trip = voyage(*LEVEL, *swell, *setting(0.2), seed=seed)
    trip.ask(Arm(arm=True))
    assert trip.mode(Mode.HOLD).reason == ""
    trip.run(150.0)
    assert trip.snapshot.action < Action.HOLD
    assert math.hypot(trip.truth.north_m, trip.truth.east_m) < 6.0


def test_a_boat_with_way_on_that_is_told_to_hold_is_stopped_before_a_slope_as_ever(voyage):
    trip = voyage(*SLOPE, "world.bottom.slope.gradient=0.5")
    trip.sail(2.5, (120.0, 0.0))
    trip.until(lambda: trip.truth.north_m > 41.5, 60.0)
    assert trip.snapshot.action is Action.NONE
    assert trip.mode(Mode.HOLD).reason == ""
    trip.until(lambda: trip.snapshot.action is Action.STOP, 3.0)
    trip.run(0.5)
    assert trip.neutral


def test_what_is_measured_stops_a_boat_that_keeps_her_station(voyage):
    trip = voyage(*LEVEL, *setting(0.2))
    trip.ask(Arm(arm=True))
    assert trip.mode(Mode.HOLD).reason == ""
    trip.run(10.0)
    trip.world.surroundings.plant.bottom = Falling(trip, from_m=5.35, fall_mps=0.05)
    trip.until(lambda: "depth_shallow" in trip.snapshot.causes, 60.0)
    assert trip.snapshot.action is Action.STOP


def lies_blind(voyage, *world):
    """A boat that was stopped soundly, and whose sounder has fallen silent since."""
    trip = stopped(voyage, *world)
    trip.run(8.0)
    trip.faults.depth_silent = True
    trip.run(8.0)
    return trip


def test_without_a_sounder_no_order_leads_over_the_shoal_that_stopped_her(voyage):
    """She was told that no shallow water is ahead, and the next Auto put her aground at full speed."""
    trip = lies_blind(voyage)
    told = [text for text in trip.texts if "shallow water is ahead" in text.lower()]
    assert not told
    assert "Nothing is known of the way ahead: sounder silent" in trip.texts
    for there in (trip.mode(Mode.AUTO).reason, trip.ask(StartPlan(2)).reason, go_to(trip, 90.0, 10.0)):
        assert there.startswith("nothing is known of the way ahead: sounder silent")
    assert trip.mode(Mode.RTL).reason == ""
    assert least_altitude(trip, 40.0) >= 4.0
    assert trip.truth.north_m < 45.0, "the way that she came by is known"
    assert trip.mode(Mode.AUTO).reason.startswith("nothing is known"), "from afar too"
    trip.faults.depth_silent = False
    trip.run(25.0)
    assert trip.mode(Mode.AUTO).reason == "", "who hears the bottom may look again"


def test_a_policy_that_goes_slow_without_a_sounder_stops_at_the_shoal_it_knows(voyage):
    trip = lies_blind(voyage, "depth.unknown_policy=slow")
    assert trip.mode(Mode.AUTO).reason == ""
    assert least_altitude(trip, 30.0) >= 3.85
    assert trip.snapshot.action is Action.STOP
    assert "Shallow water ahead (reckoned, sounder silent): stopping" in trip.texts


def test_a_boat_that_is_stopped_by_her_plan_is_not_sent_over_the_same_shoal(voyage):
    """She was told "order Auto to go on", did, and was locked at 3.4 m."""
    trip = stopped(voyage)
    trip.run(12.0)
    until, over = (
        "then order Auto with item 1 skipped or the plan changed",
        "order Auto with item 1 skipped or the plan changed to go on",
    )
    assert [text for text in trip.texts if text.endswith(until)]
    assert [text for text in trip.texts if text.endswith(over)]


def test_a_boat_that_is_locked_is_told_what_is_true(voyage):
    """Ten seconds after the lock, while it got shallower, "It is deep enough again: order Hold"; Hold was taken and did nothing."""
    trip = voyage(*LEVEL)
    trip.ask(Arm(arm=True))
    assert trip.mode(Mode.HOLD).reason == ""
    trip.world.surroundings.plant.bottom = falling = Falling(trip, from_m=4.45, fall_mps=0.01)
    trip.until(lambda: trip.snapshot.guard is GuardState.LOCKED, 90.0)
    trip.run(20.0)
    assert not [text for text in trip.texts if text.startswith("It is deep enough again")]
    assert trip.mode(Mode.HOLD).reason.startswith("depth guard locked: altitude")
    assert trip.mode(Mode.MANUAL).reason == ""
    assert trip.mode(Mode.HOLD).reason == "", "it stops the sticks"
    falling.rise()
    trip.until(lambda: trip.snapshot.guard is GuardState.OK, 20.0)
    trip.run(15.0)
    assert [text for text in trip.texts if text.startswith("It is deep enough again")] == [
        "It is deep enough again: stopped: arm again to go on"
    ]


def go_to(trip, north_m, east_m):
    lat_rad, lon_rad = (math.radians(degrees / 1e7) for degrees in trip.at(north_m, east_m))
    return trip.ask(Reposition(lat_rad, lon_rad)).reason


class Falling:
    """Level ground from which the tide runs off."""

    def __init__(self, trip, from_m, fall_mps):
        self._trip, self._from_m, self._fall_mps, self._began_s = trip, from_m, fall_mps, trip.now_s

    def depth_at(self, north_m, east_m):
        return self._from_m - self._fall_mps * (self._trip.now_s - self._began_s)

    def rise(self):
        """The flood, at once."""
        self._from_m, self._fall_mps = 8.0, 0.0
