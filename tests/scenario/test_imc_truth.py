"""What a console's plan is on the water: the very track that a MAVLink station's plan is, and each manoeuvre what its name says."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

from mavlink_bridge import imc
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.imc_rig import Rig, plan
from tests.world_station import Helm

CALM = "depth.enabled=false"
MEMORY = ('sensors=[{url="mem:nmea"}]', "actuators.url=mem:ard", "endpoints=[]", "radio.url=mem:radio")
START_S = 12.0
ACROSS = ("world.water.current_mps=0.3", "world.water.current_to_deg=90")


def here(world) -> tuple[float, float]:
    truth = world.surroundings.truth
    return truth.north_m, truth.east_m


def figures(rig: Rig) -> imc.PlanSpecification:
    circle = imc.Loiter(
        **rig.place(45.0, 25.0), speed=1.2, type=imc.LoiterType.CIRCULAR, radius_m=12.0, duration_s=10, direction=2
    )
    return plan("p1", rig.goto(20.0, 0.0), rig.goto(30.0, 15.0, 1.0), circle)


def watched(who: Rig | Helm, seconds: float) -> dict[int, tuple[float, float]]:
    """Where the boat is at each tick of the world."""
    track = {}
    for _ in range(round(seconds * 20)):
        who.step()
        track[who.world.now_us] = here(who.world)
    return track


def by_imc(seconds: float) -> dict[int, tuple[float, float]]:
    rig = Rig(CALM)
    assert rig.console.save(figures(rig)).type == imc.ReplyType.SUCCESS
    load = imc.PlanControl(op=imc.PlanControlOp.LOAD, plan_id="p1")
    assert rig.console.ask(load).type == imc.ReplyType.SUCCESS
    rig.run(START_S - rig.now_s)
    assert rig.console.start("p1").type == imc.ReplyType.SUCCESS
    return watched(rig, seconds)


def by_mavlink(seconds: float) -> dict[int, tuple[float, float]]:
    helm = Helm("ardurover", CALM)
    items = [
        (2, 178, 1.0, 1.2, -1.0, 0.0, 0, 0, 0.0),
        (3, 16, 0.0, 0.0, 0.0, math.nan, *helm.at(20.0, 0.0), 0.0),
        (2, 178, 1.0, 1.0, -1.0, 0.0, 0, 0, 0.0),
        (3, 16, 0.0, 0.0, 0.0, math.nan, *helm.at(30.0, 15.0), 0.0),
        (2, 178, 1.0, 1.2, -1.0, 0.0, 0, 0, 0.0),
        (3, 19, 10.0, 0.0, -12.0, 1.0, *helm.at(45.0, 25.0), 0.0),
    ]
    assert helm.upload(items) == 0
    helm.run(START_S - helm.now_s)
    helm.gcs.clear()
    for number, value in ((400, 1.0), (300, 0.0)):
        helm.send(dialect.MAVLink_command_long_message(1, 1, number, 0, value, *[0.0] * 6))
    helm.until(lambda: len(helm.gcs.all("COMMAND_ACK")) >= 2, 1.0)
    return watched(helm, seconds)


def test_a_plan_is_sailed_as_by_mavlink() -> None:
    """The bar: the same plan, at most 0.02 m RMS apart."""
    ours, theirs = by_imc(25.0), by_mavlink(25.0)
    common = sorted(ours.keys() & theirs.keys())
    apart = [math.dist(ours[at_us], theirs[at_us]) for at_us in common]
    assert len(common) > 450
    assert math.dist(ours[common[0]], ours[common[-1]]) > 20.0
    assert math.sqrt(math.fsum(each * each for each in apart) / len(apart)) <= 0.02


def idle(folder: Path, *, is_there: bool) -> tuple[Rig, list[tuple[int, bytes]]]:
    """A gateway for 35 s with a console that polls all it can, or with none; and what the shore has sent."""
    folder.mkdir()
    rig = Rig(*MEMORY, CALM, gateway_dir=folder)
    rig.console.present = rig.alive = is_there
    for _ in range(32):
        if is_there:
            for poll in (
                imc.RemoteActionsRequest(op=1),
                imc.GetOperationalLimits(),
                imc.QueryEntityParameters("Depth"),
            ):
                rig.console.send(poll)
        rig.run(1.0)
    log = rig.world.surroundings.radio.air.log
    return rig, [(item.start_us, item.data) for item in log if item.origin == "shore"]


def test_through_the_radio_a_plan_is_started_within_6_s_and_an_idle_console_costs_no_air(tmp_path: Path) -> None:
    rig, sent = idle(tmp_path / "console", is_there=True)
    assert rig.console.all(imc.EntityParameters)[-1].params
    _, alone = idle(tmp_path / "alone", is_there=False)
    assert [(at_us, len(data)) for at_us, data in sent] == [(at_us, len(data)) for at_us, data in alone]

    sticks = rig.console.ask(imc.PlanControl(op=imc.PlanControlOp.START, plan_id="t", arg=imc.Teleoperation()))
    assert "sticks do not cross the radio" in sticks.info
    assert rig.console.save(figures(rig)).type == imc.ReplyType.SUCCESS
    began = rig.now_s
    answer = rig.console.start("p1")
    assert answer.type == imc.ReplyType.SUCCESS, answer.info
    assert rig.snapshot.mode is Mode.AUTO
    assert rig.now_s - began <= 6.0
    rig.run(3.0)
    assert rig.view().state is imc.PlanState.EXECUTING
    assert rig.console.stop().type == imc.ReplyType.SUCCESS
    assert rig.snapshot.mode is Mode.HOLD


# Each manoeuvre on the water: long, so in the soak


def sailed(rig: Rig, *maneuvers: imc.Message, limit_s: float = 900.0) -> list[tuple[float, float]]:
    """The track of a plan from its start to its end."""
    answer = rig.console.sail(plan("p1", *maneuvers))
    assert answer.type == imc.ReplyType.SUCCESS, answer.info
    track = []

    def over() -> bool:
        track.append(here(rig.world))
        return rig.view().state is imc.PlanState.READY

    rig.until(over, limit_s)
    assert rig.view().last_outcome is imc.Outcome.SUCCESS, rig.view().last_error
    return track


def nearest_m(track: list[tuple[float, float]], point: tuple[float, float]) -> float:
    return min(math.dist(each, point) for each in track)


def turn_rad(track: list[tuple[float, float]], centre: tuple[float, float]) -> float:
    """How far round a place a track went, clockwise positive."""
    angles = [math.atan2(east - centre[1], north - centre[0]) for north, east in track]
    return math.fsum(math.remainder(b - a, math.tau) for a, b in itertools.pairwise(angles))


LOITER = {"speed": 1.2, "radius_m": 15.0, "length_m": 60.0, "duration_s": 120}
CENTRE = (60.0, 40.0)


@pytest.mark.soak
@pytest.mark.parametrize(
    "direction", [imc.Direction.CLOCKW, imc.Direction.CCLOCKW, imc.Direction.VDEP, imc.Direction.IWINDCURR]
)
def test_a_circle_is_a_circle_either_way_round(direction) -> None:
    rig = Rig(CALM)
    track = sailed(rig, imc.Loiter(**rig.place(*CENTRE), **LOITER, type=imc.LoiterType.CIRCULAR, direction=direction))
    on = track[-round(100.0 * 20) :]
    errors = [math.dist(each, CENTRE) - 15.0 for each in on]
    assert max(map(abs, errors)) < 0.6
    turned = turn_rad(on, CENTRE)
    assert abs(turned) > 1.0 * math.tau
    if direction in (imc.Direction.CLOCKW, imc.Direction.CCLOCKW):
        assert (turned > 0.0) == (direction == imc.Direction.CLOCKW)


@pytest.mark.soak
def test_an_eight_and_a_racetrack_lie_where_the_console_draws_them() -> None:
    """Bearing pi/2 is north and south, as the console draws it; the loops' far ends show it."""
    for kind, across in ((imc.LoiterType.EIGHT, 15.0), (imc.LoiterType.RACETRACK, 15.0)):
        rig = Rig(CALM)
        fields = LOITER | {"duration_s": 300, "bearing_rad": math.pi / 2}
        track = sailed(rig, imc.Loiter(**rig.place(*CENTRE), **fields, type=kind, direction=imc.Direction.CLOCKW))
        on = track[-round(280.0 * 20) :]
        north = [each[0] - CENTRE[0] for each in on]
        east = [each[1] - CENTRE[1] for each in on]
        assert max(north) == pytest.approx(45.0, abs=1.0)
        assert min(north) == pytest.approx(-45.0, abs=1.0)
        assert max(map(abs, east)) == pytest.approx(across, abs=1.0)


