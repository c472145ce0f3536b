"""What a console's manoeuvres become on the water: metres, figures and refusals, each with the node's name."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given, settings, strategies as st

from companion.imc.desk.maneuvers import Means
from companion.imc.desk.plan import compiled
from companion.imc.desk.refusal import ConsoleRefusedError
from mavlink_bridge import imc
from mavlink_bridge.language.figures import Circle, FigureEight, Hover, LoiterDirection, Racetrack
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Goto, Loiter
from mavlink_bridge.mavlink.client import Autopilot
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from tests.imc_messages import messages
from tests.imc_rig import plan

LAT, LON = 0.7188, -0.1518
HERE = {"lat_rad": LAT, "lon_rad": LON}
MEANS = Means(full_speed_mps=2.5)


def sailed(*maneuvers, **options):
    """The manoeuvres as the vessel understands the items that are sent to it, without the speeds between them."""
    made = compiled(plan("p", *maneuvers), options.pop("means", MEANS), **options)
    read = compile_items(made.items)
    assert not read.errors
    return [each for each in read.plan.maneuvers if isinstance(each, Goto | Loiter)]


def speeds(*maneuvers):
    read = compile_items(compiled(plan("p", *maneuvers), MEANS).items)
    return [each.speed_mps for each in read.plan.maneuvers if not isinstance(each, Goto | Loiter)]


def refused(spec, **options):
    with pytest.raises(ConsoleRefusedError) as refusal:
        compiled(spec, options.pop("means", MEANS), **options)
    return str(refusal.value)


def metres(goto):
    return LocalFrame(LAT, LON).to_local(goto.lat_rad, goto.lon_rad)


def goto(**fields):
    return imc.Goto(**HERE | {"z_units": imc.ZUnits.DEPTH, "speed": 1.2} | fields)


def loiter(**fields):
    usual = {"speed": 1.2, "type": imc.LoiterType.CIRCULAR, "radius_m": 12.0, "length_m": 50.0, "duration_s": 30}
    return imc.Loiter(**HERE | usual | fields)


def rows(**fields):
    usual = {"speed": 1.2, "width_m": 100.0, "length_m": 200.0, "hstep_m": 27.0, "alternation_pct": 100}
    return imc.Rows(**HERE | usual | {"flags": imc.RowsFlags.SQUARE_CURVE | imc.RowsFlags.CURVE_RIGHT} | fields)


def test_a_goto_is_its_point_at_its_speed() -> None:
    (found,) = sailed(goto())
    assert math.dist(metres(found), (0.0, 0.0)) < 0.02
    assert speeds(goto(), goto(speed=0.8), goto(speed=0.8)) == pytest.approx([1.2, 0.8])
    assert speeds(goto(speed=40.0, speed_units=imc.SpeedUnits.PERCENTAGE)) == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("direction", "ours"),
    [
        (imc.Direction.VDEP, LoiterDirection.VESSEL),
        (imc.Direction.CLOCKW, LoiterDirection.CW),
        (imc.Direction.CCLOCKW, LoiterDirection.CCW),
        (imc.Direction.IWINDCURR, LoiterDirection.INTO_DRIFT),
    ],
)
@pytest.mark.parametrize("kind", [imc.LoiterType.DEFAULT, imc.LoiterType.CIRCULAR])
def test_a_circle_keeps_radius_duration_and_direction(kind, direction, ours) -> None:
    (found,) = sailed(loiter(type=kind, direction=direction))
    assert found.figure == Circle(radius_m=12.0, direction=ours)
    assert found.duration_s == 30.0
    (endless,) = sailed(loiter(type=kind, direction=direction, duration_s=0))
    assert endless.duration_s is None


def test_the_axis_of_a_figure_is_where_the_console_draws_it() -> None:
    """IMC's bearing there is counted from east, counter-clockwise: pi/2 is a figure that lies north and south."""
    (eight,) = sailed(loiter(type=imc.LoiterType.EIGHT, bearing_rad=math.pi / 2, direction=imc.Direction.CLOCKW))
    assert isinstance(eight.figure, FigureEight)
    assert eight.figure.length_m == pytest.approx(50.0)
    assert eight.figure.radius_m == pytest.approx(12.0)
    assert eight.figure.bearing_rad == pytest.approx(0.0, abs=1e-6)
    (track,) = sailed(loiter(type=imc.LoiterType.RACETRACK, bearing_rad=0.0, direction=imc.Direction.CCLOCKW))
    assert isinstance(track.figure, Racetrack)
    assert track.figure.bearing_rad == pytest.approx(math.pi / 2, abs=1e-6)
    assert track.figure.direction is LoiterDirection.CCW


