"""A simulation of a boat's own file changes not a byte of the boat's; and what ``check`` and ``adopt`` say of a store."""

from __future__ import annotations

import contextlib
import json
import sqlite3

import pytest

import config as shipped
from companion.cli import main
from companion.io.clock import ManualClock
from companion.io.keeping import Store
from companion.io.keeping.content import SaveParam, SavePlan
from companion.io.keeping.keys import write_key
from companion.io.keeping.look import look
from companion.io.keeping.mark import WorldKind
from companion.security import Keeper
from companion.settings import load
from companion.worlds import simulated_content, simulated_store
from mavlink_bridge.language.requests import PlanItem, PlanKind
from sitl.world import SimSettings, World
from tests.replay.first_release import unpack

ITEMS = (PlanItem(16, 6, 0.0, 2.0, 0.1, 1.0, 411822000, -87063000, 0.0),)
SIM = ("--speed", "max", "--duration", "2", "--json")


@pytest.fixture
def boat(tmp_path, monkeypatch):
    """A boat's folder: its file, a store as a killed run leaves it (with a journal), a key, a recorded run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-boat.toml").write_text(shipped.path("boat.toml").read_text())
    store = Store(tmp_path / "state" / "companion.db")
    store.submit(SaveParam("DEPTH_MIN", 1.75))
    store.submit(SavePlan(PlanKind.MISSION, ITEMS))
    store.close()
    with contextlib.closing(sqlite3.connect(tmp_path / "state" / "companion.db")) as connection:
        connection.execute("PRAGMA wal_autocheckpoint=0")
        connection.execute("UPDATE entry SET generation = generation WHERE key = 'DEPTH_MIN'")
        connection.commit()
        journal = (tmp_path / "state" / "companion.db-wal").read_bytes()
    (tmp_path / "state" / "companion.db-wal").write_bytes(journal)
    write_key(tmp_path / "state" / "signing.key", bytes(range(32)))
    (tmp_path / "runs" / "20260101-120000").mkdir(parents=True)
    (tmp_path / "runs" / "20260101-120000" / "run.json").write_text('{"settings": {}}')
    return tmp_path


def everything(folder):
    """Every file of the boat's with its bytes and times; a simulation's own folder is no part of it."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if "runs-sim" not in path.parts and path.is_file():
            found[str(path.relative_to(folder))] = (path.read_bytes(), path.stat().st_mtime_ns)
    return found


@pytest.mark.parametrize(
    "more",
    [
        (),
        ("--copy-store",),
        ("--store", "runs-sim/mine.db"),
        ("--at", "52.1", "4.2", "--water", "9"),
        ("--set", "security.key_file=state/signing.key", "--set", "endpoints.0.link_class=signed"),
        ("--seed", "3", "--set", "record.enabled=false"),
    ],
    ids=" ".join,
)
def test_a_simulation_changes_nothing_of_the_boats(boat, more, capsys):
    before = everything(boat)
    assert main(["sim", "--config", "my-boat.toml", *SIM, *more]) == 0
    assert "runs-sim" in json.loads(capsys.readouterr().out)["run_dir"]
    assert everything(boat) == before


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--store", "state/companion.db"), "a store of a real boat; a simulation leaves it alone"),
        (("--store", "my-boat.toml"), "no store that can be read; a simulation leaves it alone"),
        (("--set", "store=state/companion.db"), "--store F keeps one of its own"),
        (("--run-dir", "runs/20260101-120000"), "holds the run of a real boat"),
        (("--run-dir", "runs/mine"), "stands among the runs of a real boat; give another, such as runs-sim/mine"),
        (("--set", "record.directory=runs"), "stands among the runs of a real boat"),
        (("--at", "52", "4"), "which depth? --water M"),
        (("--at", "-91", "4", "--water", "9"), "latitude -89...89"),
    ],
)
def test_a_boats_files_named_by_hand_are_refused_by_name(boat, more, said, capsys):
    before = everything(boat)
    assert main(["sim", "--config", "my-boat.toml", *SIM, *more]) == 2
    assert said in capsys.readouterr().err
    assert everything(boat) == before


