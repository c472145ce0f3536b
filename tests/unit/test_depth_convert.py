"""Charts as GeoTIFF and NetCDF become the vessel's soundings: sign, unit, datum, nodata and coordinate system are right or asked for."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest

from companion.cli import main
from companion.core.guard.depth.soundings import parse_xyz
from companion.io.depth_map import load_depth_map
from mavlink_bridge.language.geodesy import LocalFrame

rasterio = pytest.importorskip("rasterio", reason="the extra 'charts' is not installed")
numpy = pytest.importorskip("numpy")

copy_chart = pytest.importorskip("rasterio.shutil").copy
pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
WEST, NORTH, STEP = -8.71, 41.19, 0.0001
HEIGHTS = [[-5.0, -6.004, -9999.0], [-2.0, 3.0, 50.0]]
"""Two rows from the north; nodata and land in it."""
RADIUS_M = 6378137.0
MERCATOR = math.degrees(-968000.0 / RADIUS_M), math.degrees(math.atan(math.sinh(5040000.0 / RADIUS_M)))
"""Longitude and latitude of a point, by the projection's own formula."""


def geotiff(path, values=HEIGHTS, *, crs="EPSG:4326", origin=(WEST, NORTH), step=STEP, dtype="float32", **more):
    data = numpy.array(values, dtype=dtype)
    unit, scale, offset = more.pop("unit", None), more.pop("scale", 1.0), more.pop("offset", 0.0)
    tags, description = more.pop("tags", {}), more.pop("description", None)
    options = {
        "driver": "GTiff",
        "height": data.shape[0],
        "width": data.shape[1],
        "count": 1,
        "dtype": dtype,
        "crs": crs,
        "transform": rasterio.transform.from_origin(*origin, step, step),
        "nodata": -9999,
    }
    with rasterio.open(path, "w", **{**options, **more}) as chart:
        chart.write(data, 1)
        chart.update_tags(1, **tags)
        if description:
            chart.set_band_description(1, description)
        if unit:
            chart.units = (unit,)
        chart.scales, chart.offsets = (scale,), (offset,)
    return path


def convert(chart, out, *options):
    return main(["depth", "convert", str(chart), str(out), *options])


def depths(path):
    return [(math.degrees(s.lon_rad), math.degrees(s.lat_rad), s.depth_m) for s in parse_xyz(path.read_text())]


def test_heights_become_depths_at_the_middle_of_their_cells(tmp_path):
    chart = geotiff(tmp_path / "chart.tif", compress="lzw")
    assert convert(chart, tmp_path / "out.xyz", "--positive", "up", "--dry", "10") == 0
    assert depths(tmp_path / "out.xyz") == [
        (pytest.approx(WEST + 0.5 * STEP), pytest.approx(NORTH - 0.5 * STEP), 5.0),
        (pytest.approx(WEST + 1.5 * STEP), pytest.approx(NORTH - 0.5 * STEP), 6.0),
        (pytest.approx(WEST + 0.5 * STEP), pytest.approx(NORTH - 1.5 * STEP), 2.0),
        (pytest.approx(WEST + 1.5 * STEP), pytest.approx(NORTH - 1.5 * STEP), -3.0),
        (pytest.approx(WEST + 2.5 * STEP), pytest.approx(NORTH - 1.5 * STEP), -10.0),
    ], "to the shallow centimetre; nodata is left out, high land is land"


def test_high_land_stays_land_and_is_no_unknown_water(tmp_path, capsys):
    """A plan straight across an island of 35 m was let pass, as through unknown water."""
    chart = geotiff(tmp_path / "a.tif", [[35.0 if 8 <= row < 12 else -20.0 for row in range(20)]] * 3, step=9e-4)
    for name in ("a.depth", "a.xyz"):
        assert convert(chart, tmp_path / name, "--positive", "up") == 0
    grid = load_depth_map(tmp_path / "a.depth")
    across = [
        grid.depth_at(math.radians(NORTH - 1.5 * 9e-4), math.radians(WEST + (i + 0.5) * 9e-5)) for i in range(200)
    ]
    assert across[80:120] == [-20.0] * 40
    assert set(across[:80] + across[120:]) == {20.0}
    assert {depth for *_, depth in depths(tmp_path / "a.xyz")} == {20.0, -20.0}
    hill = geotiff(tmp_path / "hill.tif", [[35.0]])
    assert convert(hill, tmp_path / "hill.xyz", "--positive", "up") == 2
    assert "no depth in it" in capsys.readouterr().err


