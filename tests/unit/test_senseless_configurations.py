"""Configurations that cannot be meant: none is called good, by ``check`` or by ``run``, and each is told with line, key, value and mend."""

from __future__ import annotations

import re

import pytest

from companion.cli import main

BOAT = """\
vessel = "otter"
store = "DIR/boat.db"
[system]
name = "boat"
system_id = 7
[[sensors]]
name = "compass"
url = "serial:/dev/ttyS0?baud=115200"
[actuators]
url = "serial:/dev/ttyACM0?baud=115200"
[[endpoints]]
name = "qgc"
url = "udp://127.0.0.1:14550"
[[endpoints]]
name = "sdk"
url = "tcp-listen://127.0.0.1:5760"
[record]
directory = "DIR/runs"
"""
COMPASS = 'url = "serial:/dev/ttyS0?baud=115200"'
BOARD = 'url = "serial:/dev/ttyACM0?baud=115200"'
QGC = 'url = "udp://127.0.0.1:14550"'
SDK = 'url = "tcp-listen://127.0.0.1:5760"'
ONLY_QGC = '[[endpoints]]\nname = "sdk"\nurl = "tcp-listen://127.0.0.1:5760"\n'

CASES = {
    # what is changed -> by what; what the message must hold. The line is the one with "<<" behind it.
    "compass and board on one port": (
        (BOARD, COMPASS + " # <<"),
        "actuators.url",
        "/dev/ttyS0",
        "sensors 'compass' url has",
    ),
    "one port by two names": ((BOARD, 'url = "/dev/../dev/ttyS0" # <<'), "actuators.url", "one device serves one"),
    "station on the compass' port": ((QGC, COMPASS + " # <<"), "endpoints 'qgc' url", "one device"),
    "radio on the board's port": (
        ("", '[radio]\nurl = "serial:/dev/ttyACM0?baud=9600" # <<'),
        "radio.url",
        "one device",
    ),
    "two compasses on one port": (
        ("[actuators]", f'[[sensors]]\nname = "two"\n{COMPASS} # <<\n[actuators]'),
        "sensors 'two' url",
        "one device",
    ),
    "no sensors": (('[[sensors]]\nname = "compass"\n' + COMPASS + "\n", ""), "sensors", "missing", "[[sensors]]"),
    "a sensor without an address": ((COMPASS + "\n", ""), "sensors 'compass' url", "missing"),
    "cruise above the top speed": (
        ("", "[mission]\ncruise_speed_mps = 15 # <<"),
        "cruise_speed_mps = 15",
        "at most 3.",
    ),
    "return above the top speed": (("", "[modes]\nreturn_speed_mps = 9 # <<"), "return_speed_mps = 9", "at most 3."),
    "a guard in centimetres": (("", "[depth]\nmin_altitude_m = 400 # <<"), "min_altitude_m = 400", "centimetres"),
    "a switch as a text": (("", '[operator]\ngcs_required = "no" # <<'), "gcs_required = 'no'", "true or false"),
    "a switch as a number": (("", "[operator]\ngcs_required = 0 # <<"), "gcs_required = 0", "true or false"),
    "another switch as a text": (("", '[depth]\nenabled = "off" # <<'), "depth.enabled = 'off'", "true or false"),
    "a number as a text": (("system_id = 7", 'system_id = "7" # <<'), "system_id = '7'", "without quotes"),
    "a number as a switch": (("", "[mission]\ncruise_speed_mps = true # <<"), "cruise_speed_mps = true", "number"),
    "a number with a decimal comma": (("", '[mission]\ncruise_speed_mps = "1,5" # <<'), "'1,5'", "without quotes"),
    "two stations at one address": ((SDK, QGC + " # <<"), "endpoints 'sdk' url", "endpoints 'qgc' url", "its own port"),
    "two compasses from one server": (
        ((COMPASS, 'url = "tcp://10.0.0.5:3000"\n[[sensors]]\nname = "b"\nurl = "tcp://10.0.0.5:3000" # <<')),
        "sensors 'b' url",
        "this address already",
    ),
    "two doors on one port": (
        (QGC, 'url = "tcp-listen://0.0.0.0:5760"'),
        "endpoints 'sdk' url",
        "listens on port 5760",
    ),
    "a station that is the program itself": ((QGC, 'url = "tcp://127.0.0.1:5760"'), "of this very program"),
    "a plotter that feeds the compass": (
        (COMPASS, 'url = "udp-listen://127.0.0.1:10110"'),
        ("[system]", 'plotter = "udp://127.0.0.1:10110" # <<\n[system]'),
        "plotter",
        "of this very program",
    ),
    "nobody's address": ((QGC, 'url = "udp://0.0.0.0:14550" # <<'), "endpoints 'qgc' url", "nobody's address"),
    "everybody's address": ((QGC, 'url = "udp://255.255.255.255:14550" # <<'), "everybody's address"),
    "a group's address": ((QGC, 'url = "udp://239.1.2.3:14550" # <<'), "group's address"),
    "port nought": ((QGC, 'url = "udp://127.0.0.1:0" # <<'), "port 0"),
    "an unknown option": ((COMPASS, 'url = "serial:/dev/ttyS0?buad=115200" # <<'), "no option buad", "baud"),
    "an unknown kind": ((QGC, 'url = "upd://127.0.0.1:14550" # <<'), "unknown kind 'upd'", "udp"),
    "an address without a port": ((QGC, 'url = "udp://127.0.0.1" # <<'), "needs a host and a port"),
    "a file that is not there": ((COMPASS, 'url = "file:/nowhere/log.nmea" # <<'), "no such file"),
    "a slip in a key": (("system_id = 7", "sytem_id = 7 # <<"), "system.sytem_id", "did you mean system_id?"),
    "a key of another section": (("", "[guidance]\ncruise_speed_mps = 2 # <<"), "it belongs in [mission]"),
    "a slip in a section": (("[actuators]", "[actuator] # <<"), "actuator", "did you mean actuators?"),
    "a key at the top that belongs below": (("[system]", "system_id = 3 # <<\n[system]"), "it belongs in [system]"),
    "dashes": (("system_id = 7", "system-id = 7 # <<"), "did you mean system_id?"),
    "one bracket": (("[[sensors]]", "[sensors] # <<"), "sensors", "[[sensors]]"),
    "two brackets": (("[actuators]", "[[actuators]] # <<"), "actuators", "[actuators]"),
    "a name twice": (('name = "sdk"', 'name = "qgc" # <<'), "name = 'qgc'", "give each link its own"),
    "a compass called as a station": (
        ('name = "sdk"', 'name = "compass" # <<'),
        "endpoints 'compass' name",
        "is the name of",
    ),
    "a compass called radio": (
        ('name = "compass"', 'name = "radio" # <<'),
        "sensors 'radio' name",
        "part of the program",
    ),
    "an empty name": (('name = "sdk"', 'name = "" # <<'), "name = ''", "is empty"),
    "nobody to give orders": (
        (QGC, QGC + '\nlink_class = "telemetry"'),
        (ONLY_QGC, ""),
        "endpoints",
        "nobody could arm",
    ),
    "no station at all": (
        ('[[endpoints]]\nname = "qgc"\n' + QGC + "\n" + ONLY_QGC, ""),
        "endpoints",
        "there is none",
    ),
    "an open door": (
        (SDK, 'url = "tcp-listen://0.0.0.0:5760" # <<'),
        "endpoints 'sdk'",
        "can be reached by other machines",
    ),
    "open and closed at once": (
        (SDK, SDK + '\nlink_class = "telemetry"\ninsecure = true # <<'),
        "insecure = true",
        "one of the two",
    ),
    "signed without a key": ((SDK, SDK + '\nlink_class = "signed"'), "endpoints 'sdk'", "companion keys make"),
    "a class that there is not": ((SDK, SDK + '\nlink_class = "sigend" # <<'), "'sigend'", "signed"),
    "a key that is not there": (("", '[security]\nkey_file = "/nowhere/k" # <<'), "security.key_file", "/nowhere/k"),
    "one key for two links": (
        (
            "",
            '[security]\nkey_file = "DIR/key"\n[radio]\nurl = "serial:/dev/ttyUSB0"\nprotocol = "compact"\nkey_file = "DIR/key" # <<',
        ),
        (SDK, SDK + '\nlink_class = "signed"'),
        "radio.key_file",
        "make one for each",
    ),
    "a key for a radio that there is not": (("", '[radio]\nkey_file = "DIR/key" # <<'), "radio.key_file", "radio.url"),
    "a key for a radio that uses none": (
        ("", '[radio]\nurl = "serial:/dev/ttyUSB0"\nkey_file = "DIR/key"\nprotocol = "json" # <<'),
        "radio.protocol = 'json'",
        "compact",
    ),
    "a signing key that signs nothing": (
        ("", '[security]\nkey_file = "DIR/key" # <<'),
        "security.key_file",
        "no endpoint",
    ),
    "commands slower than the board waits": (
        ("", "[actuators.board]\nfrequency_hz = 1 # <<"),
        "frequency_hz = 1",
        "silence_ms",
    ),
    "commands faster than ticks": (
        ("", "[actuators.board]\nfrequency_hz = 40 # <<"),
        "frequency_hz = 40",
        "tick_hz 20",
    ),
    "no thrust ahead": (("", "[gate]\nthruster_max = 0 # <<"), "thruster_max = 0", "never go ahead"),
    "a level-0 sketch on level 1": (
        ("", '[actuators.board]\nlevel = "1"\nsketch = "parse-int" # <<'),
        "sketch = 'parse-int'",
        "level",
    ),
    "one thruster twice": (("", '[actuators.board]\nthruster_port.id = "M"'), "actuators.board", "one each"),
    "a guard that is off and required": (
        ("", "[depth]\nenabled = false\nrequired = true # <<"),
        "required = true",
        "enabled = true",
    ),
    "a leg shorter than the first way": (
        ("", "[mission]\nleg_distance_m = 200 # <<"),
        "leg_distance_m = 200",
        "first_distance_m",
    ),
    "gains that swing": (("", "[steering.model]\nspeed_gain = 5.0\nspeed_integral = 2.0"), "steering.model", "speed"),
    "a hull that there is not": (('vessel = "otter"', 'vessel = "ottre" # <<'), "vessel = 'ottre'", "shipped"),
    "a hull file with slips": (('vessel = "otter"', 'vessel = "DIR/hull.toml"'), "hull.toml", "line 2", "mass_kg"),
    "a law that there is not": (("", '[steering]\nprofile = "modle" # <<'), "steering.profile = 'modle'", "model"),
    "a radio profile that there is not": (
        ("", '[radio]\nurl = "serial:/dev/ttyUSB0"\nprofile = "o-11" # <<'),
        "o-11",
        "o-10",
    ),
    "a chart that is not there": (("", '[depth.map]\nfile = "/nowhere/chart.xyz" # <<'), "depth.map.file", "chart.xyz"),
    "a sentence that there is not": (
        (COMPASS, COMPASS + '\nnmea.sentences = "GGA,FOO" # <<'),
        "no sentence FOO",
        "GGA",
    ),
    "out of range": (("system_id = 7", "system_id = 300 # <<"), "system_id = 300", "at most 250"),
    "no number at all": (("", "[mission]\ncruise_speed_mps = nan # <<"), "cruise_speed_mps", "number"),
    "a failsafe that there is not": (("", '[failsafe]\ngcs_action = "hodl" # <<'), "gcs_action", "hold"),
    "a key of the first release": (
        ("", "[actuators.board]\nallow_level0 = true # <<"),
        "allow_level0 = true",
        "docs/ACTUATORS.md",
    ),
    # values that undo each other
    "a battery that stops before it warns": (
        ("", "[monitors]\nbattery_low_v = 11.0\nbattery_critical_v = 12.0 # <<"),
        "battery_critical_v = 12",
        "less than battery_low_v 11",
    ),
    "an empty battery above a low one": (
        ("", "[monitors]\nbattery_low_v = 12\nbattery_empty_v = 13 # <<"),
        "battery_empty_v = 13",
        "battery_low_v 12",
    ),
    "late after very late": (("", "[monitors]\nlate_s = 2 # <<"), "late_s = 2", "very_late_s 0.5"),
    "frozen before it is warned of": (
        ("", "[estimate]\nfrozen_warn_s = 20 # <<"),
        "frozen_warn_s = 20",
        "frozen_invalid_s 10",
    ),
    "a sounder's range the wrong way round": (
        ("", "[depth.input]\nrange_min_m = 10 # <<\nrange_max_m = 5"),
        "range_min_m = 10",
        "range_max_m 5",
    ),
    "a guard deeper than the sounder hears": (
        ("", "[depth.input]\nrange_max_m = 3 # <<"),
        "range_max_m = 3",
        "at least 4.3 for a guard of 4 m",
    ),
    "a guard that locks on the ground": (
        ("", "[depth]\nmin_altitude_m = 1\nminimum_margin_m = 3 # <<"),
        "minimum_margin_m = 3",
        "after the keel has touched",
    ),
    "slow faster than the boat": (
        ("", '[depth]\nunknown_policy = "slow"\nunknown_speed_mps = 5 # <<'),
        "unknown_speed_mps = 5",
        "at most 3.",
    ),
    "a speed that counts as a jump": (
        ("", "[estimate]\nspeed_max_mps = 1 # <<"),
        "speed_max_mps = 1",
        "refused as jumps",
    ),
    "thrust within the dead band": (
        ("", "[gate]\nthruster_max = 0.02 # <<"),
        "thruster_max = 0.02",
        "dead_band is 0.03",
    ),
    "a rudder that takes a minute": (
        ("", "[gate]\nrudder_rate_degps = 0.5 # <<"),
        "rudder_rate_degps = 0.5",
        "at least 3 deg/s, or 0",
    ),
    "a thruster that takes a minute": (("", "[gate]\nthruster_rate = 0.01 # <<"), "thruster_rate = 0.01", "or 0"),
    "traffic that is off and required": (
        ("", "[traffic]\nenabled = false\nrequired = true # <<"),
        "required = true",
        "traffic.enabled = true",
    ),
    "a transponder's number cut short": (("", "[traffic]\nown_mmsi = 12345 # <<"), "own_mmsi = 12345", "nine digits"),
    "a compass that gives no position": (
        (COMPASS, COMPASS + '\nnmea.sentences = "HDT" # <<'),
        "no sentence with a position",
        "add one",
    ),
    "a receiver that gives no heading": (
        (COMPASS, COMPASS + '\nnmea.sentences = "GGA,RMC" # <<'),
        "no sentence with a heading",
        "add one",
    ),
    "all headings forbidden": (
        (COMPASS, COMPASS + '\nnmea.sentences = "-HDT,-THS,-HDG,-HDM,-PASHR,-PSAT,-PSXN,-PTNL,-PSTI,-PTNTHTM" # <<'),
        "no sentence with a heading",
    ),
    "talkers as a text": ((COMPASS, COMPASS + '\nnmea.talkers = "GN" # <<'), "nmea.talkers = 'GN'", "talkers = [...]"),
    "two baud rates": ((COMPASS, COMPASS + "\nbaud = 4800 # <<"), "baud = 4800", "leave out one of the two"),
    "a baud rate twice": (
        (COMPASS, 'url = "serial:/dev/ttyS0?baud=115200&baud=4800" # <<'),
        "said twice",
        "leave out one",
    ),
    "a device without its folder": ((COMPASS, 'url = "serial:ttyS0?baud=4800" # <<'), "was /dev/ttyS0 meant?"),
    "a folder for a device": ((COMPASS, 'url = "serial:/dev" # <<'), "is no serial port", "by-id"),
    "a text file for a device": ((COMPASS, 'url = "serial:DIR/hull.toml" # <<'), "is no serial port"),
    "nowhere for a device": ((COMPASS, 'url = "serial:/dev/null" # <<'), "is no serial port"),
    "an address beyond 255": (
        (QGC, 'url = "udp://192.168.1.300:14550" # <<\ninsecure = true'),
        "is no address",
        "0 to 255",
    ),
    "an operator who is the boat": (("", '[operator]\nids = ["7"] # <<'), "operator.ids", "this vessel itself"),
    "a nameless boat": (('name = "boat"', 'name = "" # <<'), "system.name = ''", "give the boat a name"),
    "a name that moves the cursor": (('name = "boat"', 'name = "a\\u001b[31m" # <<'), "system.name", "no screen shows"),
    "a store in a folder of its name": (('"DIR/boat.db"', '"DIR/sub/" # <<'), "sub/'", "name a file"),
    "a store on the web": (('"DIR/boat.db"', '"http://x/y.db" # <<'), "http://x/y.db", "give a path"),
    "a store at home": (('"DIR/boat.db"', '"~/boat.db" # <<'), "store = '~/boat.db'", "the whole path"),
    "runs nowhere": (('"DIR/runs"', '"" # <<'), "record.directory = ''", "record.enabled = false"),
    "runs in the store": (('"DIR/runs"', '"DIR/boat.db" # <<'), "record.directory", "a folder of their own"),
    "a gain that steers away": (
        ("", '[steering]\nprofile = "seed"\nseed.speed_gains.kp = 1\nseed.heading_gains.kp = -1 # <<'),
        "heading_gains.kp = -1",
        "at least 0",
    ),
    "gains of nothing": (
        ("", '[steering]\nprofile = "seed"\nseed.heading_gains.kp = 1\nseed.speed_gains.kp = 0 # <<'),
        "speed_gains.kp = 0",
        "nothing follows",
    ),
    "a slip in a condition": (
        ("", '[failsafe.conditions.actuator_lots] # <<\naction = "stop"'),
        "failsafe.conditions.actuator_lots",
        "did you mean actuator_lost?",
    ),
    "a condition below its floor": (
        ("", '[failsafe.conditions.position_lost]\naction = "warn" # <<'),
        "failsafe.conditions.position_lost.action = warn",
        "at least stop",
    ),
}


