"""QGroundControl on the boat's own network, as measured (qgc-real.md): every button, every page, both generations of its rules."""

from __future__ import annotations

import math

import pytest

from tests.qgc_buttons import AUTO, GUIDED, HOLD, MOTOR_TEST, SETUP_PAGES, Generation
from tests.qgc_rig import Screen
from tests.transcript import Transcript

BOTH = pytest.mark.parametrize("generation", Generation, ids=lambda each: each.value)


def square(screen: Screen, half_m: float) -> list:
    corners = [(half_m, half_m), (half_m, -half_m), (-half_m, -half_m), (-half_m, half_m)]
    return [(0, 5001, 4.0, 0.0, 0.0, 0.0, *screen.at(*corner), 0.0) for corner in corners]


@BOTH
def test_a_day_with_the_boat_opens_no_box(generation):
    screen = Screen("depth.enabled=false", generation=generation)
    screen.run()
    assert screen.client.report.failures == []
    told = Transcript(screen.client)
    screen.wait(4.0)
    told.seen("connects")
    plan = screen.plan((60.0, 0.0), (60.0, 60.0))
    rally = [(3, 5100, 0.0, 0.0, 0.0, 0.0, *screen.at(5.0, 5.0), 0.0)]
    assert screen.run(screen.client.upload_plan(plan, square(screen, 200.0), rally))
    screen.wait(4.0)
    told.seen("*Upload*: plan, fence, rally point")
    began_us = screen.world.now_us
    assert screen.run(screen.client.start_mission())
    screen.until(lambda: screen.client.mode == AUTO, 1.5)
    assert screen.world.now_us - began_us <= 1_500_000, "slider to sailing"
    screen.wait(20.0)
    told.seen("slider *Start Mission*")
    assert screen.truth.u_mps > 1.0
    screen.run(screen.client.mode_menu(HOLD))
    screen.wait(20.0)
    told.seen("mode menu → *Hold*")
    assert abs(screen.truth.u_mps) < 0.3
    assert screen.run(screen.client.continue_mission())
    screen.wait(5.0)
    told.seen("slider *Continue Mission*")
    screen.run(screen.client.go_to(*screen.at(0.0, 30.0)))
    screen.until(lambda: screen.client.mode == GUIDED, 2.0)
    screen.until(lambda: math.hypot(screen.truth.north_m, screen.truth.east_m - 30.0) < 5.0, 90.0)
    told.seen("map → *Go to location*")
    assert screen.run(screen.client.return_home())
    screen.wait(60.0)
    told.seen("*Return*")
    assert math.hypot(screen.truth.north_m - 5.0, screen.truth.east_m - 5.0) < 4.0, "at the rally point"
    screen.run(screen.client.disarm())
    screen.until(lambda: not screen.client.armed, 2.0)
    told.seen("*Disarm*")
    assert screen.run(screen.client.upload_plan(plan)), "and without fence and rally: empty ones are sent"
    assert screen.client.report.failures == []
    screen.run(screen.client.pause())
    told.seen("*Pause* (nothing is sent)")
    screen.run(screen.client.land())
    told.seen("*Land* (nothing is sent)")
    screen.run(screen.client.reboot())
    screen.wait(8.0)
    told.seen("*Reboot Vehicle*")
    assert screen.world.starts == 2
    assert len(screen.client.report.plans[0]) == len(plan), "the plan was kept"
    told.holds(f"network {generation.value}")


@BOTH
def test_the_buttons_that_do_nothing_open_the_box_that_the_docs_name(generation):
    screen = Screen(generation=generation)
    screen.run()
    screen.run(screen.client.pause())
    screen.run(screen.client.land())
    assert screen.popups == ["Change altitude not supported.", "Guided mode not supported by Vehicle."]


@BOTH
def test_no_page_of_vehicle_setup_opens_a_box_or_shows_a_hole(generation):
    screen = Screen(generation=generation)
    screen.run()
    for page in SETUP_PAGES:
        screen.client.setup(page)
    assert screen.popups == []
    described = next(iter(screen.client.report.metadata.values()))["parameters"]
    frame = next(entry for entry in described if entry["name"] == "FRAME_CLASS")
    assert frame["values"] == [{"value": 2, "description": "Boat"}], "the frame page shows a word"


@BOTH
def test_the_motor_sliders_move_nothing(generation):
    screen = Screen(generation=generation)
    screen.run()
    screen.client.press(MOTOR_TEST, 1, 0, 50, 3)
    screen.wait(5.0)
    assert len(screen.popups) == 1
    assert all(abs(pulse - 1500) < 10 for pulse in screen.world.surroundings.plant.board.pulses_us)


@BOTH
def test_the_honest_persona_has_its_fence_and_rally_pages(generation):
    screen = Screen(persona="generic", generation=generation)
    screen.run()
    assert screen.client.report.failures == []


def test_two_presses_of_one_button_are_one_command_and_a_box():
    screen = Screen()
    screen.run()
    screen.wait(3.0)
    screen.client.press(400, 1)
    screen.client.press(400, 1)
    screen.wait(3.0)
    assert screen.popups == ["Waiting on previous response to same command."]


@pytest.mark.parametrize("persona", ["ardurover", "generic"])
def test_a_loiter_at_zero_is_sailed_at_the_waypoint_before_it(persona):
    screen = Screen("depth.enabled=false", persona=persona)
    screen.run()
    screen.wait(3.0)
    plan = [*screen.plan((25.0, 0.0)), (3, 19, 60.0, 0.0, 0.0, math.nan, 0, 0, 0.0)][persona == "generic" :]
    assert screen.run(screen.client.upload(0, plan)) == 0
    screen.client.press(400, 1)
    screen.wait(1.0)
    screen.client.press(300, 0, 0)
    screen.wait(50.0)
    assert math.hypot(screen.truth.north_m - 25.0, screen.truth.east_m) < 4.0
