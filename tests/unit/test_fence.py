"""The fence's geometry against an independent reckoning, and its decisions."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given, settings, strategies as st

from companion.core.guard.fence import Fence, FenceConfig
from companion.core.guard.fence_region import FenceDisc, Polygon, Region, Shape, build_region
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState, FenceArea, Severity
from mavlink_bridge.language.points import NorthEast

HERE = (0.7188, -0.1519)
FRAME = LocalFrame(*HERE)
COORDINATE = st.floats(-100.0, 100.0)
POINT = st.tuples(COORDINATE, COORDINATE)


def winding(point, vertices) -> bool:
    """Even-odd by another way: the parity of crossings of a ray in a skew direction, by exact intersection."""
    inside = False
    direction = (0.8912, 0.4536)
    for i, a in enumerate(vertices):
        b = vertices[i - 1]
        edge = (b[0] - a[0], b[1] - a[1])
        cross = direction[0] * edge[1] - direction[1] * edge[0]
        if cross == 0.0:
            continue
        to_a = (a[0] - point[0], a[1] - point[1])
        along = (to_a[0] * edge[1] - to_a[1] * edge[0]) / cross
        share = (to_a[0] * direction[1] - to_a[1] * direction[0]) / cross
        if along > 0.0 and 0.0 <= share < 1.0:
            inside = not inside
    return inside


@settings(max_examples=200, deadline=None)
@given(st.lists(POINT, min_size=3, max_size=8), POINT)
def test_inside_and_outside_agree_with_another_reckoning(vertices, point):
    distance = Polygon(vertices).inside_m(point)
    if abs(distance) > 1e-3:
        assert (distance > 0.0) == winding(point, vertices)


@settings(max_examples=200, deadline=None)
@given(st.lists(POINT, min_size=1, max_size=8), POINT, POINT)
def test_the_distance_changes_by_no_more_than_the_way_between(vertices, a, b):
    polygon, circle = Polygon(vertices), FenceDisc(vertices[0], 30.0)
    for shape in (polygon, circle):
        assert abs(shape.inside_m(a) - shape.inside_m(b)) <= math.dist(a, b) + 1e-6


@settings(max_examples=100, deadline=None)
@given(st.lists(POINT, min_size=3, max_size=8), POINT)
def test_the_distance_is_to_the_nearest_edge(vertices, point):
    sampled = min(
        math.dist(point, (a[0] + (b[0] - a[0]) * i / 200, a[1] + (b[1] - a[1]) * i / 200))
        for a, b in zip(vertices, vertices[1:] + vertices[:1], strict=True)
        for i in range(201)
    )
    assert abs(Polygon(vertices).inside_m(point)) == pytest.approx(sampled, abs=1.5)
    assert abs(Polygon(vertices).inside_m(point)) <= sampled + 1e-9


def area(points, inclusion=True) -> FenceArea:
    return FenceArea(inclusion, tuple(FRAME.to_geodetic(*point) for point in points))


def disc(north, east, radius, inclusion=True) -> FenceArea:
    return FenceArea(inclusion, centre_rad=FRAME.to_geodetic(north, east), radius_m=radius)


def square(half, inclusion=True) -> FenceArea:
    return area([(half, half), (half, -half), (-half, -half), (-half, half)], inclusion)


def test_areas_combine():
    both = build_region([square(50.0), disc(0.0, 0.0, 60.0), disc(20.0, 0.0, 5.0, inclusion=False)], FRAME)
    assert both.inside_m((0.0, 0.0)) == pytest.approx(15.0, abs=1e-3)
    assert both.inside_m((20.0, 0.0)) == pytest.approx(-5.0, abs=1e-3)
    assert both.inside_m((55.0, 0.0)) == pytest.approx(-5.0, abs=1e-3), "all inclusion areas count"
    either = build_region([disc(0.0, 0.0, 10.0), disc(100.0, 0.0, 10.0)], FRAME, union=True)
    assert either.inside_m((100.0, 0.0)) == pytest.approx(10.0, abs=1e-3)
    assert either.inside_m((50.0, 0.0)) == pytest.approx(-40.0, abs=1e-3)
    only_out = build_region([disc(0.0, 0.0, 10.0, inclusion=False)], FRAME)
    assert only_out.inside_m((30.0, 0.0)) == pytest.approx(20.0, abs=1e-3)


def state(north=0.0, east=0.0, speed=0.0, course=0.0, **more) -> EstimatedState:
    values = {
        "x_m": north,
        "y_m": east,
        "vx_mps": speed * math.cos(course),
        "vy_mps": speed * math.sin(course),
        "psi_rad": course,
        "origin_lat_rad": HERE[0],
        "origin_lon_rad": HERE[1],
    }
    return EstimatedState(7, **{**values, **more})


def fence(*areas, **config) -> Fence:
    made = Fence(FenceConfig(**config))
    made.load(areas)
    return made


def test_stops_when_the_way_to_stop_reaches_the_margin_and_not_before():
    made = fence(disc(0.0, 0.0, 60.0))
    # 5 m to stop, 0.6 s of 2 m/s, 1 m of margin: 7.2 m
    assert not made.check(state(52.7, speed=2.0), 5.0).flags.fence_ahead
    out = made.check(state(52.9, speed=2.0), 5.0)
    assert out.flags.fence_ahead
    assert out.texts == ((Severity.WARNING, "Fence in 7.1 m: stopping"),)
    assert made.check(state(52.9, speed=2.0), 5.0).texts == (), "told once"
    assert not made.check(state(58.0, speed=2.0, course=math.pi), 5.0).flags.fence_ahead, "sailing inward"


def test_by_hand_no_stop_is_promised_and_what_stops_it_is_told():
    made = fence(square(60.0), turn_s=0.0)
    texts = []
    for north_m in range(20, 80):
        for _ in range(10):
            out = made.check(state(float(north_m), speed=2.0), 5.0, straight_m=math.inf, by_hand=True)
            texts += [text for _, text in out.texts]
            assert out.status.stops_in_m is None
    assert not [text for text in texts if "Stops in" in text or "stopping" in text]
    assert texts == [
        "Fence: Manual goes on through it; stop within 24 m",
        "Fence in 7.0 m: Manual goes on through it; the sticks stop it, or order Hold",
        "Outside the fence by 0.0 m",
    ]
    back = made.check(state(53.0, speed=2.0), 5.0)
    assert [text for _, text in back.texts][-1] == "Fence in 7.0 m: stopping", "another mode does stop"


def test_outside_no_stop_is_foretold():
    made = fence(disc(0.0, 0.0, 60.0))
    for course in (0.0, math.pi):
        for _ in range(11):
            out = made.check(state(80.0, speed=2.0, course=course), 5.0, straight_m=math.inf)
            assert out.status.stops_in_m is None
            assert not [text for _, text in out.texts if text.startswith("Stops in")]


def test_sailing_along_the_edge_is_allowed():
    made = fence(square(50.0))
    assert not made.check(state(48.0, 0.0, 2.0, math.pi / 2.0), 5.0).flags.fence_ahead
    assert made.check(state(48.0, 0.0, 2.0, math.pi / 2.0 - 0.5), 5.0).flags.fence_ahead


def test_inside_the_margin_outward_stops_and_inward_does_not():
    made = fence(square(50.0))
    assert made.check(state(49.5, 0.0, 0.5, 0.0), 0.1).flags.fence_ahead
    assert not made.check(state(49.5, 0.0, 0.5, math.pi), 0.1).flags.fence_ahead


def test_wind_and_current_that_set_outward_count_while_under_way():
    made = fence(disc(0.0, 0.0, 60.0))
    setting = {"drift_n_mps": 0.5, "drift_e_mps": 0.0}
    assert not made.check(state(52.0, speed=1.0), 2.0).flags.fence_ahead
    assert made.check(state(54.0, speed=1.0, **setting), 2.0).flags.fence_ahead
    assert not made.check(state(54.0, speed=0.2, **setting), 0.1).flags.fence_ahead, "keeping station is not being set"


def test_from_rest_the_bow_says_where_to():
    made = fence(square(50.0))
    assert made.check(state(49.8), 0.5).flags.fence_ahead, "the bow points out"
    assert not made.check(state(49.8, course=math.pi), 0.5).flags.fence_ahead
    assert not made.check(state(49.8, vx_mps=None, vy_mps=None, psi_rad=None), 0.5).flags.fence_ahead


def test_a_breach_is_counted_told_and_ended():
    made = fence(square(50.0))
    assert made.check(state(0.0), 0.0).status.distance_m == pytest.approx(50.0, abs=1e-3)
    out = made.check(state(53.0), 0.0)
    assert (out.status.breached, out.status.breach_count, out.status.breach_type, out.status.breach_t_us) == (
        True,
        1,
        3,
        7,
    )
    assert out.texts == ((Severity.CRITICAL, "Outside the fence by 3.0 m"),)
    assert not out.flags.fence_ahead
    assert made.check(state(54.0), 0.0).texts == ()
    out = made.check(state(40.0, course=math.pi), 0.0)
    assert (out.status.breached, out.status.breach_count, out.status.breach_type) == (False, 1, 0)
    assert out.texts == ((Severity.INFO, "Inside the fence again"),)
    assert made.check(state(53.0), 0.0).status.breach_count == 2


def test_switching_and_loading():
    made = fence(square(10.0))
    far = state(40.0)
    assert made.check(far, 0.0).status.breached
    made.enable(False)
    assert not made.enabled
    assert made.check(far, 0.0).status.breached is False
    assert made.check(far, 0.0).status.breach_count == 1
    made.enable(True)
    assert made.check(far, 0.0).status.breached
    made.configure(FenceConfig(enabled=False))
    assert not made.enabled, "the setting itself was changed"
    made.configure(FenceConfig(enabled=True, margin_m=2.0))
    assert made.enabled
    made.load([square(100.0)])
    assert not made.check(far, 0.0).status.breached
    made.load([])
    assert not made.enabled
    assert made.distance_m(far, (0.0, 0.0)) is None


def test_a_command_outlasts_other_settings():
    made = fence(square(10.0))
    made.enable(False)
    made.configure(FenceConfig(margin_m=5.0))
    assert not made.enabled


def test_without_a_position_or_an_origin_there_is_nothing_to_say():
    made = fence(square(10.0))
    assert made.check(EstimatedState(0), 0.0).status.distance_m is None
    assert made.check(state(x_m=None), 0.0).status.distance_m is None
    assert made.distance_m(state(), (4.0, 0.0)) == pytest.approx(6.0, abs=1e-3)


def test_no_inclusion_area_has_no_distance_to_show():
    made = fence(disc(0.0, 0.0, 10.0, inclusion=False))
    assert made.check(state(30.0), 0.0).status.distance_m == pytest.approx(20.0, abs=1e-3)


def test_the_origin_of_another_run_lays_the_areas_out_anew():
    made = fence(square(10.0))
    assert not made.check(state(0.0), 0.0).status.breached
    lat, lon = FRAME.to_geodetic(100.0, 0.0)
    assert made.check(state(0.0, origin_lat_rad=lat, origin_lon_rad=lon), 0.0).status.breached


def sailing(speed_mps: float, course_rad: float, north_m: float = 0.0) -> EstimatedState:
    return EstimatedState(
        0,
        origin_lat_rad=HERE[0],
        origin_lon_rad=HERE[1],
        x_m=north_m,
        y_m=0.0,
        vx_mps=speed_mps * math.cos(course_rad),
        vy_mps=speed_mps * math.sin(course_rad),
    )


@pytest.mark.parametrize("course_deg", [0.0, 30.0, -40.0])
def test_a_stop_is_foretold_after_as_much_way_as_is_then_sailed(course_deg):
    """What is said at each place, plus the way already sailed, is where the fence does ask for the stop."""
    fence = Fence(FenceConfig(turn_s=0.0))
    fence.load([square(60.0)])
    course, said, texts = math.radians(course_deg), [], []
    for gone_m in range(100):
        at = sailing(2.0, course, gone_m * math.cos(course))
        at.y_m = gone_m * math.sin(course)
        for _ in range(10):
            out = fence.check(at, 5.0, straight_m=math.inf)
            texts += [text for _, text in out.texts]
        if out.flags.fence_ahead:
            break
        if out.status.stops_in_m is not None:
            said.append(gone_m + out.status.stops_in_m)
    assert said
    assert all(abs(end_m - gone_m) <= 1.5 for end_m in said)
    assert len([text for text in texts if text.startswith("Stops in ")]) == 1


def test_no_stop_is_foretold_where_none_comes():
    fence = Fence(FenceConfig())
    fence.load([square(60.0)])
    for straight_m, state in (
        (20.0, sailing(2.0, 0.0)),  # turns before it
        (None, sailing(2.0, 0.0)),  # on a figure
        (math.inf, sailing(0.1, 0.0)),  # lies still
        (math.inf, sailing(0.8, 0.0, -50.0)),  # out of sight
    ):
        assert fence.check(state, 1.0, straight_m=straight_m).status.stops_in_m is None


def test_a_way_leads_out_of_the_fence_where_it_crosses_an_edge_and_never_along_clear_water():
    """Held against a march in steps of a decimetre: discs and polygons, in and out, from inside and from outside."""
    dice = random.Random("ways")
    for _ in range(300):
        areas: list[Shape] = [FenceDisc(point(dice), dice.uniform(5.0, 30.0)) for _ in range(dice.randrange(3))]
        areas += [Polygon([point(dice) for _ in range(dice.randrange(3, 7))]) for _ in range(dice.randrange(1, 3))]
        count = dice.randrange(len(areas) + 1)
        region = Region(areas[:count], areas[count:], dice.random() < 0.5)
        start, end = point(dice), point(dice)
        way = NorthEast((end[0] - start[0], end[1] - start[1]))
        steps = math.ceil(math.hypot(*way) / 0.1)
        rooms = [
            region.inside_m(NorthEast((start[0] + k / steps * way[0], start[1] + k / steps * way[1])))
            for k in range(steps + 1)
        ]
        if min(abs(room) for room in rooms[:1] + rooms[-1:]) < 0.2:
            continue  # begins or ends on an edge
        inside = [room >= 0.0 for room in rooms]
        marched = any(not later for later in inside[inside.index(True) :]) if any(inside) else False
        if region.leads_out(start, way) != marched:
            # a corner that is cut by less than a step is none for the march
            assert region.leads_out(start, way)
            assert min(abs(room) for room in rooms) < 0.1


def point(dice: random.Random) -> NorthEast:
    return NorthEast((dice.uniform(-40.0, 40.0), dice.uniform(-40.0, 40.0)))