def write(tmp_path, edits):
    text = BOAT
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1) if old else text + new + "\n"
    text = text.replace("DIR", str(tmp_path))
    (tmp_path / "key").write_bytes(bytes(range(32)))
    (tmp_path / "key").chmod(0o600)
    (tmp_path / "hull.toml").write_text('name = "x"\nmas_kg = 3\n[hull]\nmass_kg = "4"\n')
    path = tmp_path / "boat.toml"
    path.write_text(text)
    return path, next((number for number, line in enumerate(text.splitlines(), 1) if "# <<" in line), None)


def test_the_boat_itself_is_good(tmp_path, capsys):
    path, _ = write(tmp_path, [])
    assert main(["check", str(path)]) == 0
    assert f"{path}: good" in capsys.readouterr().out


@pytest.mark.parametrize("name", CASES)
def test_it_is_refused_with_line_key_value_and_mend(tmp_path, capsys, name):
    edits = [part for part in CASES[name] if isinstance(part, tuple)]
    wanted = [part for part in CASES[name] if isinstance(part, str)]
    path, line = write(tmp_path, edits)
    said = []
    for command in (["check", str(path)], ["run", str(path), "--duration", "0.1", "--run-dir", str(tmp_path / "run")]):
        assert main(command) == 2
        told = capsys.readouterr()
        assert "good" not in told.out
        said.append(told.err)
    assert said[0] == said[1], "both judge alike"
    assert not (tmp_path / "run").exists()
    mistakes = [row for row in said[0].splitlines()[1:] if all(part in row for part in wanted)]
    assert mistakes, said[0]
    if line is not None:
        assert any(f"line {line}: " in row for row in mistakes), said[0]
    assert not re.search(r"(sensors|endpoints)\.\d", said[0]), "a number is no name"


