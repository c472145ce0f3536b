"""``companion depth``: what the vessel has sounded comes out as XYZ and GeoJSON, goes in again, and can be forgotten."""

from __future__ import annotations

import json
import math

import pytest

from companion.cli import main
from companion.commands.store import write_store
from companion.core.guard.depth.grid import offset
from companion.core.guard.depth.memory import DepthMemory, DepthMemoryConfig
from companion.core.guard.depth.soundings import parse_xyz
from companion.io.keeping.content import SaveDepth, SaveParam, entries_of
from companion.io.keeping.depth_store import join_key, soundings_of
from companion.io.keeping.store import Store
from mavlink_bridge.language.messages import EstimatedState

HERE = (0.7188, -0.1519)


@pytest.fixture
def store(tmp_path):
    """A store with soundings every metre along 100 m, a slope from 10 to 5 m, 3 readings each."""
    memory = DepthMemory(DepthMemoryConfig(), 0.05)
    for i in range(300):
        lat, lon = offset(*HERE, i / 3.0, 0.0)
        memory.note(EstimatedState(0, lat_rad=lat, lon_rad=lon), 0, 10.0 - i / 60.0, 1_800_000_000 + i)
    memory.close_cell()
    tiles = tuple((join_key(2.0, key), tile) for key, tile in memory.take_changes(100)[0])
    path = tmp_path / "companion.db"
    assert write_store(path, [*entries_of(SaveDepth(tiles)), *entries_of(SaveParam("DEPTH_MIN", 3.0))])
    return path


def content(path):
    store = Store(path)
    store.close()
    assert store.warnings == ()
    return store.snapshot()


def test_xyz_is_what_a_chart_program_and_the_vessel_itself_read(store, tmp_path, capsys):
    assert main(["depth", "export", str(store)]) == 0
    text = capsys.readouterr().out
    found = parse_xyz(text)
    assert 50 <= len(found) <= 60
    assert all(5.0 <= each.depth_m <= 10.0 for each in found)
    assert math.degrees(HERE[0]) < math.degrees(found[0].lat_rad) + 1e-4
    first = text.splitlines()[1].split()
    assert int(first[3]) >= 3
    assert float(first[4]) <= float(first[2]) + 0.01, "the shallowest"
    assert first[5].startswith("2027-01-15T08:")
    assert main(["depth", "export", str(store), str(tmp_path / "a.xyz")]) == 0
    assert (tmp_path / "a.xyz").read_text() == text


def test_geojson_is_valid_and_comes_back_without_loss(store, tmp_path, capsys):
    path = tmp_path / "a.geojson"
    assert main(["depth", "export", str(store), str(path)]) == 0
    data = json.loads(path.read_text())
    assert data["type"] == "FeatureCollection"
    lon, lat = data["features"][0]["geometry"]["coordinates"]
    assert lon == pytest.approx(math.degrees(HERE[1]), abs=1e-4)
    assert lat == pytest.approx(math.degrees(HERE[0]), abs=1e-4)
    assert set(data["features"][0]["properties"]) == {"depth_m", "least_m", "mean_m", "soundings", "last"}
    other = tmp_path / "other.db"
    assert main(["depth", "import", str(other), str(path)]) == 0
    before, after = list(soundings_of(content(store))), list(soundings_of(content(other)))
    assert len(before) == len(after)
    for was, now in zip(before, after, strict=True):
        assert now.lat_deg == was.lat_deg
        assert (now.soundings, now.utc_s) == (was.soundings, was.utc_s)
        assert now.depth_m == pytest.approx(was.depth_m, abs=0.02)
        assert now.least_m == pytest.approx(was.least_m, abs=0.011)
    assert main(["depth", "show", str(other)]) == 0
    assert "300 soundings" in capsys.readouterr().out


def test_an_import_adds_to_what_is_there(store, tmp_path):
    (tmp_path / "more.xyz").write_text("-8.70 41.18 3.5\n-8.70 41.18 3.7\n")
    before = len(list(soundings_of(content(store))))
    assert main(["depth", "import", str(store), str(tmp_path / "more.xyz")]) == 0
    after = list(soundings_of(content(store)))
    assert len(after) == before + 1
    new = next(each for each in after if each.lat_deg < 41.1805)
    assert (new.soundings, new.least_m, new.mean_m) == (2, 3.5, pytest.approx(3.6))
    assert content(store).params == {"DEPTH_MIN": 3.0}, "nothing else is touched"


def test_an_import_of_more_than_a_voyage_adds_to_is_taken_and_one_without_end_is_refused(tmp_path, capsys, monkeypatch):
    store, file = tmp_path / "a.db", tmp_path / "far.xyz"
    file.write_text("".join(f"{-8.7 + i * 0.001:.4f} 41.18 9.0\n" for i in range(2100)))
    monkeypatch.setattr("companion.commands.depth.TILES_MOST", 2050)
    assert main(["depth", "import", str(store), str(file)]) == 2
    assert "would hold more than 2050 tiles" in capsys.readouterr().err
    assert not store.exists()
    monkeypatch.undo()
    assert main(["depth", "import", str(store), str(file)]) == 0
    assert len(content(store).depth) == 2100


