"""A boat's own file in the simulator: what hangs on its ports is simulated, and nothing of the computer's is touched."""

from __future__ import annotations

import json
import shlex

import config as shipped
from companion.cli import main
from companion.settings.schema import load
from sitl.world.instance import move_instance, moved_words
from sitl.world.settings import SimSettings, at_speed, on_this_computer

BOAT = """
store = ""
[[sensors]]
name = "gps"
url = "tcp://192.168.2.5:3000?silence=5"
[[sensors]]
name = "sounder"
url = "/dev/ttyUSB1?baud=4800"
[actuators]
url = "serial:/dev/ttyACM0?baud=115200"
[radio]
url = "serial:/dev/ttyUSB0?baud=9600"
"""


def test_ports_and_addresses_of_a_boat_become_this_computers(tmp_path):
    path = tmp_path / "boat.toml"
    path.write_text(BOAT)
    settings = on_this_computer(load(path, (), SimSettings))
    assert [item.url for item in settings.sensors] == [
        "tcp://127.0.0.1:3000?silence=5",
        "serial:RUN_DIR/sounder?baud=4800",
    ]
    assert settings.actuators.url == "serial:RUN_DIR/arduino?baud=115200"
    assert settings.radio.url == "serial:RUN_DIR/lora-vessel?baud=9600"


def test_what_is_simulated_already_stays():
    settings = load(shipped.path("sim.toml"), (), SimSettings)
    assert on_this_computer(settings) == settings


def test_a_boats_file_sails_in_the_simulator(tmp_path, capsys):
    words = ["sim", "--config", str(shipped.path("boat.toml")), "--set", "store=", "--speed", "max", "--duration", "3"]
    assert main([*words, "--json", "--run-dir", str(tmp_path / "run")]) == 0
    assert json.loads(capsys.readouterr().out)["duration_s"] == 3.0


def test_a_file_of_recorded_sentences_cannot_be_simulated_and_says_so(tmp_path, capsys):
    words = ["sim", "--config", str(shipped.path("replay-nmea.toml")), "--speed", "max", "--duration", "3"]
    assert main([*words, "--run-dir", str(tmp_path / "run")]) == 2
    assert "cannot serve file:" in capsys.readouterr().err


def test_a_station_keeps_up_with_a_simulation_that_runs_faster():
    settings = load(shipped.path("sim.toml"), (), SimSettings)
    for speed in (None, 0.5, 1.0, 2.0):
        assert at_speed(settings, speed) == settings
    for speed in (3.0, 8.0, 40.0):
        heartbeat_s = speed  # of the vessel's time, one real second apart
        assert at_speed(settings, speed).failsafe.gcs_timeout_s >= 2.5 * heartbeat_s, "not even a warning"
    assert at_speed(settings, 1000.0).failsafe.gcs_timeout_s == 120.0


def test_a_separate_vessel_is_told_where_the_world_of_another_instance_is():
    """The command that was printed called the first instance's compass, which was not there."""
    settings = load(shipped.path("sim.toml"), (), SimSettings)
    moved = move_instance(settings, 7)
    told = shlex.split(" ".join(moved_words(moved, 7)))
    assert set(told[::2]) == {"--set"}
    vessel = load(shipped.path("sim.toml"), told[1::2])
    assert [item.url for item in vessel.sensors] == [item.url for item in moved.sensors]
    assert [item.url for item in vessel.endpoints] == [item.url for item in moved.endpoints]
    assert vessel.system.system_id == moved.system.system_id
    assert moved_words(settings, 0) == []