MANY = """\
vessel = "ottre"
[system]
sytem_id = 3
[sensors]
url = "x"
[actuators]
url = "serial:/dev/ttyACM0?buad=1"
[[endpoints]]
name = "qgc"
url = "udp:nowhere"
[[endpoints]]
name = "sdk"
url = "udp://0.0.0.0:1"
[[endpoints]]
nme = "x"
[guidance]
cruise_speed_mps = 2
[mission]
cruise_speed_mps = 0.0001
[operator]
gcs_required = "no"
[depth]
min_altitude_m = 400
map.file = "/nowhere/chart.xyz"
[security]
key_file = "/nowhere/key"
[radio]
url = "serial:/dev/ttyUSB0"
profile = "o-11"
"""


MENDED = """\
vessel = "otter"
[system]
system_id = 3
[[sensors]]
url = "serial:/dev/ttyS0"
[actuators]
url = "serial:/dev/ttyACM0?baud=115200"
[[endpoints]]
name = "qgc"
url = "udp://127.0.0.1:14550"
[mission]
cruise_speed_mps = 2
[depth]
min_altitude_m = 4
[radio]
url = "serial:/dev/ttyUSB0"
profile = "o-10"
insecure = true
"""
"""The same file after its owner has done what each line says, and no more."""


def test_all_mistakes_are_told_in_one_pass_in_the_order_of_the_file(tmp_path, capsys):
    path = tmp_path / "many.toml"
    path.write_text(MANY)
    assert main(["check", str(path)]) == 2
    told = capsys.readouterr().err.splitlines()[1:]
    lines = [int(match[1]) for row in told if (match := re.match(r"  line (\d+): ", row))]
    assert lines == sorted(lines)
    assert {1, 3, 4, 7, 10, 13, 15, 17, 19, 21, 23, 24, 26, 29} <= set(lines), "\n".join(told)
    path.write_text(MENDED)
    assert main(["check", str(path)]) == 0, "what was told is all there was: " + capsys.readouterr().err


