"""Guidance sails each manoeuvre as itself, says what it changes, and stops when the water wins."""

import math

import pytest

from companion.core.guide.guidance import Guidance, GuidanceConfig
from companion.core.guide.station import StationConfig
from mavlink_bridge.language.figures import Circle, FigureEight, Hover, Racetrack
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    ActuatorDemand,
    Desired,
    EstimatedState,
    Goto,
    Loiter,
    LoiterDirection,
    Severity,
)
from mavlink_bridge.language.snapshot import ControlTrace
from sitl.plant.library import load_vessel
from sitl.plant.water import WaterConfig
from tools.benches.cells.control_loop import ORIGIN_RAD, ControlLoop, Setup

OTTER = load_vessel("otter")
FRAME = LocalFrame(*ORIGIN_RAD)


def state(north=0.0, east=0.0, psi_deg=0.0, speed=0.0, drift=(0.0, 0.0), t_us=0):
    psi = math.radians(psi_deg)
    return EstimatedState(
        t_us,
        origin_lat_rad=ORIGIN_RAD[0],
        origin_lon_rad=ORIGIN_RAD[1],
        x_m=north,
        y_m=east,
        vx_mps=speed * math.cos(psi),
        vy_mps=speed * math.sin(psi),
        u_mps=speed,
        psi_rad=psi,
        r_radps=0.0,
        sog_mps=speed,
        cog_rad=psi,
        drift_n_mps=drift[0],
        drift_e_mps=drift[1],
        current_n_mps=drift[0],
        current_e_mps=drift[1],
    )


def loiter(**changes):
    return Loiter(0, *ORIGIN_RAD, **changes)


def goto(north, east, seq=0, **changes):
    return Goto(seq, *FRAME.to_geodetic(north, east), **changes)


def begun(maneuver, where, config=None, previous=None, following=None):
    guidance = Guidance(config or GuidanceConfig(), OTTER)
    guidance.begin(0, where, maneuver, previous, following)
    return guidance


def course_at(maneuver, north, east, psi_deg=0.0):
    where = state(north, east, psi_deg, 1.5)
    output = begun(maneuver, where).step(0, 0.05, where, 1.5)
    return math.degrees(output.desired.psi_rad)


@pytest.mark.parametrize(
    ("direction", "course"), [(LoiterDirection.CW, 90.0), (LoiterDirection.CCW, -90.0)], ids=["cw", "ccw"]
)
def test_on_the_ring_it_steers_along_it(direction, course):
    """North of the centre clockwise is east. The bow looks into the bend by the slip of the turn, a few degrees."""
    assert course_at(loiter(figure=Circle(radius_m=20.0, direction=direction)), 20.0, 0.0, course) == pytest.approx(
        course, abs=6.0
    )


def test_vessels_choice_is_the_side_it_already_turns_to():
    """Sailing east with the centre to starboard: clockwise; to port: counter-clockwise."""
    east_of_north = course_at(loiter(figure=Circle(radius_m=20.0, direction=LoiterDirection.VESSEL)), 20.0, 0.0, 90.0)
    assert east_of_north == pytest.approx(90.0, abs=6.0)
    east_of_south = course_at(loiter(figure=Circle(radius_m=20.0, direction=LoiterDirection.VESSEL)), -20.0, 0.0, 90.0)
    assert east_of_south == pytest.approx(90.0, abs=6.0)


def test_into_the_drift_joins_with_the_bow_to_it():
    """At the north of the ring, drift from the east: sail east (clockwise); from the west: counter-clockwise."""
    for drift_e, sign in ((-0.3, 1), (0.3, -1)):
        where = state(20.0, 0.0, 0.0, 1.5, (0.0, drift_e))
        guidance = begun(loiter(figure=Circle(radius_m=20.0, direction=LoiterDirection.INTO_DRIFT)), where)
        assert math.copysign(1, guidance.step(0, 0.05, where, 1.5).desired.psi_rad) == sign


def sail(maneuver, seconds, start=(0.0, 0.0, 0.0), speed=1.5, water=None, guidance=None):
    run = ControlLoop(Setup(OTTER, water or WaterConfig(), guidance=guidance or GuidanceConfig()))
    run.place(*start, surge_mps=0.0)
    run.sail(maneuver)
    track = []
    while run.t_s < seconds:
        output = run.tick(speed)
        track.append((run.t_s, run.vessel.north_m, run.vessel.east_m, output))
    return run, track


