"""Modes and orders on a vehicle: what each needs, what it does, what ends it."""

from __future__ import annotations

import math

import pytest

import config
from companion.settings.schema import load
from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import Action, GuardState, Loiter, Mode
from mavlink_bridge.language.requests import (
    Arm,
    GuidedHeading,
    GuidedTarget,
    LoadPlan,
    ManualInput,
    Orbit,
    PausePlan,
    PlanItem,
    PlanKind,
    Reply,
    Reposition,
    RequestBody,
    Result,
    SetCurrent,
    SetMode,
    SetSpeed,
    StartPlan,
    Terminate,
    UnlockGuard,
)
from mavlink_bridge.language.stations import Station
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World

LAT, LON = math.radians(41.1853), math.radians(-8.7060)


@pytest.fixture
def world() -> World:
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false"], SimSettings)
    made = World(settings, 1)
    made.run(3.0)
    return made


def ask(world: World, body: RequestBody) -> Reply:
    """Submit a request and step until it is answered."""
    replies: list[Reply] = []
    world.app.submit(body, replies.append)
    for _ in range(5):
        world.step()
        if replies:
            return replies[0]
    raise AssertionError("no answer")


def accept(world: World, body: RequestBody) -> None:
    reply = ask(world, body)
    assert reply.result is Result.ACCEPTED, reply.reason


def mode_of(world: World) -> Mode:
    assert world.snapshot is not None
    return world.snapshot.mode


def plan() -> LoadPlan:
    x, y = round(math.degrees(LAT) * 1e7), round(math.degrees(LON) * 1e7)
    made = load_plan(PlanKind.MISSION, [PlanItem(17, 3, 0.0, 0.0, 20.0, 0.0, x, y, 0.0)])
    assert isinstance(made, LoadPlan)
    return made


def test_a_start_needs_arming_and_a_plan(world: World) -> None:
    assert ask(world, StartPlan(0)).reason == "not armed"
    accept(world, Arm(arm=True))
    assert "no plan" in ask(world, StartPlan(0)).reason
    assert "no plan" in ask(world, SetMode(Mode.AUTO)).reason
    accept(world, plan())
    accept(world, StartPlan(0))
    assert mode_of(world) is Mode.AUTO


def test_pause_holds_here_and_continue_goes_on(world: World) -> None:
    accept(world, plan())
    accept(world, Arm(arm=True))
    accept(world, StartPlan(0))
    world.run(5.0)
    accept(world, PausePlan(pause=True))
    assert mode_of(world) is Mode.HOLD
    held = world.surroundings.truth
    world.run(20.0)
    truth = world.surroundings.truth
    assert math.dist((truth.north_m, truth.east_m), (held.north_m, held.east_m)) < 6.0
    accept(world, PausePlan(pause=False))
    assert mode_of(world) is Mode.AUTO


def test_a_guided_point_is_reached_and_kept(world: World) -> None:
    accept(world, Arm(arm=True))
    accept(world, Reposition(LAT, LON, speed_mps=2.0))
    assert mode_of(world) is Mode.GUIDED
    world.run(60.0)
    target = world.surroundings.plant.frame.to_local(LAT, LON)
    truth = world.surroundings.truth
    assert math.dist((truth.north_m, truth.east_m), target) < 2.0


def test_a_point_without_consent_to_change_the_mode_is_refused(world: World) -> None:
    accept(world, Arm(arm=True))
    assert "Guided" in ask(world, Reposition(LAT, LON, change_mode=False)).reason
    assert mode_of(world) is Mode.HOLD


def test_an_orbit_circles_and_ends_after_its_turns(world: World) -> None:
    accept(world, Arm(arm=True))
    accept(world, Orbit(LAT, LON, Circle(12.0), speed_mps=1.5, turns=1.0))
    assert mode_of(world) is Mode.CIRCLE
    world.run(45.0)
    assert world.snapshot is not None
    assert world.snapshot.path.orbit_radius_m == pytest.approx(12.0)
    world.run(90.0)
    leg = world.app.vehicle.parts.navigator.intent(world.now_us, world.snapshot.state)
    assert leg is not None
    assert isinstance(leg.maneuver, Loiter)
    assert leg.maneuver.figure == Hover()


def test_a_heading_is_steered_and_a_stream_that_stops_ends_in_station_keeping(world: World) -> None:
    accept(world, Arm(arm=True))
    assert "Guided" in ask(world, GuidedHeading(1.0, 1.0, stream=True)).reason
    accept(world, GuidedHeading(math.radians(90.0), 1.0))
    world.run(15.0)
    assert math.degrees(world.surroundings.truth.psi_rad) == pytest.approx(90.0, abs=5.0)
    accept(world, GuidedTarget(LAT, LON))
    world.run(8.0)
    leg = world.app.vehicle.parts.navigator.intent(world.now_us, world.snapshot.state)
    assert leg is None or leg.maneuver.figure == Hover()


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (Station(254, 190, "gcs", "10.0.0.1"), "station 255 over gcs has the sticks"),
        (Station(255, 190, "tcp", "10.0.0.2"), "station 255 over gcs has the sticks"),
        (Station(255, 190, "tcp", ""), "station 255 over gcs has the sticks"),
        (Station(255, 230, "gcs", "10.0.0.1"), "station 255/190 over gcs has the sticks"),
        (Station(255, 190, "gcs", "10.0.0.2"), "station 255 over gcs at 10.0.0.1 has the sticks"),
    ],
    ids=["number", "link", "serial link", "component", "host"],
)
def test_sticks_belong_to_one_station_and_time_out(world: World, other: Station, told: str) -> None:
    accept(world, SetMode(Mode.MANUAL))
    accept(world, Arm(arm=True))
    for _ in range(20):
        world.app.submit(ManualInput(0.8, 0.0, 255), station=Station(255, 190, "gcs", "10.0.0.1"))
        world.step()
    assert world.snapshot is not None
    assert world.snapshot.output.thruster_port > 0.5
    replies: list[Reply] = []
    for _ in range(14):
        world.app.submit(ManualInput(0.8, 0.0, other.system), replies.append, station=other)
        world.step()
    assert {reply.reason for reply in replies} == {told}
    assert world.snapshot.output.thruster_port == 0.0
    assert mode_of(world) is Mode.MANUAL