@pytest.mark.parametrize(
    ("edits", "says"),
    [
        ([(COMPASS, 'url = "serial:/dev/ttyS0?baud=500000"')], "500000 baud is unusual; was 460800 meant?"),
        ([('store = "DIR/boat.db"', 'store = "/proc/nowhere/boat.db"')], "store = '/proc/nowhere/boat.db'"),
        ([('store = "DIR/boat.db"', 'store = "DIR"')], "is a folder; name a file"),
        ([('directory = "DIR/runs"', 'directory = "DIR/key"')], "record.directory"),
        ([("", "[operator]\ngcs_required = false")], "nothing happens when the ground station is lost"),
        ([("", '[failsafe]\ngcs_action = "warn"\ngcs_then_action = "none"')], "as gcs_then_action does no more"),
        ([("", "[operator]\nstore_required = false")], "is lost with the power"),
        ([("", "[estimate]\nposition_timeout_s = 10")], "she sails 15 m before a silent sensor counts as lost"),
        ([(COMPASS, COMPASS + "\ninsecure = true")], "a serial line has one sender"),
        ([("", "[depth]\nenabled = false")], "no depth guard"),
        ([("", '[depth]\nunknown_policy = "ignore"')], "when the sounder is silent"),
        ([("", '[actuators.board]\nlevel = "0"')], "does not stop if this computer dies"),
        ([("", "[estimate]\naccept_simulated = true")], "for the bench only"),
        ([("", "[depth]\nmin_altitude_m = 0")], "when the keel touches"),
        ([("", "[fence]\nenabled = false")], "no fence is kept"),
        ([("[actuators]\n" + BOARD + "\n", "")], "actuators.url: not said"),
        ([('"DIR/boat.db"', '"DIR/key"')], "run leaves it alone and keeps nothing"),
        ([(COMPASS, 'url = "file:DIR/key"')], "a recording says where the boat is"),
        ([(COMPASS, COMPASS + '\nnmea.sentences = "GGA,HDT"')], "depth.enabled = true: no sensor's nmea.sentences let"),
        ([("", "free_floor_mb = 1000000000")], "record.free_floor_mb = 1000000000: the disk has"),
        (
            [(COMPASS, COMPASS + "\nnmea.heading_latency_s = 0.3"), ("", "[steering.model]\nheading_late_s = 0.05")],
            "heading_late_s = 0.05: a sensor's nmea.heading_latency_s is 0.3",
        ),
    ],
)
def test_what_a_person_should_look_at_is_told_and_not_called_good(tmp_path, capsys, edits, says):
    path, _ = write(tmp_path, edits)
    assert main(["check", str(path)]) == 0
    told = capsys.readouterr().out
    assert says in told
    assert "WARNING" in told
    assert "good" not in told


@pytest.mark.parametrize(
    ("edits", "says"),
    [
        ([], "not there now"),
        ([(COMPASS, 'url = "tcp://127.0.0.1:3000"')], "where a simulator on this computer"),
        ([("", "[steering.seed.speed_gains]\nkp = 0.6")], "steering.seed: is not used, profile is 'model'"),
    ],
)
def test_what_may_well_be_meant_is_noted(tmp_path, capsys, edits, says):
    path, _ = write(tmp_path, [(BOARD, 'url = "serial:/dev/nothing-here"'), *edits])
    assert main(["check", str(path)]) == 0
    told = capsys.readouterr().out
    assert any(row.strip().startswith("NOTE  ") and says in row for row in told.splitlines()), told
    assert "NOTE        actuators.url" in told
