"""What each plan item means, and how a bad one is refused."""

from __future__ import annotations

import dataclasses
import math

import pytest

from mavlink_bridge.language.figures import Circle, FigureEight, Hover, Racetrack
from mavlink_bridge.language.messages import (
    ChangeSpeed,
    Delay,
    FenceEnable,
    Goto,
    Jump,
    Loiter,
    LoiterDirection,
    Noted,
    ReturnHome,
    SetHome,
)
from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import (
    Cmd,
    MissionResult,
    PlanError,
    PlanLimits,
    compile_item,
    compile_items,
    load_plan,
    plan_id,
)

NAN = math.nan
LAT, LON = 411_850_123, -87_062_154
HERE = (math.radians(LAT / 1e7), math.radians(LON / 1e7))


def at(command, p1=0.0, p2=0.0, p3=0.0, p4=NAN, *, frame=3, x=LAT, y=LON, z=50.0):
    return PlanItem(command, frame, p1, p2, p3, p4, x, y, z)


def plain(command, p1=0.0, p2=0.0, p3=0.0, p4=0.0):
    return PlanItem(command, 2, p1, p2, p3, p4, 0, 0, 0.0)


CCW = LoiterDirection.CCW
# item as a ground station sends it, the manoeuvre that it means
MEANINGS = [
    (at(16), Goto(0, *HERE)),
    (at(16, 5.0, 3.0), Goto(0, *HERE, hold_s=5.0, acceptance_m=3.0)),
    (at(16, NAN, NAN, NAN), Goto(0, *HERE)),
    (at(17, p3=50.0), Loiter(0, *HERE, figure=Circle(radius_m=50.0))),
    (at(17, p3=NAN), Loiter(0, *HERE)),
    (at(17, p3=0.0), Loiter(0, *HERE, figure=Hover())),
    (
        at(18, 2.5, 1.0, -20.0, 1.0),
        Loiter(0, *HERE, figure=Circle(radius_m=20.0, direction=CCW), turns=2.5, exit_toward_next=True),
    ),
    (at(19, 600.0, 0.0, 20.0, 1.0), Loiter(0, *HERE, figure=Circle(radius_m=20.0), duration_s=600.0)),
    (at(19, 600.0, 1.0, 0.0, 1.0), Loiter(0, *HERE, figure=Hover(), duration_s=600.0, exit_toward_next=True)),
    (
        at(31, 1.0, -30.0),
        Loiter(0, *HERE, figure=Circle(radius_m=30.0, direction=CCW), duration_s=0.0, exit_toward_next=True),
    ),
    (at(34, -25.0, 1.5, 3.0, 0.0), Loiter(0, *HERE, figure=Circle(radius_m=25.0, direction=CCW), speed_mps=1.5)),
    (at(34, 25.0, NAN, 3.0, math.tau * 3), Loiter(0, *HERE, figure=Circle(radius_m=25.0), turns=3.0)),
    (
        at(35, -60.0, 20.0, 90.0, 0.5),
        Loiter(
            *(0, *HERE),
            figure=FigureEight(length_m=80.0, radius_m=20.0, bearing_rad=0.5, direction=CCW),
            duration_s=90.0,
        ),
    ),
    (
        at(31_000, 300.0, 100.0, 15.0, 90.0),
        Loiter(*(0, *HERE), figure=Racetrack(length_m=100.0, radius_m=15.0, bearing_rad=math.pi / 2), duration_s=300.0),
    ),
    (
        at(31_001, 0.0, 3.0, 20.0, 1.0),
        Loiter(0, *HERE, figure=Circle(radius_m=20.0, direction=LoiterDirection.INTO_DRIFT), turns=3.0),
    ),
    (
        at(31_001, 60.0, 0.0, 0.0, 0.0),
        Loiter(0, *HERE, figure=Circle(direction=LoiterDirection.VESSEL), duration_s=60.0),
    ),
    (plain(20), ReturnHome(0)),
    (plain(93, 12.0, -1.0, -1.0, -1.0), Delay(0, duration_s=12.0)),
    (plain(93, 60.0), Delay(0, duration_s=60.0)),
    (plain(93, -1.0, 10.0, 30.0, -1.0), Delay(0, until_utc_s_of_day=37_800.0)),
    (plain(112, 7.0), Delay(0, duration_s=7.0)),
    (plain(178, 1.0, 2.5, -1.0), ChangeSpeed(0, 2.5)),
    (plain(178, 0.0, 2.5, 0.0), ChangeSpeed(0, 2.5)),
    (plain(178, 1.0, -2.0, -1.0), ChangeSpeed(0, None)),
    (plain(178, 1.0, -1.0, -1.0), Noted(0, 178, "DO_CHANGE_SPEED")),
    (dataclasses.replace(plain(178, 1.0, 2.0, -1.0), z=NAN), ChangeSpeed(0, 2.0)),
    (plain(179, 1.0), SetHome(0)),
    (at(179, 0.0), SetHome(0, *HERE)),
    (plain(207, 1.0), FenceEnable(0, True)),
    (plain(207, 0.0), FenceEnable(0, False)),
    (plain(206, 25.0, 0.0, 1.0), Noted(0, 206, "DO_SET_CAM_TRIGG_DIST")),
    (at(195), Noted(0, 195, "DO_SET_ROI_LOCATION")),
    (plain(530, 0.0, 2.0, NAN, NAN), Noted(0, 530, "SET_CAMERA_MODE")),
]