@pytest.mark.soak
def test_hover_and_station_keeping_stay() -> None:
    rig = Rig(CALM)
    hover = imc.Loiter(**rig.place(30.0, 0.0), **LOITER, type=imc.LoiterType.HOVER)
    station = imc.StationKeeping(**rig.place(30.0, 30.0), radius_m=5.0, duration_s=60, speed=1.2)
    track = sailed(rig, hover, station)
    assert nearest_m(track, (30.0, 0.0)) < 1.5
    assert all(math.dist(each, (30.0, 30.0)) < 5.0 for each in track[-round(50.0 * 20) :])


@pytest.mark.soak
def test_paths_and_rows_pass_their_points() -> None:
    rig = Rig(CALM)
    points = ((0.0, 0.0), (30.0, 10.0), (30.0, 40.0), (0.0, 50.0))
    path = imc.FollowPath(
        **rig.place(20.0, 10.0), speed=1.2, points=tuple(imc.PathPoint(x_m=x, y_m=y) for x, y in points)
    )
    flags = imc.RowsFlags.SQUARE_CURVE | imc.RowsFlags.CURVE_RIGHT
    rows = imc.Rows(
        **rig.place(20.0, 80.0), speed=1.2, width_m=40.0, length_m=60.0, hstep_m=20.0, alternation_pct=100, flags=flags
    )
    track = sailed(rig, path, rows)
    corners = [(20.0 + x, 10.0 + y) for x, y in points]
    corners += [(20.0, 80.0), (80.0, 80.0), (80.0, 100.0), (20.0, 100.0), (20.0, 120.0), (80.0, 120.0)]
    assert max(nearest_m(track, corner) for corner in corners) < 2.5


@pytest.mark.soak
def test_against_the_peer_in_a_current_across() -> None:
    """0.3 m/s across: the peer's line stands 2.84 m off, its circle 0.69 m; the bar here is 0.1 m RMS (imc-wire §8)."""
    rig = Rig(CALM, *ACROSS)
    circle = imc.Loiter(**rig.place(230.0, 60.0), speed=1.5, radius_m=20.0, duration_s=160, type=1, direction=1)
    track = sailed(rig, rig.goto(30.0, 0.0, 1.5), rig.goto(230.0, 0.0, 1.5), circle)
    line = [east for north, east in track if 50.0 <= north <= 210.0 and abs(east) < 10.0]
    assert rms(line) <= 0.1
    errors = [math.dist(each, (230.0, 60.0)) - 20.0 for each in track[-round(140.0 * 20) :]]
    assert rms(errors) <= 0.1


def rms(values: list[float]) -> float:
    return math.sqrt(math.fsum(each * each for each in values) / len(values))