def test_keeping_station_is_keeping_station() -> None:
    for maneuver in (
        loiter(type=imc.LoiterType.HOVER),
        imc.StationKeeping(**HERE, radius_m=12.0, duration_s=30, speed=1.2),
        imc.StationKeepingExtended(**HERE, radius_m=12.0, duration_s=30, speed=1.2),
    ):
        (found,) = sailed(maneuver)
        assert found.figure == Hover()
        assert found.duration_s == 30.0


def test_a_path_is_its_points() -> None:
    points = tuple(imc.PathPoint(x_m=x, y_m=y) for x, y in ((0.0, 0.0), (50.0, 10.0), (50.0, -300.0)))
    found = sailed(imc.FollowPath(**HERE, speed=1.0, points=points))
    assert [metres(each) for each in found] == [
        pytest.approx(each, abs=0.02) for each in ((0.0, 0.0), (50.0, 10.0), (50.0, -300.0))
    ]


def test_rows_are_the_rows_that_the_console_draws() -> None:
    found = [metres(each) for each in sailed(rows(coff_m=15))]
    wanted = [(-15, 0), (215, 0), (215, 27), (-15, 27), (-15, 54), (215, 54), (215, 81), (-15, 81)]
    assert found == [pytest.approx(each, abs=0.02) for each in wanted]


def test_rows_turn_to_either_side_cut_corners_alternate_and_skew() -> None:
    port = [metres(each) for each in sailed(rows(flags=imc.RowsFlags.SQUARE_CURVE, hstep_m=60.0))]
    assert port == [pytest.approx(each, abs=0.02) for each in ((0, 0), (200, 0), (200, -60), (0, -60))]
    cut = [metres(each) for each in sailed(rows(flags=imc.RowsFlags.CURVE_RIGHT, hstep_m=60.0, coff_m=10))]
    assert cut == [pytest.approx(each, abs=0.02) for each in ((-10, 0), (210, 0), (200, 60), (-10, 60))]
    half = [metres(each) for each in sailed(rows(alternation_pct=50, hstep_m=40.0))]
    assert [round(east) for _, east in half] == [0, 0, 20, 20, 80, 80]
    east = [metres(each) for each in sailed(rows(bearing_rad=math.pi / 2, hstep_m=60.0))]
    assert east == [pytest.approx(each, abs=0.02) for each in ((0, 0), (0, 200), (-60, 200), (-60, 0))]
    skew = [metres(each) for each in sailed(rows(cross_angle_rad=math.radians(30.0), hstep_m=60.0))]
    step = (60.0 * math.cos(math.radians(120.0)), 60.0 * math.sin(math.radians(120.0)))
    assert skew[2] == pytest.approx((200.0 + step[0], step[1]), abs=0.02)


