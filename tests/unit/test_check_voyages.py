"""``companion check --voyage``: a file that fits is said to fit; fouling, load and a weak propeller are told by how much."""

import math

import numpy as np
import pytest

import config
from companion.cli import main
from companion.core.trial import TrialConfig
from companion.io.recording.input_recorder import InputRecorder
from companion.tuning.compare import Comparison, Share, _attributed, compare
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


def sailed(vessel, file, seed=1, sea=SEA):
    sail_trial(vessel, sea, TrialConfig(quick=True), file, seed=seed, source=SensedState(seed))
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


def run_of(folder, table, vessel):
    """A run's folder that holds this record, sailed by this file."""
    folder.mkdir()
    (folder / "control.csv").write_text("".join(table.splitlines(keepends=True)[:2200]))
    head = bytearray()
    InputRecorder(head.extend).start({"settings": {}, "vessel": vessel.model_dump(mode="json")})
    (folder / "inputs.bin").write_bytes(head)
    return folder


def test_a_voyage_that_was_sailed_by_another_file_accuses_nobody(tmp_path, capsys):
    """A true file was told that its boat is 26 % lighter, and a way to rest that is a third too short."""
    table = sailed(worn(shipped("blueboat"), drag=1.4), tmp_path / "fouled.csv").read_text()
    other, own = (run_of(tmp_path / name, table, shipped(name)) for name in ("otter", "blueboat"))
    assert main([*CHECK, "--voyage", str(other)]) == 0
    told = capsys.readouterr().out
    assert f"{other}: sailed by another hull file ('{shipped('otter').name}')" in told
    assert "undecided" in told
    assert "NO LONGER" not in told
    assert "way to rest" not in told
    assert main([*CHECK, "--voyage", str(other), str(own)]) == 1
    told = capsys.readouterr().out
    assert "left out" in told
    assert "NO LONGER   the drag is" in told


@pytest.mark.parametrize(
    ("found_m", "between_m", "runs_on"),
    [(3.2, (2.8, 3.6), False), (3.4, (3.1, 3.7), True), (3.05, (3.01, 3.09), False), (2.0, (1.8, 2.2), False)],
)
def test_a_way_to_rest_is_longer_when_its_interval_is_and_then_the_file_does_not_fit(found_m, between_m, runs_on):
    """3.2 m of 3.0 was warned of and called a fit in one breath."""
    compared = _compared((3.0, found_m), between_m, {})
    assert (compared.runs_on, compared.fits) == (runs_on, not runs_on)


def test_a_voyage_that_is_none_is_named(tmp_path, capsys):
    run = tmp_path / "short.csv"
    run.write_text("t_s,heading_deg\n0,1\n")
    assert main([*CHECK, "--voyage", str(run)]) == 2
    assert "short.csv" in capsys.readouterr().err


def _compared(rest_m, between_m, shares):
    return Comparison(400.0, (1.6, 1.6), rest_m, rest_between_m=between_m, shares=shares)


def _shares(**more):
    usual = dict.fromkeys(("thrust", "drag", "turning", "starboard_share", "area"), 0.0)
    shares = {k: Share(v, 0.05) for k, v in (usual | more).items()}
    return _compared((4.0, 4.0), (3.8, 4.2), shares).findings


def test_load_is_told_once_though_it_shows_in_all_that_acts_against_inertia():
    assert _shares(thrust=-0.22, drag=-0.21, turning=-0.26, area=-0.2) == (
        "the boat is about 27 % heavier than the file says: load",
    )


def test_a_fouled_hull_that_is_also_loaded_is_told_as_both():
    told = _shares(thrust=-0.22, drag=-0.21, turning=0.4)
    assert len(told) == 2
    assert told[1].startswith("what damps turning is 40 %")