def test_a_chart_of_coarse_cells_is_no_soundings(tmp_path, capsys):
    """A bar of 200 m was imported as single places 90 m apart, and the boat sailed across between them."""
    store, file = tmp_path / "a.db", tmp_path / "bar.xyz"
    file.write_text("# a chart\n# cell_deg 0.000900000 0.000900000\n-8.70 41.18 2.0\n")
    assert main(["depth", "import", str(store), str(file)]) == 2
    assert "cells of 100 x 76 m, the memory has 2 m: name it in depth.map.file" in capsys.readouterr().err
    assert not store.exists()
    file.write_text(file.read_text().replace("0.000900000", "0.000015000"))
    assert main(["depth", "import", str(store), str(file)]) == 0
    assert len(list(soundings_of(content(store)))) == 1


def test_forgetting_a_place_or_all(store, capsys):
    lat, lon = (math.degrees(value) for value in offset(*HERE, 50.0, 0.0))
    before = {each[:2] for each in soundings_of(content(store))}
    assert main(["depth", "forget", str(store), "--near", str(lat), str(lon), "10"]) == 0
    after = {each[:2] for each in soundings_of(content(store))}
    assert after < before
    assert 9 <= len(before - after) <= 11
    assert all(abs(place[0] - lat) < 1e-4 for place in before - after)
    assert main(["depth", "forget", str(store), "--all"]) == 0
    assert not content(store).depth
    assert content(store).params == {"DEPTH_MIN": 3.0}
    assert main(["depth", "show", str(store)]) == 0
    assert "nothing sounded yet" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("near", "said"),
    [
        (("95", "10", "10"), "latitude 95: give LAT LON M, latitude from -90 to 90 degrees"),
        (("41.18", "-188.7", "10"), "longitude -188.7: give LAT LON M, longitude from -180 to 180 degrees"),
        (("41.18", "-8.7", "-10"), "radius -10: give LAT LON M, radius from 0 to 100000 m"),
    ],
)
def test_a_place_that_is_none_is_refused_with_its_number(store, capsys, near, said):
    before = content(store)
    assert main(["depth", "forget", str(store), "--near", *near]) == 2
    assert said in capsys.readouterr().err
    assert content(store) == before


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.geojson", "[]", "FeatureCollection"),
        ("a.geojson", '{"features": [{}]}', "feature 0"),
        (
            "a.geojson",
            '{"features": [{"geometry": {"coordinates": [200, 0]}, "properties": {"depth_m": 1}}]}',
            "feature 0",
        ),
        ("a.geojson", "{", "a.geojson"),
        ("a.xyz", "1 2\n", "line 1"),
        ("a.xyz", "1 2 9999\n", "line 1: 9999 is 'unknown'"),
        ("a.xyz", "# nothing\n", "holds no sounding"),
        ("a.geojson", '{"features": []}', "holds no sounding"),
        ("none.xyz", None, "No such file"),
    ],
)
def test_bad_files_change_nothing_and_are_told(store, tmp_path, capsys, name, text, said):
    if text is not None:
        (tmp_path / name).write_text(text)
    before = content(store)
    assert main(["depth", "import", str(store), str(tmp_path / name)]) == 2
    assert said in capsys.readouterr().err
    assert content(store) == before


def test_an_empty_file_makes_no_store_and_heights_are_asked_about(tmp_path, capsys):
    (tmp_path / "a.xyz").write_text("")
    assert main(["depth", "import", str(tmp_path / "a.db"), str(tmp_path / "a.xyz")]) == 2
    assert not (tmp_path / "a.db").exists()
    (tmp_path / "a.xyz").write_text("-8.7 41.18 -12\n-8.7 41.19 -11\n")
    assert main(["depth", "import", str(tmp_path / "a.db"), str(tmp_path / "a.xyz")]) == 0
    assert "all of it lies above datum. Are these heights?" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--all"], ["--near", "41.1838", "-8.7052", "20"]], ids=["all", "near"])
def test_nothing_is_told_forgotten_that_could_not_be(store, capsys, monkeypatch, words):
    """On a full disk "2000 tiles forgotten" was told, and then the error: all of them were still there."""
    monkeypatch.setattr("companion.commands.depth.write_store", lambda path, entries: False)
    assert main(["depth", "forget", str(store), *words]) == 1
    assert capsys.readouterr().out == ""


def test_wrong_stores_and_targets_are_told(store, tmp_path, capsys):
    for words in (["show", "none.db"], ["export", "none.db"], ["forget", "none.db", "--all"]):
        assert main(["depth", *words]) == 2
        assert "no such store" in capsys.readouterr().err
    (tmp_path / "noise.db").write_bytes(b"noise" * 100)
    (tmp_path / "a.xyz").write_text("-8.7 41.2 5\n")
    assert main(["depth", "import", str(tmp_path / "noise.db"), str(tmp_path / "a.xyz")]) == 2
    assert main(["depth", "export", str(store), str(tmp_path / "none" / "a.xyz")]) == 1
    assert main(["depth", "import", str(store), str(tmp_path / "a.xyz"), "--cell", "0.1"]) == 2
