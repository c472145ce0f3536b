"""No command writes over what it reads, nor over a store, a configuration or a recording: by no name and no link."""

from __future__ import annotations

import json
import os

import pytest

from companion.cli import main
from companion.commands.outputs import may_write
from companion.commands.store import write_store
from companion.io.keeping.content import SaveParam, entries_of
from companion.settings import ConfigError
from mavlink_bridge.language.messages import Goto
from mavlink_bridge.mavlink.missions.plan_export import items_from_maneuvers
from mavlink_bridge.plans import PlanFile, write_plan

BOAT = '# a boat\nvessel = "otter"\n\n[steering.seed.heading_gains]\nkp = 1.8\n'


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A boat's folder: a store, a configuration, a chart, a plan, a recording, and links to some."""
    monkeypatch.chdir(tmp_path)
    assert write_store(tmp_path / "boat.db", entries_of(SaveParam("DEPTH_MIN", 3.0)))
    (tmp_path / "boat.toml").write_text(BOAT)
    (tmp_path / "c.xyz").write_text("-8.7 41.18 5.0\n")
    route = [Goto(0, 0.71880, -0.1519), Goto(1, 0.71881, -0.1519)]
    (tmp_path / "a.plan").write_text(write_plan(PlanFile(items_from_maneuvers(route))))
    run = tmp_path / "run"
    run.mkdir()
    (run / "run.json").write_text(json.dumps({"format": 1}))
    (run / "inputs.bin").write_bytes(b"USVIN")
    (run / "control.csv").write_text("t_s\n0\n")
    (run / "mavlink.tlog").write_bytes(b"")
    (tmp_path / "soft.html").symlink_to(run / "inputs.bin")
    os.link(run / "mavlink.tlog", tmp_path / "hard.html")
    (tmp_path / "soft.plan").symlink_to("a.plan")
    return tmp_path


def held(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("words", "out", "said"),
    [
        (["store", "export", "boat.db", "boat.db"], "boat.db", "is what this command reads"),
        (["store", "export", "boat.db", "boat.toml"], "boat.toml", "a TOML file of another kind"),
        (["depth", "export", "boat.db", "boat.db"], "boat.db", "is what this command reads"),
        (["depth", "convert", "c.xyz", "c.xyz", "--crs", "EPSG:4326"], "c.xyz", "is what this command reads"),
        (["tune", "gains", "-o", "boat.toml"], "boat.toml", "a TOML file of another kind"),
        (["tune", "gains", "boat.toml", "-o", "boat.toml"], "boat.toml", "is what this command reads"),
        (["report", "run", "-o", "run/inputs.bin"], "run/inputs.bin", "is what this command reads"),
        (["report", "run", "-o", "soft.html"], "soft.html", "is what this command reads"),
        (["report", "run", "-o", "hard.html"], "hard.html", "is what this command reads"),
        (["report", "run", "--picture", "run/control.csv"], "run/control.csv", "is what this command reads"),
        (["report", "run/mavlink.tlog", "-o", "run/mavlink.tlog"], "run/mavlink.tlog", "is what this command reads"),
        (["report", "run/mavlink.tlog", "-o", "run/inputs.bin"], "run/inputs.bin", "part of a recording"),
        (["report", "run", "-o", "boat.db"], "boat.db", "a boat's store"),
        (["plan", "check", "a.plan", "--svg", "a.plan"], "a.plan", "is what this command reads"),
        (["plan", "check", "a.plan", "--svg", "boat.toml"], "boat.toml", "a TOML file of another kind"),
        (["plan", "convert", "a.plan", "soft.plan"], "soft.plan", "is what this command reads"),
        (["keys", "make", "boat.db", "--replace"], "boat.db", "a boat's store"),
        (
            ["lora", "bench", "/dev/null", "rate=656", "--codes", "boat.toml"],
            "boat.toml",
            "a TOML file of another kind",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_it_is_refused_by_path_and_mend_and_everything_stays(files, capsys, words, out, said):
    """Each had been done without a question: store, configuration, recording or chart were gone."""
    if words[1] == "convert" and words[0] == "depth":
        pytest.importorskip("rasterio")
    before = held(files)
    assert main(words) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"{out}: ")
    assert said in told
    assert "name another file" in told
    assert held(files) == before


def test_what_a_command_made_itself_it_makes_again(files):
    for name, text in (("new.html", ""), ("old.svg", "<svg/>"), ("old.json", "{}"), ("old.xyz", "-8.7 41.18 5.0\n")):
        (files / name).write_text(text)
        may_write(files / name, files / "boat.db")
    (files / "gains.toml").write_text("[steering.seed.heading_gains]\nkp = 1.8\n")
    may_write(files / "gains.toml", files / "boat.toml", is_own=lambda tables: tables.keys() == {"steering"})
    for absent in (None, files / "none.html", files / "run"):
        may_write(absent, files / "run", None)
    (files / "broken.toml").write_text("vessel = otter")
    with pytest.raises(ConfigError, match="TOML"):
        may_write(files / "broken.toml")


@pytest.mark.parametrize("name", ["new.bin", "new.tlog", "new.jsonl"])
def test_the_ending_of_a_recording_is_refused_at_once_and_not_at_the_second_time(files, capsys, name):
    for _ in range(2):
        assert main(["depth", "export", "boat.db", name]) == 2
        told = capsys.readouterr().err
        assert told.startswith(f"{name}: ")
        assert "name another file" in told
        assert not (files / name).exists()


def test_a_file_that_is_nested_beyond_reading_is_judged_by_its_name(files):
    for name in ("deep.txt", "deep.toml"):
        (files / name).write_text("x=" + "[" * 20_000)
    may_write(files / "deep.txt")
    with pytest.raises(ConfigError, match="TOML"):
        may_write(files / "deep.toml")


def test_drawing_a_plan_twice_and_exporting_twice_works(files):
    for _ in range(2):
        assert main(["plan", "check", "a.plan", "--svg", "a.svg"]) == 0
        assert main(["store", "export", "boat.db", "a.json"]) == 0
        assert main(["plan", "convert", "a.plan", "b.plan"]) == 0
    assert (files / "a.svg").read_text().startswith("<svg")