def straight_leg(file):
    """200 s along one course, by a law that answers gusts."""
    rows = ["t_s,heading_deg,thruster_port,thruster_starboard,speed_mps,yaw_rate_dps,lat_deg,lon_deg"]
    north_m = 0.0
    for k in range(2000):
        wave = math.sin(0.1 * k)
        north_m += 0.1 * (1.0 + 0.2 * wave)
        command = f"{0.4 - 0.2 * wave:.4f}"
        turned = f"{5.0 * wave:.3f},{command},{command},{1.0 + 0.2 * wave:.4f},{5.0 * math.cos(0.1 * k):.3f}"
        rows.append(f"{0.1 * k:.1f},{turned},{50.0 + north_m / 111_200.0:.8f},8.0")
    file.write_text("\n".join(rows) + "\n")
    return file


def test_one_straight_leg_tells_nothing_and_accuses_nobody(tmp_path, capsys):
    """Sound boats on one leg were told of weaker propellers and looser rudders, three times in ten."""
    assert main([*CHECK, "--voyage", str(straight_leg(tmp_path / "leg.csv"))]) == 0
    told = capsys.readouterr().out
    assert "cannot tell whether the file fits these voyages: she keeps one course: sail turns" in told
    assert "fits        " not in told
    assert "NO LONGER" not in told


def test_the_same_record_given_twice_is_named_and_taken_once(tmp_path, capsys):
    one, copy = straight_leg(tmp_path / "one.csv"), straight_leg(tmp_path / "copy.csv")
    assert main([*CHECK, "--voyage", str(one), str(copy), str(one)]) == 0
    told = capsys.readouterr().out
    assert f"{copy}: the same record as {one}, taken once" in told
    assert f"{one}: given twice, taken once" in told
    assert "voyages     192 s" in told


def test_what_is_told_more_widely_than_its_bar_is_no_evidence_for_the_file():
    """ "The file fits" stood beside a speed that was a quarter too low, because drag was known within half."""
    shares = {"thrust": Share(0.01, 0.05), "drag": Share(0.4, 0.5), "turning": Share(-0.1, 0.4)}
    found = _compared((4.0, 4.0), (2.0, 8.0), shares)
    assert found.findings == ()
    assert (
        found.unclear == "drag within ± 50 %, damping of turning within ± 40 %; sail turns and two speeds in calm water"
    )
    assert _compared((4.0, 4.0), (3.8, 4.2), {"drag": Share(0.02, 0.1)}).unclear == ""


def attributed(thrust, drag, spread=0.05, scale=0.06):
    return _attributed(np.array([thrust, drag]), spread**2 * np.eye(2) + scale**2)


def test_a_ratio_of_thrust_and_drag_is_told_as_one_cause_with_what_looks_the_same():
    """A fouled hull that looked a tenth too heavy was told of worn propellers."""
    found = attributed(-0.08, 0.25)
    assert not found.thrust.more
    assert found.drag.more == pytest.approx(0.35, abs=0.05)
    assert not found.either
    found = attributed(-0.08, 0.25, scale=0.3)
    assert found.drag.more == pytest.approx(0.38, abs=0.05)
    assert found.either
    compared = Comparison(
        400.0, (1.6, 1.4), (4.0, 3.0), (2.0, 5.0), {"thrust": found.thrust, "drag": found.drag}, found.either
    )
    assert compared.findings[0].endswith("fouling, or something in tow; or the propellers give less")


def test_a_change_of_scale_is_load_after_a_trial_and_nothing_after_a_voyage_in_a_blow():
    """A sound boat that answered gusts was told to be twice as heavy."""
    found = attributed(-0.24, -0.25)
    assert found.thrust == found.drag
    assert found.thrust.more == pytest.approx(-0.22, abs=0.02)
    found = attributed(-0.67, -0.71, spread=0.08, scale=0.4)
    for share, bar in ((found.thrust, 0.08), (found.drag, 0.15)):
        assert not share.stands_out(bar)


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


@pytest.mark.soak
@pytest.mark.parametrize("name", ["otter", "blueboat", "wamv"])
@pytest.mark.parametrize("seed", range(1, 4))
def test_a_sound_boat_in_a_blow_is_accused_of_nothing(tmp_path, name, seed):
    blow = WaterConfig(current_mps=0.3, wind_mps=9.0, wave_height_m=0.2)
    found = compare(shipped(name), read_voyage(sailed(shipped(name), tmp_path / "a.csv", seed, blow)))
    assert found.fits, (found.findings, found.rest_between_m)
