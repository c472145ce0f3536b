"""A loiter that is tighter than wind and current allow is told, and one that can be sailed is not."""

import functools
import math

import pytest

from companion.core.guide.tight import TightWatch
from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import Loiter
from sitl.plant.library import load_vessel
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.sensed import SensedState


@pytest.mark.parametrize(("radius_m", "mps", "told"), [(3.0, 1.0, True), (10.0, 1.5, False)])
def test_a_loiter_too_tight_for_the_weather_is_told(radius_m, mps, told):
    source = functools.partial(SensedState)
    run = Case(load_vessel("otter"), WATERS["0.5 m/s + 8 m/s"], source=source).loop()
    run.place(radius_m + 8.0, 0.0, 1.57, mps)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Circle(radius_m=radius_m)))
    texts = []
    while run.t_s < 90.0:
        run.tick(mps)
        texts += [text for _, text in run.guidance.drain_texts() if "tighter than wind and current" in text]
    assert len(texts) == (1 if told else 0), texts


def told(cross_m, seconds=300.0, near=lambda t: True):
    watch = TightWatch()
    texts = [
        watch.step(0.1, near=near(k / 10), cross_m=cross_m(k / 10), radius_m=5.0) for k in range(round(10 * seconds))
    ]
    return [(k // 10, text.partition(":")[2]) for k, text in enumerate(texts) if text]


def swung(t_s, most_m):
    """Off the path once in each lap of 60 s, and on it in between."""
    return most_m * max(math.sin(2.0 * math.pi * t_s / 60.0 - 0.5 * math.pi), 0.0)


def test_the_greatest_error_of_the_lap_is_told_and_not_what_it_grew_from():
    """0.8 m was told, and she was 9 m off once a lap."""
    assert told(lambda t: swung(t, 9.0)) == [(36, " up to 9.0 m off its path; a greater one would be held")]


def test_a_much_greater_error_is_told_again():
    texts = told(lambda t: swung(t, 4.0 if t < 60 else 8.0 if t < 180 else 9.0))
    assert [text.split()[2] for _, text in texts] == ["4.0", "8.0"]


def test_an_error_that_stays_is_told_after_a_lap():
    assert told(lambda t: 2.0) == [(45, " up to 2.0 m off its path; a greater one would be held")]


def test_a_boat_that_crosses_the_path_and_turns_round_to_join_it_is_left_alone():
    """Started within her circle she crossed it outwards: 15 s later the way that her turn took was told as what the wind does."""
    assert told(lambda t: max(20.0 - abs(t - 20.0), 0.0) if t < 40 else 0.2, near=lambda t: t > 40) == []