def test_figure_eight_crosses_itself_and_turns_both_ways():
    _, track = sail(loiter(figure=FigureEight(radius_m=10.0, length_m=40.0, bearing_rad=0.0)), 240.0)
    norths, easts = [point[1] for point in track], [point[2] for point in track]
    assert max(norths) == pytest.approx(30.0, abs=1.0)
    assert min(norths) == pytest.approx(-30.0, abs=1.0)
    assert max(easts) == pytest.approx(10.0, abs=1.0)
    radii = {math.copysign(1, output.path.orbit_radius_m) for *_, output in track if output.path.orbit_radius_m}
    assert radii == {1.0, -1.0}
    assert track[-1][3].turns > 1.2


def test_racetrack_has_its_length_along_the_compass_bearing():
    bearing = math.radians(90.0)
    _, track = sail(loiter(figure=Racetrack(radius_m=10.0, length_m=50.0, bearing_rad=bearing)), 300.0)
    late = [point for point in track if point[0] > 60.0]
    assert max(point[2] for point in late) == pytest.approx(35.0, abs=1.0)
    assert min(point[2] for point in late) == pytest.approx(-35.0, abs=1.0)
    assert max(abs(point[1]) for point in late) == pytest.approx(10.0, abs=0.5)


def test_too_tight_a_ring_is_slowed_down_for_and_told():
    run, track = sail(loiter(figure=Circle(radius_m=4.0)), 60.0, (20.0, 0.0, math.pi), 2.5)
    texts = run.guidance.drain_texts()
    assert any("slowing to" in text for _, text in texts)
    late = [math.hypot(point[1], point[2]) for point in track if point[0] > 40.0]
    assert max(abs(radius - 4.0) for radius in late) < 0.7
    assert track[-1][3].path.orbit_radius_m == pytest.approx(4.0)


def test_a_ring_tighter_than_the_vessel_can_turn_is_widened_and_told():
    where = state(20.0)
    guidance = begun(loiter(figure=Circle(radius_m=1.0)), where)
    severity, text = guidance.drain_texts()[0]
    assert severity is Severity.WARNING
    assert "loiter radius raised from 1.0" in text
    assert abs(guidance.step(0, 0.05, where, 1.5).path.orbit_radius_m) > 1.0


def test_speed_is_restored_when_the_bend_allows_it():
    config = GuidanceConfig()
    guidance = begun(loiter(figure=Circle(radius_m=4.0)), state(4.0, 0.0, 90.0, 1.0), config)
    for speed in (2.5, 0.5):
        where = state(4.0, 0.0, 90.0, speed)
        guidance.step(0, 0.05, where, speed)
    assert [severity for severity, _ in guidance.drain_texts()] == [Severity.INFO, Severity.INFO]


def test_a_wide_pass_still_arrives():
    """Abeam of the point is arrival, however far off: the line is never followed for ever."""
    where = state()
    guidance = begun(goto(50.0, 0.0), where)
    assert not guidance.step(0, 0.05, state(48.0, 30.0, 0.0, 1.5), 1.5).arrived
    assert guidance.step(50_000, 0.05, state(50.5, 30.0, 0.0, 1.5), 1.5).arrived


def test_arrival_by_radius():
    guidance = begun(goto(50.0, 0.0, acceptance_m=3.0), state())
    assert guidance.step(0, 0.05, state(48.0, 1.0, 0.0, 1.0), 1.5).arrived


def test_the_last_point_is_stopped_at():
    _, track = sail(goto(40.0, 0.0), 90.0)
    assert math.hypot(track[-1][1] - 40.0, track[-1][2]) < 1.0
    assert track[-1][3].arrived
    assert max(point[1] for point in track) < 41.0


@pytest.mark.parametrize(("stream_mps", "lets_go"), [(0.03, True), (0.3, False)])
def test_drift_mode_lets_go_inside_its_radius_where_that_pays(stream_mps, lets_go):
    """A stream that carries the boat out within a minute is held against: turning back each time costs more thrust."""
    config = GuidanceConfig(station=StationConfig(mode="drift", radius_m=3.0))
    current = WaterConfig(current_mps=stream_mps, current_to_deg=0.0)
    _, track = sail(loiter(figure=Hover()), 200.0, water=current, guidance=config)
    idle = sum(1 for *_, output in track if output.desired.speed_mps is None)
    assert (idle > 0.2 * len(track)) == lets_go
    assert max(math.hypot(point[1], point[2]) for point in track) < 2.0 * 3.0


def test_water_faster_than_the_vessel_is_a_stop_with_the_reason():
    where = state(10.0, 0.0, 0.0, 1.0, (0.0, 3.5))
    for maneuver in (goto(50.0, 0.0), loiter(figure=Circle(radius_m=20.0)), loiter(figure=Hover())):
        output = begun(maneuver, where).step(0, 0.05, where, 1.5)
        assert output.desired.psi_rad is None
        assert output.desired.speed_mps is None
        assert "faster than the vessel" in output.unable


