"""A simulated run, replayed from its recorded inputs: the same bytes, or the first difference with its field."""

from __future__ import annotations

import json
import math
import shutil

import pytest

import config as shipped
from companion.cli import main
from companion.io.recording.inputs import (
    CRC,
    HEAD,
    MAGIC,
    RECORD_META,
    RECORD_STEP,
    RECORD_STORE,
    STEP_HEAD,
    InputReader,
    pack_record,
)
from companion.replay import ReplayError, known_settings, replay, summary
from companion.settings.schema import ConfigError, load
from mavlink_bridge.language.requests import Arm
from sitl.scenario.run import run_scenario
from sitl.world.settings import SimSettings
from sitl.world.world import World


def sail(run_dir, seconds=30.0, seed=3):
    """A short run with everything a replay must cope with: requests, a talking station, links that come and go."""
    settings = load(shipped.path("sim.toml"), ("operator.gcs_required=false",), SimSettings)
    world = World(settings, seed, run_dir=run_dir)
    station = world.ground("gcs")
    for number in range(round(seconds * 20)):
        if number == 100:
            world.app.submit(Arm(True))
        if number % 150 == 140:
            station.unplug("pulled")
        if number % 150 == 149:
            station.plug()
        station.poll(world.now_us)
        station.write(0, bytes([number & 0xFF]) * (number % 7))
        if number % 10 == 3:
            world.loop_app.pump(world.now_us + 20_000)
        world.step()
    world.shutdown(world.now_us)
    return world


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    sail(path)
    return path


def test_a_replay_is_identical(run_dir):
    outcome = replay(run_dir)
    assert outcome.identical, summary(outcome, 1.0)
    assert outcome.ticks == outcome.rows_compared == 600
    assert outcome.writes_compared > 600
    assert not outcome.cut


def test_a_scenario_and_a_run_with_a_plotter_replay_too(tmp_path):
    for name in ("sounder-drop-out", "actuator-cable-pulled"):
        run_scenario(name, run_dir=tmp_path / name)
        assert replay(tmp_path / name).identical
    settings = load(shipped.path("sim.toml"), ("plotter=udp://127.0.0.1:10110",), SimSettings)
    world = World(settings, 1, run_dir=tmp_path / "plotter")
    world.run(3.0)
    world.shutdown(world.now_us)
    assert replay(tmp_path / "plotter").identical


def test_equal_seeds_give_equal_recordings(run_dir, tmp_path):
    sail(tmp_path)
    for name in ("inputs.bin", "events.jsonl", "control.csv", "truth.csv", "mavlink.tlog"):
        assert (tmp_path / name).read_bytes() == (run_dir / name).read_bytes(), name


def test_a_changed_setting_shows_the_first_difference_with_its_field(run_dir):
    outcome = replay(run_dir, changes=["depth.min_altitude_m=3.5"])
    assert not outcome.identical
    first = next(item for item in outcome.differences if item.field == "altitude_limit_m")
    assert (first.tick, first.after) == (1, "3.5")
    assert "altitude_limit_m" in summary(outcome, 1.0)


def test_what_goes_to_a_ground_station_is_compared_field_by_field(run_dir):
    outcome = replay(run_dir, changes=["system.name=other", "depth.min_altitude_m=3.5"])
    fields = {item.field for item in outcome.differences}
    assert any(":" in field for field in fields), fields


def test_a_recording_that_was_cut_replays_up_to_the_cut(run_dir, tmp_path):
    whole = (run_dir / "inputs.bin").read_bytes()
    for name in ("control.csv", "mavlink.tlog"):
        shutil.copy(run_dir / name, tmp_path)
    ends = []
    for share in (0.3, 0.5, 0.99):
        (tmp_path / "inputs.bin").write_bytes(whole[: int(len(whole) * share)])
        outcome = replay(tmp_path)
        assert outcome.identical
        assert outcome.cut
        ends.append(outcome.ticks)
    assert 0 < ends[0] < ends[1] < ends[2] < 600


@pytest.mark.parametrize("content", [None, b"", b"not a recording", b"USVIN\x001\n"])
def test_what_is_no_recording_is_said_to_be_none(tmp_path, content):
    if content is not None:
        (tmp_path / "inputs.bin").write_bytes(content)
    with pytest.raises(ReplayError):
        replay(tmp_path)


def test_the_recording_names_nothing_of_this_machine(run_dir, tmp_path):
    reader = InputReader(run_dir / "inputs.bin")
    text = repr(reader.meta)
    reader.close()
    assert str(run_dir) not in text.replace("RUN_DIR", "")
    assert str(run_dir) not in (run_dir / "events.jsonl").read_text()


