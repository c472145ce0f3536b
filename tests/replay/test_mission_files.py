"""Plan files made by others: each is uploaded and comes back equal, or is refused with the item and the reason."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.requests import ACCEPTED, PlanKind
from mavlink_bridge.mavlink.missions.plan_rules import MissionResult, plan_id
from mavlink_bridge.mavlink.missions.service import MissionServer
from mavlink_bridge.mavlink.missions.wire import item_from_message, item_to_message, with_home
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.plans.files import PlanFileError, read_plan, write_plan, write_wpl

# file: items of mission, fence, rally; and what the refusal must say (empty: it is accepted)
FILES = {
    "cmac_circuit.txt": (7, 0, 0, "NAV_TAKEOFF"),
    "cmac_fence_oldformat.txt": (0, 5, 0, ""),
    "cmac_grid.txt": (17, 0, 0, "NAV_TAKEOFF"),
    "copter_nav_delay.txt": (4, 0, 0, "NAV_TAKEOFF"),
    "dronekit_mpmission.txt": (6, 0, 0, "NAV_TAKEOFF"),
    "foamy_springvalley_ccw.txt": (11, 0, 0, "NAV_TAKEOFF"),
    "mavros_simple.plan": (10, 6, 3, "NAV_TAKEOFF"),
    "mavsdk_mission_planner_sample.txt": (4, 0, 0, "NAV_TAKEOFF"),
    "mavsdk_qgroundcontrol_sample.plan": (6, 0, 0, "NAV_TAKEOFF"),
    "mavsdk_qgroundcontrol_sample_with_survey.plan": (13, 0, 0, ""),
    "plane_dalby_obc2016_jumps.txt": (34, 0, 0, "NAV_VTOL_TAKEOFF"),
    "qgc_100Waypoints.mission": (99, 0, 0, "NAV_TAKEOFF"),
    "qgc_100Waypoints.waypoints.txt": (99, 0, 0, "NAV_TAKEOFF"),
    "qgc_MissionPlanner.waypoints": (5, 0, 0, ""),
    "qgc_SectionTest.plan": (5, 0, 0, "NAV_TAKEOFF"),
    "rover_depthfinder.txt": (4, 0, 0, ""),
    "rover_drive_rover1.txt": (20, 0, 0, ""),
    "rover_endmission.txt": (1, 0, 0, "no position"),
    "rover_gripper.txt": (5, 0, 0, "DO_GRIPPER"),
    "rover_pathplanning_fence.txt": (0, 24, 0, ""),
    "rover_pathplanning_mission.txt": (2, 0, 0, ""),
    "rover_rtl.txt": (3, 0, 0, ""),
}
NO_PLAN = {"mavsdk_qgroundcontrol_sample_wrong_overall_version.plan": "version 42"}


class Vessel:
    def __init__(self, home_item):
        self.plans = dict.fromkeys(PlanKind, ())
        self.home = None
        self.server = MissionServer(self, home_item=home_item)
        self.station = Codec(255, 190)

    def items(self, kind):
        return self.plans[kind]

    def plan_id(self, kind):
        return plan_id(self.plans[kind])

    def send(self, message):
        (frame,) = Deframer().receive(self.station.encode(message), 0)
        answers = self.server.handle(decode(frame), 0)
        for handle, load in self.server.loads():
            self.plans[load.kind] = load.items
            answers += self.server.finish(handle, ACCEPTED, plan_id(load.items))
        return answers

    def upload(self, items, kind):
        answers = self.send(dialect.MAVLink_mission_count_message(1, 1, len(items), kind.value))
        while answers[0].get_type() == "MISSION_REQUEST_INT":
            seq = answers[0].seq
            answers = self.send(item_to_message(items[seq], seq, 1, 1, kind))
        return answers[0].type

    def download(self, kind):
        (count,) = self.send(dialect.MAVLink_mission_request_list_message(1, 1, kind.value))
        requests = (dialect.MAVLink_mission_request_int_message(1, 1, seq, kind.value) for seq in range(count.count))
        return [item_from_message(answer) for request in requests for answer in self.send(request)]


def test_every_file_is_covered(shared_data):
    present = {path.name for path in (shared_data / "missions").iterdir()} - {"README.md"}
    assert present == set(FILES) | set(NO_PLAN)


@pytest.mark.parametrize("home_item", [False, True], ids=["generic", "ardurover"])
@pytest.mark.parametrize("name", FILES)
def test_a_file_is_uploaded_and_comes_back_equal_or_is_refused_with_the_reason(shared_data, name, home_item):
    mission, fence, rally, refusal = FILES[name]
    found = read_plan((shared_data / "missions" / name).read_bytes(), name)
    assert [len(found.items(kind)) for kind in PlanKind] == [mission, fence, rally]
    vessel = Vessel(home_item)
    for kind in PlanKind:
        items = found.items(kind)
        wire = with_home(items, found.home_rad) if home_item and kind is PlanKind.MISSION else items
        if not items:
            continue
        result = vessel.upload(wire, kind)
        if kind is PlanKind.MISSION and refusal:
            assert result != MissionResult.ACCEPTED
            text = vessel.server.drain_texts()[0][1]
            assert refusal in text
            assert "item " in text
            assert vessel.items(kind) == ()
            continue
        assert result == MissionResult.ACCEPTED
        skip = 1 if home_item and kind is PlanKind.MISSION else 0
        assert plan_id(vessel.download(kind)[skip:]) == plan_id(wire[skip:])


@pytest.mark.parametrize("name", NO_PLAN)
def test_a_file_of_an_unknown_version_is_refused(shared_data, name):
    with pytest.raises(PlanFileError, match=NO_PLAN[name]):
        read_plan((shared_data / "missions" / name).read_bytes(), name)


@pytest.mark.parametrize("name", FILES)
def test_a_file_written_again_holds_the_same_plan(shared_data, name):
    found = read_plan((shared_data / "missions" / name).read_bytes(), name)
    again = read_plan(write_plan(found))
    assert plan_id(again.mission) == plan_id(found.mission)
    assert sorted(item.x for item in again.fence) == sorted(item.x for item in found.fence)
    assert plan_id(again.rally) == plan_id(found.rally)
    text = read_plan(write_wpl(found))
    assert [item.command for item in text.mission] == [item.command for item in found.mission]
    assert [item.x for item in text.mission if item.frame != 2] == [item.x for item in found.mission if item.frame != 2]


def test_a_jump_of_a_wpl_file_keeps_its_target(shared_data):
    found = read_plan((shared_data / "missions" / "plane_dalby_obc2016_jumps.txt").read_bytes())
    jump = found.mission[13]
    # row 9 of the file, with the home row as 0, is the ninth item: place 8
    assert (jump.command, jump.param1, jump.param2) == (177, 8.0, 4.0)
    assert math.isclose(found.mission[8].x / 1e7, -27.330435, abs_tol=1e-6)
