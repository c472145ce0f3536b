"""The buttons and the plan that QGroundControl gets from this project: each command is taken, each generation has its file."""

import json

import pytest

import config
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.wire import with_home
from mavlink_bridge.plans.files import read_plan
from tests.fake_vessel import Bench
from tests.qgc_buttons import AUTO
from tests.qgc_rig import Screen

FILES = {"MavlinkActions": "qgc/usv-actions.json", "CustomActions": "qgc/usv-actions-qgc4.json"}
"""By fileType: QGroundControl 5.x reads the first, 4.x the second only."""
CONTENT = {kind: json.loads(config.path(name).read_text()) for kind, name in FILES.items()}
ACTIONS = CONTENT["MavlinkActions"]["actions"]


def button(label: str) -> dict:
    return next(action for action in ACTIONS if action["label"] == label)


@pytest.mark.parametrize("kind", FILES)
def test_each_generation_has_a_file_that_it_reads_with_the_same_buttons(kind):
    content = CONTENT[kind]
    assert (content["version"], content["fileType"]) == (1, kind)
    assert all({"label", "description", "mavCmd"} <= set(action) for action in content["actions"])
    assert content["actions"] == ACTIONS


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action["label"])
def test_every_button_is_taken(action):
    bench = Bench("generic")
    bench.vessel.plans.stored[PlanKind.MISSION] = (PlanItem(16, 3, 0, 0, 0, 0, 1, 1, 0),)
    bench.tick()
    bench.long(action["mavCmd"], *(action.get(f"param{number}", 0.0) for number in range(1, 8)))
    bench.tick()
    assert bench.acked(action["mavCmd"]) == [0]


def test_the_ready_plan_is_sailed_and_the_hold_button_is_an_honest_pause():
    plan = read_plan(config.path("qgc/first-loiter.plan").read_bytes(), "first-loiter.plan")
    screen = Screen("depth.enabled=false")
    screen.run()
    screen.wait(3.0)
    items = [
        (i.frame, i.command, i.param1, i.param2, i.param3, i.param4, i.x, i.y, i.z)
        for i in with_home(plan.mission, plan.home_rad)
    ]
    assert screen.run(screen.client.upload_plan(items))
    assert screen.run(screen.client.start_mission())
    screen.until(lambda: screen.client.mode == AUTO, 2.0)
    screen.until(lambda: bool(screen.world.snapshot.path.on_path), 120.0)
    hold = button("Hold here")
    screen.client.press(hold["mavCmd"], hold["param1"])
    screen.wait(15.0)
    assert screen.world.snapshot.mode is Mode.HOLD
    assert abs(screen.truth.u_mps) < 0.3
    go_on = button("Continue")
    screen.client.press(go_on["mavCmd"], go_on["param1"])
    screen.wait(10.0)
    assert screen.world.snapshot.mode is Mode.AUTO
    assert screen.popups == []