def test_the_sign_is_read_or_asked_for_and_never_guessed(tmp_path, capsys):
    plain = geotiff(tmp_path / "plain.tif")
    assert convert(plain, tmp_path / "out.xyz") == 2
    assert "--positive up or --positive down" in capsys.readouterr().err
    assert not list(tmp_path.glob("*out*")), "no half file"
    for number, said in enumerate(
        ({"tags": {"positive": "down"}}, {"description": "Depth"}, {"tags": {"standard_name": "sea_floor_depth"}})
    ):
        chart = geotiff(tmp_path / f"{number}.tif", [[5.0, 6.0]], **said)
        assert convert(chart, tmp_path / "out.xyz") == 0
        assert [depth for *_, depth in depths(tmp_path / "out.xyz")] == [5.0, 6.0]
    chart = geotiff(tmp_path / "up.tif", [[-5.0]], tags={"long_name": "Elevation relative to sea level"})
    assert convert(chart, tmp_path / "out.xyz") == 0
    assert depths(tmp_path / "out.xyz")[0][2] == 5.0
    both = geotiff(tmp_path / "both.tif", [[5.0]], tags={"long_name": "height or depth"})
    assert convert(both, tmp_path / "out.xyz") == 2


def test_datum_unit_scale_and_a_second_nodata_value(tmp_path, capsys):
    chart = geotiff(tmp_path / "a.tif", [[500, 999, 7]], dtype="int16", scale=0.1, offset=1.0, unit="ft", nodata=7)
    assert convert(chart, tmp_path / "out.xyz", "--positive", "down", "--datum", "-2", "--nodata", "999") == 0
    assert [depth for *_, depth in depths(tmp_path / "out.xyz")] == [pytest.approx(51.0 * 0.3048 - 2.0, abs=0.01)]
    assert "values     51 to 51 ft" in capsys.readouterr().out, "as they are meant, not as they are kept"
    strange = geotiff(tmp_path / "b.tif", [[5.0]], unit="furlong")
    assert convert(strange, tmp_path / "out.xyz", "--positive", "down") == 2
    assert "--unit" in capsys.readouterr().err
    assert convert(strange, tmp_path / "out.xyz", "--positive", "down", "--unit", "dm") == 0
    assert depths(tmp_path / "out.xyz")[0][2] == 0.5


@pytest.mark.parametrize("said", ["-3.4028235e38", "-3.40282e+38", "-9999.9", "0"])
def test_a_nodata_value_is_found_in_the_digits_that_the_raster_keeps(tmp_path, said):
    """A float32 raster never had it: its cells were known, and deep."""
    chart = geotiff(tmp_path / "a.tif", [[-5.0, float(numpy.float32(said)), -5.1]], nodata=None)
    if said == "-3.40282e+38":
        chart = geotiff(tmp_path / "a.tif", [[-5.0, numpy.finfo("float32").min, -5.1]], nodata=None)
    assert convert(chart, tmp_path / "out.xyz", "--positive", "up", f"--nodata={said}") == 0
    assert [depth for *_, depth in depths(tmp_path / "out.xyz")] == [5.0, 5.09]


@pytest.mark.parametrize(
    ("crs", "origin", "place"),
    [
        ("EPSG:32629", (525000.0, 4559000.0), (-8.7017, 41.1820)),
        ("EPSG:3857", (-968000.0, 5040000.0), MERCATOR),
        ("EPSG:4258", (-8.7, 41.18), (-8.7, 41.18)),
    ],
    ids=["UTM", "web mercator", "ETRS89"],
)
def test_projected_charts_end_up_where_they_belong(tmp_path, crs, origin, place):
    step = 1e-5 if crs == "EPSG:4258" else 1.0
    chart = geotiff(tmp_path / "c.tif", [[5.0]], crs=crs, origin=origin, step=step)
    assert convert(chart, tmp_path / "out.xyz", "--positive", "down") == 0
    ((lon, lat, _),) = depths(tmp_path / "out.xyz")
    north, east = LocalFrame(math.radians(place[1]), math.radians(place[0])).to_local(
        math.radians(lat), math.radians(lon)
    )
    assert math.hypot(north, east) < 30.0


