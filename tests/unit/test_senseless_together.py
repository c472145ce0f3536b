"""Files with many mistakes by other hands: slips of unit, sign and kind, contradictions, hulls that cannot float. All told in one pass."""

from __future__ import annotations

import re

import pytest

import config as shipped
from companion.cli import main
from companion.judge import hull_mistakes
from companion.settings import load_vessel
from tests.unit.test_hull_arrays import HULLS
from tests.unit.test_senseless_configurations import BOARD, BOAT, COMPASS, QGC, SDK

SYSTEM = "[system]"
FILES = {
    # each row: what is changed (nothing: added at the end), by what, what the message on that line must hold. "@": the line, else the last
    "kinds and units": [
        ("system_id = 7", "system_id = 1.5", "system_id = 1.5", "whole number"),
        ('name = "boat"', "name = 2024-01-01", "system.name = 2024-01-01", "in quotes"),
        ('store = "DIR/boat.db"', "store = false", "store = false", "in quotes"),
        (SYSTEM, "depth = false@\n[system]", "depth = false", "[depth]"),
        (SYSTEM, 'radio = "serial:/dev/ttyUSB0"@\n[system]', "radio = ", "[radio]"),
        (BOARD, 'url = "serial:/dev/ttyACM0?baud=9600,8N1"', "actuators.url", "baud=9600,8N1"),
        (COMPASS, 'url = "COM3"', "sensors 'compass' url = 'COM3'", "/dev/ttyS0"),
        ("", "[mission]\ncruise_speed_mps = -1.5", "cruise_speed_mps = -1.5", "at least 0.1"),
        ("", "[failsafe]\ngcs_timeout_s = 5000", "gcs_timeout_s = 5000", "at most 120"),
        ("", "manual_timeout_s = 500", "manual_timeout_s = 500", "at most 5"),
        ("", "[steering.model]\nheading_bandwidth = 126", "heading_bandwidth = 126", "at most 5"),
        ("", "yaw_rate_limit = 25", "yaw_rate_limit = 25", "at most 2"),
        ("", "[gate]\nthruster_max = 100", "thruster_max = 100", "at most 1"),
        ("", "thruster_min = 0.5", "thruster_min = 0.5", "at most 0"),
        ("", "[monitors]\nbattery_low_v = 11800", "battery_low_v = 11800", "at most 1000"),
        ("", "[world]@\nlatitude_deg = 41.0", "world", "companion sim"),
        ("", '[operator]\nids = "255"', "operator.ids = '255'", "in brackets"),
        ("", "[estimate]\nheading_offset_deg = 360", "heading_offset_deg = 360", "at most 180"),
        ("", '[traffic]\nown_mmsi = "263123456"', "own_mmsi", "without quotes"),
    ],
    "kinds and units, on": [
        (SYSTEM, "[System]", "System", "did you mean system?"),
        ("", '[depth]\nmin_altitude_m = "4m"', "min_altitude_m = '4m'", "must be a number"),
        ("", "tide_m = -inf", "tide_m = -inf", "must be a number"),
        ("", 'file = "chart.xyz"', "depth.file", "it belongs in [depth.map]"),
        ("", "[failsafe.conditions.position_lost]\ndelay_s = 1e9", "delay_s = 1e+09", "at most 2"),
        ("", "[actuators.board]\nsilence_ms = 0.5", "silence_ms = 0.5", "whole number"),
        ("", "lower_us = 100", "lower_us = 100", "at least 1000"),
        ("", 'level = "2"', "level = '2'", "'auto', '0' or '1'"),
        ("", '[page]\nbind = "127.0.0.1:8080"', "page.bind = '127.0.0.1:8080'", "port = 8080"),
        ("", 'names = ["http://boat.local"]', "page.names", "'http://boat.local'", "bare"),
        (COMPASS, COMPASS + "\nnmea.heading_latency_s = 120", "heading_latency_s = 120", "at most 1"),
        (QGC, 'url = "udp://[::1:14550"', "endpoints 'qgc' url", "udp://[::1]:14550"),
        (SDK, 'url = "http://127.0.0.1:5760"', "unknown kind 'http'", "tcp-listen"),
        ('directory = "DIR/runs"', 'directory = "$HOME/runs"', "record.directory = '$HOME/runs'", "the whole path"),
    ],
    "what undoes itself": [
        (COMPASS, COMPASS + '\nnmea.talkers = ["GN", "-GN"]', "sensors 'compass' nmea.talkers", "wants and forbids GN"),
        ('store = "DIR/boat.db"', 'store = "DIR/boat.toml"', "boat.toml", "this very configuration"),
        (QGC, 'url = "udp://127.0.0.1:14550?local=14550"', "endpoints 'qgc' url", "only itself"),
        (SDK, 'url = "tcp-listen://127.0.0.1:8080"'),
        ("", "[page]\nport = 8080", "page.port = 8080", "endpoints 'sdk' listens on it"),
        ("", 'bind = "lo"', "page.bind = 'lo'", "is an interface"),
        ("", '[failsafe]\ngcs_action = "stop"\ngcs_then_action = "warn"', "gcs_then_action = 'warn'", "never be taken"),
        ("", "radio_timeout_s = 20", "radio_timeout_s = 20", "every 30 s", "65"),
        ("", '[radio]\nurl = "serial:/dev/ttyUSB0"\nkey_file = "DIR/key"\nprotocol = "compact"'),
        ("", "[guidance.follow]\nspeed_min_mps = 2.5", "speed_min_mps = 2.5", "cruise_speed_mps 1.5"),
        ("", "[guidance.station]\nspeed_mps = 5", "speed_mps = 5", "at most 3."),
        ("", "[depth]\nslow_least_mps = 2.5", "slow_least_mps = 2.5", "cruise_speed_mps 1.5"),
        ("", "[monitors]\nstuck_share = 1", "stuck_share = 1", "0.25"),
        (
            "",
            '[actuators.board.thruster_port]\nid = "m"\nencoding = "duty"\nus_zero = 1520',
            "us_zero = 1520",
            "leave out",
        ),
        ("", '[actuators.board]\nlevel = "0"\nsketch = "read-line"\nterminator = "\\r\\n"', "terminator", "leave out"),
    ],
    "what undoes itself, on": [
        (COMPASS, COMPASS + '\nnmea.sentences = "GGA,HDM,DPT"'),
        ("", "[estimate]\nworld_magnetic_model = false", "world_magnetic_model = false", "variation_deg"),
        ('store = "DIR/boat.db"', 'store = ":memory:"', "store = ':memory:'", 'store = ""'),
        ('name = "sdk"', 'name = "s\\ndk"', "endpoints 's\\ndk' name", "no screen shows"),
        (QGC, 'url = "udp://127.0.0.1:14550?local=14600"'),
        (SDK, 'url = "udp://127.0.0.1:14540?local=14600"', "endpoints 's\\ndk' url", "hears at port 14600"),
        ("", '[security]\nkey_file = "DIR/key"\n[page]\nkey_file = "DIR/key"', "page.key_file", "make one for each"),
        ("", '[steering]\nprofile = "seed"\nseed.heading_gains.kp = 1\nseed.speed_gains.kp = 1'),
        ("", "seed.max_thruster_output = 0", "max_thruster_output = 0", "never go ahead"),
        ("", "seed.high_speed_hysteresis_kn = 5", "high_speed_hysteresis_kn = 5", "high_speed_threshold_kn 1"),
        (BOARD, 'url = "tcp://my board:5000"', "actuators.url", "'my board' can be no host's name"),
    ],
    "what takes away what another asks for": [
        ("", '[depth]\nrequired = true\nunknown_policy = "ignore"', "unknown_policy = 'ignore'", "required = false"),
        ("", "[gate]\nthruster_max = 0.2", "thruster_max = 0.2", "m/s, and mission.cruise_speed_mps is 1.5"),
        ("", "[traffic]\nship_distance_m = 300@\nshown_range_m = 100", "ship_distance_m = 300", "shown_range_m 100"),
        ('"DIR/boat.db"', '"/proc/boat.db"', "store = '/proc/boat.db'", "belongs to the system"),
        ('"DIR/runs"', '"/"', "record.directory = '/'", "a folder of the boat's own"),
    ],
    "a brake without thrust": [
        (BOARD, 'url = "serial:/dev/ttyACM0?baud=2400"'),
        ("", "[estimate]\nheading_rate_max_dps = 20", "heading_rate_max_dps = 20", "26 deg/s"),
        ("", "[actuators.board]\nfrequency_hz = 20", "frequency_hz = 20", "the line has 2400"),
        ("", "[gate]\nthruster_min = 0\n[depth]\nbrake = true", "depth.brake = true", "gate.thruster_min = 0"),
    ],
    "a store that would eat the key": [
        ('store = "DIR/boat.db"', 'store = "DIR/key"', "store = ", "is security.key_file"),
        (SDK, SDK + '\nlink_class = "signed"'),
        ("", '[security]\nkey_file = "DIR/key"'),
        ('"DIR/runs"', '"/dev/null"', "record.directory = '/dev/null'", "is a device"),
    ],
}
HULL = 'vessel = "DIR/hull.toml"'
HULL_FILES = {
    "centimetres and radians": [
        ("keel_depth_m = 0.35", "keel_depth_m = 19", "keel_depth_m = 19", "centimetres"),
        ("transducer_depth_m = 0.20", "transducer_depth_m = 35", "transducer_depth_m = 35", "at most 20"),
        ("lateral_m = 0.395", "lateral_m = 39.5", "lateral_m = 39.5", "beam_m 1.08"),
        ("max_deg = 30.0", "max_deg = 0.52", "max_deg = 0.52", "30 degrees"),
        ("munk = 0.5", "munk = 50", "hull.munk = 50", "at most 1"),
    ],
    "centimetres, radians, milliseconds": [
        ("transducer_depth_m = 0.20", "transducer_depth_m = 20", "transducer_depth_m = 20", "centimetres"),
        ("[hull]", "[antenna]\nup_m = 45@\n[hull]", "antenna.up_m = 45", "a mast"),
        ("[antenna]", "[antenna]\nforward_m = 30", "antenna.forward_m = 30", "off a hull of 2 m"),
        ("diameter_m = 0.18", "diameter_m = 18", "diameter_m = 18", "metres"),
        ("lag_s = 0.15", "lag_s = 150", "thruster.lag_s = 150", "milliseconds"),
        ("x_m = -0.95", "x_m = -95", "rudder.x_m = -95", "metres"),
        ("area_m2 = 0.010", "area_m2 = 100", "rudder.area_m2 = 100", "cm2"),
        ("rate_dps = 60.0", "rate_dps = 1.05", "rudder.rate_dps = 1.05", "29 s"),
        ("stall_deg = 35.0", "stall_deg = 0.61", "stall_deg = 0.61", "35 degrees"),
        ("lag_s = 0.10", "lag_s = 100", "rudder.lag_s = 100", "milliseconds"),
        ("frontal_m2 = 0.45", "frontal_m2 = 4500", "frontal_m2 = 4500", "square metres"),
        ("astern_n = 66.7", "astern_n = 6670", "astern_n = 6670", "times ahead_n"),
    ],
    "signs and shares": [
        ("transducer_depth_m = 0.20", "transducer_depth_m = -0.2", "transducer_depth_m = -0.2", "positive down"),
        ("[hull]", "[antenna]\nup_m = -2@\n[hull]", "antenna.up_m = -2", "above the waterline"),
        ("keel_depth_m = 0.35", "keel_depth_m = 0.1", "keel_depth_m = 0.1", "lowest point"),
        ("max_deg = 30.0", "max_deg = 10.0\noffset_deg = 18", "offset_deg = 18", "max_deg 10"),
        ("m11_kg = 85.5", "m11_kg = 5.5", "m11_kg = 5.5", "about 85.6"),
        ("m33_kgm2 = 42.6", "m33_kgm2 = 0.01", "m33_kgm2 = 0.01", "about 34"),
        ("ahead_n = 119.6", "ahead_n = 119600", "ahead_n = 119600", "newtons"),
    ],
    "nothing holds her": [
        ("xu = 25.0", "xu = 0", "hull.xu = 0", "coast for ever"),
        ("yv = 162.5", "yv = 0", "hull.yv = 0", "sliding sideways"),
        ("yvv = 200.0", "yvv = 0"),
        ("nr = 42.6", "nr = 0", "hull.nr = 0", "from turning"),
        ("nrr = 426.0", "nrr = 0"),
        ("m23_kgm = 12.25", "m23_kgm = 500", "m23_kgm = 500", "0 when not known"),
        ("count = 2\nlateral_m", "count = 1@\nlateral_m", "thruster.count = 1", "nothing steers her"),
        ("[rudder]\ncount = 2", "[rudder]\ncount = 0"),
    ],
    "a digit too many": [
        ("yv = 162.5", "yv = 16250.0", "hull.yv = 16250", "100 1/s of m22_kg"),
        ("nr = 42.6", "nr = 4260", "hull.nr = 4260", "too few in m33_kgm2"),
        ("nrr = 426.0", "nrr = 42600", "hull.nrr = 42600", "1/rad"),
    ],
    "grams": [
        ("mass_kg = 80.0", "mass_kg = 80000.0", "mass_kg = 80000", "432 kg"),
        ("ahead_n = 119.6", "ahead_n = 0.1196", "ahead_n = 0.1196", "newtons"),
        ("lateral_m = 0.395", "lateral_m = 0"),
        ("[rudder]\ncount = 2", "[rudder]\ncount = 0"),
        ("[thruster]\ncount = 2", "[thruster]\ncount = 2", "thruster.count = 2", "nothing steers her"),
    ],
    "centimetres of hull": [
        ("length_m = 2.0", "length_m = 200.0"),
        ("mass_kg = 80.0", "mass_kg = 80.0", "mass_kg = 80", "200 x 1.08 x 0.195 m"),
    ],
    "a barge on end": [
        ("beam_m = 1.08", "beam_m = 10.8", "beam_m = 10.8", "length_m 2"),
        ("draught_m = 0.195", "draught_m = 19.5", "draught_m = 19.5", "length_m 2"),
    ],
    "no numbers": [
        ("xu = 25.0", "xu = nan", "hull.xu = nan", "must be a number"),
        ("x_m = -0.95", "x_m = 0.95", "rudder.x_m = 0.95", "below 0"),
        ("cx = 0.7", "cx = true", "windage.cx = true", "number"),
        (
            "dead_band = 0.03",
            "dead_band = 0.03\ncurve = [[-1, -1], [0, 0], [0.9, 0.1], [0.95, 0.05], [1, 1]]",
            "curve",
            "rise",
        ),
    ],
}


