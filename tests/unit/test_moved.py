"""Old keys: a settings file is told each new place at once, a recording is carried over, a store's parameter is named."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest

from companion.core.hull.vessel_file import VesselConfig
from companion.facade import SettingsParams
from companion.settings.moved import MOVES, carry_over, parameter_told
from companion.settings.params import entries
from companion.settings.schema import ConfigError, SensorConfig, Settings, load, load_vessel
from sitl.world.settings import SimSettings

OLD_FILE = """
[[sensors]]
name = "compass"
[sensors.nmea]
transducer_depth_m = 0.3
keel_depth_m = 0.8
[depth]
beam_m = 2.0
[depth.input]
transducer_depth_m = 0.3
keel_depth_m = 0.8
[estimate]
antenna_forward_m = 1.0
antenna_starboard_m = -0.2
antenna_up_m = 2.0
[gate]
control_period_s = 0.1
rudder_max_deg = 25.0
[monitors]
control_period_s = 0.1
rudder_max_deg = 25.0
[actuators.board]
rudder_max_deg = 25.0
[modes]
manual_timeout_s = 0.6
guided_timeout_s = 2.0
[world.sensors]
transducer_depth_m = 0.3
antenna_forward_m = 1.0
antenna_starboard_m = -0.2
antenna_up_m = 2.0
"""
WHERE = {
    "depth.input.keel_depth_m = 0.8": "keel_depth_m = 0.8",
    "sensors 'compass' nmea.transducer_depth_m = 0.3": "[mounts.NAME]",
    "depth.beam_m = 2.0": "hull.beam_m = 2.0",
    "estimate.antenna_up_m = 2.0": "antenna.up_m = 2.0",
    "gate.rudder_max_deg = 25.0": "rudder.max_deg = 25.0",
    "actuators.board.rudder_max_deg = 25.0": "rudder.max_deg = 25.0",
    "monitors.control_period_s = 0.1": "system.tick_hz = 10",
    "modes.guided_timeout_s = 2.0": "failsafe.guided_timeout_s = 2.0",
    "world.sensors.antenna_forward_m = 1.0": "antenna.forward_m = 1.0",
}


def test_an_old_file_is_told_every_new_place_at_once(tmp_path: Path) -> None:
    path = tmp_path / "old.toml"
    path.write_text(OLD_FILE)
    with pytest.raises(ConfigError) as caught:
        load(path, model=SimSettings)
    told = caught.value.mistakes
    assert len(told) == len(MOVES) == 19
    for key, place in WHERE.items():
        (line,) = [mistake for mistake in told if f": {key}:" in mistake]
        assert place in line
    assert not [mistake for mistake in told if "no such key" in mistake]


def test_no_old_key_is_a_key_again() -> None:
    hull = VesselConfig.model_fields
    for move in MOVES:
        if move.hull:
            assert move.new.split(".")[0] in hull
    names = {entry.param.name for entry in entries(Settings)}
    assert not names & {move.parameter for move in MOVES}


def recorded() -> tuple[dict[str, object], dict[str, object]]:
    settings = Settings(sensors=(SensorConfig(),)).model_dump(mode="json")
    vessel = load_vessel("otter").model_dump(mode="json")
    del vessel["antenna"], vessel["mounts"]
    return settings, vessel


def put(data: dict[str, object], key: str, value: object) -> None:
    *tables, name = key.replace("*", "0").split(".")
    place: object = data
    for table in tables:
        place = place[int(table)] if isinstance(place, list) else place.setdefault(table, {})  # type: ignore[attr-defined]
    place[name] = value  # type: ignore[index]


DEFAULTS = {
    "keel_depth_m": 0.35,
    "transducer_depth_m": 0.2,
    "hull.beam_m": 1.1,
    "rudder.max_deg": 30.0,
    "system.tick_hz": 0.05,
    "failsafe.manual_timeout_s": 0.5,
    "failsafe.guided_timeout_s": 3.0,
}


def test_a_recording_of_the_first_release_is_carried_over_without_a_word() -> None:
    settings, vessel = recorded()
    new = copy.deepcopy(settings)
    for move in MOVES:
        put(settings, move.old, DEFAULTS.get(move.new, 0.0))
    assert carry_over(settings, vessel) == []
    del settings["world"]
    assert settings == new
    assert VesselConfig.model_validate(vessel).hull.beam_m == 1.1


def test_what_the_first_release_sailed_by_wins_and_contradictions_are_told() -> None:
    settings, vessel = recorded()
    put(settings, "depth.input.keel_depth_m", 1.2)
    put(settings, "sensors.0.nmea.keel_depth_m", 0.35)
    put(settings, "gate.rudder_max_deg", 20.0)
    put(settings, "gate.control_period_s", 0.1)
    told = carry_over(settings, vessel)
    hull = VesselConfig.model_validate(vessel)
    assert (hull.keel_depth_m, hull.rudder.max_deg) == (1.2, 20.0)
    assert told == [
        "sensors.0.nmea.keel_depth_m = 0.35 gave way to keel_depth_m = 1.2",
        "the hull's rudder.max_deg = 30 gave way to gate.rudder_max_deg = 20",
        "gate.control_period_s = 0.1 gave way to system.tick_hz = 20",
    ]


def test_a_stored_parameter_of_old_names_its_new_home() -> None:
    assert parameter_told("KEEL_DEPTH", 0.8) == "KEEL_DEPTH = 0.8 counts no more: the hull file's keel_depth_m does"
    with pytest.raises(ValueError, match=r"GUIDED_TIMEOUT = 3 counts no more: .*failsafe\.guided_timeout_s"):
        SettingsParams(Settings()).change("GUIDED_TIMEOUT", 3.0)
    with pytest.raises(ValueError, match="no parameter NEVER_WAS"):
        SettingsParams(Settings()).change("NEVER_WAS", 1.0)