@pytest.mark.parametrize(("item", "meaning"), MEANINGS, ids=[f"{i[0].command}-{n}" for n, i in enumerate(MEANINGS)])
def test_each_item_means_one_manoeuvre(item, meaning):
    assert _close(compile_item(0, item), meaning)


def _close(left, right):
    if type(left) is not type(right):
        return False
    for field in dataclasses.fields(left):
        a, b = getattr(left, field.name), getattr(right, field.name)
        if isinstance(a, float) and isinstance(b, float):
            if not math.isclose(a, b, rel_tol=1e-12):
                return False
        elif a != b:
            return False
    return True


def test_check_20_loiter_turns_takes_the_default_radius_for_0_and_nan():
    assert compile_item(0, at(18, 1.0, 0.0, 0.0)).figure.radius_m is None
    assert compile_item(0, at(18, 1.0, 0.0, NAN)).figure.radius_m is None
    assert compile_item(0, at(18, 1.0, 0.0, 0.0)).figure == Circle()
    left = compile_item(0, at(18, 1.0, 0.0, -20.0))
    assert (left.figure.radius_m, left.figure.direction) == (20.0, CCW)


@pytest.mark.parametrize("frame", [0, 3, 5, 6, 10, 11])
@pytest.mark.parametrize("altitude", [50.0, -10.0, NAN, math.inf])
def test_check_19_altitude_is_never_looked_at(frame, altitude):
    assert isinstance(compile_item(0, at(16, frame=frame, z=altitude)), Goto)


