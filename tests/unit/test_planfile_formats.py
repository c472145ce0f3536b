"""Plan files of every format: what is read, what is refused, and that what is written reads back the same."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language import messages as imc
from mavlink_bridge.language.figures import Circle, FigureEight, Hover, Racetrack
from mavlink_bridge.language.messages import LoiterDirection
from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_export import InexpressibleError, items_from_maneuvers
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.plans import seed_json
from mavlink_bridge.plans.files import PlanFile, PlanFileError, read_plan, write_plan, write_wpl

KNOT = 1852.0 / 3600.0
LAT, LON = math.radians(41.1850123), math.radians(-8.7062154)


def simple(command, *params, jump_id=None, frame=3):
    entry = {"type": "SimpleItem", "command": command, "frame": frame, "autoContinue": True, "params": list(params)}
    return entry if jump_id is None else entry | {"doJumpId": jump_id}


def plan_json(*items, **extra):
    mission = {"version": 2, "items": list(items), "plannedHomePosition": [41.0, -8.7, 10]}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": mission} | extra)


def point(number, jump_id=None):
    return simple(16, 0, 0, 0, None, 41.0 + number / 1000, -8.7, 50, jump_id=jump_id)


def test_a_qgc_plan_gives_items_home_fence_and_rally():
    fence = {
        "version": 2,
        "polygons": [{"version": 1, "inclusion": True, "polygon": [[41, -8], [41.1, -8], [41.1, -8.1]]}],
        "circles": [{"version": 1, "inclusion": False, "circle": {"center": [41, -8], "radius": 12.5}}],
        "breachReturn": [41, -8, 50],
    }
    rally = {"version": 2, "points": [[41.0, -8.7, 0]]}
    found = read_plan(plan_json(point(0), point(1), geoFence=fence, rallyPoints=rally))
    assert [item.x for item in found.mission] == [410_000_000, 410_010_000]
    assert math.isnan(found.mission[0].param4)
    assert found.home_rad == (math.radians(41.0), math.radians(-8.7))
    assert [item.command for item in found.fence] == [5001, 5001, 5001, 5004, 5000]
    assert [item.param1 for item in found.fence[:4]] == [3.0, 3.0, 3.0, 12.5]
    assert [item.command for item in found.items(PlanKind.RALLY)] == [5100]


def test_jumps_in_a_plan_name_ids_and_become_places():
    found = read_plan(plan_json(point(0, 10), point(1, 20), simple(177, 20, 3, 0, 0, 0, 0, 0, jump_id=30, frame=2)))
    assert found.mission[2].param1 == 1.0
    # ids that QGroundControl numbers from 1
    found = read_plan(plan_json(point(0), point(1), simple(177, 1, 3, 0, 0, 0, 0, 0, frame=2)))
    assert found.mission[2].param1 == 0.0
    lost = read_plan(plan_json(point(0, 1), simple(177, 9, 3, 0, 0, 0, 0, 0, jump_id=2, frame=2)))
    assert compile_items(lost.mission).errors[0].field == 1


def test_survey_and_corridor_items_are_expanded_in_place():
    survey = {
        "type": "ComplexItem",
        "complexItemType": "CorridorScan",
        "TransectStyleComplexItem": {"Items": [point(1, 2), simple(206, 25, 0, 1, 0, 0, 0, 0, jump_id=3, frame=2)]},
    }
    found = read_plan(plan_json(point(0, 1), survey, point(2, 4)))
    assert [item.command for item in found.mission] == [16, 16, 206, 16]
    assert found.notes == ("CorridorScan expanded to 2 items",)
    assert not compile_items(found.mission).errors


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (plan_json(point(0)).replace('"version": 1', '"version": 42'), "version 42"),
        (plan_json(point(0)).replace('"Plan"', '"Params"'), "Params"),
        (plan_json({"type": "ComplexItem", "complexItemType": "StructureScan"}), "StructureScan"),
        (plan_json({"type": "SimpleItem", "command": 16, "frame": 3, "params": [1, 2]}), "numbers"),
        (plan_json({"type": "SimpleItem", "command": "x", "frame": 3}), "mission.items.0"),
        (plan_json({"type": "Magic"}), "mission.items.0"),
        ('{"fileType": "Plan", "version": 1}', "mission"),
        ('{"fileType": "Plan", "fileType": "Plan"}', "twice"),
        ('{"mission": NaN}', "NaN"),
        ("[" * 100_000, "not JSON"),
        ("{", "not JSON"),
        ("", "no plan"),
        ("hello", "neither"),
        ("QGC WPL 999\n", "999"),
        ("QGC WPL 110\n0\t1\t0\n", "3 columns"),
        ("QGC WPL 110\n5\t1\t0\t16\t0\t0\t0\t0\t0\t0\t0\t1\n", "item number 5"),
        ("QGC WPL 110\n0\t1\t0\tx\t0\t0\t0\t0\t0\t0\t0\t1\n", "line 2"),
        ("QGC WPL 110\n0\t1\tnan\t16\t0\t0\t0\t0\t0\t0\t0\t1\n", "line 2"),
        ("QGC WPL 110\n0\t1\t0\t16\t1e39\t0\t0\t0\t0\t0\t0\t1\n", "too large"),
        ("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t0\t0\t0\tinf\n", "line 2"),
        (plan_json(simple(16, 1e300, 0, 0, 0, 41, -8, 0)), "too large"),
        (b"\xff\xfe\x00\x01", "UTF-8"),
        (b" " * 8_000_001, "8000001"),
    ],
    ids=range(23),
)
def test_what_is_no_usable_plan_is_refused_with_the_reason(text, words):
    with pytest.raises(PlanFileError, match=words):
        read_plan(text)


def test_every_bad_line_is_told_at_once():
    with pytest.raises(PlanFileError) as caught:
        read_plan("QGC WPL 110\nx\ny\n")
    assert len(caught.value.problems) == 2


WPL = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t41.0\t-8.7\t10\t1
1\t0\t3\t16\t0\t0\t0\t0\t41.001\t-8.7\t50\t1
2\t0\t3\t177\t1\t-1\t0\t0\t0\t0\t0\t1
"""


