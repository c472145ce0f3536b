"""The depth guard on the water, whole vessel: the slope, the shoal, the brake, and the way back."""

from __future__ import annotations

import math

import pytest

from companion.tuning.fitted import vessel_toml
from mavlink_bridge.language.messages import Action, GuardState, Mode
from mavlink_bridge.language.requests import Arm
from tests.soaked import in_the_soak
from tools.benches.cells.drawn_hulls import drawn

KEEL_M = 0.35
SLOPE = ("world.bottom.mounds=[]", "world.bottom.slope.bearing_deg=0", "world.bottom.slope.start_m=40")

MARGINS = ("depth.minimum_margin_m=1.0", "depth.good_margin_m=0.3")
"""What vessel-control §5.4 recommends: room for a turn in shallow water."""


def least_altitude(trip, seconds):
    least = math.inf
    for _ in range(round(20 * seconds)):
        trip.step()
        least = min(least, trip.truth.depth_m - KEEL_M)
    return least


@pytest.mark.parametrize(
    ("gradient", "brake"), [(0.5, "true"), (0.1, "false"), *in_the_soak((0.5, "false"), (0.1, "true"))]
)
def test_a_plan_up_a_slope_stops_in_good_water(voyage, gradient, brake):
    trip = voyage(*SLOPE, *MARGINS, f"world.bottom.slope.gradient={gradient}", f"depth.brake={brake}")
    trip.sail(2.5, (400.0, 0.0))
    assert least_altitude(trip, 150.0) >= 3.85
    assert trip.snapshot.mode is Mode.HOLD
    assert trip.snapshot.guard is GuardState.OK
    assert (trip.snapshot.state.sog_mps or 0.0) < 0.3
    assert any(text.startswith("Shallow water ahead (closing") for text in trip.texts)
    assert trip.snapshot.action >= Action.HOLD, "it stands until an operator decides"
    if gradient > 0.2:
        return
    # On a gentler slope there is room to turn back; on 1:2 the turn itself would take metres of water.
    assert trip.plan(1.5, (0.0, 0.0)).reason == ""
    for _ in range(4):
        assert trip.mode(Mode.AUTO).reason == ""
        trip.run(40.0)
        if trip.truth.north_m < 100.0:
            break
    assert trip.truth.north_m < 100.0


LEVEL = ("world.bottom.mounds=[]", "world.bottom.slope.gradient=0")


@pytest.mark.parametrize(
    ("hull", "depth_m", "waves_m", "speed_mps", "seed"),
    [("otter", 6.0, 0.6, 1.5, 1), ("otter", 5.0, 0.5, 1.0, 1), ("blueboat", 6.0, 0.6, 1.5, 2)],
)
def test_waves_over_a_level_bottom_are_no_slope(voyage, hull, depth_m, waves_m, speed_mps, seed):
    """Heave closes by up to 1 m/s for a second and a half; each of these boats was stopped within 12 s."""
    depth = (f"world.bottom.depth_m={depth_m}", f"world.water.wave_height_m={waves_m}")
    trip = voyage(f"vessel='{hull}'", *LEVEL, *depth, seed=seed)
    trip.run(8.0)
    trip.sail(speed_mps, (400.0, 0.0))
    trip.run(60.0)
    assert trip.snapshot.mode is Mode.AUTO
    assert not [text for text in trip.texts if "losing" in text]


def test_waves_over_a_level_bottom_leave_a_boat_on_her_station(voyage):
    trip = voyage(*LEVEL, "world.bottom.depth_m=5", "world.water.wave_height_m=0.6", "world.water.wind_mps=5")
    trip.run(8.0)
    trip.ask(Arm(arm=True))
    assert trip.mode(Mode.HOLD).reason == ""
    trip.run(90.0)
    assert trip.snapshot.action is Action.NONE
    assert math.hypot(trip.truth.north_m, trip.truth.east_m) < 4.0


def test_the_limit_that_is_shown_is_the_one_that_is_told_and_only_what_stops_her_moves(voyage):
    trip = voyage(*SLOPE, "world.bottom.slope.gradient=0.3")
    trip.sail(1.5, (400.0, 0.0))
    stops = set()
    for _ in range(20 * 60):
        trip.step()
        assert trip.snapshot.altitude_least_m == 4.0
        stops.add(round(trip.snapshot.altitude_limit_m or 0.0, 1))
    assert max(stops) > 4.5
    assert any("limit 4.00 m" in text for text in trip.texts)


def test_the_brake_shortens_the_way(voyage):
    """With the look-ahead off the entry itself brakes: astern the vessel is off its way in metres, not in seconds."""
    reached = {}
    for brake in ("false", "true"):
        trip = voyage(*SLOPE, "world.bottom.slope.gradient=0.2", f"depth.brake={brake}", "depth.rate_look_ahead=false")
        trip.sail(2.5, (400.0, 0.0))
        trip.until(lambda trip=trip: trip.snapshot.action >= Action.HOLD, 120.0)
        began_m = trip.truth.north_m
        trip.until(lambda trip=trip: trip.truth.u_mps < 0.15, 20.0)
        reached[brake] = trip.truth.north_m - began_m
        trip.run(3.0)
        assert trip.neutral, "then it stays stopped"
    assert reached["true"] < 2.6
    assert reached["false"] > 4.0


