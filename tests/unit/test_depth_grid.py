"""The depth map: errs shallow, knows what it does not know, is compact, and judges plans."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given, settings, strategies as st

from companion.core.guard.depth.grid import (
    DepthGrid,
    PlanLeg,
    PlanProblem,
    Sounding,
    build,
    check_plan,
    offset,
    unknown_share,
)
from companion.core.guard.depth.plan_legs import plan_legs
from companion.core.guard.depth.soundings import cell_of, dune_reference, parse, parse_csv, parse_dune, parse_xyz
from companion.io.depth_map import load_depth_map
from mavlink_bridge.language.figures import Circle, FigureEight, Hover, Racetrack
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    ChangeSpeed,
    EstimatedState,
    Goto,
    Jump,
    Loiter,
    LoiterDirection,
)
from sitl.plant.bottom import Soundings

HERE = (math.radians(41.18), math.radians(-8.70))


def place(north_m: float, east_m: float, depth_m: float) -> Sounding:
    return Sounding(*offset(*HERE, north_m, east_m), depth_m)


def test_the_offset_agrees_with_the_geodesic():
    frame = LocalFrame(*HERE)
    for north, east in ((0.0, 0.0), (3000.0, -1400.0), (-2000.0, 2500.0), (5.0, 5.0)):
        assert frame.to_local(*offset(*HERE, north, east)) == pytest.approx((north, east), abs=0.02)


SOME = st.lists(
    st.tuples(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0), st.floats(-2.0, 60.0)), min_size=1, max_size=25
)


@settings(max_examples=60, deadline=None)
@given(
    SOME, st.floats(-230.0, 230.0), st.floats(-230.0, 230.0), st.sampled_from([(5.0, 10.0), (2.0, 7.0), (10.0, 0.0)])
)
def test_no_sounding_within_the_spread_is_shallower_than_the_map(soundings, north, east, sizes):
    pitch, spread = sizes
    grid = build([place(*item) for item in soundings], pitch, spread)
    depth = grid.depth_at(*offset(*HERE, north, east))
    near = [d for n, e, d in soundings if math.hypot(n - north, e - east) <= spread - 0.05]
    if near:
        assert depth is not None
        assert depth <= min(near) + 1e-7
    far = [math.hypot(n - north, e - east) for n, e, _ in soundings]
    if min(far) > spread + 1.5 * pitch:
        assert depth is None


def test_the_map_is_never_deeper_than_an_interpolated_bottom():
    rng = random.Random(3)
    soundings = [place(rng.uniform(-150, 150), rng.uniform(-150, 150), rng.uniform(1.0, 20.0)) for _ in range(400)]
    grid, bottom = build(soundings), Soundings(soundings, LocalFrame(*HERE))
    known = 0
    for _ in range(2000):
        north, east = rng.uniform(-170, 170), rng.uniform(-170, 170)
        depth, charted = bottom.depth_at(north, east), grid.depth_at(*offset(*HERE, north, east))
        if depth is not None:
            known += 1
            assert charted is not None
            assert charted <= depth + 1e-9
    assert known > 1000


def test_depths_are_whole_centimetres_to_the_shallow_side():
    grid = build([place(0, 0, 4.1), place(100, 0, 4.109), place(200, 0, -0.501), place(300, 0, 1e6)])
    found = [grid.depth_at(*offset(*HERE, n, 0.0)) for n in (0, 100, 200, 300)]
    assert found == [4.10, 4.10, -0.51, 327.67]


def test_the_plane_of_a_state_is_the_same_map():
    grid = build([place(30, 0, 5.0), place(0, 30, 8.0)])
    lat, lon = offset(*HERE, 3.0, 4.0)
    plane = grid.plane(EstimatedState(0, lat_rad=lat, lon_rad=lon, x_m=1003.0, y_m=504.0))
    assert plane(1030.0, 500.0) == 5.0
    assert plane(1000.0, 530.0) == 8.0
    assert plane(1200.0, 500.0) is None
    assert grid.plane(EstimatedState(0)) is None


def test_a_stored_grid_comes_back_and_damage_is_found():
    grid = build([place(30, 0, 5.0), place(0, 30, 8.0)])
    data = grid.to_bytes()
    again = DepthGrid.from_bytes(data)
    assert again.depth_at(*offset(*HERE, 30, 0)) == 5.0
    assert (again.rows, again.columns, again.known_share()) == (grid.rows, grid.columns, grid.known_share())
    for i in range(0, len(data), 7):
        broken = bytearray(data)
        broken[i] ^= 1
        with pytest.raises(ValueError, match=r"damaged|not a depth grid"):
            DepthGrid.from_bytes(bytes(broken))
    with pytest.raises(ValueError, match="not a depth grid"):
        DepthGrid.from_bytes(data[:20])


def test_no_soundings_and_too_many_cells_are_said():
    with pytest.raises(ValueError, match="no soundings"):
        build([Sounding(*HERE, math.nan)])
    with pytest.raises(ValueError, match="larger pitch_m"):
        build([place(0, 0, 5.0), place(20_000, 20_000, 5.0)], 1.0)


# ---- plans


def test_the_first_item_over_the_shallow_is_named():
    grid = build([place(n, e, 3.0 if n > 90 else 20.0) for n in range(-20, 150, 5) for e in range(-20, 60, 5)])
    points = [offset(*HERE, n, e) for n, e in ((0, 0), (50, 0), (50, 40), (130, 40), (0, 40))]
    legs = [PlanLeg(i + 4, (points[i], points[i + 1])) for i in range(4)]
    assert check_plan(grid, legs, 4.0) == PlanProblem(6, "charted depth 3.0 m, at least 4.0 m needed")
    assert check_plan(grid, legs[:2], 4.0) is None
    assert check_plan(grid, legs, 3.0) is None
    assert check_plan(grid, [PlanLeg(9, (points[3],))], 4.0) == PlanProblem(
        9, "charted depth 3.0 m, at least 4.0 m needed"
    )


def test_a_narrow_bank_far_along_a_leg_is_found_and_unknown_water_passes():
    grid = build([place(5000.0, e, 1.0) for e in range(-30, 31, 5)], 5.0, 5.0)
    away = (offset(*HERE, -20_000.0, 0.0), offset(*HERE, 9000.0, 0.0))
    assert check_plan(grid, [PlanLeg(0, away)], 4.0) is not None
    assert check_plan(grid, [PlanLeg(0, tuple(reversed(away)))], 4.0) is not None
    assert check_plan(grid, [PlanLeg(0, (offset(*HERE, 0.0, 200.0), offset(*HERE, 9000.0, 200.0)))], 4.0) is None
    assert check_plan(grid, [PlanLeg(0, (offset(*HERE, 0.0, -90.0), offset(*HERE, 0.0, 90.0)))], 4.0) is None


def at(north: float, east: float) -> dict[str, float]:
    lat, lon = offset(*HERE, north, east)
    return {"lat_rad": lat, "lon_rad": lon}


def metres(leg: PlanLeg) -> list[tuple[float, float]]:
    frame = LocalFrame(*HERE)
    return [tuple(round(value, 1) for value in frame.to_local(*point)) for point in leg.points_rad]


def strip_at(lon_deg):
    """A mile of 12 m with a strip of 1 m across it; longitudes may lie beyond 180."""
    lat, lon = 0.1, math.radians(lon_deg)
    shape = (
        (east, north, 1.0 if -20.0 <= east <= 20.0 else 12.0) for east in range(-500, 501, 20) for north in (-20, 20)
    )
    return build((Sounding(*offset(lat, lon, north, east), depth_m) for east, north, depth_m in shape), 10.0, 30.0)


def leg(from_deg, to_deg):
    return [PlanLeg(1, tuple((0.1, math.radians(deg)) for deg in (from_deg, to_deg)))]


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("there", [179.99, 179.0])
def test_a_plan_across_the_180th_meridian_is_held_against_the_chart_it_crosses(side, there):
    """It was held against what lies the other way round the earth: the shoal on it was not seen, one behind the boat was."""
    chart = strip_at(side * there)
    over, behind = leg(side * (there - 0.003), -side * 179.95), leg(side * (there + 0.003), -side * 179.95)
    for legs in (over, [PlanLeg(1, tuple(reversed(over[0].points_rad)))]):
        assert check_plan(chart, legs, 4.0) is not None
        assert 0.05 < unknown_share(chart, legs) < 0.999
    assert check_plan(chart, behind, 4.0) is None
    assert check_plan(strip_at(0.0), over, 4.0) is None
    assert unknown_share(strip_at(0.0), over) == 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_chart_that_reaches_over_the_180th_meridian_is_known_on_both_sides(side):
    """What a sounding counts for does not end there."""
    chart = strip_at(side * 180.0)
    for deg in (179.9999, -179.9999):
        assert chart.depth_at(0.1, math.radians(deg)) == 1.0
        assert check_plan(chart, leg(side * 179.99, deg), 4.0) is not None
    assert unknown_share(chart, leg(179.997, -179.997)) == 0.0


def test_plans_are_laid_out_leg_by_leg():
    items = [ChangeSpeed(0, 1.5), Goto(1, **at(10, 0)), Goto(2, **at(10, 20)), Jump(3, 1, 2)]
    legs = plan_legs(items, HERE, 20.0)
    assert [leg.seq for leg in legs] == [1, 2, 3]
    assert [metres(leg) for leg in legs] == [[(0, 0), (10, 0)], [(10, 0), (10, 20)], [(10, 20), (10, 0)]]
    assert metres(plan_legs(items, None, 20.0)[0]) == [(10, 0)]
    assert plan_legs([Jump(0, 5, 1)], HERE, 20.0) == []


def test_a_loiter_is_its_whole_figure():
    circle = metres(plan_legs([Loiter(0, figure=Circle(radius_m=20.0), **at(0, 0))], HERE, 5.0)[0])[1:]
    assert circle[0] == circle[-1], "all the way round"
    assert all(math.hypot(*point) == pytest.approx(20.0, abs=0.2) for point in circle)
    assert len(circle) > 24
    default = metres(plan_legs([Loiter(0, **at(0, 0))], HERE, 5.0)[0])[1:]
    assert max(math.hypot(*point) for point in default) == pytest.approx(5.0, abs=0.2)
    track = Loiter(
        0, figure=Racetrack(length_m=60.0, radius_m=10.0, bearing_rad=0.0, direction=LoiterDirection.CCW), **at(0, 0)
    )
    north = [point[0] for point in metres(plan_legs([track], HERE, 5.0)[0])]
    assert (max(north), min(north)) == pytest.approx((40.0, -40.0), abs=0.3)
    eight = Loiter(0, figure=FigureEight(length_m=40.0, radius_m=10.0, bearing_rad=math.pi / 2), **at(0, 0))
    east = [point[1] for point in metres(plan_legs([eight], HERE, 5.0)[0])]
    assert (max(east), min(east)) == pytest.approx((30.0, -30.0), abs=0.3)
    hover = Loiter(0, figure=Hover(), **at(7, 0))
    assert metres(plan_legs([hover], HERE, 5.0)[0]) == [(0, 0), (7, 0)]


def test_a_leg_behind_a_loiter_begins_where_the_vessel_leaves_it_or_is_not_guessed():
    """The centre, where no boat goes, may be a rock."""
    round_it = Loiter(1, figure=Circle(radius_m=40.0), **at(60, 0), turns=1.0)
    legs = plan_legs([Goto(0, **at(10, 0)), round_it, Goto(2, **at(60, 120))], HERE, 20.0)
    assert metres(legs[1])[:2] == [(10, 0), (20, 0)], "joined on the near side"
    assert metres(legs[2]) == [(20, 0), (60, 120)], "left where it was joined, after whole laps"
    for other in ({"duration_s": 60.0}, {"turns": 1.5}, {"turns": 1.0, "exit_toward_next": True}, {}):
        legs = plan_legs(
            [Loiter(1, **at(60, 0), figure=Circle(radius_m=40.0), **other), Goto(2, **at(60, 120))], HERE, 20.0
        )
        assert metres(legs[1]) == [(60, 120)], "left somewhere on the circle"
    inner, outer = (
        Loiter(0, figure=Circle(radius_m=25.0), **at(60, 0), turns=1.0),
        Loiter(1, figure=Circle(radius_m=35.0), **at(60, 0), turns=1.0),
    )
    assert metres(plan_legs([inner, outer], HERE, 20.0)[1])[:2] == [(35, 0), (25, 0)], "from circle to circle"


# ---- reading


def test_xyz_with_comments_separators_and_either_order():
    text = "# a survey\n-8.70 41.18 5.5\n\n-8.71;41.19;6.0,7  # more\n"
    found = parse_xyz(text)
    assert [(round(math.degrees(s.lon_rad), 6), round(math.degrees(s.lat_rad), 6), s.depth_m) for s in found] == [
        (-8.70, 41.18, 5.5),
        (-8.71, 41.19, 6.0),
    ]
    assert parse_xyz("41.18 -8.70 5.5", "lat-lon") == parse_xyz("-8.70 41.18 5.5")


def test_csv_by_its_header_depth_or_elevation():
    depth = parse_csv("Name,Latitude,Longitude,Depth_m\na,41.18,-8.70,5.5\n\n")
    elevation = parse_csv("x;y;elevation\n-8.70;41.18;-5.5\n")
    assert depth == elevation == parse_xyz("-8.70 41.18 5.5")


def test_what_a_spreadsheet_writes_is_read():
    """A byte order mark, tabs and units in the header each gave "the header must name latitude ...", though it did."""
    meant = parse("-8.70 41.18 5.5", "a.xyz")
    for text in (
        "\ufefflat,lon,depth\n41.18,-8.70,5.5\n",
        "lat\tlon\tdepth\r\n41.18\t-8.70\t5.5\r\n",
        "Latitude (deg),Longitude [deg],Depth (m)\n41.18,-8.70,5.5\n",
    ):
        assert parse(text, "a.csv") == meant
    assert parse("\ufeff-8.70 41.18 5.5", "a.xyz") == meant
    assert cell_of("\ufeff# cell_deg 0.1 0.1\n-8.70 41.18 5.5\n") == pytest.approx((math.radians(0.1),) * 2)


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        ("-8,70 41,18 5,2", "a.xyz", "line 1: '-8,70' has a decimal comma; write decimal points .-8.70."),
        ("-8.70 41.18 5,2", "a.xyz", "line 1: '5,2' has a decimal comma"),
        ("# a\n-8,7060;41,1850;3,4", "a.xyz", "line 2: '-8,7060' has a decimal comma"),
        ("lat,lon,depth (ft)\n41.18,-8.7,12\n", "a.csv", "in m; it names lat, lon, depth .ft."),
        ("1 2 3\n1 2 -9999", "a.xyz", "line 2: -9999 is 'unknown', not a depth; leave the line out"),
        ("lat,lon,elevation\n1,2,-32768\n", "a.csv", "line 2: 32768 is 'unknown'"),
        ("1 2", "a.xyz", "line 1: three numbers"),
        ("1 2 x", "a.xyz", "line 1: 'x' is not a number"),
        ("1 2 nan", "a.xyz", "not a number"),
        ("1 95 3", "a.xyz", "line 1: no such position"),
        ("a,b\n1,2\n", "a.csv", "header must name"),
        ("", "a.csv", "header must name"),
        ("lat,lon,depth\n1,2\n", "a.csv", "line 2: 3 fields"),
        ("lat,lon,depth\n1,2,?\n", "a.csv", "line 2"),
        ("[Bathymetry]\n", "a.ini", "no Latitude"),
        ("Latitude (degrees) = 41\nLongitude (degrees) = -8\n", "a.ini", "no Data"),
        ("Latitude = 41\nLongitude = -8\nData = 1 2 3,\n 4 5", "a.ini", "line 4: triples"),
    ],
)
def test_what_cannot_be_read_is_named_by_its_line(text, name, message):
    with pytest.raises(ValueError, match=message):
        parse(text, name)


def test_the_dune_simulators_ini():
    text = "# DUNE\n[Bathymetry]\nLatitude (degrees)  = 41.18\nLongitude (degrees) = -8.70\n\nData = 10 20 5.5,\n  -10.5 0 2.0 # shoal\n"
    assert dune_reference(text) == pytest.approx(HERE)
    found = parse_dune(text)
    frame = LocalFrame(*HERE)
    assert [(*(round(v, 2) for v in frame.to_local(s.lat_rad, s.lon_rad)), s.depth_m) for s in found] == [
        (10.0, 20.0, 5.5),
        (-10.5, 0.0, 2.0),
    ]


def test_files_of_every_kind(tmp_path):
    (tmp_path / "a.xyz").write_text("-8.70 41.18 5.5\n", "utf-8")
    grid = load_depth_map(tmp_path / "a.xyz", 2.0, 3.0)
    assert grid.depth_at(*HERE) == 5.5
    (tmp_path / "a.depth").write_bytes(grid.to_bytes())
    assert load_depth_map(tmp_path / "a.depth").depth_at(*HERE) == 5.5
    (tmp_path / "b.xyz").write_text("nothing here at all\n", "utf-8")
    with pytest.raises(ValueError, match=r"b\.xyz: line 1"):
        load_depth_map(tmp_path / "b.xyz")
    (tmp_path / "c.xyz").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"c\.xyz"):
        load_depth_map(tmp_path / "c.xyz")


def test_the_soundings_of_leixoes(leixoes):
    text = leixoes.read_text("utf-8")
    soundings = parse_dune(text)
    assert len(soundings) == 13_137
    assert sum(s.depth_m < 4.0 for s in soundings) == 982
    assert (min(s.depth_m for s in soundings), max(s.depth_m for s in soundings)) == (0.2, 15.1)
    grid = load_depth_map(leixoes)
    assert all(grid.depth_at(s.lat_rad, s.lon_rad) <= s.depth_m for s in soundings)
    assert len(grid.to_bytes()) < 30_000