def _drained(guidance, where, seconds):
    """Sail on at one place; return the last output and what was told."""
    for _ in range(round(seconds / 0.05)):
        output = guidance.step(0, 0.05, where, 1.5)
    return output, [text for _, text in guidance.drain_texts()]


def test_a_boat_that_is_steered_slower_than_it_could_go_is_not_let_go():
    """Its margins forbid more than 0.7 m/s: letting go makes more leeway than that speed against wind and current."""
    where = state(10.0, 0.0, 0.0, 1.0, (0.0, 1.0))
    for maneuver in (goto(50.0, 0.0), loiter(figure=Circle(radius_m=20.0)), loiter(figure=Hover())):
        guidance = begun(maneuver, where)
        guidance.limit(fast_mps=0.7, turn_radps=1.0, backs_and_fills=False)
        output, texts = _drained(guidance, where, 20.0)
        assert not output.unable
        assert output.desired.psi_rad is not None
        assert [text for text in texts if "loses ground" in text] == [
            "wind and current carry it at 1.0 m/s, and faster than 0.7 m/s it is not steered safely: it goes on trying, and loses ground"
        ]


def test_a_boat_that_has_lost_a_thruster_stops_where_what_is_left_is_slower_than_the_water():
    where = state(10.0, 0.0, 0.0, 1.0, (0.0, 1.0))
    guidance = begun(loiter(figure=Hover()), where)
    guidance.thrusters((0.0, 1.0))
    guidance.limit(fast_mps=0.7, turn_radps=1.0, backs_and_fills=False)
    output, _ = _drained(guidance, where, 1.0)
    assert "faster than the vessel" in output.unable


def test_without_a_position_nothing_is_steered():
    guidance = begun(loiter(figure=Circle(radius_m=20.0)), state(20.0))
    output = guidance.step(0, 0.05, EstimatedState(0, psi_rad=0.0), 1.5)
    assert output.desired.psi_rad is None
    assert output.desired.speed_mps is None


def test_reference_needs_a_position_to_begin():
    with pytest.raises(ValueError, match="known position"):
        begun(goto(1.0, 1.0), EstimatedState(0))


def test_an_idle_vessel_learns_the_drift_that_carries_it():
    """Nothing steers and the law is reset every tick: what it makes over ground is drift, along the bow too."""
    run = ControlLoop(Setup(OTTER, WaterConfig(current_mps=0.5, current_to_deg=0.0)))
    run.place(0.0, 0.0, 0.0)
    for _ in range(20 * 60):
        run.controller.reset(run.state, 0.05, run.sent)
        run.controller.step = lambda *_: (ActuatorDemand(run.now_us), ControlTrace())
        run.steer(Desired(None, None))
    assert run.state.drift_n_mps == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("off_m", [0.0, 0.2, 0.45, 2.0])
def test_a_leg_that_begins_at_its_own_end_goes_on_to_the_next(off_m):
    """No way is left to round the corner in: the vessel is there, and the next leg follows."""
    here, first, onward = FRAME.to_geodetic(-off_m, 0.0), goto(0.0, 0.0), goto(0.0, 50.0, seq=1)
    guidance = begun(first, state(-off_m), previous=here, following=onward)
    output = guidance.step(0, 0.05, state(-off_m), 1.5)
    assert output.desired.psi_rad is not None


def test_a_leg_of_no_length_is_no_leg_north():
    """At its point the boat stays there, beyond it she goes back to it, and on the way to another she goes there."""
    point, previous = goto(0.0, 0.0), FRAME.to_geodetic(0.0, 0.0)
    where = state(1.0, 0.0, 90.0, 0.0)
    output = begun(point, where, previous=previous).step(0, 0.05, where, 1.5)
    assert output.arrived
    assert not output.desired.speed_mps
    where = state(8.0, 0.0, 180.0, 1.0)
    output = begun(point, where, previous=previous).step(0, 0.05, where, 1.5)
    assert not output.arrived
    assert abs(output.desired.psi_rad) == pytest.approx(math.pi, abs=0.1)
    where = state(0.0, 0.0, 90.0, 1.0)
    output = begun(point, where, previous=previous, following=goto(0.0, 50.0)).step(0, 0.05, where, 1.5)
    assert output.arrived
    assert output.desired.psi_rad == pytest.approx(0.5 * math.pi, abs=0.1)