def test_without_a_coordinate_system_it_asks_for_one(tmp_path, capsys):
    chart = geotiff(tmp_path / "c.tif", [[5.0]], crs=None)
    assert convert(chart, tmp_path / "out.xyz", "--positive", "down") == 2
    assert "--crs" in capsys.readouterr().err
    assert convert(chart, tmp_path / "out.xyz", "--positive", "down", "--crs", "EPSG:4326") == 0
    assert convert(chart, tmp_path / "out.xyz", "--positive", "down", "--crs", "nonsense") == 2
    with (
        pytest.warns(rasterio.errors.NotGeoreferencedWarning),
        rasterio.open(
            tmp_path / "nowhere.tif", "w", driver="GTiff", height=1, width=1, count=1, dtype="float32", crs="EPSG:4326"
        ) as nowhere,
    ):
        nowhere.write(numpy.array([[5.0]], dtype="float32"), 1)
    assert convert(tmp_path / "nowhere.tif", tmp_path / "out.xyz", "--positive", "down") == 2
    assert "not georeferenced" in capsys.readouterr().err


def test_netcdf_by_its_attributes_and_variables(tmp_path, capsys):
    tif = geotiff(tmp_path / "a.tif", [[-5.0, -9999.0], [-7.0, -8.0]], tags={"long_name": "elevation"}, unit="m")
    copy_chart(tif, tmp_path / "chart.nc", driver="netCDF")
    assert convert(tmp_path / "chart.nc", tmp_path / "out.xyz", "--positive", "up") == 0
    assert [depth for *_, depth in depths(tmp_path / "out.xyz")] == [5.0, 7.0, 8.0]
    with rasterio.open(tmp_path / "two.tif", "w", **{**_profile(tif), "count": 2}) as two:
        two.write(numpy.array([[[5.0, 5.0], [5.0, 5.0]], [[6.0, 6.0], [6.0, 6.0]]], dtype="float32"))
    copy_chart(tmp_path / "two.tif", tmp_path / "two.nc", driver="netCDF")
    assert convert(tmp_path / "two.nc", tmp_path / "out.xyz", "--positive", "down") == 2
    assert "--variable: Band1, Band2" in capsys.readouterr().err
    assert convert(tmp_path / "two.nc", tmp_path / "out.xyz", "--positive", "down", "--variable", "Band3") == 2
    assert convert(tmp_path / "two.nc", tmp_path / "out.xyz", "--positive", "down", "--variable", "Band2") == 0
    assert {depth for *_, depth in depths(tmp_path / "out.xyz")} == {6.0}


def _profile(path):
    with rasterio.open(path) as chart:
        return chart.profile


def test_thinning_keeps_the_shallowest_and_the_box_cuts(tmp_path):
    values = [[5.0 + ((7 * i + 3 * j) % 11) for j in range(40)] for i in range(40)]
    chart = geotiff(tmp_path / "a.tif", values, step=1e-5)
    assert convert(chart, tmp_path / "all.xyz", "--positive", "down") == 0
    assert convert(chart, tmp_path / "thin.xyz", "--positive", "down", "--thin", "10") == 0
    full, thin = depths(tmp_path / "all.xyz"), depths(tmp_path / "thin.xyz")
    assert len(full) == 1600
    assert len(thin) < 40
    assert {depth for *_, depth in thin} == {5.0}
    box = ["--box", str(NORTH - 1e-4), str(WEST), str(NORTH), str(WEST + 1e-4)]
    assert convert(chart, tmp_path / "box.xyz", "--positive", "down", *box) == 0
    assert len(depths(tmp_path / "box.xyz")) == 100


def test_thinning_in_strips_gives_what_the_whole_chart_would(tmp_path, monkeypatch):
    """A square is given out once; where a strip of rows ends inside it, its shallowest is waited for."""
    chance = numpy.random.default_rng(5)
    chart = geotiff(tmp_path / "c.tif", -5.0 - chance.random((60, 40)))
    found = []
    for cells in (10**6, 400, 55, 17):
        monkeypatch.setattr("companion.commands.chart.source._BLOCK", cells)
        assert convert(chart, tmp_path / "c.xyz", "--positive", "up", "--thin", "50") == 0
        found.append(sorted(depths(tmp_path / "c.xyz")))
    assert len(found[0]) > 50
    assert all(each == found[0] for each in found)


