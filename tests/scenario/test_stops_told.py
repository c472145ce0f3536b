"""What is told of a stop is what goes on: an order that is named is obeyed when it is given, and one that would do nothing is refused."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.language.requests import Arm, Orbit, Reposition
from tests.scenario.conftest import Voyage

DEEP = ('world.bottom.kind="flat"', "world.bottom.depth_m=20")


def under_way(hull: str = "otter", *, after_s: float = 20.0) -> Voyage:
    boat = Voyage(f'vessel="{hull}"', *DEEP)
    boat.sail(0.8, (200.0, 0.0), after_s=after_s)
    return boat


def stopped_by_a_thruster(hull: str) -> Voyage:
    """One that pushed the wrong way, and is mended now."""
    boat = under_way(hull, after_s=30.0)
    health = boat.world.surroundings.plant.vessel.thruster_health
    health[0] = -1.0
    boat.until(lambda: "thruster_reversed" in boat.snapshot.causes, 60.0)
    health[0] = 1.0
    boat.run(10.0)
    return boat


@pytest.mark.parametrize("hull", ["otter", "blueboat"])
def test_after_a_thruster_that_pushed_the_wrong_way_what_is_told_is_what_goes_on(hull):
    """She was told to order Auto once the thrusters push as told, which a stopped boat cannot show, and Hold held nothing."""
    boat = stopped_by_a_thruster(hull)
    assert "Until disarmed and armed again, then order Auto" in boat.texts
    for mode in (Mode.AUTO, Mode.RTL, Mode.HOLD):
        why = boat.mode(mode).reason
        assert why == "a thruster pushes the wrong way: disarm and arm again to try; Manual is obeyed"
    assert boat.ask(Arm(arm=False)).reason == ""
    boat.run(15.0)
    assert not [text for text in boat.texts if "push as told" in text], "nothing has shown that"
    assert boat.ask(Arm(arm=True)).reason == ""
    for mode in (Mode.HOLD, Mode.AUTO):
        assert boat.mode(mode).reason == ""
        boat.run(4.0)
        assert boat.snapshot.action < Action.STOP
    assert not boat.neutral


def test_of_two_stops_the_one_that_ends_first_names_no_order():
    """ "Heading is back: stopped: order Auto to go on" was told, and Auto refused: "position lost"."""
    boat = under_way()
    boat.faults.no_fix = boat.faults.heading_silent = True
    boat.run(6.0)
    boat.faults.heading_silent = False
    boat.run(20.0)
    assert "Heading is back (stopped: position lost)" in boat.texts
    assert not [text for text in boat.texts if "to go on" in text]
    boat.faults.no_fix = False
    boat.run(20.0)
    assert "Position is back: stopped: order Auto to go on" in boat.texts
    assert boat.mode(Mode.AUTO).reason == ""
    boat.run(2.0)
    assert not boat.neutral


def test_a_go_to_that_a_stop_broke_off_goes_on_when_guided_is_ordered_as_told():
    """ "Order Guided to go on" was obeyed, and the boat lay where the stop had left it, for good; a Hold or a Disarm ends the go-to."""
    boat = Voyage(*DEEP)
    there = boat.world.surroundings.plant.frame.to_geodetic(60.0, 0.0)
    assert boat.ask(Arm(arm=True)).reason == ""
    assert boat.ask(Reposition(*there, speed_mps=2.0)).reason == ""
    boat.run(8.0)
    assert boat.mode(Mode.GUIDED).reason == "", "repeated, it changes nothing"
    boat.run(4.0)
    boat.faults.no_fix = True
    boat.run(5.0)
    boat.faults.no_fix = False
    boat.until(lambda: "Position is back: stopped: order Guided to go on" in boat.texts, 30.0)
    stopped_m = boat.truth.north_m
    assert stopped_m < 40.0
    assert boat.mode(Mode.GUIDED).reason == ""
    boat.run(8.0)
    assert "Going on: Go-to" in "".join(boat.texts)
    assert boat.truth.north_m > stopped_m + 6.0
    for leaves in (Arm(arm=False), Arm(arm=True)):
        assert boat.ask(leaves).reason == ""
    boat.run(4.0)
    left_m = boat.truth.north_m
    assert boat.mode(Mode.GUIDED).reason == ""
    boat.run(8.0)
    assert abs(boat.truth.north_m - left_m) < 4.0


def test_a_circle_that_a_stop_broke_off_goes_on_about_its_middle():
    """ "Order Circle to go on" was obeyed with a circle of another size, about the place where the boat had stopped."""
    boat = Voyage(*DEEP)
    middle = boat.world.surroundings.plant.frame.to_geodetic(0.0, 12.0)
    assert boat.ask(Arm(arm=True)).reason == ""
    assert boat.ask(Orbit(*middle, figure=Circle(radius_m=12.0), speed_mps=1.5)).reason == ""
    boat.run(8.0)
    boat.faults.no_fix = True
    boat.run(5.0)
    boat.faults.no_fix = False
    boat.until(lambda: "Position is back: stopped: order Circle to go on" in boat.texts, 30.0)
    assert boat.mode(Mode.CIRCLE).reason == ""
    boat.run(12.0)
    for _ in range(5):
        boat.run(5.0)
        assert math.hypot(boat.truth.north_m, boat.truth.east_m - 12.0) == pytest.approx(12.0, abs=2.0)


def test_a_hold_stops_the_sticks_though_a_thruster_has_stopped_the_boat():
    boat = stopped_by_a_thruster("otter")
    assert boat.mode(Mode.MANUAL).reason == ""
    assert boat.mode(Mode.HOLD).reason == ""
    boat.run(1.0)
    assert boat.neutral


@pytest.mark.parametrize(("fault", "name"), [("heading_silent", "Heading"), ("no_fix", "Position")])
def test_a_boat_that_was_disarmed_meanwhile_is_told_so(fault, name):
    """She was told "stopped: order Auto to go on", and Auto, accepted, moved nothing."""
    boat = under_way()
    setattr(boat.faults, fault, True)
    boat.run(5.0)
    assert boat.ask(Arm(arm=False)).reason == ""
    boat.run(3.0)
    setattr(boat.faults, fault, False)
    boat.run(20.0)
    assert f"{name} is back: disarmed: arm, then order Auto to go on" in boat.texts
    assert boat.ask(Arm(arm=True)).reason == ""
    assert boat.mode(Mode.AUTO).reason == ""
    boat.run(2.0)
    assert not boat.neutral


def test_a_disarm_names_what_disarmed_her_and_no_warning_beside_it():
    """ "disarmed: actuators lost, no water depth" was told: a sounder that is silent disarms nobody."""
    boat = under_way(after_s=5.0)
    boat.faults.depth_silent = True
    boat.until(lambda: "depth_lost" in boat.snapshot.causes, 30.0)
    boat.board._command = lambda *command: None
    boat.until(lambda: not boat.snapshot.armed, 5.0)
    assert [text for text in boat.texts if text.startswith("disarmed: ")] == ["disarmed: actuators lost"]
