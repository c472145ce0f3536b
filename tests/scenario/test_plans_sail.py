"""Whole plans from file to water: uploaded over MAVLink, armed, started and sailed in lock-step, judged by truth."""

from __future__ import annotations

import json
import math

import pytest

import config
from companion.settings.schema import load
from mavlink_bridge.language.figures import figure_of
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Delay, Goto, Loiter, LoiterDirection
from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.mavlink.missions.plan_export import items_from_maneuvers
from mavlink_bridge.mavlink.missions.wire import item_to_message, with_home
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.plans.files import PlanFile, read_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.plans import LAT_DEG, LON_DEG, qgc_plan, simple_item

LAT, LON = math.radians(LAT_DEG), math.radians(LON_DEG)


class Voyage:
    """A simulated vessel with a ground station on one of its links; keeps the truth and what the vessel reports."""

    def __init__(self, link: str) -> None:
        self.world = World(load(config.path("sim.toml"), [], SimSettings), seed=5)
        self.link = self.world.ground(link)
        self.offset = 1 if link == "gcs" else 0
        self.codec, self.deframer = Codec(255, 190), Deframer()
        self.heard: list[object] = []
        self.track: list[tuple[float, float]] = []
        self.frame = LocalFrame(LAT, LON)
        self.tick(20)

    def send(self, message: object) -> None:
        self.link.write(0, self.codec.encode(message))

    def tick(self, count: int = 1) -> list[object]:
        new: list[object] = []
        for _ in range(count):
            if self.world.now_us % 1_000_000 == 0:
                self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            truth = self.world.step()
            self.track.append(self.frame.to_local(truth.lat_rad, truth.lon_rad))
            for event in self.link.poll(self.world.now_us):
                frames = self.deframer.receive(getattr(event, "data", b""), self.world.now_us)
                new += [message for message in map(decode, frames) if message is not None]
        self.heard += new
        return new

    def wait(self, kind: str, limit: int = 200) -> object:
        for _ in range(limit):
            for message in self.tick():
                if message.get_type() == kind:
                    return message
        raise AssertionError(f"no {kind} in {limit} ticks: {self.texts()[-5:]}")

    def texts(self) -> list[str]:
        return [message.text for message in self.heard if message.get_type() == "STATUSTEXT"]

    def upload(self, plan: PlanFile) -> None:
        items = with_home(plan.mission, (LAT, LON)) if self.offset else plan.mission
        self.send(dialect.MAVLink_mission_count_message(1, 1, len(items), 0))
        while (answer := self.next_of("MISSION_REQUEST_INT", "MISSION_ACK")).get_type() == "MISSION_REQUEST_INT":
            self.send(item_to_message(items[answer.seq], answer.seq, 1, 1, PlanKind.MISSION))
        assert answer.type == 0, self.texts()[-1]

    def next_of(self, *kinds: str) -> object:
        for _ in range(100):
            for message in self.tick():
                if message.get_type() in kinds:
                    return message
        raise AssertionError(f"no {kinds}")

    def command(self, number: int, *params: float) -> None:
        values = [*params, *[math.nan] * (7 - len(params))]
        self.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *values))
        ack = self.wait("COMMAND_ACK")
        assert (ack.command, ack.result) == (number, 0), self.texts()[-3:]

    def sail(self, plan: PlanFile, limit_s: float) -> None:
        """Upload, arm, start, and run until the plan is complete."""
        self.upload(plan)
        self.tick(40)
        self.command(400, 1.0)
        self.command(300, 0.0, 0.0)
        self.track.clear()
        for _ in range(round(limit_s)):
            if any(message.get_type() == "MISSION_CURRENT" and message.mission_state == 5 for message in self.tick(20)):
                return
        raise AssertionError(f"not complete after {limit_s} s: {self.texts()[-5:]}")

    def reached(self) -> list[int]:
        return [message.seq - self.offset for message in self.heard if message.get_type() == "MISSION_ITEM_REACHED"]

    def nearest_m(self, lat_rad: float, lon_rad: float) -> float:
        north, east = self.frame.to_local(lat_rad, lon_rad)
        return min(math.hypot(north - n, east - e) for n, e in self.track)