R = MissionResult
# item, field, result
REFUSALS = [
    (at(22), None, R.UNSUPPORTED),
    (at(21), None, R.UNSUPPORTED),
    (plain(183, 1.0, 1_500.0), None, R.UNSUPPORTED),
    (plain(65_535), None, R.UNSUPPORTED),
    (at(16, frame=1), None, R.UNSUPPORTED_FRAME),
    (at(16, frame=2), None, R.UNSUPPORTED_FRAME),
    (at(16, frame=255), None, R.UNSUPPORTED_FRAME),
    (at(16, -1.0), 1, R.INVALID_PARAM1),
    (at(16, math.inf), 1, R.INVALID_PARAM1),
    (at(16, 1e38), 1, R.INVALID_PARAM1),
    (at(16, 0.0, -5.0), 2, R.INVALID_PARAM2),
    (at(16, 0.0, 0.0, math.inf), 3, R.INVALID_PARAM3),
    (at(16, x=0, y=0), 5, R.INVALID_PARAM5_X),
    (at(16, x=0x7FFFFFFF), 5, R.INVALID_PARAM5_X),
    (at(16, x=-0x80000000), 5, R.INVALID_PARAM5_X),
    (at(16, x=900_000_001), 5, R.INVALID_PARAM5_X),
    (at(16, y=1_800_000_001), 6, R.INVALID_PARAM6_Y),
    (at(16, y=0x7FFFFFFF), 6, R.INVALID_PARAM6_Y),
    (at(17, p3=1e9), 3, R.INVALID_PARAM3),
    (at(17, p3=-math.inf), 3, R.INVALID_PARAM3),
    (at(18, NAN), 1, R.INVALID_PARAM1),
    (at(18, -1.0), 1, R.INVALID_PARAM1),
    (at(19, -1.0), 1, R.INVALID_PARAM1),
    (at(19, NAN), 1, R.INVALID_PARAM1),
    (at(31, 0.0, 1e9), 2, R.INVALID_PARAM2),
    (at(35, 30.0, 20.0), 1, R.INVALID_PARAM1),
    (at(35, 60.0, NAN), 1, R.INVALID_PARAM1),
    (at(35, 60.0, 20.0, 0.0, 100.0), 4, R.INVALID_PARAM4),
    (at(31_000, 0.0, NAN, 10.0, 0.0), 2, R.INVALID_PARAM2),
    (at(31_000, 0.0, 50.0, 10.0, 400.0), 4, R.INVALID_PARAM4),
    (at(31_001, 0.0, 0.0, 10.0, 7.0), 4, R.INVALID_PARAM4),
    (plain(93, 0.0, 24.0), 2, R.INVALID_PARAM2),
    (plain(93, -1.0, -1.0, 30.0), 2, R.INVALID_PARAM2),
    (plain(177, 0.0, 1.0), 1, R.INVALID_PARAM1),
    (plain(177, NAN, 1.0), 1, R.INVALID_PARAM1),
    (plain(177, 1.5, 1.0), 1, R.INVALID_PARAM1),
    (plain(177, -1.0, 1.0), 1, R.INVALID_PARAM1),
    (plain(177, 3.0, NAN), 2, R.INVALID_PARAM2),
    (plain(177, 3.0, -2.0), 2, R.INVALID_PARAM2),
    (plain(177, 3.0, 1e9), 2, R.INVALID_PARAM2),
    (plain(178, 2.0, 1.0), 1, R.INVALID_PARAM1),
    (plain(178, 1.0, 0.0), 2, R.INVALID_PARAM2),
    (plain(178, 1.0, -3.0), 2, R.INVALID_PARAM2),
    (plain(178, 1.0, 1e9), 2, R.INVALID_PARAM2),
    (plain(178, 1.0, math.inf), 2, R.INVALID_PARAM2),
    (plain(178, 1.0, -1.0, 50.0), 3, R.INVALID_PARAM3),
    (plain(178, 1.0, 2.0, -1.0, 1.0), 4, R.INVALID_PARAM4),
    (at(179, 0.0, x=0, y=0), 5, R.INVALID_PARAM5_X),
    (plain(207, 2.0), 1, R.INVALID_PARAM1),
]


@pytest.mark.parametrize(
    ("item", "field", "result"), REFUSALS, ids=[f"{row[0].command}-{number}" for number, row in enumerate(REFUSALS)]
)
def test_check_18_a_bad_item_is_refused_with_its_field_and_a_reason(item, field, result):
    error = compile_item(0, item)
    assert isinstance(error, PlanError)
    assert (error.field, error.result) == (field, result)
    assert len(error.reason) > 10


def route(*items):
    return [at(16), *items, at(16, x=LAT + 1000)]


def test_check_21_jumps_name_places_in_the_plan_counted_from_0():
    compiled = compile_items(route(plain(177, 0.0, 3.0)))
    assert compiled.plan.maneuvers[1] == Jump(1, 0, 3)
    assert compile_items(route(plain(177, 0.0, -1.0))).plan.maneuvers[1].repeats == -1


