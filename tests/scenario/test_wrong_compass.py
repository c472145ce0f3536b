"""A compass that is wrong from the start, or after a flip at rest: the first thrust shows it, and she stops instead of running away."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from companion.core.nmea.line import frame
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, Reposition
from mavlink_bridge.language.units import wrap_pi
from sitl.sensors.talkers import Truth
from tests.soaked import in_the_soak

OFF = "Heading not believed"


def in_hold(voyage, *overrides: str, bias_deg: float = 0.0):
    trip = voyage("depth.enabled=false", *overrides)
    trip.faults.set("heading_bias_deg", bias_deg)
    trip.run(20.0)
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.mode(Mode.HOLD).reason == ""
    return trip


def go_to(trip, north_m: float, east_m: float) -> None:
    assert trip.ask(Reposition(*trip.world.surroundings.plant.frame.to_geodetic(north_m, east_m))).reason == ""


def wrong_s(trip, seconds: float) -> float:
    """For how long the thrusters work by a heading that is more than 40 degrees off."""
    found = 0
    end_us = trip.world.now_us + round(seconds * 1e6)
    while trip.world.now_us < end_us:
        trip.step()
        shown = trip.snapshot.state.psi_rad
        if shown is not None and not trip.neutral and abs(wrap_pi(shown - trip.truth.psi_rad)) > math.radians(40.0):
            found += 1
    return found * 0.05


@pytest.mark.parametrize("vessel", ["otter", "plant_b"])
@pytest.mark.parametrize("bias_deg", [180.0, 90.0, -60.0])
def test_row_31_a_compass_that_was_wrong_all_the_time_is_shown_by_the_first_thrust(
    voyage, bias_deg: float, vessel: str
) -> None:
    """240 m in 160 s at full thrust, and "the water is faster than the vessel" in still water."""
    trip = in_hold(voyage, f'vessel="{vessel}"', bias_deg=bias_deg)
    go_to(trip, 40.0, 0.0)
    assert wrong_s(trip, 60.0) < 12.0
    assert -12.0 < trip.truth.north_m < 45.0
    assert abs(trip.truth.east_m) < 15.0
    assert trip.neutral
    assert len([text for text in trip.texts if OFF in text]) == 1
    assert any("tried again" in text for text in trip.texts)
    assert not any("water is faster" in text for text in trip.texts)


PLAIN = 'world.sensors.grade="standalone"'
SLOW = (PLAIN, "world.sensors.fix_hz=1")
NO_VELOCITY = (PLAIN, 'world.sensors.sentences="GPZDA, GPGGA, GPHDT"')


@pytest.mark.parametrize(
    ("vessel", "bias_deg", "receiver", "within_m"),
    [("otter", 120.0, SLOW, 18.0), ("blueboat", 180.0, NO_VELOCITY, 30.0)],
)
def test_row_31_a_receiver_that_is_slow_or_tells_no_velocity_shows_it_too(
    voyage, vessel: str, bias_deg: float, receiver: tuple[str, ...], within_m: float
) -> None:
    """Once a second told of it after 48 m; without velocity she went 175 m in 120 s, and on."""
    trip = in_hold(voyage, f'vessel="{vessel}"', *receiver, bias_deg=bias_deg)
    go_to(trip, 60.0, 0.0)
    assert wrong_s(trip, 40.0) < 14.0
    assert math.hypot(trip.truth.north_m, trip.truth.east_m) < within_m
    assert trip.neutral
    assert any(OFF in text for text in trip.texts)


@pytest.mark.parametrize("wind_mps", [0.0, 8.0])
def test_row_31_one_that_flipped_at_rest_does_not_lead_her_off_her_point(voyage, wind_mps: float) -> None:
    """It is accepted after 10 s, "order Hold to go on" is told, and that order drove her off."""
    trip = in_hold(voyage, f"world.water.wind_mps={wind_mps}")
    trip.run(30.0)
    trip.faults.set("heading_bias_deg", 180.0)
    trip.run(30.0)
    assert trip.mode(Mode.HOLD).reason == ""
    north_m, east_m = trip.truth.north_m, trip.truth.east_m
    go_to(trip, north_m + 30.0, east_m)
    assert wrong_s(trip, 40.0) < 12.0
    assert -12.0 < trip.truth.north_m - north_m < 35.0
    assert abs(trip.truth.east_m - east_m) < 15.0
    assert any(OFF in text for text in trip.texts)


def test_a_second_compass_that_agrees_with_what_thrust_showed_steps_in(voyage) -> None:
    trip = voyage("depth.enabled=false")
    sensors = trip.world.surroundings.plant.sensors
    step = sensors.step

    def beside(now_us: int, truth: Truth) -> list[bytes]:
        right = [frame(f"HEHDT,{math.degrees(truth.psi_rad) % 360.0:.2f},T")] if now_us % 100_000 == 0 else []
        return [*step(now_us, truth), *right]

    trip.faults.set("heading_bias_deg", 180.0)
    trip.run(15.0)
    sensors.step = beside
    trip.run(15.0)
    barred = trip.ask(Arm(arm=True)).reason
    assert "compasses disagree" in barred
    assert "HEHDT reads 180 deg" in barred
    assert trip.ask(Arm(arm=True, force=True)).reason == ""
    assert trip.mode(Mode.HOLD).reason == ""
    go_to(trip, 40.0, 0.0)
    assert wrong_s(trip, 90.0) < 12.0
    assert math.hypot(trip.truth.north_m - 40.0, trip.truth.east_m) < 4.0
    assert any("using" in text and "HEHDT" in text for text in trip.texts)


WILD = ("world.water.wind_mps=12", "world.water.current_mps=0.5", "world.water.wave_height_m=0.5")


RTK = ('world.sensors.grade="rtk"',)
RACE = ("world.water.current_mps=2.0",)


@pytest.mark.parametrize(
    ("water", "receiver"),
    [
        (RACE, RTK),
        (RACE, SLOW),
        (WILD, (PLAIN,)),
        (WILD, (*SLOW, *NO_VELOCITY)),
        *in_the_soak((RACE, (PLAIN,)), (RACE, (*SLOW, *NO_VELOCITY)), (WILD, RTK), (WILD, SLOW)),
    ],
)
def test_a_sound_boat_is_not_stopped_by_what_carries_her(
    voyage, water: tuple[str, ...], receiver: tuple[str, ...]
) -> None:
    trip = in_hold(voyage, *water, *receiver)
    trip.run(30.0)
    go_to(trip, 20.0, 20.0)
    trip.run(60.0)
    assert not any(OFF in text for text in trip.texts)


def test_a_current_that_sets_in_within_a_moment_makes_no_compass_wrong(voyage) -> None:
    trip = in_hold(voyage)
    trip.run(20.0)
    water = trip.world.surroundings.plant.water
    for current_mps, wind_mps in ((1.2, 0.0), (0.0, 0.0), (2.0, 0.0), (0.0, 18.0)):
        water.configure(water.config.model_copy(update={"current_mps": current_mps, "wind_mps": wind_mps}))
        trip.run(30.0)
    assert not any(OFF in text for text in trip.texts)


def creeping(trip, rate_dps: float) -> Callable[[], None]:
    """Return what lets the compass creep away from now on; the turn rate tells nothing of it."""
    begun_us = trip.world.now_us

    def creep() -> None:
        off_deg = min(180.0, rate_dps * (trip.world.now_us - begun_us) * 1e-6)
        trip.faults.set("heading_bias_deg", off_deg)

    return creep


def farthest_m(trip, seconds: float, each_s: Callable[[], None]) -> float:
    """From where she is now, at most."""
    north_m, east_m, most_m = trip.truth.north_m, trip.truth.east_m, 0.0
    for _ in range(round(seconds)):
        each_s()
        trip.run(1.0)
        most_m = max(most_m, math.hypot(trip.truth.north_m - north_m, trip.truth.east_m - east_m))
    return most_m


@pytest.mark.parametrize(
    ("rate_dps", "water"),
    [
        (1.0, ("world.water.current_mps=0.3", "world.water.wind_mps=5")),
        *in_the_soak(
            (0.5, ("world.water.current_mps=0.3", "world.water.wind_mps=5")), (2.0, ("world.water.current_mps=0.3",))
        ),
    ],
)
def test_a_compass_that_creeps_away_in_hold_is_found(voyage, rate_dps: float, water: tuple[str, ...]) -> None:
    """It took her 344 m off her point: what had borne it out once counted for ever, and the water was told to be too fast."""
    trip = in_hold(voyage, *water)
    trip.run(30.0)
    creep = creeping(trip, rate_dps)
    farthest_m(trip, 180.0 / rate_dps, creep)
    assert any(OFF in text for text in trip.texts)
    assert trip.neutral


@pytest.mark.parametrize("vessel", ["otter", *in_the_soak("blueboat")])
def test_a_compass_that_creeps_away_under_way_is_found(voyage, vessel: str) -> None:
    trip = in_hold(voyage, f'vessel="{vessel}"')
    go_to(trip, 40.0, 0.0)
    trip.run(50.0)
    creep = creeping(trip, 1.0)
    for north_m, east_m in ((40.0, 40.0), (0.0, 40.0), (0.0, 0.0)):
        if not any(OFF in text for text in trip.texts):
            go_to(trip, north_m, east_m)
        assert farthest_m(trip, 50.0, creep) < 60.0
    assert any(OFF in text for text in trip.texts)
    assert trip.neutral
    assert -15.0 < trip.truth.north_m < 50.0
    assert -10.0 < trip.truth.east_m < 50.0