def survey_plan() -> PlanFile:
    """A QGroundControl survey of two lines, with its camera items, as QGroundControl stores it."""
    corners = [(0, 0), (0, 40), (20, 40), (20, 0)]
    frame = LocalFrame(LAT, LON)
    expanded, number = [], 2
    for north, east in corners:
        lat, lon = frame.to_geodetic(north, east)
        expanded.append(simple_item(number, 16, 3, [0, 0, 0, None, math.degrees(lat), math.degrees(lon), 50]))
        expanded.append(simple_item(number + 1, 206, 2, [25, 0, 1, 0, 0, 0, 0]))
        number += 2
    survey = {
        "type": "ComplexItem",
        "complexItemType": "survey",
        "TransectStyleComplexItem": {"Items": expanded, "version": 1},
    }
    whole = qgc_plan([simple_item(1, 530, 2, [0, 2, None, None, None, None, None])])
    whole["mission"]["items"].append(survey)
    return read_plan(json.dumps(whole))


def test_a_survey_with_camera_items_is_sailed_from_end_to_end():
    plan = survey_plan()
    voyage = Voyage("gcs")
    voyage.sail(plan, 300.0)
    waypoints = [seq for seq, item in enumerate(plan.mission) if item.command == 16]
    assert len(waypoints) == 4
    reached = voyage.reached()
    assert [seq for seq in reached if seq in waypoints] == waypoints
    assert len(reached) == len(set(reached))
    for seq in waypoints:
        item = plan.mission[seq]
        assert voyage.nearest_m(math.radians(item.x / 1e7), math.radians(item.y / 1e7)) < 2.5


def test_jumps_are_counted_and_delays_hold():
    frame = LocalFrame(LAT, LON)
    first, second = frame.to_geodetic(0, 0), frame.to_geodetic(0, 20)
    plan = [Goto(0, *first), Goto(1, *second), Delay(2, duration_s=5.0)]
    items = items_from_maneuvers(plan)
    text = "QGC WPL 120\n" + "".join(
        f"{seq}\t0\t{item.frame}\t{item.command}\t{item.param1}\t{item.param2}\t0\t0\t{item.x / 1e7}\t{item.y / 1e7}\t0\t1\n"
        for seq, item in enumerate(items)
    )
    text += "3\t0\t2\t177\t0\t2\t0\t0\t0\t0\t0\t1\n"
    voyage = Voyage("sdk")
    voyage.sail(read_plan(text), 400.0)
    reached = voyage.reached()
    assert reached.count(0) == reached.count(1) == 3, reached


@pytest.mark.parametrize(
    ("kind", "direction"),
    [
        ("circular", LoiterDirection.CCW),
        ("racetrack", LoiterDirection.CW),
        ("racetrack", LoiterDirection.CCW),
        ("figure-eight", LoiterDirection.CW),
        ("hover", LoiterDirection.CW),
    ],
    ids=str,
)
def test_every_kind_of_loiter_is_sailed_as_itself(kind, direction):
    hover = kind == "hover"
    loiter = Loiter(
        *(0, LAT, LON),
        figure=figure_of(kind, radius_m=10.0, length_m=30.0, bearing_rad=math.radians(90.0), direction=direction),
        duration_s=30.0 if hover else 80.0,
        speed_mps=2.0,
    )
    voyage = Voyage("sdk")
    voyage.sail(PlanFile(items_from_maneuvers([loiter])), 250.0)
    # what was sailed before the end was on the path
    path = voyage.track[-20 * (20 if hover else 70) :]
    north = [point[0] for point in path]
    east = [point[1] for point in path]
    half_east = {"circular": 10.0, "hover": 0.0}.get(kind, 25.0)
    half_north = 0.0 if hover else 10.0
    assert max(east) == pytest.approx(half_east, abs=2.5)
    assert min(east) == pytest.approx(-half_east, abs=2.5)
    assert max(north) == pytest.approx(half_north, abs=2.5)
    assert min(north) == pytest.approx(-half_north, abs=2.5)
    if not hover:
        eight = kind == "figure-eight"
        turned = _turned(path, centre=(0.0, 15.0) if eight else (0.0, 0.0), eastern_only=eight)
        assert turned * (1.0 if direction is LoiterDirection.CW else -1.0) > 0.0


def _turned(path, centre, eastern_only):
    """Angle sailed about a point, clockwise positive; of an eight only the eastern loop counts."""
    total, last = 0.0, None
    for north, east in path:
        if eastern_only and east < 10.0:
            last = None
            continue
        bearing = math.atan2(east - centre[1], north - centre[0])
        if last is not None:
            total += math.remainder(bearing - last, math.tau)
        last = bearing
    return total
