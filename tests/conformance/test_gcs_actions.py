"""The buttons that QGroundControl gets for the honest face: each is a command that the vessel takes."""

import json

import pytest

import config
from mavlink_bridge.language.requests import PlanItem, PlanKind
from tests.fake_vessel import Bench

ACTIONS = json.loads(config.path("qgc/usv-actions.json").read_text())


def test_the_file_is_one_that_qgc_reads():
    assert (ACTIONS["version"], ACTIONS["fileType"]) == (1, "MavlinkActions")
    assert all({"label", "description", "mavCmd"} <= set(action) for action in ACTIONS["actions"])


@pytest.mark.parametrize("action", ACTIONS["actions"], ids=lambda action: action["label"])
def test_every_button_is_taken(action):
    bench = Bench("generic")
    bench.vessel.plans.stored[PlanKind.MISSION] = (PlanItem(16, 3, 0, 0, 0, 0, 1, 1, 0),)
    bench.tick()
    bench.long(action["mavCmd"], *(action.get(f"param{number}", 0.0) for number in range(1, 8)))
    bench.tick()
    assert bench.acked(action["mavCmd"]) == [0]