def test_keys_of_the_first_release_are_carried_over_and_strange_ones_named(run_dir):
    reader = InputReader(run_dir / "inputs.bin")
    recorded = reader.meta["settings"]
    reader.close()
    assert known_settings(recorded).depth.min_altitude_m == 4.0
    assert known_settings(recorded, ["depth.min_altitude_m=5"]).depth.min_altitude_m == 5.0
    with pytest.raises(ConfigError):
        known_settings(recorded, ["depth.abolished_m=5"])
    recorded["depth"]["abolished_m"] = 3.0
    recorded["endpoints"][0]["colour"] = "blue"
    with pytest.raises(
        ReplayError, match=r"depth\.abolished_m = 3\.0, endpoints\.0\.colour = 'blue'|colour.*abolished"
    ):
        known_settings(recorded)


def changed(run_dir, folder, change):
    """The recording with another description."""
    raw = (run_dir / "inputs.bin").read_bytes()
    length, _ = HEAD.unpack_from(raw, len(MAGIC))
    start = len(MAGIC) + HEAD.size
    meta = json.loads(raw[start : start + length])
    change(meta)
    path = folder / "inputs.bin"
    path.write_bytes(MAGIC + pack_record(RECORD_META, json.dumps(meta).encode()) + raw[start + length + CRC.size :])
    return path


@pytest.mark.parametrize(
    "change",
    [
        lambda meta: meta.pop("vessel"),
        lambda meta: meta.pop("identity"),
        lambda meta: meta["identity"].update(colour="red"),
        lambda meta: meta.update(links=meta["links"][:1]),
        lambda meta: meta.update(links="none"),
        lambda meta: meta.update(settings=None),
        lambda meta: meta.update(vessel=7),
    ],
)
def test_a_recording_that_this_version_cannot_run_is_one_clear_message(run_dir, tmp_path, change, capsys):
    assert main(["replay", str(changed(run_dir, tmp_path, change))]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_recording_of_another_version_says_so(run_dir, tmp_path):
    outcome = replay(changed(run_dir, tmp_path, lambda meta: meta.update(version="0.0.9")))
    assert "recorded by version 0.0.9" in summary(outcome, 1.0)
    outcome = replay(changed(run_dir, tmp_path, lambda meta: meta.update(python="OtherPython")))
    assert "on OtherPython, replayed by" in summary(outcome, 1.0)


A_MINUTE_IN_WIND = """
[scenario]
title = "The way to a circle and a part of it"
duration_s = 60
[settings.world.water]
current_mps = 0.5
wind_mps = 8.0
wave_height_m = 0.3
[[plan.item]]
speed_mps = 1.5
[[plan.item]]
loiter = { north_m = 40.0, east_m = 15.0, radius_m = 20.0, direction = "ccw" }
[[expect]]
no_failsafe = true
"""


def test_another_pythons_last_bits_are_tolerated_and_a_change_is_not(tmp_path, monkeypatch):
    """PyPy makes degrees by a division where CPython multiplies: a nanometre, which feedback makes more of."""
    (tmp_path / "minute.toml").write_text(A_MINUTE_IN_WIND)
    run_scenario(tmp_path / "minute.toml", run_dir=tmp_path)
    monkeypatch.setattr(math, "degrees", lambda angle_rad: angle_rad / (math.pi / 180.0))
    assert not replay(tmp_path).identical
    outcome = replay(tmp_path, tolerant=True)
    assert outcome.identical, summary(outcome, 1.0)
    assert not replay(tmp_path, tolerant=True, changes=["steering.model.heading_damping=0.81"]).identical


def test_another_vessel_file_shows_what_it_would_have_commanded(tmp_path, capsys):
    (tmp_path / "minute.toml").write_text(A_MINUTE_IN_WIND)
    run_scenario(tmp_path / "minute.toml", run_dir=tmp_path)
    own = tmp_path / "own.toml"
    own.write_bytes(shipped.path("vessels", "otter.toml").read_bytes())
    thrusts = {str(own): [], "blueboat": []}
    for name, seen in thrusts.items():
        outcome = replay(
            tmp_path,
            changes=[f"vessel={name}"],
            on_tick=lambda snapshot, seen=seen: seen.append(snapshot.output.thruster_port),
        )
        assert outcome.identical is (name != "blueboat"), "the same hull under another name is the same boat"
    assert any(thrusts["blueboat"])
    assert thrusts["blueboat"] != thrusts[str(own)]
    assert main(["replay", str(tmp_path), "--set", "vessel=no-such"]) == 2
    assert "vessel = 'no-such': no such file" in capsys.readouterr().err


def test_a_step_of_a_later_version_is_said_and_not_guessed(run_dir, tmp_path):
    step = STEP_HEAD.pack(9, 0, 0, 0.0, 0.0, 0)
    path = tmp_path / "inputs.bin"
    raw = (run_dir / "inputs.bin").read_bytes()
    length, _ = HEAD.unpack_from(raw, len(MAGIC))
    description = raw[: len(MAGIC) + HEAD.size + length + CRC.size]
    path.write_bytes(description + pack_record(RECORD_STORE, b"{}") + pack_record(RECORD_STEP, step))
    with pytest.raises(ReplayError, match="none that this version knows"):
        replay(path)
