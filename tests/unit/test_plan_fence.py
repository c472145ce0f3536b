"""The plan against the fence: every leg and figure, switches inside the plan, jumps, and a bounded share of each tick."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.fence import Fence, FenceConfig
from companion.core.vehicle.plan_fence import LEGS_A_TICK, SETTLE_US, PlanFence
from mavlink_bridge.language.figures import Circle, FigureEight, Hover
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    EstimatedState,
    FenceArea,
    FenceEnable,
    Goto,
    Jump,
    Loiter,
    Noted,
    PlanSpecification,
)

ORIGIN = LocalFrame(0.7188, -0.1518)


def at(north_m, east_m=0.0):
    return ORIGIN.to_geodetic(north_m, east_m)


def state(north_m=0.0, east_m=0.0):
    lat, lon = at(north_m, east_m)
    return EstimatedState(
        0,
        lat_rad=lat,
        lon_rad=lon,
        x_m=north_m,
        y_m=east_m,
        origin_lat_rad=ORIGIN.lat_rad,
        origin_lon_rad=ORIGIN.lon_rad,
    )


def circle(radius_m, north_m=0.0, east_m=0.0, inclusion=True):
    return FenceArea(inclusion=inclusion, centre_rad=at(north_m, east_m), radius_m=radius_m)


def square(half_m, inclusion=True):
    corners = ((-half_m, -half_m), (-half_m, half_m), (half_m, half_m), (half_m, -half_m))
    return FenceArea(inclusion=inclusion, vertices_rad=tuple(at(*corner) for corner in corners))


def goto(seq, north_m, east_m=0.0):
    return Goto(seq, *at(north_m, east_m))


def ask(areas, *items, first=0, here=None, from_here=True, config=None):
    fence = Fence(config or FenceConfig())
    fence.load(areas)
    check = PlanFence(fence)
    check.renew(PlanSpecification(tuple(items), 1), here or state(), 20.0)
    return check.refusal(here or state(), first, from_here=from_here)


def test_inside_is_fine_and_the_edge_too():
    assert ask([circle(60)], goto(0, 40), goto(1, 0, 59.9)) == ""
    assert ask([square(50)], goto(0, 49.99, 49.99), goto(1, -49.99, -49.99)) == ""
    assert ask([], goto(0, 4000)) == ""
    assert ask([circle(60)]) == ""


def test_two_circles_round_a_rock_are_sailed_and_a_way_past_it_is_seen():
    rock, pond = circle(10, 60, inclusion=False), circle(200, 60)
    inner = Loiter(0, *at(60), figure=Circle(radius_m=25.0), turns=1.0)
    outer = Loiter(1, *at(60), figure=Circle(radius_m=35.0), turns=1.0)
    assert ask([pond, rock], inner, outer) == ""
    ahead = circle(5, 40, 60, inclusion=False)
    left = Loiter(1, *at(60), figure=Circle(radius_m=40.0), turns=1.0)
    assert ask([pond, ahead], goto(0, 10), left, goto(2, 60, 120)) == "item 2 leads out of the fence"
    assert ask([pond], goto(0, 10), left, goto(2, 60, 120)) == ""


def test_the_item_is_named_with_its_distance():
    assert ask([circle(60)], goto(0, 40), goto(1, 100)) == "item 1 is 40 m outside the fence"
    assert ask([circle(60)], Noted(0, 2000), goto(1, 62)) == "item 1 is 2.0 m outside the fence"
    assert ask([square(50)], goto(0, 0), goto(1, 0, 75)) == "item 1 is 25 m outside the fence"


def test_a_leg_that_cuts_through_an_exclusion_counts_and_one_round_it_does_not():
    rock = circle(10, 50, 0, inclusion=False)
    assert ask([rock], goto(0, 0), goto(1, 100)) == "item 1 leads out of the fence"
    assert ask([rock], goto(0, 0), goto(1, 50, 30), goto(2, 100)) == ""
    assert ask([rock], goto(0, 100), here=state(0, 0)) == "the way from here to item 0 leads out of the fence"
    assert ask([rock], goto(0, 100), here=state(0, 0), from_here=False) == ""


def test_a_loiter_may_circle_what_it_must_not_enter():
    rock = circle(10, 50, 0, inclusion=False)
    assert ask([rock], goto(0, 0), Loiter(1, *at(50), figure=Circle(radius_m=30.0), turns=1.0)) == ""
    assert ask([rock], goto(0, 0), Loiter(1, *at(50), figure=Circle(radius_m=8.0))) == "item 1 leads out of the fence"
    assert ask([circle(60)], Loiter(0, *at(50), figure=Circle(radius_m=15.0))) == "item 0 leads out of the fence"
    assert ask([circle(60)], Loiter(0, *at(50), figure=Circle(radius_m=9.0))) == ""
    eight = Loiter(0, *at(40), figure=FigureEight(length_m=40.0, radius_m=8.0, bearing_rad=0.0))
    assert ask([circle(60)], eight) == "item 0 leads out of the fence"
    assert ask([circle(60)], Loiter(0, *at(70), figure=Hover())) == "item 0 is 10 m outside the fence"


def test_what_is_sailed_while_the_fence_is_off_does_not_count():
    off, on = FenceEnable(1, enable=False), FenceEnable(3, enable=True)
    assert ask([circle(60)], goto(0, 10), off, goto(2, 200), on, goto(4, 20)) == "item 4 leads out of the fence"
    assert ask([circle(60)], goto(0, 10), off, goto(2, 200)) == ""
    closed = FenceConfig(enabled=False)
    assert ask([circle(60)], goto(0, 200), config=closed) == ""
    assert ask([circle(60)], FenceEnable(0, enable=True), goto(1, 200), config=closed).startswith("item 1 is 140 m")


def test_only_what_is_still_to_be_sailed_counts_unless_a_jump_leads_back():
    plan = goto(0, 100), goto(1, 20), goto(2, 30)
    assert ask([circle(60)], *plan, first=1, here=state(10)) == "item 1 leads out of the fence", "the leg from item 0"
    assert ask([circle(60)], *plan, first=2, here=state(10)) == ""
    assert ask([circle(60)], *plan, Jump(3, 0, 2), first=2, here=state(10)) == "item 0 is 40 m outside the fence"


def test_a_vessel_outside_may_sail_back_in():
    assert ask([circle(60)], goto(0, 20), here=state(90)) == ""


@pytest.mark.parametrize("count", [829])
def test_a_long_plan_takes_a_bounded_share_of_each_tick_and_is_told_once_it_stands(count):
    fence, asked = Fence(FenceConfig()), []
    fence.load([circle(60)])
    inner = fence.distance_m
    fence.distance_m = lambda *each: asked.append(1) or inner(*each)
    check = PlanFence(fence)
    items = [goto(n, 30 * math.cos(n), 30 * math.sin(n)) for n in range(count - 1)] + [goto(count - 1, 75)]
    plan = PlanSpecification(tuple(items), 1)
    told, most = [], 0
    for tick in range(400):
        before = len(asked)
        text = check.step(tick * 50_000, plan, state(), 20.0)
        most = max(most, len(asked) - before)
        told += [(tick, text)] if text else []
    assert most <= LEGS_A_TICK * 40
    assert [text for _, (_, text) in told] == ["Plan: item 828 is 15 m outside the fence; it will not be started"]
    assert told[0][0] * 50_000 >= SETTLE_US
    quiet = len(asked)
    check.step(30_000_000, plan, state(), 20.0)
    assert len(asked) == quiet, "nothing is done again while nothing changes"