@pytest.mark.parametrize("is_heard", [True, False], ids=["heard", "silent"])
def test_a_program_on_its_second_link_has_the_sticks_once_those_of_the_first_are_neutral(
    world: World, is_heard: bool
) -> None:
    first, second = (Station(255, 190, link, "10.0.0.1") for link in ("gcs", "tcp"))
    accept(world, SetMode(Mode.MANUAL))
    accept(world, Arm(arm=True))
    replies: list[Reply] = []
    for tick in range(60):
        if tick < 20 or is_heard:
            world.app.submit(ManualInput(0.8, 0.0, 255), station=first)
        if tick >= 20:
            world.app.submit(ManualInput(-0.8, 0.0, 255), replies.append, station=second)
        world.step()
    obeyed = [reply.result is Result.ACCEPTED for reply in replies]
    assert not any(obeyed[:9]), "the first one's sticks steer for half a second"
    assert all(obeyed[14:]) is not is_heard
    assert any(obeyed) is not is_heard
    assert world.snapshot is not None
    assert (world.snapshot.output.thruster_port > 0.0) is is_heard


@pytest.mark.parametrize("last", [SetMode(Mode.MANUAL), Arm(arm=True)], ids=["armed before", "armed last"])
def test_who_takes_the_sticks_later_has_time_for_the_first_and_silence_stops_all_the_same(
    world: World, last: SetMode | Arm
) -> None:
    accept(world, SetMode(Mode.MANUAL))
    accept(world, Arm(arm=True))
    for _ in range(20):
        world.app.submit(ManualInput(0.8, 0.0, 255))
        world.step()
    accept(world, SetMode(Mode.HOLD) if isinstance(last, SetMode) else Arm(arm=False, force=True))
    world.run(5.0)
    accept(world, last)
    assert world.snapshot is not None
    for _ in range(8):
        assert world.snapshot.armed
        assert mode_of(world) is Mode.MANUAL
        assert "manual_lost" not in world.snapshot.causes
        assert world.snapshot.output.thruster_port == 0.0, "sticks of before steer no more"
        world.step()
    world.run(0.2)
    assert "manual_lost" in world.snapshot.causes
    assert world.snapshot.action is Action.STOP
    world.app.submit(ManualInput(0.8, 0.0, 255))
    world.run(0.3)
    assert world.snapshot.action is Action.NONE
    assert world.snapshot.output.thruster_port > 0.0


def test_speeds_beyond_the_hull_are_denied(world: World) -> None:
    assert ask(world, SetSpeed(50.0)).result is Result.DENIED
    accept(world, SetSpeed(1.0))
    accept(world, SetSpeed(None, throttle=0.5))
    accept(world, SetSpeed())


def test_a_plan_faster_than_the_hull_is_refused_with_its_item(world: World) -> None:
    made = load_plan(PlanKind.MISSION, [PlanItem(178, 2, 1.0, 20.0, -1.0, 0.0, 0, 0, 0.0)])
    assert isinstance(made, LoadPlan)
    accept(world, plan())
    reply = ask(world, made)
    assert reply.result is Result.DENIED
    assert "item 0" in reply.reason
    assert world.snapshot is not None
    assert world.snapshot.progress.total == 1


def test_modes_say_what_they_need() -> None:
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false"], SimSettings)
    blind = World(settings, 1)
    blind.surroundings.plant.sensors.faults.set("gnss_silent", True)
    blind.run(3.0)
    for mode in (Mode.RTL, Mode.GUIDED, Mode.CIRCLE):
        assert "position" in ask(blind, SetMode(mode)).reason
    accept(blind, SetMode(Mode.MANUAL))
    accept(blind, SetMode(Mode.HOLD))


def test_termination_is_final(world: World) -> None:
    accept(world, Arm(arm=True))
    accept(world, Terminate())
    world.step()
    assert world.snapshot is not None
    assert not world.snapshot.armed
    assert "terminated" in ask(world, Arm(arm=True, force=True)).reason


def test_wrong_numbers_and_needless_unlocks_are_denied(world: World) -> None:
    assert ask(world, SetCurrent(3)).result is Result.DENIED
    assert world.app.vehicle.controls.guard_state is not GuardState.LOCKED
    assert ask(world, UnlockGuard()).result is Result.DENIED
