"""An operator who changes his mind twice in a moment, over the gateway: his last word is carried out, and what he reads is true."""

from __future__ import annotations

import pytest

from companion.io.links.link import Received
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.scenario.test_gateway import upload
from tests.scenario.test_radio_protocols import Shore

ACCEPTED, REJECTED, IN_PROGRESS = 0, 1, 5
NAN = float("nan")
ARM, DISARM = (400, 1.0), (400, 0.0)
AUTO, HOLD, PAUSE, GO_ON = (176, 1.0, 10.0), (176, 1.0, 4.0), (193, 0.0), (193, 1.0)
X_NORTH, X_SOUTH, Y = 411_940_000, 411_740_000, -87_060_000
HOME = (0, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, X_SOUTH, Y, 0.0)
WAYPOINT = (3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, X_NORTH, Y, 0.0)


def press(shore, command):
    number, *params = command
    shore.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *params, *([0.0] * (7 - len(params)))))


def answers(shore, number):
    """Final acknowledgements since the messages were cleared."""
    found = [message for _, message in shore.of("COMMAND_ACK") if message.command == number]
    return [message.result for message in found if message.result != IN_PROGRESS]


def deaf(shore):
    """Let the gateway hear nothing from now on; returns what ends it."""
    modem = shore.gateway.modem
    hear = modem.poll
    modem.poll = lambda now_us: [event for event in hear(now_us) if not isinstance(event, Received)]
    return lambda: setattr(modem, "poll", hear)


@pytest.fixture
def sailing(tmp_path):
    """A boat that sails a long leg."""
    shore = Shore(tmp_path, "depth.enabled=false")
    shore.run(60.0)
    assert upload(shore, HOME, WAYPOINT) == ACCEPTED
    press(shore, ARM)
    shore.run(4.0)
    press(shore, AUTO)
    shore.run(6.0)
    assert (shore.sim.snapshot.mode, shore.sim.snapshot.armed) == (Mode.AUTO, True)
    shore.messages.clear()
    return shore


@pytest.mark.parametrize(("stop", "go"), [(HOLD, AUTO), (PAUSE, GO_ON), (DISARM, ARM)])
def test_a_stop_pressed_again_is_obeyed_and_the_start_between_is_not_carried_out_after_it(sailing, stop, go):
    """The first stop's answer is lost: it is still open when the second one comes."""
    hears = deaf(sailing)
    for command in (stop, go, stop):
        press(sailing, command)
        sailing.run(2.0)
    hears()
    sailing.run(1.0)

    def moves():
        snapshot = sailing.sim.snapshot
        return snapshot.armed if stop == DISARM else snapshot.mode is Mode.AUTO

    sailing.run(25.0, until=moves)
    assert not moves()
    assert answers(sailing, stop[0]) == [ACCEPTED]


def test_hold_start_hold_on_a_clean_air_ends_in_hold(sailing):
    for command, wait_s in ((HOLD, 0.3), (AUTO, 3.0), (HOLD, 3.0)):
        press(sailing, command)
        sailing.run(wait_s)
    assert sailing.sim.snapshot.mode is Mode.HOLD


def test_a_disarm_that_overtakes_the_arming_is_not_reported_as_refused(sailing):
    press(sailing, DISARM)
    sailing.run(5.0)
    sailing.messages.clear()
    press(sailing, ARM)
    sailing.run(0.3)
    press(sailing, DISARM)
    sailing.run(20.0)
    assert answers(sailing, 400) == [ACCEPTED]
    assert not sailing.sim.snapshot.armed


def test_a_mode_that_was_overtaken_is_not_answered_when_another_is_on_its_way(sailing):
    for command, wait_s in ((HOLD, 3.0), (AUTO, 0.2), (HOLD, 16.7), ((176, 1.0, 11.0), 3.0)):
        press(sailing, command)
        sailing.run(wait_s)
    assert answers(sailing, 176) == [ACCEPTED] * 3
    assert sailing.sim.snapshot.mode is Mode.RTL


def test_the_last_of_three_go_tos_is_sailed(sailing):
    def go_to(x):
        sailing.send(dialect.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, NAN, x, Y, 0))

    for x, wait_s in ((X_NORTH, 0.2), (X_SOUTH, 0.2), (X_NORTH, 40.0)):
        go_to(x)
        sailing.run(wait_s)
    state = sailing.sim.snapshot.state
    assert abs(state.psi_rad) < 0.5, "north"


def test_the_last_of_three_values_is_kept(sailing):
    for value in (2.0, 5.0, 2.0):
        sailing.send(dialect.MAVLink_param_set_message(1, 1, b"WP_RADIUS", value, 9))
        sailing.run(0.2)
    sailing.run(20.0)
    assert sailing.sim.app.facade.params.get("WP_RADIUS").value == 2.0
    assert not sailing.of("PARAM_ERROR")
