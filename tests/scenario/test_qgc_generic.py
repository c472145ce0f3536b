"""QGroundControl and the boat's honest face (persona generic): arming in the toolbar, and the buttons of the action file."""

from __future__ import annotations

import pytest

from tests.qgc_buttons import Generation
from tests.qgc_client import QgcClient
from tests.qgc_rig import Screen
from tests.radio_rig import LOITER, RadioScreen
from tests.transcript import Transcript

BOTH = pytest.mark.parametrize("generation", Generation, ids=lambda each: each.value)


@BOTH
def test_a_day_on_the_network(generation):
    screen = Screen("depth.enabled=false", persona="generic", generation=generation)
    screen.run()
    told = Transcript(screen.client)
    screen.wait(4.0)
    told.seen("connects")
    assert screen.run(screen.client.upload_plan(screen.plan((60.0, 0.0), (60.0, 60.0))[1:]))
    screen.wait(2.0)
    told.seen("*Upload*: plan, empty fence and rally points")
    screen.run(screen.client.arm())
    screen.wait(2.0)
    told.seen("toolbar → *Arm*")
    screen.run(screen.client.action("Start mission"))
    screen.wait(20.0)
    told.seen("action *Start mission*")
    assert screen.truth.u_mps > 1.0
    screen.run(screen.client.action("Hold here"))
    screen.wait(20.0)
    told.seen("action *Hold here*")
    assert abs(screen.truth.u_mps) < 0.3
    for action in ("Continue", "Circle here", "Return"):
        screen.run(screen.client.action(action))
        screen.wait(5.0)
        told.seen(f"action *{action}*")
    screen.run(screen.client.disarm())
    screen.wait(2.0)
    told.seen("toolbar → *Disarm*")
    screen.run(screen.client.reboot())
    screen.wait(8.0)
    told.seen("*Reboot Vehicle*")
    assert screen.world.starts == 2
    report = screen.client.report
    assert (report.popups, report.failures, len(report.plans[0])) == ([], [], 3), "and the plan was kept"
    told.holds(f"generic network {generation.value}")


@BOTH
def test_a_day_over_the_radio(tmp_path, generation):
    screen = RadioScreen(tmp_path, QgcClient(generation=generation), persona="generic")
    client = screen.client
    told = Transcript(client)
    screen.run()
    screen.wait(40.0)
    told.seen("connects")
    assert screen.run(client.upload_plan(LOITER[1:]))
    screen.wait(2.0)
    told.seen("*Upload*: plan, empty fence and rally points")
    screen.run(client.arm())
    screen.wait(2.5)
    told.seen("toolbar → *Arm*")
    for action in ("Start mission", "Hold here", "Continue", "Return"):
        screen.run(client.action(action))
        screen.wait(2.5)
        told.seen(f"action *{action}*")
    screen.run(client.disarm())
    screen.wait(2.5)
    told.seen("toolbar → *Disarm*")
    screen.run(client.reboot())
    screen.run()
    screen.wait(30.0)
    told.seen("*Reboot Vehicle*")
    assert screen.sim.starts == 2
    assert (screen.armed, client.armed) == (False, False)
    assert (client.report.popups, client.report.failures, len(client.report.plans[0])) == ([], [], 2), (
        "and the plan was kept"
    )
    told.holds(f"generic radio {generation.value}")
