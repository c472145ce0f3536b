"""A coarse chart, as the world's own are: its cells are filled, and the boat is not let into what it calls shallow."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from companion.cli import main
from companion.core.guard.depth.grid import DepthGrid
from companion.io.depth_map import load_depth_map
from mavlink_bridge.language.messages import Action

rasterio = pytest.importorskip("rasterio", reason="the extra 'charts' is not installed")
numpy = pytest.importorskip("numpy")
pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")

ARC_S = 1.0 / 240.0
"""15 seconds of arc, as GEBCO's cells: 463 m by 350 m here."""
WEST, NORTH = -8.7312, 41.2021
"""The simulator's start lies 4 cells down and 6 across."""


def gebco(path, heights, **more):
    values = numpy.array(heights, dtype="int16")
    options = {"driver": "GTiff", "height": values.shape[0], "width": values.shape[1], "count": 1, "dtype": "int16"}
    place = {"crs": "EPSG:4326", "transform": rasterio.transform.from_origin(WEST, NORTH, ARC_S, ARC_S)}
    with rasterio.open(path, "w", **{**options, **place, **more}) as chart:
        chart.write(values, 1)
        chart.set_band_description(1, "Elevation relative to sea level")
        chart.update_tags(1, long_name="Elevation relative to sea level")
    return path


def sea(shallow_rows=()):
    return [[-1 if row in shallow_rows else -25] * 12 for row in range(10)]


def convert(*words):
    return main(["depth", "convert", *map(str, words)])


@pytest.mark.parametrize("ending", ["xyz", "depth"])
def test_the_boat_is_not_let_into_a_metre_of_water_that_the_chart_shows(voyage, tmp_path, ending):
    chart = tmp_path / f"chart.{ending}"
    assert convert(gebco(tmp_path / "gebco.tif", sea({0, 1, 2})), chart) == 0
    trip = voyage(f"depth.map.file={chart}", "world.bottom.kind=flat", "world.bottom.depth_m=20.35")
    assert trip.truth.depth_m > 20.0, "the chart is all that knows of the shoal"
    assert "charted depth 1.0 m" in trip.plan(1.5, (900.0, 0.0)).reason
    assert trip.plan(1.5, (200.0, 0.0)).reason == ""


def test_under_way_without_a_plan_it_is_stopped_before_it(voyage, tmp_path):
    chart = tmp_path / "chart.depth"
    assert convert(gebco(tmp_path / "gebco.tif", sea({0, 1, 2, 3})), chart) == 0
    grid = load_depth_map(chart)
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=20.35", "world.latitude_deg=41.1845")
    trip.sail(1.5, (900.0, 0.0))
    trip.world.app.vehicle.parts.guard.set_map(grid)  # a chart that came after the plan was taken
    stopped = trip.until(lambda: trip.snapshot.action >= Action.HOLD, 300.0)
    trip.run(15.0)
    assert stopped
    assert grid.depth_at(trip.truth.lat_rad, trip.truth.lon_rad) == 25.0
    assert any("Shallow water ahead (map" in text for text in trip.texts)


def known_share(grid: DepthGrid, lat_deg, lon_deg, rows=40):
    import math

    places = [(lat_deg - 0.02 * i / rows, lon_deg + 0.02 * k / rows) for i in range(rows) for k in range(rows)]
    found = [grid.depth_at(math.radians(lat), math.radians(lon)) for lat, lon in places]
    return sum(each is not None for each in found) / len(found)


@pytest.mark.parametrize("ending", ["xyz", "depth"])
def test_a_filled_chart_has_no_holes(tmp_path, ending):
    chart = tmp_path / f"chart.{ending}"
    assert convert(gebco(tmp_path / "gebco.tif", sea()), chart) == 0
    assert known_share(load_depth_map(chart), NORTH - 0.01, WEST + 0.01) == 1.0


def test_the_owner_is_shown_what_was_understood(tmp_path, capsys):
    heights = sea({3})
    heights[5][5] = 9
    assert convert(gebco(tmp_path / "g.tif", heights), tmp_path / "c.xyz", "--datum", "-2", "--dry", "2") == 0
    told = capsys.readouterr().out
    assert "values     -25 to 9 m, heights (positive up): named 'elevation'" in told
    assert "datum      -2 m" in told
    assert "100.0 % known" in told
    assert "shallowest -2.00 m below datum at 41.17" in told
    assert "462.7 x 349." in told


@pytest.mark.parametrize(
    ("values", "words", "more", "said"),
    [
        ([[-9999, -20]], (), {}, "--nodata=-9999"),
        ([[-32768, -20]], ("--positive", "up"), {}, "--nodata=-32768"),
        ([[12500, 9000]], ("--positive", "down"), {}, "no sea is like that"),
        ([[20, 30]], (), {}, "no value is below zero"),
    ],
    ids=["undeclared nodata", "smallest number", "deeper than any sea", "depths called elevation"],
)
def test_what_cannot_be_meant_is_refused(tmp_path, capsys, values, words, more, said):
    assert convert(gebco(tmp_path / "g.tif", values, **more), tmp_path / "c.depth", *words) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.glob("*c.depth*")), "no half file"