def test_the_copy_holds_parameters_and_plans_and_is_the_simulations_own(boat):
    words = ["sim", "--config", "my-boat.toml", *SIM, "--copy-store", "--store", "mine.db"]
    assert main(words) == 0
    content = look(boat / "mine.db").content
    assert content.world == "simulated"
    assert content.params == {"DEPTH_MIN": 1.75}
    assert content.plans == {PlanKind.MISSION: ITEMS}
    assert content.vessel != look(boat / "state" / "companion.db").content.vessel


def test_a_new_signing_key_of_a_simulation_stays_in_it(boat):
    settings = load(boat / "my-boat.toml", ["security.key_file=state/signing.key"], SimSettings)
    said = []
    keeper = Keeper(settings, simulated_store(None, simulated_content(0)), lambda *text: said.append(text), 0)
    keeper.take_key(b"\x07" * 32)
    assert (boat / "state" / "signing.key").read_bytes() == bytes(range(32))
    assert keeper.state.key == b"\x07" * 32
    assert "simulation" in said[0][1]


def test_equal_seeds_give_equal_vessels_and_no_boat_has_one():
    settings = load(shipped.path("sim.toml"), (), SimSettings)
    one, other, third = (World(settings, seed).app.store.snapshot() for seed in (1, 1, 2))
    assert one.meta == other.meta != third.meta
    assert one.world == "simulated"


@pytest.fixture
def no_waiting(monkeypatch):
    """``companion run`` in virtual time: on a busy machine a second and a half may hold no tick."""
    monkeypatch.setattr("companion.commands.run.SystemClock", ManualClock)


def test_run_sets_a_simulations_store_aside_and_check_foretells_it(boat, no_waiting, capsys, caplog):
    (boat / "state" / "companion.db-wal").unlink()
    (boat / "state" / "companion.db").unlink()
    store = simulated_store(boat / "state" / "companion.db", simulated_content(5))
    store.submit(SaveParam("DEPTH_MIN", 0.5))
    store.close()
    assert main(["check", "my-boat.toml"]) == 0
    assert "written by a simulated vessel: run sets it aside" in capsys.readouterr().out
    quiet = [
        "--set",
        'endpoints=[{name="gcs", url="udp://127.0.0.1:29550"}]',
        "--set",
        'sensors=[{name="gps",url="serial:/dev/none"}]',
        "--set",
        "actuators.url=",
    ]
    assert main(["run", "my-boat.toml", "--duration", "5", *quiet]) == 0
    assert "moved to companion.db.simulated-1" in caplog.text
    assert look(boat / "state" / "companion.db.simulated-1").content.params == {"DEPTH_MIN": 0.5}
    assert look(boat / "state" / "companion.db").content.params == {}
    assert main(["check", "my-boat.toml"]) == 0
    assert "companion store adopt" in capsys.readouterr().out
    assert main(["store", "adopt", "state/companion.db", "--yes"]) == 0
    capsys.readouterr()
    assert main(["check", "my-boat.toml"]) == 0
    assert "adopt" not in capsys.readouterr().out


def test_check_and_run_name_each_parameter_that_the_store_overrules(boat, no_waiting, capsys, caplog):
    before = everything(boat)
    assert main(["check", "my-boat.toml"]) == 0
    assert "WARNING     DEPTH_MIN = 1.75 from the store (file: 4)" in capsys.readouterr().out
    assert everything(boat) == before, "to look is not to touch"
    quiet = [
        "--set",
        'endpoints=[{name="gcs", url="udp://127.0.0.1:29550"}]',
        "--set",
        'sensors=[{name="gps",url="serial:/dev/none"}]',
        "--set",
        "actuators.url=",
    ]
    assert main(["run", "my-boat.toml", "--duration", "5", *quiet]) == 0
    assert caplog.text.count("DEPTH_MIN = 1.75 from the store (file: 4)") == 1


