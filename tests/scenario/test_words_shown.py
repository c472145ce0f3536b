"""The words that a station is shown for ordinary things: each says what is so, by the names that the station has."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.mavlink.wire.codec import dialect
from tests.world_station import Helm

WAYPOINT, TRIGGER, REGION = 16, 206, 201
SET_MODE, ARM, REBOOT, TERMINATE, START = 176, 400, 246, 185, 300
HOLD, AUTO, GUIDED = 4.0, 10.0, 15.0
ONLY_SPEED = 0b0000_1101_1100_0111
NORTHWARD = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SHUTDOWN = 2.0


def armed(persona: str = "ardurover") -> Helm:
    helm = Helm(persona)
    assert helm.command(ARM, 1.0) == 0
    return helm


@pytest.mark.parametrize(("persona", "first"), [("ardurover", 1), ("generic", 0)])
def test_items_that_a_boat_passes_over_are_told_by_number_and_name(persona, first):
    helm = armed(persona)
    there = (3, WAYPOINT, 0.0, 0.0, 0.0, math.nan, *helm.at(60.0, 0.0), 0.0)
    assert helm.upload([(2, TRIGGER, 10.0, 0.0, 1.0, 0.0, 0, 0, 0.0), (2, REGION, *[0.0] * 4, 0, 0, 0.0), there]) == 0
    assert helm.command(START) == 0
    helm.run(1.0)
    assert f"item {first} (DO_SET_CAM_TRIGG_DIST) noted, nothing done" in helm.texts()
    assert f"item {first + 1} (DO_SET_ROI) noted, nothing done" in helm.texts()


def test_a_plan_that_is_cleared_under_way_is_told_with_what_the_boat_does():
    helm = armed()
    assert helm.upload([(3, WAYPOINT, 0.0, 0.0, 0.0, math.nan, *helm.at(300.0, 0.0), 0.0)]) == 0
    assert helm.command(SET_MODE, 1.0, AUTO) == 0
    helm.run(15.0)
    assert helm.upload([]) == 0
    north_m = helm.truth.north_m
    helm.run(20.0)
    assert abs(helm.truth.north_m - north_m) < 3.0
    assert helm.texts().count("the plan was cleared: keeping station here") == 1


def test_a_disarming_is_told_once_and_says_by_whom():
    helm = armed()
    assert helm.command(ARM, 0.0) == 0
    helm.run(1.0)
    assert "disarmed: by the operator" in helm.texts()


def test_a_boat_on_a_voyage_does_not_go_dark_and_says_that_this_is_why():
    helm = armed()
    helm.run(2.0)
    assert helm.command(TERMINATE, 1.0) == 0
    assert helm.command(REBOOT, SHUTDOWN) != 0
    assert "On a voyage (0 m from where it was started): a vessel afloat does not go dark" in "".join(
        message.text for message in helm.gcs.all("STATUSTEXT")
    )


@pytest.mark.parametrize(
    ("with_plan", "modes", "order", "number"),
    [
        (False, (), "Hold", HOLD),
        (True, (), "Hold", HOLD),
        (True, (AUTO,), "Auto", AUTO),
        (True, (AUTO, HOLD), "Hold", HOLD),
    ],
)
def test_a_stopped_boat_names_the_order_that_goes_on_with_what_she_did(with_plan, modes, order, number):
    """One that held by order was told "order Auto to go on", and sailed the plan that her operator had stopped."""
    helm = armed()
    if with_plan:
        assert helm.upload([(3, WAYPOINT, 0.0, 0.0, 0.0, math.nan, *helm.at(60.0, 0.0), 0.0)]) == 0
    for mode in modes:
        assert helm.command(SET_MODE, 1.0, mode) == 0
        helm.run(2.0)
    faults = helm.world.surroundings.plant.sensors.faults
    faults.set("no_fix", True)
    helm.run(5.0)
    assert f"Until position is back, then order {order}" in helm.texts()
    faults.set("no_fix", False)
    helm.run(20.0)
    assert f"Position is back: stopped: order {order} to go on" in helm.texts()
    assert helm.command(SET_MODE, 1.0, number) == 0
    helm.run(1.0)
    assert "Over: position lost" in helm.texts()


def test_set_points_that_stopped_ask_for_an_order_and_not_for_set_points():
    """The boat has left Guided for Hold by then: set-points alone move nothing."""
    helm = armed()
    assert helm.command(SET_MODE, 1.0, GUIDED) == 0

    def stream(count: int) -> None:
        for _ in range(count):
            helm.send(dialect.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, ONLY_SPEED, *NORTHWARD))
            helm.run(0.1)

    stream(30)
    helm.run(5.0)
    assert "Until Guided is ordered again" in helm.texts()
    here = helm.truth.north_m
    stream(50)
    assert abs(helm.truth.north_m - here) < 2.0
    assert helm.command(SET_MODE, 1.0, GUIDED) == 0
    stream(50)
    assert helm.truth.north_m > here + 2.0
