"""A shutdown asked for over MAVLink: obeyed at the berth only, never by radio, and it stays; a restart comes back."""

from __future__ import annotations

from pathlib import Path

import pytest

import config
from companion.commands.run import SHUT_DOWN
from companion.core.vehicle.refusals import shutdown_refusal
from mavlink_bridge.language.requests import Arm, Reboot, Result

NO_DEPTH = "depth.enabled=false"


def test_at_the_berth_it_is_obeyed_and_differs_from_a_restart(voyage):
    trip = voyage(NO_DEPTH)
    assert trip.ask(Reboot(shutdown=True)).reason == ""
    assert (trip.world.app.stop_wanted, trip.world.app.shutdown_wanted) == (True, True)
    again = voyage(NO_DEPTH)
    assert again.ask(Reboot()).reason == ""
    assert (again.world.app.stop_wanted, again.world.app.shutdown_wanted) == (True, False)


def test_a_vessel_adrift_or_under_way_does_not_go_dark(voyage):
    trip = voyage(NO_DEPTH, "world.water.current_mps=0.6")
    trip.run(45.0)
    refused = trip.ask(Reboot(shutdown=True))
    assert refused.result is Result.REJECTED_NOW
    assert "adrift" in refused.reason
    assert not trip.world.app.stop_wanted
    assert trip.ask(Reboot()).reason == "", "a restart comes back, and is obeyed"


def test_armed_or_on_a_voyage_it_is_refused(voyage):
    trip = voyage(NO_DEPTH)
    trip.ask(Arm(arm=True))
    assert "armed" in trip.ask(Reboot(shutdown=True)).reason


def test_by_radio_it_is_never_obeyed(voyage):
    trip = voyage(NO_DEPTH)
    controls = trip.world.app.vehicle.controls
    assert shutdown_refusal(controls, trip.world.now_us, by_radio=False) == ""
    assert "by radio" in shutdown_refusal(controls, trip.world.now_us, by_radio=True)


@pytest.mark.parametrize("line", [f"RestartPreventExitStatus={SHUT_DOWN}", "Restart=always"])
def test_the_shipped_unit_honours_it(line):
    assert line in Path(config.path("system/usv-companion.service")).read_text(encoding="utf-8").splitlines()
