"""Thresholds that nothing reaches, links that cannot be what they are for, keys that do nothing: each told by a rule for its kind."""

from __future__ import annotations

import re

import pytest

from companion.cli import main
from tests.unit.test_senseless_configurations import BOARD, COMPASS, QGC, SDK, write

REFUSED = {
    # what is changed -> by what ("<<" marks the line), and what the message must hold
    "a range that begins where the guard stops": (
        ("", "[depth]\nmin_altitude_m = 1\ninput.range_min_m = 9 # <<"),
        "range_min_m = 9",
        "deaf where the guard stops",
        "less than 1.15",
    ),
    "only perfect echoes": (("", "[depth.input]\nquality_min = 1 # <<"), "quality_min = 1", "about 0.05"),
    "astern within the dead band": (("", "[gate]\nthruster_min = -0.01 # <<"), "thruster_min = -0.01", "or 0 for no"),
    "more swings than ticks": (
        ("", "[monitors]\noscillation_reversals = 50 # <<\noscillation_window_s = 0.1"),
        "oscillation_reversals = 50",
        "2 ticks",
    ),
    "a limit above the limit": (
        ("", "[gate]\nthruster_max = 0.6\n[failsafe]\noscillation_thrust = 0.8 # <<"),
        "oscillation_thrust = 0.8",
        "gate.thruster_max 0.6",
    ),
    "a drift faster than the boat": (("", "[monitors]\ndrift_mps = 5 # <<"), "drift_mps = 5", "reaches 3.1 m/s"),
    "a course that no speed gives": (
        ("", "[estimate]\ncourse_speed_mps = 20 # <<"),
        "course_speed_mps = 20",
        "never stand in",
    ),
    "a racing start": (("", "[steering.model]\nacceleration = 5 # <<"), "acceleration = 5", "gives 2.8 m/s^2"),
    "a stop on the spot": (("", "[guidance.follow]\ndeceleration = 5 # <<"), "deceleration = 5", "gives 4.4 m/s^2"),
    "a calm that carries her off": (
        ("", "[guidance.station]\ncalm_mps = 0.5 # <<\nspeed_mps = 0.4"),
        "calm_mps = 0.5",
        "less than speed_mps 0.4",
    ),
    "a return slower than any current": (
        ("", "[modes]\nreturn_speed_mps = 0.05 # <<"),
        "return_speed_mps = 0.05",
        "or 0 for the cruise",
    ),
    "a longer limit that is shorter": (
        ("", "[estimate]\nposition_timeout_s = 3\nslow_receiver_s = 1 # <<"),
        "slow_receiver_s = 1",
        "position_timeout_s 3",
    ),
    "positions that are too old when they come": (
        (COMPASS, COMPASS + "\nnmea.position_latency_s = 0.9 # <<"),
        ("", "[estimate]\nposition_timeout_s = 0.5\nslow_receiver_s = 0.8"),
        "position_latency_s = 0.9",
        "estimate.position_timeout_s",
        "0.8 s",
    ),
    "a sentence wanted and forbidden": (
        (COMPASS, COMPASS + '\nnmea.sentences = "GGA,-GGA,RMC,HDT,DPT" # <<'),
        "nmea.sentences",
        "wants and forbids GGA",
    ),
    "a buoy's number": (("", "[traffic]\nown_mmsi = 992631234 # <<"), "own_mmsi = 992631234", "2 to 7"),
    "dates of another century": (
        (COMPASS, COMPASS + "\nnmea.earliest_year = 2190 # <<"),
        "earliest_year = 2190",
        "no time would be believed",
    ),
    "pulses that move nothing": (
        ("", "[actuators.board]\nlower_us = 1490 # <<\nupper_us = 1510"),
        "thruster_port",
        "10 us from the middle",
        "lower_us 1490",
    ),
    "a page for every name": (("", '[page]\nnames = ["*"] # <<'), "page.names", "'*'", "write each name out"),
    "a recording as a board": ((BOARD, 'url = "file:DIR/hull.toml" # <<'), "actuators.url", "is a recording"),
    "a recording as a station": ((SDK, 'url = "file:DIR/hull.toml" # <<'), "endpoints 'sdk' url", "is a recording"),
    "a recording as a plotter": (("[system]", 'plotter = "file:DIR/key" # <<\n[system]'), "plotter", "is a recording"),
    "a board that anybody may be": (
        (BOARD, 'url = "udp-listen://0.0.0.0:9999" # <<'),
        "actuators.url",
        "whoever speaks to this port would be the board",
    ),
    "a budget that the line has not": (
        (SDK, 'url = "serial:/dev/ttyUSB5?baud=9600"\nbudget_bytes_per_s = 5000 # <<'),
        "budget_bytes_per_s = 5000",
        "960 bytes/s",
    ),
}
TOLD = {
    # what may be meant and should be looked at: WARNING; the file is not called good
    "a trim that takes a side": (("", '[actuators.board.rudder_port]\nid = "l"\ntrim_us = 200'), "60 % of that side"),
    "a guess for ten seconds": (("", "[estimate]\nposition_hold_s = 10 # <<"), "she sails 15 m by a guess"),
    "a compass that may jump": (("", "[estimate]\nheading_jump_deg = 180 # <<"), "no heading is ever a jump"),
    "one plan's word in the file": (("", "[mission]\nfar_plan = 77 # <<"), "PLAN_FAR_OK"),
    "an operator twice": (("", '[operator]\nids = ["255", "255"] # <<'), "operator.ids: 255 stands there 2 times"),
    "more room from a dinghy than from a ship": (
        ("", "[traffic]\nship_distance_m = 20\nsmall_distance_m = 200 # <<"),
        "were the two exchanged?",
    ),
    "a name longer than a text": (('"sdk"', f'"{"x" * 40}" # <<'), "no room for so long a name"),
    "a loiter that she cannot turn": (("", "[guidance]\nloiter_radius_m = 1 # <<"), "no tighter than 1.2 m"),
    "a compass on a slow line": ((COMPASS, 'url = "serial:/dev/ttyS0?baud=1200" # <<'), "NMEA 0183 begins at 4800"),
    "a station on a slow line": ((SDK, 'url = "serial:/dev/ttyUSB5?baud=4800"'), "the line carries 480"),
    "the module at another rate": (
        ("", '[radio]\nurl = "serial:/dev/ttyUSB0?baud=57600" # <<\nprotocol = "compact"\nkey_file = "DIR/key"'),
        "profile 'o-10' has its module at 9600",
    ),
    "plain MAVLink on slow air": (
        ("", '[radio]\nurl = "serial:/dev/ttyUSB0"\nprotocol = "mavlink" # <<\ninsecure = true'),
        "plain-10",
    ),
    "a door at another's address": (
        (SDK, 'url = "tcp-listen://192.0.2.1:5760" # <<\nlink_class = "telemetry"'),
        "no such address now",
    ),
    "a page at another's address": (("", '[page]\nbind = "192.0.2.1" # <<'), "page.bind = '192.0.2.1'"),
    "a page at another's name": (("", '[page]\nbind = "banana" # <<'), "page.bind = 'banana'", "0.0.0.0 for all"),
    "a door at another's name": (
        (SDK, 'url = "tcp-listen://banana:5760" # <<\nlink_class = "telemetry"'),
        "'banana' is not this computer's name",
    ),
}
NOTED = {
    # what does nothing beside the others: NOTE
    "a chart's cells without a chart": (("", "[depth.map]\npitch_m = 10 # <<"), "depth.map.pitch_m: is not used"),
    "a radio's time without a radio": (("", "[failsafe]\nradio_timeout_s = 90 # <<"), "radio_timeout_s: is not used"),
    "a door opened that is shut": ((QGC, QGC + "\ninsecure = true # <<"), "endpoints 'qgc' insecure: is not used"),
    "level 0's end of line on level 1": (
        ("", '[actuators.board]\nlevel = "1"\nterminator = "" # <<'),
        "terminator: is not used",
    ),
    "sentences kept for no plotter": ((COMPASS, COMPASS + "\nnmea.relay = true # <<"), "nmea.relay: is not used"),
}


