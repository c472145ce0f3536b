"""Which polygons are no fence: told at the upload with the corner, and every fence that means something is taken."""

from __future__ import annotations

import itertools
import math
import random

import pytest

from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan

INSIDE, OUTSIDE = 5001, 5002
SQUARE = [(0, 0), (100, 0), (100, 100), (0, 100)]
BOW_TIE = [(0, 0), (100, 100), (100, 0), (0, 100)]
LINE = [(0, 0), (50, 50), (100, 100)]
STAR = [(100 * math.cos(a), 100 * math.sin(a)) for a in (math.tau * 2 * k / 5 for k in range(5))]
RING = [(0, 0), (100, 0), (100, 100), (0, 100), (0, 0)]
TWICE = [(0, 0), (0, 0), (100, 0), (100, 100), (100, 100), (0, 100)]
KEYHOLE = [
    (0, 0),
    (100, 0),
    (100, 100),
    (0, 100),
    (0, 50),
    (40, 50),
    (40, 60),
    (60, 60),
    (60, 40),
    (40, 40),
    (40, 50),
    (0, 50),
]
BAY = [(0, 0), (100, 0), (100, 40), (20, 50), (100, 60), (100, 100), (0, 100)]
BARRIER = [(0, 0), (200, 0), (200, 0.3), (0, 0.3)]


def fence(*polygons, latitude=41.18, longitude=-8.7):
    frame = LocalFrame(math.radians(latitude), math.radians(longitude))
    items = []
    for command, corners in polygons:
        for corner in corners:
            lat, lon = (round(math.degrees(angle) * 1e7) for angle in frame.to_geodetic(*corner))
            items.append(PlanItem(command, 0, float(len(corners)), 0.0, 0.0, 0.0, lat, lon, 0.0))
    return load_plan(PlanKind.FENCE, items)


@pytest.mark.parametrize("command", [INSIDE, OUTSIDE])
@pytest.mark.parametrize("corners", [BOW_TIE, STAR, [*SQUARE[:3], (50, -20)]], ids=["bow tie", "star", "one too far"])
@pytest.mark.parametrize("latitude", [0.0, 41.18, -70.0])
def test_sides_that_cross_are_refused_with_both_corners(command, corners, latitude):
    refused = fence((command, corners), latitude=latitude)
    assert not isinstance(refused, LoadPlan)
    assert "cross" in refused.reason
    assert "corners" in refused.reason


def test_the_item_of_the_second_polygon_is_named():
    refused = fence((INSIDE, SQUARE), (INSIDE, BOW_TIE))
    assert not isinstance(refused, LoadPlan)
    assert refused.seq == 6


@pytest.mark.parametrize("corners", [LINE, [(0, 0), (0, 0), (0, 0)], [(0, 0), (300, 0.2), (600, 0)]])
def test_an_inclusion_without_room_is_refused(corners):
    refused = fence((INSIDE, corners))
    assert not isinstance(refused, LoadPlan)
    assert "no room inside" in refused.reason


@pytest.mark.parametrize(
    "polygons",
    [
        [(INSIDE, SQUARE)],
        [(INSIDE, SQUARE[::-1])],
        [(INSIDE, RING)],
        [(INSIDE, TWICE)],
        [(INSIDE, KEYHOLE)],
        [(INSIDE, BAY)],
        [(OUTSIDE, BARRIER)],
        [(OUTSIDE, LINE)],
        [(INSIDE, SQUARE), (OUTSIDE, [(n + 50, e + 50) for n, e in SQUARE])],
        [(INSIDE, [(0, 0), (2, 0), (2, 2)])],
        [(INSIDE, [(20_000 * n, 20_000 * e) for n, e in ((0, 0), (1, 0), (0, 1))])],
    ],
)
def test_what_means_something_is_taken(polygons):
    taken = fence(*polygons)
    assert isinstance(taken, LoadPlan), taken


@pytest.mark.parametrize("seed", range(20))
def test_a_coast_drawn_round_a_point_never_crosses_itself(seed):
    chance = random.Random(seed)
    angles = [*sorted(chance.uniform(0.0, math.tau) for _ in range(200)), math.tau]
    coast = [(r * math.cos(a), r * math.sin(a)) for a in angles for r in [chance.uniform(100.0, 1000.0)]]
    widest = max(b - a for a, b in itertools.pairwise(angles))
    assert widest < math.pi
    taken = fence((INSIDE, coast))
    assert isinstance(taken, LoadPlan), taken