def spoilt(text, rows):
    """The text with every row's change in it, the wanted parts, and the line on which each stands."""
    wanted = []
    for number, (old, new, *parts) in enumerate(rows):
        assert old in text, old
        mark = f" # <<{number}"
        new = (new.replace("@", mark) if "@" in new else f"{new}{mark}") if parts else new
        text = text.replace(old, new, 1) if old else f"{text}{new}\n"
        wanted.append((mark, parts))
    lines = text.splitlines()
    return text, [
        (next(number for number, line in enumerate(lines, 1) if re.search(rf"{mark}\b", line)), parts)
        for mark, parts in wanted
        if parts
    ]


def told_by_both(path, capsys):
    """What ``check`` says of a file, and ``run`` too."""
    said = []
    for words in (["check", str(path)], ["run", str(path), "--duration", "0.1", "--run-dir", str(path.parent / "run")]):
        assert main(words) == 2
        told = capsys.readouterr()
        assert "good" not in told.out
        said.append(told.err)
    assert said[0] == said[1], "both judge alike"
    assert not (path.parent / "run").exists()
    return said[0].splitlines()[1:]


def boat(tmp_path, text):
    (tmp_path / "key").write_bytes(bytes(range(32)))
    (tmp_path / "key").chmod(0o600)
    path = tmp_path / "boat.toml"
    path.write_text(text.replace("DIR", str(tmp_path)))
    return path


