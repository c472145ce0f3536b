"""Which place a return leads to: the nearest with an open way, one and the same while it stays open, and what a look costs."""

from __future__ import annotations

import itertools

import pytest

from companion.core.guard.fence import Fence, FenceConfig
from companion.core.vehicle.haven import Havens
from companion.core.vehicle.plan_reach import MissionConfig
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState, FenceArea
from mavlink_bridge.language.points import LatLon

ORIGIN = (0.7188, -0.1519)
FRAME = LocalFrame(*ORIGIN)
HOME, RALLY = (0.0, 0.0), (80.0, -120.0)


def at(north_m, east_m, t_us=0):
    lat, lon = FRAME.to_geodetic(north_m, east_m)
    origin = {"origin_lat_rad": ORIGIN[0], "origin_lon_rad": ORIGIN[1]}
    return EstimatedState(t_us, lat_rad=lat, lon_rad=lon, x_m=north_m, y_m=east_m, psi_rad=0.0, **origin)


def box(south_m, north_m, west_m, east_m):
    corners = ((south_m, west_m), (north_m, west_m), (north_m, east_m), (south_m, east_m))
    return FenceArea(inclusion=False, vertices_rad=tuple(LatLon(FRAME.to_geodetic(*corner)) for corner in corners))


ISLAND = box(30.0, 55.0, -15.0, 15.0)


@pytest.fixture
def havens():
    fence = Fence(FenceConfig())
    fence.load([ISLAND])
    made = Havens(MissionConfig(), fence)
    made.home, made.rally = LatLon(FRAME.to_geodetic(*HOME)), (LatLon(FRAME.to_geodetic(*RALLY)),)
    return made


def test_the_nearest_with_an_open_way_is_taken_and_the_text_says_why(havens):
    shut, free = at(80.0, 0.0), at(80.0, 60.0)
    assert havens.nearest(shut).told == "rally point 1, 120 m: the fence is across the way to home, 80 m"
    assert havens.nearest(free).told == "home, 100 m"
    assert not havens.is_shut_off(shut)


def test_where_no_way_is_open_the_nearest_is_waited_for(havens):
    havens._fence.load([ISLAND, box(60.0, 100.0, -70.0, -60.0)])
    assert havens.nearest(at(80.0, 0.0)).told == "home, 80 m: the fence is across the way"
    assert havens.is_shut_off(at(80.0, 0.0))


def test_a_return_keeps_to_its_place_while_the_way_there_is_open(havens):
    """Set to and fro where the way to the nearer opens and closes, she would go to neither."""
    assert havens.choose(at(80.0, 0.0)).name == "rally point 1"
    beside = at(80.0, 60.0)
    for _ in range(3):
        assert havens.choose(beside).told == "rally point 1, 180 m"
    havens.begin_anew()
    assert havens.choose(beside).name == "home"


def test_a_place_that_is_kept_is_given_up_when_its_way_is_shut_or_the_places_change(havens):
    assert havens.choose(at(80.0, 0.0)).name == "rally point 1"
    assert havens.choose(at(40.0, 30.0)).name == "home", "the island is between now"
    havens.choose(at(80.0, 0.0))
    havens.rally += (LatLon(FRAME.to_geodetic(80.0, 40.0)),)
    assert havens.choose(at(80.0, 0.0)).name == "rally point 2"


TIMES_US = itertools.count(0, 100_000)
"""Time goes on from one stretch of a voyage to the next."""


def rally_at(havens, *places):
    havens.rally = tuple(LatLon(FRAME.to_geodetic(*place)) for place in places)


def sailed(havens, *places):
    """The vessel is at each place for 5 s, and a return is chosen again whenever its key changes; what is told."""
    told, key = [], havens.key
    for place in places:
        for _ in range(50):
            t_us = next(TIMES_US)
            state = at(*place, t_us)
            havens.step(t_us, state)
            if havens.key != key:
                told.append(havens.choose(state).told)
                key = havens.key
    return told


@pytest.mark.parametrize(
    ("east_m", "name"), [(290.0, "rally point 1"), (310.0, "home"), (2980.0, "home")], ids=["near", "farther", "far"]
)
def test_a_detour_is_no_voyage_of_its_own(havens, east_m, name):
    """With 82 m to home and an island before it she sailed for a rally point 2980 m off, on the last of her battery."""
    rally_at(havens, (80.0, east_m))
    assert havens.nearest(at(80.0, 0.0)).name == name
    assert havens.is_shut_off(at(80.0, 0.0)) is (name == "home")


@pytest.mark.parametrize(("east_m", "name"), [(1150.0, "rally point 1"), (1300.0, "home")])
def test_far_from_home_a_detour_may_be_three_times_as_long(havens, east_m, name):
    rally_at(havens, (400.0, east_m))
    assert havens.nearest(at(400.0, 0.0)).name == name


def test_a_return_changes_once_to_a_place_that_has_been_markedly_nearer_for_ten_seconds(havens):
    """One look decided, from where the corner of an island was in the way; home lay open for the rest of the voyage."""
    rally_at(havens, (80.0, -250.0))
    assert havens.choose(at(80.0, 0.0)).name == "rally point 1"
    beside, shut = (80.0, 60.0), (80.0, 0.0)
    assert not sailed(havens, beside, beside)
    assert sailed(havens, beside, beside, beside) == ["home, 100 m: the way is open, and shorter than to rally point 1"]
    assert not sailed(havens, *[beside] * 5)
    assert havens.choose(at(*shut)).name == "rally point 1", "set before the island again"
    assert not sailed(havens, *[beside] * 20), "to none twice: she would go to and fro"


def test_a_way_that_opens_and_shuts_changes_nothing(havens):
    rally_at(havens, (80.0, -250.0))
    assert havens.choose(at(80.0, 0.0)).name == "rally point 1"
    assert not sailed(havens, *[(80.0, 60.0), (80.0, 0.0)] * 10)


def test_a_place_that_is_a_little_nearer_is_not_changed_to(havens):
    assert havens.choose(at(80.0, 0.0)).name == "rally point 1"
    assert not sailed(havens, *[(80.0, 45.0)] * 10), "92 m to home, 165 m to the rally point"


def test_who_has_come_back_may_change_on_the_next_return_too(havens):
    rally_at(havens, (80.0, -250.0))
    for _ in range(2):
        assert havens.choose(at(80.0, 0.0), keeps=False).name == "rally point 1"
        assert len(sailed(havens, *[(80.0, 60.0)] * 4)) == 1
        assert not sailed(havens, (5.0, 5.0), (5.0, 5.0))


def test_looking_again_is_bounded(havens):
    """Hundreds of rally points and corners take milliseconds: no tick of the control loop may have that each time."""
    rally_at(havens, *((80.0, -250.0 - k) for k in range(200)))
    havens.choose(at(80.0, 0.0))
    looks, fence = [], havens._fence
    asked, fence.crosses = fence.crosses, lambda state, place: looks.append(state.t_us) or asked(state, place)
    sailed(havens, *[(80.0, 0.0)] * 12)
    assert 0 < len(set(looks)) <= 13