def test_a_netcdf_called_depth_that_holds_heights_is_refused(tmp_path, capsys):
    copy = pytest.importorskip("rasterio.shutil").copy
    gebco(tmp_path / "g.tif", sea())
    with rasterio.open(tmp_path / "g.tif", "r+") as chart:
        chart.set_band_description(1, "depth")
        chart.update_tags(1, long_name="depth")
    copy(tmp_path / "g.tif", tmp_path / "g.nc", driver="netCDF")
    assert convert(tmp_path / "g.nc", tmp_path / "c.depth") == 2
    assert "below zero, as heights are" in capsys.readouterr().err
    assert convert(tmp_path / "g.nc", tmp_path / "c.depth", "--positive", "up") == 0
    assert known_share(load_depth_map(tmp_path / "c.depth"), NORTH - 0.01, WEST + 0.01) == 1.0


def test_an_ascii_grid_and_a_projected_chart_have_no_holes_either(tmp_path):
    head = f"ncols 12\nnrows 10\nxllcorner {WEST}\nyllcorner {NORTH - 10 * ARC_S}\ncellsize {ARC_S}\nNODATA_value -1\n"
    (tmp_path / "a.asc").write_text(head + "\n".join([" ".join(["25.5"] * 12)] * 10) + "\n")
    words = ("--positive", "down", "--crs", "EPSG:4326")
    assert convert(tmp_path / "a.asc", tmp_path / "a.depth", *words) == 0
    assert known_share(load_depth_map(tmp_path / "a.depth"), NORTH - 0.01, WEST + 0.01) == 1.0
    utm = {"crs": "EPSG:32629", "transform": rasterio.transform.from_origin(520_000.0, 4_565_000.0, 400.0, 400.0)}
    assert convert(gebco(tmp_path / "u.tif", sea(), **utm), tmp_path / "u.xyz") == 0
    assert known_share(load_depth_map(tmp_path / "u.xyz"), 41.23, -8.75) == 1.0


def test_a_box_reads_only_its_window(tmp_path, capsys):
    chart = gebco(tmp_path / "g.tif", [[-25] * 600 for _ in range(400)])
    box = ("--box", NORTH - 0.05, WEST + 0.05, NORTH - 0.02, WEST + 0.1)
    assert convert(chart, tmp_path / "c.depth", *box) == 0
    told = capsys.readouterr().out
    cells = int(told.split("cells")[1].split()[0])
    assert cells <= 12 * 18, "of 240 000"
    assert convert(chart, tmp_path / "o.depth", "--box", -10, 10, -9, 11) == 2
    assert "outside the chart" in capsys.readouterr().err


def test_a_plan_is_held_against_the_chart_ashore_as_aboard(voyage, tmp_path, capsys):
    chart = tmp_path / "chart.depth"
    assert convert(gebco(tmp_path / "g.tif", sea({0, 1})), chart) == 0
    config = tmp_path / "boat.toml"
    config.write_text(f'[depth.map]\nfile = "{chart}"\n')
    plan = str(tmp_path / "far.plan")
    assert main(["plan", "make", plan, "41.1850,-8.7062", "41.1850,-8.6452", "--far"]) == 0
    capsys.readouterr()
    main(["plan", "check", plan, "--config", str(config)])
    told = capsys.readouterr().out
    assert "% of this plan lies in unknown water" in told
    assert "? unknown water" in told
    north = str(tmp_path / "north.plan")
    assert main(["plan", "make", north, "41.1850,-8.7062", "41.1990,-8.7062"]) == 0
    assert main(["plan", "check", north, "--config", str(config)]) == 1
    assert "charted depth 1.0 m" in capsys.readouterr().err
    trip = voyage(f"depth.map.file={chart}", "mission.leg_distance_m=20000")
    assert trip.plan(1.5, (0.0, 5100.0)).reason == ""
    trip.run(0.1)
    assert any("of this plan lies in unknown water" in text for text in trip.texts)


@pytest.mark.soak
def test_36_million_cells_in_300_megabytes(tmp_path):
    side = 6000
    options = {"driver": "GTiff", "height": side, "width": side, "count": 1, "dtype": "float64", "crs": "EPSG:4326"}
    transform = rasterio.transform.from_origin(WEST, NORTH, 2e-5, 2e-5)
    path = tmp_path / "big.tif"
    with rasterio.open(path, "w", transform=transform, **options) as chart:
        for row in range(0, side, 500):
            noise = numpy.random.default_rng(row).random((500, side))
            chart.write(-20.0 - 5.0 * noise, 1, window=rasterio.windows.Window(0, row, side, 500))
    run = (
        "import resource, sys; from companion.cli import main; status = main(sys.argv[1:]); "
        "print(status, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)"
    )
    words = ["depth", "convert", path, tmp_path / "big.depth", "--positive", "up"]
    done = subprocess.run([sys.executable, "-c", run, *map(str, words)], capture_output=True, text=True, check=True)
    status, peak_mb = map(int, done.stdout.splitlines()[-1].split())
    assert (status, peak_mb <= 300) == (0, True), peak_mb


def test_the_commands_of_the_page_work_as_printed(tmp_path, monkeypatch):
    copy = pytest.importorskip("rasterio.shutil").copy
    page = (Path(__file__).parents[2] / "docs" / "DEPTH.md").read_text(encoding="utf-8")
    printed = [
        line.split("#")[0].split()[1:] for line in page.splitlines() if line.startswith("companion depth convert ")
    ]
    assert len(printed) == 2
    monkeypatch.chdir(tmp_path)
    wide = {"transform": rasterio.transform.from_origin(-8.9, 41.4, ARC_S, ARC_S)}
    gebco("chart.tif", sea())
    gebco("wide.tif", [[-25] * 100 for _ in range(100)], **wide)
    copy("wide.tif", "gebco.nc", driver="netCDF")
    for words in printed:
        assert main(words) == 0, words
