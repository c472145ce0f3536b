"""Which place a return leads to: the nearest with an open way, one and the same while it stays open, and what a look costs."""

from __future__ import annotations

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
