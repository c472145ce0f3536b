"""Properties of the geometry and of the allocation that must hold for every input."""

import math

import pytest
from hypothesis import example, given, settings, strategies as st

from companion.core.guide.field import approach, bow, triangle
from companion.core.guide.paths import Chain, Line, fillet
from companion.core.hull.forces import ForceModel
from companion.core.steer.allocation import Allocator
from companion.core.steer.law import mix
from mavlink_bridge.language.figures import Circle, FigureEight, Racetrack
from mavlink_bridge.language.units import wrap_pi
from sitl.plant.library import load_vessel, vessel_names

ALLOCATORS = [Allocator(load_vessel(name), ForceModel(load_vessel(name))) for name in vessel_names()]
SHORT = settings(max_examples=60, deadline=None)
metres = st.floats(-200.0, 200.0)
radius = st.floats(2.0, 100.0)
angle = st.floats(-math.pi, math.pi)
sense = st.sampled_from((1, -1))


@SHORT
@given(radius, st.floats(0.0, 200.0), angle, sense, st.sampled_from((Racetrack, FigureEight)))
def test_patterns_are_closed_and_smooth(r, length, bearing, turn, shape):
    segments = shape(length_m=max(length, 0.1), bearing_rad=bearing).segments((10.0, -5.0), r, turn)
    for one, after in zip(segments, segments[1:] + segments[:1], strict=True):
        end, start = one.point(one.length_m), after.point(0.0)
        assert math.dist(end, start) < 1e-6 * max(1.0, r)
        if min(one.length_m, after.length_m) > 1e-3:
            gap = wrap_pi(one.project(*end).course_rad - after.project(*start).course_rad)
            assert abs(gap) < 1e-5


@SHORT
@given(metres, metres, metres, metres, st.floats(0.2, 5.0), st.floats(0.0, 50.0))
def test_a_rounded_corner_leaves_its_legs_by_no_more_than_the_cut(bn, be, cn, ce, cut, reach):
    """``reach`` is 0 where a leg ends as soon as it begins: no arc then, and none without a radius."""
    start, corner, end = (0.0, 0.0), (bn, be), (cn, ce)
    arc = fillet(start, corner, end, cut, 0.0, reach)
    if arc is None:
        return
    assert math.isfinite(arc.curvature)
    legs = Line(start, corner), Line(corner, end)
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        point = arc.point(share * arc.length_m)
        assert min(abs(leg.project(*point).cross_m) for leg in legs) <= cut + 1e-6


@SHORT
@given(metres, metres, radius, sense)
def test_projection_on_a_circle_has_the_distance_and_a_tangent_course(north, east, r, turn):
    (arc,) = Circle().segments((0.0, 0.0), r, turn)
    here = arc.project(north, east)
    assert here.cross_m == pytest.approx(turn * (r - math.hypot(north, east)), abs=1e-9)
    outward = math.atan2(east, north)
    assert math.cos(here.course_rad - outward) == pytest.approx(0.0, abs=1e-9)


@SHORT
@given(st.lists(st.floats(-0.4, 0.6), min_size=1, max_size=60), sense)
def test_laps_of_a_circle_are_counted_through_the_seam(steps, turn):
    track = Chain(Circle().segments((0.0, 0.0), 20.0, turn), closed=True)
    start = track.locate(20.0, 0.0).along_m
    swept = 0.0
    for step in steps:
        swept += step
        bearing = turn * swept
        here = track.locate(20.0 * math.cos(bearing), 20.0 * math.sin(bearing))
    assert here.along_m - start == pytest.approx(20.0 * swept, abs=1e-6)


@SHORT
@given(st.floats(-300.0, 300.0), st.floats(0.5, 20.0), st.floats(0.0, 50.0), st.floats(0.0, 10.0))
@example(offset=5e-324, look=1.0, turn=0.25, into=0.0)
@example(offset=3.0, look=5.0, turn=0.0, into=8.0)
def test_the_field_turns_towards_the_path_and_never_back(offset, look, turn, into):
    found, slope = approach(offset, look, turn, into)
    assert abs(found) <= 0.5 * math.pi + 1e-9
    assert found * offset >= 0.0
    assert slope >= 0.0
    assert into * math.sin(abs(found)) + turn * (1.0 - math.cos(found)) <= abs(offset) + 1e-6 or abs(found) > 1.57


@SHORT
@given(angle, st.floats(0.1, 3.0), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_the_triangle_of_velocities_closes(course, speed, drift_n, drift_e):
    """Speed through the water on that heading plus drift goes along the course, at the speed that is promised."""
    found = triangle(course, speed, (drift_n, drift_e), 3.0, 0.0)
    if found.water_mps < 0.6:
        return
    found = triangle(course, speed, (drift_n, drift_e), 3.0, found.water_mps)
    north = found.water_mps * math.cos(found.psi_rad) + drift_n
    east = found.water_mps * math.sin(found.psi_rad) + drift_e
    across = east * math.cos(course) - north * math.sin(course)
    along = north * math.cos(course) + east * math.sin(course)
    if abs(drift_e * math.cos(course) - drift_n * math.sin(course)) < 0.9 * found.water_mps:
        assert across == pytest.approx(0.0, abs=1e-6)
        assert along == pytest.approx(found.ground_mps, abs=1e-6)


@SHORT
@given(st.sampled_from(ALLOCATORS), st.floats(-2000.0, 2000.0), st.floats(-3000.0, 3000.0), st.floats(-3.0, 5.0))
def test_allocation_stays_in_range_and_never_turns_the_wrong_way(allocator, surge, yaw, speed):
    found = allocator.allocate(surge, yaw, speed)
    assert abs(found.thruster_port) <= 1.0
    assert abs(found.thruster_starboard) <= 1.0
    assert found.yaw_nm * yaw >= -1e-6
    assert abs(found.yaw_nm) <= abs(yaw) + 1e-6


@SHORT
@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(0.0, 1.0))
def test_the_mix_keeps_range_and_priority(common, differential, limit):
    port, starboard = mix(common, differential, limit)
    assert max(abs(port), abs(starboard)) <= limit + 1e-12
    assert (port - starboard) / 2.0 == pytest.approx(max(-limit, min(limit, differential)))


@SHORT
@given(
    angle,
    st.floats(-1.5, 1.5),
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    st.floats(0.0, 3.0),
    st.sampled_from([(0.0, True, 1.6), (-0.15, True, 1.6), (0.3, True, 1.3), (-0.5, True, 1.3), (0.0, False, 1.3)]),
)
def test_the_bow_turns_off_the_path_no_more_than_a_wrong_file_bears(path, off, drift, now, doubtful):
    """Strong water along the way asks for any gain; a file that says half the speed shows the same water, and it is not there."""
    course, (made_share, is_bend, gain) = wrap_pi(path + off), doubtful
    along, plain = (triangle(each, 1.5, drift, 3.0, now) for each in (path, course))
    found = bow(path, course, 1.5, drift, top_mps=3.0, now_mps=now, made_share=made_share, is_bend=is_bend)
    assert abs(wrap_pi(found.psi_rad - along.psi_rad)) <= gain * abs(off) + 1e-9
    if abs(wrap_pi(plain.psi_rad - along.psi_rad)) <= gain * abs(off):
        assert found == plain