@pytest.mark.parametrize("seed", [0, 5, 11])
def test_the_brake_stops_a_heavy_boat_in_good_water(voyage, tmp_path, seed):
    """She needs ten seconds of thrust astern; let go after three, she ran on until 0.2 to 0.9 m were left under the keel."""
    boat = drawn("heavy", seed)
    (tmp_path / "boat.toml").write_text(vessel_toml(boat), encoding="utf-8")
    trip = voyage(f"vessel='{tmp_path / 'boat.toml'}'", *SLOPE, "world.bottom.slope.gradient=0.3", "depth.brake=true")
    trip.sail(1.5, (300.0, 0.0))
    assert least_altitude(trip, 150.0) + KEEL_M - boat.keel_depth_m >= 3.85
    assert trip.neutral
    assert sum(text.startswith("Shallow water ahead (") for text in trip.texts) == 1, "one stop is told once"


def test_the_brake_reckons_with_what_the_gate_lets_through(voyage):
    trip = voyage(*SLOPE, "world.bottom.slope.gradient=0.5", "depth.brake=true", "gate.thruster_min=-0.3")
    trip.sail(2.5, (400.0, 0.0))
    assert least_altitude(trip, 100.0) >= 3.85
    assert trip.neutral


@pytest.mark.parametrize("fix_hz", [1.0, *in_the_soak(5.0)])
@pytest.mark.parametrize("hull", ["otter", "blueboat", "wamv"])
def test_the_brake_takes_the_way_off_and_drives_nobody_astern(voyage, hull, fix_hz):
    """Her speed is told half a second late, and later by a receiver of 1 Hz: let go by it, she went astern with up to 1.2 m/s."""
    slope = (*SLOPE, "world.bottom.slope.gradient=0.1")
    trip = voyage(f"vessel='{hull}'", *slope, "depth.brake=true", f"world.sensors.fix_hz={fix_hz}")
    trip.sail(2.0, (300.0, 0.0))
    speeds = []
    trip.until(lambda: trip.snapshot.action >= Action.HOLD, 250.0)
    for _ in range(200):
        trip.run(0.05)
        speeds.append(trip.truth.u_mps)
    assert -0.2 < min(speeds) < 0.1


def test_the_shipped_shoal_is_stopped_at(voyage):
    trip = voyage()
    trip.sail(1.5, (240.0, 0.0))
    assert least_altitude(trip, 150.0) >= 3.85
    assert trip.snapshot.mode is Mode.HOLD


def test_a_sounder_lost_at_five_metres_slows_and_stops_as_configured(voyage):
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=5.35", "depth.unknown_policy=stop")
    trip.sail(2.0, (300.0, 0.0), after_s=15.0)
    trip.faults.depth_silent = True
    told_s = trip.until(lambda: "depth_lost" in trip.snapshot.causes, 2.0)
    assert told_s <= 1.0
    stopped_s = told_s + trip.until(lambda: trip.neutral, 6.0)
    assert 4.5 < stopped_s <= 5.2
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=5.35", "depth.unknown_policy=slow")
    trip.sail(2.0, (300.0, 0.0), after_s=15.0)
    trip.faults.depth_no_bottom = True
    took_s = trip.until(lambda: (trip.snapshot.desired.speed_mps or 9.0) <= 0.5, 2.0)
    assert took_s <= 1.0, "must hold"


@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("gradient", [0.02, 0.05, 0.1])
def test_a_sounder_lost_at_five_metres_closing_is_acted_on_within_a_second_by_default(voyage, gradient, speed_mps):
    """Must hold, with the default policy: slow at once, stopped where the limit would be."""
    trip = voyage(
        "world.bottom.mounds=[]",
        f"world.bottom.depth_m={5.35 + 40.0 * gradient}",
        f"world.bottom.slope.gradient={gradient}",
        "world.bottom.slope.bearing_deg=0",
        "world.bottom.slope.start_m=10",
    )
    trip.sail(speed_mps, (400.0, 0.0))
    trip.until(lambda: trip.truth.depth_m - KEEL_M < 5.0 or trip.snapshot.mode is Mode.HOLD, 90.0)
    if trip.snapshot.mode is Mode.HOLD:
        return  # it had stopped already
    trip.faults.depth_silent = True
    took_s = trip.until(
        lambda: trip.snapshot.action >= Action.HOLD or (trip.snapshot.desired.speed_mps or 9.0) <= 0.5, 2.0
    )
    assert took_s <= 1.0
    assert least_altitude(trip, 60.0) >= 3.85


def test_a_boat_that_goes_slow_without_a_sounder_is_told_of_once_and_stays_slow(voyage):
    """Slow, the limit was far in time again: fast, slow, fast, slow, told each time, until control was said to oscillate."""
    trip = voyage(*SLOPE, "world.bottom.depth_m=13", "world.bottom.slope.gradient=0.05")
    trip.sail(2.0, (400.0, 0.0))
    trip.until(lambda: trip.truth.depth_m - KEEL_M < 9.0, 150.0)
    trip.faults.depth_silent = True
    trip.until(lambda: (trip.snapshot.desired.speed_mps or 9.0) <= 0.5, 40.0)
    trip.run(60.0)
    assert sum(text.startswith("Sounder lost while the bottom closes") for text in trip.texts) == 1
    assert (trip.snapshot.desired.speed_mps or 0.0) <= 0.5
    assert not any("oscillates" in text for text in trip.texts)
