"""Every figure of a loiter, also one that is made tomorrow: sailed, drawn, written and read back, carried by radio, said in words."""

from __future__ import annotations

import itertools
import math
from dataclasses import fields

import pytest

from mavlink_bridge.language.figures import FIGURES, Figure, LoiterDirection, outline, radius_of
from mavlink_bridge.language.messages import Loiter
from mavlink_bridge.language.requests import Orbit
from mavlink_bridge.mavlink.missions.figure_items import item_of
from mavlink_bridge.mavlink.missions.plan_mapping import compile_item
from mavlink_bridge.plans import PlanFile, read_plan, write_plan
from mavlink_bridge.radio.codec.request import decode_request, encode_request

SIZES = {"radius_m": 20.0, "length_m": 60.0, "bearing_rad": math.radians(30.0), "direction": LoiterDirection.CCW}
CENTRE = (100.0, -50.0)
LAT, LON = math.radians(41.185), math.radians(-8.706)


def made(name: str) -> Figure:
    kind = FIGURES[name]
    return kind(**{field.name: SIZES[field.name] for field in fields(kind)})


@pytest.mark.parametrize("name", FIGURES)
def test_it_is_written_as_an_item_of_a_plan_and_read_back(name):
    loiter = Loiter(3, LAT, LON, figure=made(name), duration_s=120.0)
    again = compile_item(3, item_of(loiter))
    assert isinstance(again, Loiter), again
    assert type(again.figure) is FIGURES[name]
    for field in fields(again.figure):
        assert getattr(again.figure, field.name) == (
            SIZES[field.name] if field.name == "direction" else pytest.approx(SIZES[field.name], rel=1e-6)
        )
    assert again.duration_s == 120.0


@pytest.mark.parametrize("name", FIGURES)
def test_it_survives_a_plan_file(name):
    item = item_of(Loiter(0, LAT, LON, figure=made(name), duration_s=120.0))
    (again,) = read_plan(write_plan(PlanFile(mission=(item,)))).mission
    assert type(compile_item(0, again).figure) is FIGURES[name]


@pytest.mark.parametrize("name", FIGURES)
def test_it_crosses_the_radio(name):
    figure = made(name)
    again = decode_request(encode_request(Orbit(LAT, LON, figure, 1.5)), lambda code: None)
    assert type(again.figure) is type(figure)
    assert all(
        getattr(again.figure, field.name) == pytest.approx(getattr(figure, field.name), rel=1e-6)
        for field in fields(figure)
        if field.name != "direction"
    )


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize("sense", [1, -1])
def test_what_goes_round_is_one_closed_line_within_sight_of_its_centre(name, sense):
    """Guidance sails the segments, the fence and the chart look at them, reports draw them."""
    figure = made(name)
    segments = figure.segments(CENTRE, radius_of(figure, 15.0), sense)
    assert bool(segments) == figure.goes_round
    for one, after in itertools.pairwise((*segments, *segments[:1])):
        assert math.dist(one.point(one.length_m), after.point(0.0)) < 1e-6
    points = outline(figure, CENTRE, 15.0)
    assert all(math.dist(point, CENTRE) < 100.0 for point in points)
    assert all(figure.error_m(CENTRE, radius_of(figure, 15.0), point, -1) < 1e-3 for point in points)


@pytest.mark.parametrize("name", FIGURES)
def test_it_has_words(name):
    assert all(made(name).words())