@pytest.mark.parametrize("name", FILES)
def test_all_of_them_are_told_at_once_with_line_key_value_and_mend(tmp_path, capsys, name):
    text, wanted = spoilt(BOAT, FILES[name])
    told = told_by_both(boat(tmp_path, text), capsys)
    for line, parts in wanted:
        assert any(f"line {line}: " in row and all(part in row for part in parts) for row in told), (line, parts, told)


@pytest.mark.parametrize("name", HULL_FILES)
def test_a_hull_that_cannot_be_is_told_with_its_own_files_lines(tmp_path, capsys, name):
    text, wanted = spoilt(shipped.path("vessels", "otter.toml").read_text(), HULL_FILES[name])
    (tmp_path / "hull.toml").write_text(text)
    told = told_by_both(boat(tmp_path, BOAT.replace('vessel = "otter"', HULL)), capsys)
    for line, parts in wanted:
        assert any(f"hull.toml: line {line}: " in row and all(part in row for part in parts) for row in told), (
            line,
            parts,
            told,
        )


def test_no_hull_that_the_house_sails_is_refused():
    assert {name: found for name, hull in HULLS.items() if (found := hull_mistakes(hull))} == {}
    assert hull_mistakes(load_vessel("otter").scaled(mass=1.5, drag=3.0, thrust=0.4)) == [], "laden, fouled, weak"