def test_the_compact_grid_is_what_the_vessel_reads(tmp_path):
    chart = geotiff(tmp_path / "a.tif", [[5.0] * 20 for _ in range(20)], step=1e-4)
    assert convert(chart, tmp_path / "out.depth", "--positive", "down", "--pitch", "5", "--spread", "8") == 0
    grid = load_depth_map(tmp_path / "out.depth")
    assert grid.depth_at(math.radians(NORTH - 10e-4), math.radians(WEST + 10e-4)) == 5.0
    assert grid.depth_at(math.radians(NORTH + 10e-4), math.radians(WEST + 10e-4)) is None


def test_land_is_never_written_as_water(tmp_path, capsys):
    """With ``--dry -2`` it stood in the file as 2 m of water."""
    chart, out = geotiff(tmp_path / "chart.tif"), tmp_path / "out.xyz"
    with pytest.raises(SystemExit, match="2"):
        convert(chart, out, "--positive", "up", "--dry=-2")
    assert "--dry: -2: give a number of at least 0" in capsys.readouterr().err
    assert not out.exists()
    assert convert(chart, out, "--positive", "up", "--dry", "0") == 0
    assert min(depth_m for *_, depth_m in depths(out)) == 0.0


@pytest.mark.parametrize("box", [(), ("--box", "41.1802", "-8.7098", "41.1898", "-8.7002")], ids=["whole", "box"])
@pytest.mark.parametrize("turn", [0.0, 360.0, -360.0])
def test_a_chart_from_0_to_360_degrees_gives_the_same_grid(tmp_path, turn, box, capsys):
    """The grid of one was empty, though "100.0 % known" was told: a plan across the shoal was let pass."""
    chart = geotiff(tmp_path / "a.tif", shoal_of(100), origin=(WEST + turn, NORTH))
    assert convert(chart, tmp_path / "a.depth", "--positive", "down", *box) == 0
    assert " -8.7" in capsys.readouterr().out.split("box")[1]
    grid = load_depth_map(tmp_path / "a.depth")
    place = math.radians(NORTH - 50.5 * STEP), math.radians(WEST + 50.5 * STEP)
    assert grid.depth_at(*place) == 2.0
    for north, east in ((5, 5), (95, 95), (5, 95), (95, 5)):
        assert grid.depth_at(math.radians(NORTH - north * STEP), math.radians(WEST + east * STEP)) == 15.0