def test_the_home_row_of_wpl_is_taken_off_and_jumps_are_counted_without_it():
    found = read_plan(WPL)
    assert [item.command for item in found.mission] == [16, 177]
    assert found.mission[1].param1 == 0.0
    assert found.home_rad == (math.radians(41.0), math.radians(-8.7))
    old = read_plan(WPL.replace("110", "120"))
    assert [item.command for item in old.mission] == [16, 16, 177]


def test_a_first_row_that_cannot_be_home_is_an_item():
    found = read_plan("QGC WPL 110\n0\t1\t3\t19\t60\t0\t20\t0\t41.0\t-8.7\t10\t1\n")
    assert [item.command for item in found.mission] == [19]
    assert "row 0" in found.notes[0]


def test_windows_line_ends_spaces_and_byte_order_marks_are_read():
    assert len(read_plan(WPL.replace("\n", "\r\n").encode("utf-8-sig")).mission) == 2
    assert len(read_plan(WPL.replace("\t", "   ")).mission) == 2


def test_wpl_and_plan_written_read_back_the_same():
    found = read_plan(WPL)
    assert plan_id(read_plan(write_wpl(found)).mission) == plan_id(found.mission)
    assert read_plan(write_plan(found)) == PlanFile(
        found.mission, home_rad=found.home_rad, format="QGroundControl plan"
    )


def test_a_plan_written_by_us_is_what_qgc_expects():
    whole = json.loads(write_plan(read_plan(WPL)))
    assert (whole["fileType"], whole["version"], whole["mission"]["version"]) == ("Plan", 1, 2)
    assert [item["doJumpId"] for item in whole["mission"]["items"]] == [1, 2]
    assert whole["mission"]["items"][1]["params"][0] == 1.0
    assert whole["mission"]["vehicleType"] == 11


numbers = st.floats(-1e6, 1e6, width=32) | st.just(math.nan)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.builds(
            PlanItem,
            st.integers(0, 65_535).filter(lambda command: command != 177),
            st.sampled_from([0, 2, 3, 5, 6, 10, 11]),
            *(numbers, numbers, numbers, numbers),
            st.integers(-900_000_000, 900_000_000),
            st.integers(-1_800_000_000, 1_800_000_000),
            numbers,
            st.sampled_from([0, 1]),
        ),
        max_size=8,
    )
)
def test_any_item_survives_a_plan_file_bit_for_bit(items):
    back = read_plan(write_plan(PlanFile(tuple(items))))
    assert plan_id(back.mission) == plan_id(items)


# The seed's JSON

LOITER = {
    "id": "loiter-1",
    "latitude": 41.1850123,
    "longitude": -8.7062154,
    "duration_s": 600,
    "loiter_type": "circular",
    "speed_kn": 3.0,
    "length_m": 40.0,
    "radius_m": 20.0,
}


def test_the_seeds_loiter_becomes_a_speed_and_a_loiter():
    (plan,) = seed_json.parse(json.dumps(LOITER))
    assert plan.name == "loiter-1"
    assert plan.loiter == imc.Loiter(
        0, LAT, LON, figure=imc.Circle(radius_m=20.0), duration_s=600.0, speed_mps=3.0 * KNOT
    )
    items = read_plan(json.dumps(LOITER)).mission
    assert [item.command for item in items] == [178, 19]
    assert (items[0].param2, items[1].param1, items[1].param3) == (3.0 * KNOT, 600.0, 20.0)
    assert (items[1].x, items[1].y) == (411_850_123, -87_062_154)