def test_a_run_beside_a_simulated_world_keeps_apart_too(boat, no_waiting):
    (boat / "state" / "companion.db-wal").unlink()
    before = everything(boat)
    quiet = [
        "--set",
        'endpoints=[{name="gcs", url="udp://127.0.0.1:29550"}]',
        "--set",
        'sensors=[{name="gps",url="serial:/dev/none"}]',
        "--set",
        "actuators.url=",
    ]
    assert main(["run", "my-boat.toml", "--simulated", "--duration", "5", *quiet]) == 0
    assert everything(boat) == before
    (run_dir,) = (boat / "runs-sim").iterdir()
    assert look(run_dir / "companion.db").content.world == "simulated"
    assert json.loads((run_dir / "run.json").read_text())["world_kind"] == "simulated"
    assert run_dir.stat().st_mode & 0o777 == 0o750


@pytest.mark.parametrize(("answer", "plans"), [("--yes", 3), ("--forget", 0)])
def test_what_a_first_release_kept_is_shown_and_taken_over_or_dropped(tmp_path, capsys, answer, plans):
    path = unpack("home/companion.db", tmp_path)
    assert main(["store", "adopt", str(path)]) == 1, "nobody was there to say yes"
    shown = capsys.readouterr().out
    for words in (
        "mission    3 items, 41.18510",
        "fence      4 items",
        "rally      2 items",
        "depth      1060 soundings",
    ):
        assert words in shown
    assert look(path).content.world is None, "and nothing was changed"
    assert main(["store", "adopt", str(path), answer]) == 0
    store = Store(path)
    store.close()
    content = store.snapshot()
    assert store.warnings == ()
    assert len(content.plans) == len(content.depth) == plans
    assert len(content.params) == 3
    assert content.old_plans == content.old_depth == {}
    assert main(["store", "adopt", str(path)]) == 0


def test_a_simulations_store_is_not_adopted_and_of_its_export_only_parameters_and_plans_are_taken(tmp_path, capsys):
    sim, real, export = tmp_path / "sim.db", tmp_path / "real.db", tmp_path / "sim.json"
    content = simulated_content(1)
    store = simulated_store(sim, content)
    store.submit(SaveParam("DEPTH_MIN", 2.5))
    store.close()
    assert main(["store", "adopt", str(sim)]) == 2
    assert "written by a simulated vessel" in capsys.readouterr().err
    assert main(["store", "export", str(sim), str(export)]) == 0
    assert main(["store", "import", str(real), str(export)]) == 0
    assert "only its parameters and plans" in capsys.readouterr().err
    taken = look(real).content
    assert (taken.params, taken.world) == ({"DEPTH_MIN": 2.5}, "real")
    assert taken.vessel != content.vessel


def test_the_owners_chart_is_the_bottom_of_a_rehearsal(boat):
    soundings = [f"{4.2 + 1e-4 * i:.6f} {52.1 + 1e-4 * j:.6f} {7 + 0.1 * i:.2f}" for i in range(5) for j in range(5)]
    (boat / "harbour.xyz").write_text("\n".join(soundings))
    words = ["sim", "--config", "my-boat.toml", *SIM, "--set", "depth.map.file=harbour.xyz"]
    assert main([*words, "--at", "52.1002", "4.2002", "--run-dir", "one"]) == 0
    rows = (boat / "one" / "truth.csv").read_text().splitlines()
    depth = rows[0].split(",").index("depth_m")
    assert float(rows[-1].split(",")[depth]) == pytest.approx(7.2, abs=0.25)
    assert main([*words, "--at", "52.2", "4.2", "--run-dir", "two"]) == 2
    assert main([*words, "--at", "52.2", "4.2", "--water", "11", "--run-dir", "two"]) == 0
    assert float((boat / "two" / "truth.csv").read_text().splitlines()[-1].split(",")[depth]) == 11.0
    assert WorldKind(look(boat / "state" / "companion.db").content.world) is WorldKind.REAL