def test_a_sounder_below_the_lowest_point_is_told(tmp_path, capsys):
    """It was called good, and 1.65 m more water told under the keel than there was under the sounder."""
    hull = (
        shipped.path("vessels", "otter.toml").read_text().replace("transducer_depth_m = 0.20", "transducer_depth_m = 2")
    )
    path = boat(tmp_path, BOAT.replace('vessel = "otter"', HULL))
    for keel, warned in (("0.35", True), ("2.0", False)):
        (tmp_path / "hull.toml").write_text(hull.replace("keel_depth_m = 0.35", f"keel_depth_m = {keel}"))
        assert main(["check", str(path)]) == 0
        told = capsys.readouterr().out
        assert ("transducer_depth_m = 2: the sounder would hang 1.65 m below the lowest point" in told) == warned


def test_a_hull_that_nothing_damps_at_cruise_is_told(tmp_path, capsys):
    """A catamaran measured by turns on the spot alone sailed her legs by metres."""
    hull = shipped.path("vessels", "otter.toml").read_text()
    path = boat(tmp_path, BOAT.replace('vessel = "otter"', HULL))
    for damping, warned in (("nr = 4.26", True), ("nr = 4.26\nnur = 30.0", False)):
        (tmp_path / "hull.toml").write_text(hull.replace("nr = 42.6", damping))
        assert main(["check", str(path)]) == 0
        assert ("hull.nur = 0 beside nr 4.26" in capsys.readouterr().out) == warned


