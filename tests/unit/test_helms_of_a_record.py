"""A record whose helm is not the file's: the owner is asked, and nothing is refused."""

from dataclasses import replace

import numpy as np

from companion.tuning.records.helms import unlike_file
from sitl.plant.library import load_vessel as shipped
from tests.unit.test_record_copies import sailed

RUDDERLESS = shipped("blueboat")
RUDDERED = RUDDERLESS.model_copy(
    update={"rudder": RUDDERLESS.rudder.model_copy(update={"count": 2, "max_deg": 30.0})},
)


def steered(helm):
    whole = sailed("a", 60.0, 1)
    return [replace(whole, rudder_rad=helm * np.sin(np.arange(len(whole.port))))]


def test_a_helm_from_minus_one_to_one_is_not_taken_for_radians_unsaid():
    (told,) = unlike_file(steered(1.0), RUDDERED)
    assert "rudder goes to 57 degrees, and the file's to 30" in told
    assert list(unlike_file(steered(0.52), RUDDERED)) == []


def test_a_rudder_that_never_moves_is_asked_for():
    (told,) = unlike_file(steered(0.0), RUDDERED)
    assert "in the record none moves" in told
    assert list(unlike_file(steered(0.0), RUDDERLESS)) == []


def test_thrusters_that_are_one_column_are_asked_for():
    (whole,) = steered(0.0)
    (told,) = unlike_file([replace(whole, starboard=whole.port)], RUDDERLESS)
    assert "port and starboard are alike in every row" in told