@pytest.mark.parametrize(
    "text",
    [
        '{"v":1,"id":"loiter-1","lat":41.1850123,"lon":-8.7062154,"dur":600,"type":"circular","spd":3.0,"len":40.0,"rad":20.0}',
        '{"ID":"loiter-1","Latitude":41.1850123,"Longitude":-8.7062154,"Duration":600,"Loiter type":"Circular",'
        '"Speed":3.0,"Length":40.0,"Radius":20.0}',
    ],
)
def test_short_keys_and_the_seeds_labels_mean_the_same(text):
    assert seed_json.parse(text) == seed_json.parse(json.dumps(LOITER))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("racetrack", Racetrack),
        ("HOVER", Hover),
        ("Figure-Eight", FigureEight),
        ("LT_EIGHT", FigureEight),
        ("LT_CIRCULAR", Circle),
    ],
)
def test_every_kind_of_loiter_compiles_to_itself(name, kind):
    items = read_plan(json.dumps(LOITER | {"loiter_type": name, "bearing_deg": 30, "direction": "ccw"})).mission
    loiter = compile_items(items).plan.maneuvers[1]
    figure = loiter.figure
    assert type(figure) is kind
    if kind is not Hover:
        assert (figure.radius_m, figure.direction) == (20.0, LoiterDirection.CCW)
    if kind in (Racetrack, FigureEight):
        assert figure.length_m == pytest.approx(40.0)
        assert math.degrees(figure.bearing_rad) == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"loiter_type": "spiral"}, "spiral"),
        ({"loiter_type": 5}, "loiter type"),
        ({"latitude": 90.1}, "latitude"),
        ({"latitude": "41"}, "number"),
        ({"latitude": True}, "number"),
        ({"longitude": None}, "longitude"),
        ({"duration_s": -1}, "duration"),
        ({"radius_m": -20}, "radius"),
        ({"speed_kn": 0}, "speed"),
        ({"speed_kn": 1e9}, "speed"),
        ({"id": ""}, "id"),
        ({"id": "a\nb"}, "id"),
        ({"colour": "red"}, "colour"),
        ({"lat": 41.0}, "twice"),
        ({"direction": "left"}, "direction"),
        ({"v": 2}, "version"),
        ({"loiter_type": "racetrack", "length_m": 0}, "length"),
        ({"loiter_type": "figure-eight", "length_m": 30}, "twice the radius"),
    ],
)
def test_bad_seed_plans_are_refused_never_guessed(change, words):
    with pytest.raises(seed_json.SeedJsonError, match=words):
        seed_json.parse(json.dumps(LOITER | change))


@pytest.mark.parametrize(
    "data",
    [b"", b"{}", b"[]", b"null", b"[[[", b'{"id":' * 10_000, b'"' + b"x" * 70_000 + b'"', b"\xff\xfe{}", b"1e999"]  # noqa: RUF005
    + [json.dumps(LOITER).encode() * 2, json.dumps(LOITER)[:-5].encode(), b'{"id":"a","id":"b"}']
    + [json.dumps(LOITER).replace("600", "1e999").encode(), json.dumps(LOITER).replace("600", "NaN").encode()],
)
def test_hostile_json_is_refused(data):
    with pytest.raises(seed_json.SeedJsonError):
        seed_json.parse(data)


def test_seed_json_written_reads_back():
    (plan,) = seed_json.parse(json.dumps(LOITER | {"direction": "ccw", "bearing_deg": 12.5}))
    (back,) = seed_json.parse(seed_json.write(plan.name, plan.loiter))
    assert back.loiter.speed_mps == pytest.approx(plan.loiter.speed_mps, abs=1e-3)
    assert (back.loiter.duration_s, back.loiter.figure.direction) == (600.0, LoiterDirection.CCW)
    with pytest.raises(seed_json.SeedJsonError):
        seed_json.write("x", imc.Loiter(0, LAT, LON, turns=3.0, speed_mps=1.0))


# Manoeuvres to items and back: dune-imc table 2.2