@pytest.mark.parametrize(
    "items",
    [
        route(plain(177, 1.0, -1.0)),
        route(plain(177, 3.0, 1.0)),
        route(plain(177, 828.0, 1.0)),
        # two jumps that bounce between each other
        [at(16), plain(177, 2.0, -1.0), plain(177, 1.0, -1.0)],
        # a loop that only changes speed
        [at(16), plain(178, 1.0, 2.0, -1.0), plain(177, 1.0, -1.0)],
        # the same a finite number of times: still nothing to sail
        [at(16), plain(206, 1.0), plain(177, 1.0, 30_000.0)],
        # a delay of no time is no pause
        [at(16), plain(93, 0.0, -1.0, -1.0, -1.0), plain(177, 1.0, -1.0)],
    ],
    ids=["itself", "past the end", "far past the end", "bounce", "speed loop", "finite loop", "empty delay"],
)
def test_check_21_jumps_that_lead_nowhere_are_refused(items):
    errors = compile_items(items).errors
    assert errors
    assert {error.field for error in errors} == {1}


def test_jump_loops_with_something_to_sail_are_fine():
    assert not compile_items(route(plain(177, 0.0, -1.0))).errors
    assert not compile_items([at(16), plain(93, 5.0), plain(177, 1.0, -1.0)]).errors
    assert not compile_items([at(16), plain(177, 0.0, 2.0), plain(177, 0.0, -1.0)]).errors
    # a jump that never jumps
    assert not compile_items([at(16), plain(177, 2.0, 0.0), plain(177, 1.0, 0.0)]).errors


def test_all_errors_are_told_at_once_and_in_order():
    compiled = compile_items([at(16), at(22), at(18, NAN), at(16)])
    assert [error.seq for error in compiled.errors] == [1, 2]


def test_829_items_fit_and_830_do_not():
    assert not compile_items([at(16)] * 829).errors
    (error,) = compile_items([at(16)] * 830).errors
    assert error.result is R.NO_SPACE


def test_coincident_points_poles_and_the_date_line_compile():
    places = [at(16), at(16), at(19, 5.0, 0.0, 10.0), at(16, x=900_000_000), at(16, y=1_800_000_000)]
    places += [at(16, y=-1_800_000_000), at(16, x=0, y=1), at(16, x=-900_000_000, y=0)]
    assert not compile_items(places).errors


def test_speed_limit_of_the_vessel_is_applied():
    assert isinstance(compile_item(0, plain(178, 1.0, 6.0), PlanLimits(max_speed_mps=5.0)), PlanError)


def test_plan_ids_change_with_every_bit_and_are_never_zero():
    base = route()
    ids = {plan_id(base), plan_id(base[:1]), plan_id([dataclasses.replace(base[0], z=51.0), base[1]])}
    ids.add(plan_id([dataclasses.replace(base[0], param4=0.0), base[1]]))
    assert len(ids) == 4
    assert 0 not in ids
    assert plan_id([]) == 0


def fence(command, count, x=LAT, y=LON):
    return PlanItem(command, 0, float(count), 0.0, 0.0, 0.0, x, y, 0.0)


def test_check_29_two_polygons_and_a_circle_become_areas():
    items = (
        [fence(5001, 3, LAT + 1000 * n, LON + 1000 * (n % 2)) for n in range(3)]
        + [fence(5002, 4, LAT + n) for n in range(4)]
        + [fence(5003, 25.5)]
    )
    load = load_plan(PlanKind.FENCE, [*items, fence(5000, 0)])
    assert isinstance(load, LoadPlan)
    assert [(area.inclusion, len(area.vertices_rad), area.radius_m) for area in load.fence] == [
        (True, 3, None),
        (False, 4, None),
        (True, 0, 25.5),
    ]
    assert load.fence[2].centre_rad == pytest.approx(HERE)


