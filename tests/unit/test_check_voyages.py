"""``companion check --voyage``: a file that fits is said to fit; fouling, load and a weak propeller are told by how much."""

import pytest

import config
from companion.cli import main
from companion.core.trial import TrialConfig
from companion.tuning.compare import Comparison, Share, compare
from companion.tuning.voyages import read_voyage
from sitl.plant import WaterConfig
from sitl.plant.library import load_vessel as shipped
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.trial_cells import sail_trial

SEA = WaterConfig(current_mps=0.3, wind_mps=4.0, wave_height_m=0.1)
CHECK = ["check", str(config.path("boat.toml")), "--set", 'vessel="blueboat"']
MASSES = ("m11_kg", "m22_kg", "m23_kgm", "m33_kgm2")


def worn(vessel, *, drag=1.0, mass=1.0, starboard=1.0):
    hull = {"xu": drag * vessel.hull.xu, "xuu": drag * vessel.hull.xuu}
    hull |= {name: mass * getattr(vessel.hull, name) for name in MASSES}
    thruster = vessel.thruster.model_copy(update={"starboard_share": starboard})
    return vessel.model_copy(update={"hull": vessel.hull.model_copy(update=hull), "thruster": thruster})


def sailed(vessel, file, seed=1):
    sail_trial(vessel, SEA, TrialConfig(quick=True), file, seed=seed, source=SensedState(seed))
    return file


def test_fouling_is_told_with_its_size_and_the_command_fails(tmp_path, capsys):
    whole = sailed(worn(shipped("blueboat"), drag=1.4), tmp_path / "fouled.csv").read_text()
    run = tmp_path / "part.csv"
    run.write_text("".join(whole.splitlines(keepends=True)[:2200]))
    assert main([*CHECK, "--voyage", str(run)]) == 1
    told = capsys.readouterr().out
    assert "NO LONGER   the drag is" in told
    assert "fouling" in told
    assert "fit it anew" in told


def test_a_voyage_that_is_none_is_named(tmp_path, capsys):
    run = tmp_path / "short.csv"
    run.write_text("t_s,heading_deg\n0,1\n")
    assert main([*CHECK, "--voyage", str(run)]) == 2
    assert "short.csv" in capsys.readouterr().err


def _shares(**more):
    usual = dict.fromkeys(("thrust", "drag", "turning", "starboard_share", "area"), 0.0)
    return Comparison(400.0, (1.6, 1.6), (4.0, 4.0), {k: Share(v, 0.05) for k, v in (usual | more).items()}).findings


def test_load_is_told_once_though_it_shows_in_all_that_acts_against_inertia():
    assert _shares(thrust=-0.22, drag=-0.21, turning=-0.26, area=-0.2) == (
        "the boat is about 27 % heavier than the file says: load",
    )


def test_a_fouled_hull_that_is_also_loaded_is_told_as_both():
    told = _shares(thrust=-0.22, drag=-0.21, turning=0.4)
    assert len(told) == 2
    assert told[1].startswith("what damps turning is 40 %")


@pytest.mark.soak
@pytest.mark.parametrize("name", ["otter", "blueboat", "wamv"])
@pytest.mark.parametrize("seed", range(1, 6))
def test_a_file_that_is_true_fits(tmp_path, name, seed):
    assert compare(shipped(name), read_voyage(sailed(shipped(name), tmp_path / "a.csv", seed))).findings == ()


@pytest.mark.soak
@pytest.mark.parametrize("name", ["otter", "blueboat", "wamv"])
@pytest.mark.parametrize(
    ("change", "word"), [({"drag": 1.4}, "drag"), ({"mass": 1.3}, "heavier"), ({"starboard": 0.75}, "starboard")]
)
def test_each_change_is_told_by_its_name(tmp_path, name, change, word):
    found = compare(shipped(name), read_voyage(sailed(worn(shipped(name), **change), tmp_path / "a.csv")))
    assert len(found.findings) == 1, found
    assert word in found.findings[0]