@pytest.mark.parametrize(
    ("maneuver", "words"),
    [
        (goto(z_m=3.0), "depth 3 m: a surface vessel"),
        (goto(z_m=3.0, z_units=imc.ZUnits.ALTITUDE), "altitude 3 m"),
        (goto(z_m=0.0, z_units=9), "z of unit 9"),
        (goto(speed=600.0, speed_units=imc.SpeedUnits.RPM), "RPM"),
        (goto(speed=0.0), "speed 0"),
        (goto(speed=math.nan), "speed nan"),
        (goto(speed=9.0, speed_units=7), "unit 7"),
        (goto(lat_rad=0.0, lon_rad=0.0), "means not set"),
        (goto(lat_rad=math.inf), "not on the globe"),
        (loiter(type=9), "loiter type 9"),
        (loiter(direction=9), "direction 9"),
        (loiter(radius_m=0.0), "radius 0"),
        (loiter(type=imc.LoiterType.EIGHT, direction=imc.Direction.IWINDCURR), "clockwise"),
        (loiter(type=imc.LoiterType.EIGHT, length_m=math.nan), "length nan"),
        (loiter(type=imc.LoiterType.RACETRACK, bearing_rad=math.inf), "bearing inf"),
        (imc.FollowPath(**HERE, speed=1.0), "no points"),
        (imc.FollowPath(**HERE, speed=1.0, z_units=1, points=(imc.PathPoint(z_m=4.0),)), "depth 4 m"),
        (imc.FollowPath(**HERE, speed=1.0, points=(imc.PathPoint(x_m=math.nan),)), "nan m away"),
        (imc.FollowPath(**HERE, speed=1.0, points=(imc.PathPoint(),) * 900), "900 points"),
        (rows(hstep_m=0.0), "horizontal step 0"),
        (rows(hstep_m=0.001), "rows"),
        (rows(alternation_pct=120), "alternation 120"),
        (imc.RowsCoverage(**HERE), "RowsCoverage is not one"),
        (imc.YoYo(**HERE), "YoYo is not one"),
        (imc.FollowTrajectory(**HERE), "FollowTrajectory is not one"),
        (imc.CompassCalibration(**HERE), "CompassCalibration is not one"),
        (imc.CommsRelay(**HERE), "CommsRelay is not one"),
        (imc.FollowPoint(**HERE), "FollowPoint is not one"),
        (imc.Launch(**HERE), "Launch is not one"),
        (imc.Teleoperation(), "Teleoperation is not one"),
    ],
)
def test_what_cannot_be_sailed_is_refused_by_its_name(maneuver, words) -> None:
    said = refused(plan("p", goto(), maneuver, goto()))
    assert said.startswith(f"{type(maneuver).__name__}2: ")
    assert words in said


def test_a_share_of_an_unknown_full_speed_is_refused() -> None:
    said = refused(plan("p", goto(speed=50.0, speed_units=imc.SpeedUnits.PERCENTAGE)), means=Means())
    assert "full_speed_mps" in said


def test_a_speed_limit_binds_each_manoeuvre() -> None:
    spec = plan("p", goto(), goto(speed=1.6))
    assert "Goto2: speed 1.6 m/s is above the limit 1.5" in refused(spec, max_speed_mps=1.5)
    assert compiled(spec, MEANS, max_speed_mps=1.6).items


SQUARE = plan("p", goto(), goto(), goto())


def ways(*pairs, **fields):
    return tuple(imc.PlanTransition(source_man=one, dest_man=other, **fields) for one, other in pairs)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        (imc.PlanSpecification(plan_id="p"), "the plan is empty"),
        (dataclasses.replace(SQUARE, start_man_id="Goto9"), 'starts with "Goto9"'),
        (dataclasses.replace(SQUARE, transitions=ways(("Goto1", "Goto2"))), "Goto3: it is never reached"),
        (
            dataclasses.replace(SQUARE, transitions=(*SQUARE.transitions, *ways(("Goto1", "Goto3")))),
            "Goto1: it has two successors, Goto2 and Goto3",
        ),
        (
            dataclasses.replace(SQUARE, transitions=(*SQUARE.transitions, *ways(("Goto3", "Goto1")))),
            "Goto3: it goes back to Goto1",
        ),
        (
            dataclasses.replace(SQUARE, transitions=ways(("Goto1", "Goto7"))),
            "Goto1: it leads to Goto7, which is not in the plan",
        ),
        (
            dataclasses.replace(
                SQUARE, transitions=ways(("Goto1", "Goto2"), ("Goto2", "Goto3"), conditions="Depth > 3")
            ),
            'Goto1: it goes on to Goto2 on "Depth > 3"',
        ),
        (
            dataclasses.replace(
                SQUARE, transitions=ways(("Goto1", "Goto2"), ("Goto2", "Goto3"), actions=(imc.Abort(),))
            ),
            "Goto1: its way to Goto2 has actions",
        ),
        (
            dataclasses.replace(SQUARE, maneuvers=(*SQUARE.maneuvers, SQUARE.maneuvers[0])),
            "Goto1: there are two manoeuvres of this name",
        ),
        (
            dataclasses.replace(SQUARE, maneuvers=(imc.PlanManeuver(maneuver_id="Goto1"),), transitions=()),
            "Goto1: there is no manoeuvre in it",
        ),
        (plan("p", imc.UnknownMessage(number=487)), "ScheduledGoto"),
        (plan("p", *[goto()] * 900), "items"),
    ],
)
def test_a_graph_that_is_no_list_is_refused_by_node_and_reason(spec, words) -> None:
    assert words in refused(spec)