@pytest.mark.parametrize(
    ("items", "result"),
    [
        ([fence(5001, 3)] * 2, R.INVALID),
        ([fence(5001, 2)] * 2, R.INVALID),
        ([fence(5001, 0)], R.INVALID),
        ([fence(5001, -1e10)], R.INVALID),
        ([fence(5001, NAN)] * 3, R.INVALID),
        ([fence(5001, math.inf)] * 3, R.INVALID),
        ([fence(5001, 3.5)] * 4, R.INVALID),
        ([fence(5001, 3), fence(5002, 3), fence(5001, 3)], R.INVALID),
        ([fence(5001, 3), fence(5001, 4), fence(5001, 3)], R.INVALID),
        ([fence(5003, 0.0)], R.INVALID_PARAM1),
        ([fence(5003, NAN)], R.INVALID_PARAM1),
        ([fence(5004, -5.0)], R.INVALID_PARAM1),
        ([fence(5003, 10.0, x=900_000_001)], R.INVALID_PARAM5_X),
        ([fence(5001, 3), fence(5001, 3, y=1_900_000_000), fence(5001, 3)], R.INVALID_PARAM6_Y),
        ([at(16)], R.UNSUPPORTED),
        ([fence(5003, 10.0)] * 830, R.NO_SPACE),
    ],
)
def test_check_29_bad_fences_are_refused(items, result):
    error = load_plan(PlanKind.FENCE, items)
    assert isinstance(error, PlanError)
    assert error.result is result


def test_check_32_rally_points():
    load = load_plan(PlanKind.RALLY, [at(5100), at(5100, x=LAT + 5)])
    assert len(load.rally_rad) == 2
    assert load.rally_rad[0] == pytest.approx(HERE)
    assert load_plan(PlanKind.RALLY, [at(16)]).result is R.UNSUPPORTED
    assert load_plan(PlanKind.RALLY, [at(5100, x=0, y=0)]).field == 5


@pytest.mark.parametrize("value", [NAN, math.inf, -math.inf, 1e38, -1e38, 1e-45, -0.0])
def test_no_value_of_any_field_of_any_item_raises(value):
    for command in [*Cmd, 22, 206, 0, 65_535]:
        for number in range(5):
            fields = [0.0] * 5
            fields[number] = value
            for x, y in ((LAT, LON), (-(2**31), 2**31 - 1)):
                item = PlanItem(int(command), 3, *fields[:4], x, y, fields[4])
                for kind in PlanKind:
                    load_plan(kind, [item])


def test_ardupilots_loiter_at_zero_is_where_the_boat_has_come_to():
    """All of its loiters, also one behind another; never the Gulf of Guinea."""
    kinds = [at(17, p3=10.0, x=0, y=0), at(18, 2.0, p3=10.0, x=0, y=0), at(19, 30.0, x=0, y=0), at(31, x=0, y=0)]
    compiled = compile_items([at(16), *kinds, at(16, x=LAT + 900), at(19, 5.0, x=0, y=0)])
    assert compiled.errors == ()
    loiters = [item for item in compiled.plan.maneuvers if isinstance(item, Loiter)]
    assert [(item.lat_rad, item.lon_rad) for item in loiters[:4]] == [HERE] * 4
    assert loiters[4].lat_rad == math.radians((LAT + 900) / 1e7)
    assert compiled.plan.plan_id == plan_id([at(16), *kinds, at(16, x=LAT + 900), at(19, 5.0, x=0, y=0)])


@pytest.mark.parametrize("items", [[at(19, 5.0, x=0, y=0), at(16)], [at(16), plain(20), at(17, x=0, y=0)]])
def test_a_loiter_at_zero_with_no_place_before_it_is_refused_in_words(items):
    (error,) = compile_items(items).errors
    assert "no item before it" in error.reason


def test_only_loiters_stay_where_the_boat_is():
    for command in (16, 34, 5100):
        assert compile_items([at(16), at(command, x=0, y=0)]).errors