def test_a_wrong_hull_hides_nothing_of_the_boats_own_file(tmp_path, capsys):
    text = (
        BOAT.replace('vessel = "otter"', 'vessel = "ottre"')
        + "[depth]\nmin_altitude_m = 400\n[gate]\nthruster_max = 0\n"
    )
    told = "\n".join(told_by_both(boat(tmp_path, text), capsys))
    for part in ("ottre", "min_altitude_m = 400", "thruster_max = 0"):
        assert part in told


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (BOAT + "[system]\nsystem_id = 4\n", 19, "'[system]': this section stands above already"),
        (BOAT.replace("system_id = 7", "system_id = 7\nsystem_id = 8"), 6, "'system_id = 8': this key stands above"),
        (BOAT.replace('name = "boat"', 'name = "boat'), 4, "'name = \"boat': the text has no second quotation mark"),
        (BOAT.replace("system_id = 7", "system_id = seven"), 5, "'system_id = seven': is no value"),
        ("vessel: otter\n", 1, "'vessel: otter': is no TOML; write key = value"),
        ('{"vessel": "otter"}', 1, "is no TOML; write key = value, or [section]"),
    ],
)
def test_what_is_no_toml_is_shown_with_its_line_and_the_mend(tmp_path, capsys, text, line, says):
    (row,) = told_by_both(boat(tmp_path, text), capsys)
    assert f"line {line}: not valid TOML: " in row
    assert says in row


def test_a_file_of_another_encoding_is_told(tmp_path, capsys):
    path = boat(tmp_path, BOAT)
    path.write_bytes(BOAT.encode("utf-16"))
    assert "save it as UTF-8" in told_by_both(path, capsys)[0]


def test_a_store_that_names_the_boats_own_files_moves_none_of_them(tmp_path, capsys):
    path = boat(tmp_path, BOAT.replace("DIR/boat.db", "DIR/boat.toml"))
    before = path.read_bytes()
    told_by_both(path, capsys)
    assert path.read_bytes() == before