# 0/0 means that no place is given
angle = st.floats(0.1, 1.4) | st.floats(-1.4, -0.1)
metres = st.integers(5, 500).map(float)
seconds = st.none() | st.integers(1, 3_600).map(float)
circling = st.sampled_from([LoiterDirection.CW, LoiterDirection.CCW])
MANOEUVRES = st.one_of(
    st.builds(
        imc.Goto, st.just(0), angle, angle, hold_s=st.integers(0, 60).map(float), acceptance_m=st.none() | metres
    ),
    st.builds(
        imc.Loiter,
        *(st.just(0), angle, angle),
        figure=st.builds(Circle, radius_m=metres, direction=circling) | st.just(Hover()),
        duration_s=seconds,
    ),
    st.builds(
        imc.Loiter,
        *(st.just(0), angle, angle),
        figure=st.builds(Circle, radius_m=metres, direction=circling),
        turns=st.integers(1, 9).map(float),
    ),
    st.builds(
        imc.Loiter,
        *(st.just(0), angle, angle),
        figure=st.builds(
            Racetrack, radius_m=metres, length_m=metres, bearing_rad=st.floats(0.0, 6.28), direction=circling
        ),
        duration_s=seconds,
    ),
    st.builds(
        imc.Loiter,
        *(st.just(0), angle, angle),
        figure=st.builds(
            FigureEight,
            radius_m=st.just(20.0),
            length_m=st.integers(40, 500).map(float),
            bearing_rad=st.floats(-3.14, 3.14),
            direction=circling,
        ),
        duration_s=seconds,
    ),
    st.builds(
        imc.Loiter,
        *(st.just(0), angle, angle),
        figure=st.builds(
            Circle,
            radius_m=metres,
            direction=st.sampled_from([LoiterDirection.INTO_DRIFT, LoiterDirection.VESSEL]),
        ),
        duration_s=seconds,
    ),
    st.builds(imc.Delay, st.just(0), duration_s=st.integers(1, 999).map(float)),
    st.builds(imc.Delay, st.just(0), until_utc_s_of_day=st.integers(0, 86_399).map(float)),
    st.builds(imc.ChangeSpeed, st.just(0), st.none() | st.floats(0.125, 10.0)),
    st.builds(imc.SetHome, st.just(0), angle, angle),
    st.builds(imc.FenceEnable, st.just(0), st.booleans()),
    st.sampled_from([imc.ReturnHome(0), imc.SetHome(0), imc.Noted(0, 206, "DO_SET_CAM_TRIGG_DIST")]),
)


def same(left, right):
    """Equal but for what an item rounds: positions to 1e-7 degree."""
    pairs = [(getattr(left, name), getattr(right, name)) for name in type(right).__slots__]
    return type(left) is type(right) and all(alike(a, b) for a, b in pairs)


def alike(left, right):
    if isinstance(left, float) and isinstance(right, float):
        return math.isclose(left, right, rel_tol=1e-9, abs_tol=2e-9)
    return same(left, right) if isinstance(left, imc.Figure) else left == right


@settings(max_examples=300, deadline=None)
@given(MANOEUVRES)
def test_every_manoeuvre_survives_the_way_through_a_plan_item(maneuver):
    items = items_from_maneuvers([maneuver])
    compiled = compile_items(items)
    assert not compiled.errors
    (back,) = compiled.plan.maneuvers
    assert same(back, maneuver)


def test_speeds_of_manoeuvres_become_items_and_jumps_follow():
    plan = [
        imc.Goto(0, LAT, LON, speed_mps=2.0),
        imc.Goto(1, LAT, LON),
        imc.ChangeSpeed(2, 3.0),
        imc.Loiter(3, LAT, LON, figure=imc.Circle(radius_m=10.0), speed_mps=1.0),
        imc.Goto(4, LAT, LON),
        imc.Jump(5, 3, 1),
    ]
    items = items_from_maneuvers(plan)
    assert [(item.command, item.param2) for item in items if item.command == 178] == [
        (178, 2.0),
        (178, -2.0),
        (178, 3.0),
        (178, 1.0),
        (178, 3.0),
    ]
    jump = items[-1]
    assert items[int(jump.param1)].param2 == 1.0
    assert not compile_items(items).errors


@pytest.mark.parametrize(
    "maneuver",
    [
        imc.Loiter(0, LAT, LON, duration_s=5.0, turns=2.0),
        imc.Loiter(0, LAT, LON, figure=imc.Racetrack()),
        imc.Loiter(0, LAT, LON, figure=imc.Racetrack(length_m=9.0, direction=LoiterDirection.INTO_DRIFT)),
        imc.Loiter(0, LAT, LON, figure=imc.FigureEight(length_m=40.0, radius_m=9.0), turns=2.0),
        imc.Loiter(0, LAT, LON, figure=imc.Circle(direction=LoiterDirection.CCW)),
        imc.Jump(0, 5, 1),
    ],
)
def test_what_no_item_can_say_is_refused(maneuver):
    with pytest.raises(InexpressibleError):
        items_from_maneuvers([maneuver])