def shoal_of(side):
    """15 m, and 2 m in the middle."""
    return [[2.0 if row == column == side // 2 else 15.0 for column in range(side)] for row in range(side)]


@pytest.mark.parametrize(
    ("crs", "origin", "step"),
    [("EPSG:4326", (179.995, -17.0), STEP), ("EPSG:3832", (3339584.7 - 500.0, -1900000.0), 10.0)],
    ids=["degrees", "Pacific Mercator"],
)
def test_a_chart_across_the_180th_meridian_is_refused_as_a_grid_or_cut_by_a_box(tmp_path, capsys, crs, origin, step):
    """Its eastern half was lost, with its depths in the westernmost column."""
    chart = geotiff(tmp_path / "a.tif", [[15.0] * 50 + [2.0] * 50] * 100, crs=crs, origin=origin, step=step)
    out = tmp_path / "a.depth"
    assert convert(chart, out, "--positive", "down") == 2
    assert "both sides of the 180th meridian" in capsys.readouterr().err
    assert not out.exists()
    south, north = ("-17.02", "-16.99") if crs == "EPSG:4326" else ("-16.95", "-16.91")
    for west, east, seen, other in (("179", "180", 179.998, -179.998), ("-180", "-179", -179.998, 179.998)):
        assert convert(chart, out, "--positive", "down", "--box", south, west, north, east) == 0
        told = capsys.readouterr().out
        middle = math.radians(float(told.split("for one")[1].split()[5]))
        grid = load_depth_map(out)
        assert grid.depth_at(middle, math.radians(seen)) == (15.0 if seen > 0.0 else 2.0)
        assert grid.depth_at(middle, math.radians(other)) is None


@pytest.mark.parametrize("first_deg", [0.0, -0.125], ids=["edges", "middles"])
def test_a_box_across_the_ends_of_a_chart_from_0_to_360_degrees_is_refused_or_cut_in_two(tmp_path, capsys, first_deg):
    """Its western half was left out without a word, an islet in it."""
    world = numpy.full((8, 1440), -10.0)
    world[4, 1436] = 3.0
    chart = geotiff(tmp_path / "a.tif", world, origin=(first_deg, 52.0), step=0.25)
    end = f"{first_deg:g}"
    for name in ("a.xyz", "a.depth"):
        out = tmp_path / name
        pitch = ("--pitch", "1000") if name == "a.depth" else ()
        assert convert(chart, out, "--positive", "up", *pitch, "--box", "50", "-2", "52", "2") == 2
        assert f"the box lies on both sides of {first_deg:.5f} degrees" in capsys.readouterr().err
        assert not out.exists()
        assert convert(chart, out, "--positive", "up", *pitch, "--box", "50", end, "52", "2") == 0
        assert convert(chart, out, "--positive", "up", *pitch, "--box", "50", "-2", "52", end) == 0
    lons = [lon for lon, _, depth_m in depths(tmp_path / "a.xyz") if depth_m == -3.0]
    assert lons == [pytest.approx(first_deg - 0.875)]
    grid = load_depth_map(tmp_path / "a.depth")
    assert grid.depth_at(math.radians(50.875), math.radians(first_deg - 0.875)) == -3.0


@pytest.mark.parametrize(("west", "east"), [("-180", "-178"), ("178", "180")])
def test_a_chart_whose_ends_overlap_is_cut_by_a_box_at_one_of_them(tmp_path, west, east):
    chart = geotiff(tmp_path / "a.tif", numpy.full((4, 361), 10.0), origin=(-180.5, 2.0), step=1.0)
    assert convert(chart, tmp_path / "a.xyz", "--positive", "down", "--box", "-2", west, "2", east) == 0
    assert {abs(lon) for lon, *_ in depths(tmp_path / "a.xyz")} == {178.0, 179.0, 180.0}


def test_mistakes_are_told_in_a_line(tmp_path, capsys):
    chart = geotiff(tmp_path / "a.tif", [[-9999.0]])
    (tmp_path / "noise.tif").write_bytes(b"II*\x00" + bytes(100))
    for arguments, said in (
        ((tmp_path / "none.tif", tmp_path / "o.xyz"), "no such file"),
        ((tmp_path / "noise.tif", tmp_path / "o.xyz"), "noise.tif"),
        ((chart, tmp_path / "o.xyz"), "no depth in it"),
        ((chart, tmp_path / "o.depth"), "no depth in it"),
        ((chart, tmp_path / "o.xyz", "--band", "2"), "no band 2"),
        ((chart, tmp_path / "none" / "o.xyz"), "No such file"),
    ):
        assert convert(*arguments, "--positive", "down") == (1 if said == "No such file" else 2)
        told = capsys.readouterr().err
        assert said in told
        assert "Traceback" not in told
    assert convert(chart, tmp_path / "o.tif") == 2


def test_without_the_extra_the_install_line_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert convert(tmp_path / "a.tif", tmp_path / "o.xyz") == 2
    assert "pip install '.[charts]'" in capsys.readouterr().err


@pytest.mark.soak
@pytest.mark.parametrize("options", [[], ["--thin", "20"]], ids=["xyz", "thinned"])
def test_36_million_cells_take_no_more_memory_than_a_raspberry_pi_has(tmp_path, options):
    """A gigabyte of soundings comes of the first; a process of its own, so that its memory is its own."""
    side, block = 6000, 500
    place = rasterio.transform.from_origin(-9.0, 41.5, 0.0001, 0.0001)
    shape = {"driver": "GTiff", "height": side, "width": side, "count": 1, "dtype": "float64", "crs": "EPSG:4326"}
    chance = numpy.random.default_rng(3)
    with rasterio.open(tmp_path / "c.tif", "w", transform=place, nodata=-9999, **shape) as chart:
        for row in range(0, side, block):
            heights = -9.0 - chance.random((block, side))
            chart.write(heights, 1, window=((row, row + block), (0, side)))
    code = (
        "import resource, sys; from companion.cli import main; found = main(sys.argv[1:]); "
        "print(found, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    words = ["depth", "convert", str(tmp_path / "c.tif"), str(tmp_path / "c.xyz"), "--positive", "up", *options]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
    found, peak_kb = map(int, done.stdout.splitlines()[-1].split())
    print(f"peak {peak_kb / 1024:.0f} MB, {(tmp_path / 'c.xyz').stat().st_size / 1e6:.0f} MB written")
    assert found == 0
    assert done.stderr == "", "nothing in a pipe"
    assert peak_kb / 1024 <= 300.0
