"""A loiter that is tighter than wind and current allow is told, and one that can be sailed is not."""

import functools

import pytest

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
