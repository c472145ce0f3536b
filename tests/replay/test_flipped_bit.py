"""A recording with one flipped bit is never called identical, whichever of its files has it."""

from __future__ import annotations

import random
import shutil

import pytest

import config as shipped
from companion.cli import main
from companion.replay import ReplayError, replay
from companion.settings import load
from mavlink_bridge.language.requests import SetParameter
from sitl.world import SimSettings, World
from tests.replay.first_release import unpack

FLIPS = 4


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory):
    """Three seconds of a vessel, ended in order."""
    path = tmp_path_factory.mktemp("flip") / "run"
    settings = load(shipped.path("sim.toml"), ["operator.gcs_required=false"], SimSettings)
    world = World(settings, 2, run_dir=path, about={"settings": settings.model_dump(mode="json")})
    world.app.submit(SetParameter("DEPTH_MIN", 2.0))
    world.run(3.0)
    world.shutdown(world.now_us)
    return path


def flipped(run_dir, folder, name, at, bit):
    copy = folder / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(run_dir, copy)
    data = bytearray((copy / name).read_bytes())
    data[at] ^= 1 << bit
    (copy / name).write_bytes(data)
    return copy


def test_an_untouched_run_is_identical(run_dir):
    outcome = replay(run_dir)
    assert outcome.identical
    assert outcome.damaged == ()


@pytest.mark.parametrize("name", ["inputs.bin", "control.csv", "mavlink.tlog", "events.jsonl", "run.json"])
def test_one_flipped_bit_anywhere_is_told(run_dir, tmp_path, capsys, name):
    rng = random.Random(name)
    size = (run_dir / name).stat().st_size
    for _ in range(FLIPS):
        copy = flipped(run_dir, tmp_path, name, rng.randrange(size), rng.randrange(8))
        assert main(["replay", str(copy)]) in (1, 2)
        told = capsys.readouterr()
        assert name in told.out + told.err
        assert "identical" not in told.out.splitlines()


def test_inputs_of_a_killed_run_guard_themselves(run_dir, tmp_path, capsys):
    """No run.json says what the file was: every record has its own checksum. A flip between two ticks looks like a cut."""
    rng = random.Random(7)
    size = (run_dir / "inputs.bin").stat().st_size
    for _ in range(2 * FLIPS):
        copy = flipped(run_dir, tmp_path, "inputs.bin", rng.randrange(size), rng.randrange(8))
        (copy / "run.json").unlink()
        try:
            outcome = replay(copy)
        except ReplayError:
            continue
        assert outcome.cut or not outcome.identical


def test_a_run_that_was_cut_by_a_loss_of_power_is_replayed_up_to_there(run_dir, tmp_path):
    copy = flipped(run_dir, tmp_path, "run.json", 0, 0)
    (copy / "run.json").unlink()
    inputs = copy / "inputs.bin"
    inputs.write_bytes(inputs.read_bytes()[:-40])
    outcome = replay(copy)
    assert outcome.cut
    assert outcome.identical, "as far as it goes"


def test_a_run_of_the_first_release_has_no_checksums_and_is_judged_by_what_it_has(tmp_path):
    outcome = replay(unpack("qgc-ardurover", tmp_path))
    assert outcome.damaged == ()