def made(tmp_path, case):
    path, line = write(tmp_path, [part for part in case if isinstance(part, tuple)])
    return path, line, [part for part in case if isinstance(part, str)]


@pytest.mark.parametrize("name", REFUSED)
def test_what_nothing_reaches_is_refused_by_both(tmp_path, capsys, name):
    path, line, wanted = made(tmp_path, REFUSED[name])
    said = []
    for command in (["check", str(path)], ["run", str(path), "--duration", "0.1", "--run-dir", str(tmp_path / "run")]):
        assert main(command) == 2
        said.append(capsys.readouterr().err)
    assert said[0] == said[1]
    rows = [row for row in said[0].splitlines()[1:] if all(part in row for part in wanted)]
    assert rows, said[0]
    assert name == "pulses that move nothing" or any(f"line {line}: " in row for row in rows), said[0]
    assert not re.search(r"(sensors|endpoints)\.\d", said[0]), "a number is no name"


@pytest.mark.parametrize("name", TOLD)
def test_what_should_be_looked_at_is_told_with_its_line(tmp_path, capsys, name):
    path, line, wanted = made(tmp_path, TOLD[name])
    assert main(["check", str(path)]) == 0
    told = capsys.readouterr().out
    assert "good" not in told
    rows = [row for row in told.splitlines() if "  WARNING  " in row and all(part in row for part in wanted)]
    assert rows, told
    assert line is None or f"(line {line})" in rows[0], rows


@pytest.mark.parametrize("name", NOTED)
def test_what_does_nothing_is_noted_with_its_line(tmp_path, capsys, name):
    path, line, wanted = made(tmp_path, NOTED[name])
    assert main(["check", str(path)]) == 0
    told = capsys.readouterr().out
    rows = [row for row in told.splitlines() if "  NOTE  " in row and all(part in row for part in wanted)]
    assert [f"(line {line})" in row for row in rows] == [True], told


def test_a_list_or_table_in_which_something_is_wrong_is_named_without_its_kind(tmp_path, capsys):
    path, _ = write(tmp_path, [("", '[operator]\nids = ["qgc"]\n[actuators.board]\nlower_us = 1900\nupper_us = 1100')])
    assert main(["check", str(path)]) == 2
    told = capsys.readouterr().err
    assert "operator.ids: 'qgc' is no station" in told
    assert "actuators.board: lower_us 1900 must be below upper_us 1100" in told


def test_a_boat_that_keeps_nothing_may_be_started_anywhere(tmp_path, capsys, monkeypatch):
    path, _ = write(tmp_path, [('store = "DIR/boat.db"', 'store = ""')])
    monkeypatch.chdir("/")
    assert main(["check", str(path)]) == 0, capsys.readouterr().err