def test_the_order_is_the_graphs_and_not_the_lists() -> None:
    shuffled = dataclasses.replace(SQUARE, maneuvers=tuple(reversed(SQUARE.maneuvers)))
    assert [stage.name for stage in compiled(shuffled, MEANS).stages] == ["Goto1", "Goto2", "Goto3"]


def test_every_item_belongs_to_the_manoeuvre_that_it_came_from() -> None:
    made = compiled(plan("p", goto(), rows(hstep_m=60.0, speed=0.9), loiter(speed=0.9)), MEANS)
    names = [made.stage_of(number).name for number in range(len(made.items))]
    assert names == ["Goto1"] * 2 + ["Rows2"] * 5 + ["Loiter3"]


def test_actions_of_this_vessel_are_kept_and_payloads_noted() -> None:
    light = imc.SetEntityParameters(name="LBL", params=(imc.EntityParameter("Active", "false"),))
    way = imc.SetEntityParameters(name="Guidance", params=(imc.EntityParameter("WP_RADIUS", "3.5"),))
    made = compiled(plan("p", goto(), start_actions=(light, way)), MEANS, sections=("Depth", "Guidance"))
    assert [(each.section, each.name, each.value) for each in made.on_start] == [("Guidance", "WP_RADIUS", "3.5")]
    assert "there is no LBL here" in made.remark
    assert "the plan's start sets WP_RADIUS = 3.5, which stays" in made.remark


@pytest.mark.parametrize("when", ["start_actions", "end_actions"])
@pytest.mark.parametrize(
    ("part", "name"), [("Depth", "DEPTH_MIN"), ("Fence", "FENCE_ENABLE"), ("Mission", "PLAN_FAR_OK")]
)
def test_what_guards_the_vessel_is_not_a_plans_to_set(when: str, part: str, name: str) -> None:
    action = imc.SetEntityParameters(name=part, params=(imc.EntityParameter(name, "0"),))
    node = imc.PlanManeuver(maneuver_id="a", data=goto(), **{when: (action,)})
    for spec in (
        plan("p", goto(), **{when: (action,)}),
        imc.PlanSpecification("p", start_man_id="a", maneuvers=(node,)),
    ):
        assert f"a plan may not set {name}" in refused(spec, sections=("Depth", "Fence", "Mission"))


def test_an_end_that_never_comes_is_told() -> None:
    assert "Loiter1 has no duration" in compiled(plan("p", loiter(duration_s=0), goto()), MEANS).remark


def test_other_autopilots_get_what_their_boats_sail_and_refuse_the_rest() -> None:
    (circle,) = sailed(loiter(duration_s=300), autopilot=Autopilot.ARDUPILOT)
    assert circle.turns == round(1.2 * 300.0 / (2.0 * math.pi * 12.0))
    assert "turns" in compiled(plan("p", loiter()), MEANS, Autopilot.ARDUPILOT).remark
    for autopilot in (Autopilot.ARDUPILOT, Autopilot.PX4, Autopilot.OTHER):
        assert len(sailed(goto(), imc.StationKeeping(**HERE, duration_s=5, speed=1.0), autopilot=autopilot)) == 2
        assert "Loiter1" in refused(plan("p", loiter(type=imc.LoiterType.EIGHT)), autopilot=autopilot)
    assert "Loiter1" in refused(plan("p", loiter()), autopilot=Autopilot.PX4)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_whatever_a_console_sends_is_compiled_or_refused_in_words(data) -> None:
    kinds = (imc.Goto, imc.Loiter, imc.StationKeeping, imc.Rows, imc.FollowPath, imc.StationKeepingExtended)
    maneuver = data.draw(st.sampled_from(kinds).flatmap(messages))
    try:
        items = compiled(plan("p", maneuver), MEANS).items
    except ConsoleRefusedError as refusal:
        said = str(refusal)
    else:
        said = "" if compile_items(items).errors else "sailed"
    assert said
