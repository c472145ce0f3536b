"""Boats of other autopilots behind the desk: their numbers, their home item, what they sail and what is refused of them.

The stand-ins answer as ArduRover and PX4 do where these differ from the vessel here: old item requests, no plan id, no mission state.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from companion.imc.desk import Desk, DeskConfig
from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker, Udp
from mavlink_bridge.mavlink.client import ClientConfig, VehicleClient
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from tests.imc_rig import plan

ARDUPILOT, PX4 = 3, 12
HERE = {"lat_rad": 0.7188, "lon_rad": -0.1518}
CIRCLE = imc.Loiter(**HERE, speed=1.2, type=imc.LoiterType.CIRCULAR, radius_m=12.0, duration_s=120)
STATION = imc.StationKeeping(**HERE, speed=1.0, duration_s=30)


class Boat:
    """An autopilot that obeys."""

    def __init__(self, autopilot: int) -> None:
        self.autopilot = autopilot
        self.mode = (4 if autopilot == ARDUPILOT else 0x03040000, False)
        self.codec, self.deframer = Codec(7, 1), Deframer()
        self.items: list = []
        self.wanted = 0
        self.commands: list[tuple[int, list[float]]] = []
        self.out: list = []

    def receive(self, data: bytes, now_us: int) -> None:
        for frame in self.deframer.receive(data, now_us):
            message = decode(frame)
            match message.get_type():
                case "MISSION_COUNT":
                    self.items, self.wanted = [], message.count
                    self.request()
                case "MISSION_ITEM_INT":
                    self.items.append(message)
                    self.request()
                case "COMMAND_LONG":
                    self.obey(message)

    def request(self) -> None:
        if len(self.items) < self.wanted:
            self.out.append(dialect.MAVLink_mission_request_message(254, 190, len(self.items), 0))
        else:
            self.out.append(dialect.MAVLink_mission_ack_message(254, 190, 0, 0))

    def obey(self, message) -> None:
        values = [message.param1, message.param2, message.param3]
        self.commands.append((message.command, values))
        auto = 10 if self.autopilot == ARDUPILOT else 0x04040000
        match message.command:
            case 400:
                self.mode = self.mode[0], message.param1 == 1.0
            case 300:
                self.mode = auto, self.mode[1]
            case 176 if self.autopilot == ARDUPILOT:
                self.mode = int(message.param2), self.mode[1]
            case 176:
                self.mode = int(message.param2) << 16 | int(message.param3) << 24, self.mode[1]
            case 512:
                self.out.append(dialect.MAVLink_autopilot_version_message(*[0] * 5, *[[0] * 8] * 3, 0, 0, 0))
        self.out.append(dialect.MAVLink_command_ack_message(message.command, 0, 0, 0, 254, 190))

    def beat(self) -> None:
        custom, armed = self.mode
        self.out.append(dialect.MAVLink_heartbeat_message(11, self.autopilot, 1 | 128 * armed, custom, 4, 3))
        if self.autopilot == ARDUPILOT:
            self.out.append(dialect.MAVLink_mission_current_message(1))

    def take(self) -> bytes:
        out, self.out = self.out, []
        return b"".join(self.codec.encode(message) for message in out)


class Line:
    """Boat, client, desk and one console in virtual time."""

    def __init__(self, autopilot: int) -> None:
        self.boat = Boat(autopilot)
        self.client = VehicleClient(ClientConfig(streams_hz={"ATTITUDE": 2.0}))
        self.desk = Desk(DeskConfig(), self.client)
        self.now_us, self.number = 0, 0
        self.answers: list = []
        self.run(2.0)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.now_us += 50_000
            if self.now_us % 1_000_000 == 0:
                self.boat.beat()
                self.desk.heard(self.asker, self.now_us)
            for _ in range(6):
                self.client.receive(self.boat.take(), self.now_us)
                self.answers += [out.message for out in self.desk.take(self.now_us)]
                self.boat.receive(self.client.take(self.now_us), self.now_us)

    @property
    def asker(self) -> Asker:
        return Asker(0x4001, 0xFF, "ccu", Udp("10.77.0.1", 6001), sent_utc_s=self.now_us * 1e-6)

    def ask(self, message):
        self.number += 1
        self.desk.receive(replace(message, request_id=self.number), self.asker, self.now_us)
        self.run(3.0)
        return next(each for each in reversed(self.answers) if getattr(each, "request_id", 0) == self.number)

    def sail(self, *maneuvers):
        spec = plan("p1", *maneuvers)
        self.ask(imc.PlanDB(op=imc.PlanDBOp.SET, plan_id="p1", arg=spec))
        return self.ask(imc.PlanControl(op=imc.PlanControlOp.START, plan_id="p1"))

    @property
    def numbers(self) -> list[int]:
        return [number for number, _ in self.boat.commands]


def test_an_ardurover_boat_gets_its_home_item_its_turns_and_its_mode_numbers() -> None:
    line = Line(ARDUPILOT)
    answer = line.sail(imc.Goto(**HERE, speed=1.2), CIRCLE)
    assert answer.type == imc.ReplyType.SUCCESS, answer.info
    assert "120 s are sailed as 2 turns" in answer.info
    assert [item.command for item in line.boat.items] == [16, 178, 16, 18]
    assert [item.seq for item in line.boat.items] == [0, 1, 2, 3]
    assert line.boat.mode == (10, True)
    assert {511, 224, 400, 300} <= set(line.numbers)
    assert line.ask(imc.PlanControl(op=imc.PlanControlOp.STOP)).type == imc.ReplyType.SUCCESS
    assert line.boat.mode == (4, True)


def test_a_plan_of_a_boat_that_says_no_mission_state_ends_with_its_last_item() -> None:
    line = Line(ARDUPILOT)
    assert line.sail(imc.Goto(**HERE, speed=1.2)).type == imc.ReplyType.SUCCESS
    assert line.desk.view(line.now_us).state is imc.PlanState.EXECUTING
    line.boat.out.append(dialect.MAVLink_mission_item_reached_message(2))
    line.boat.mode = (4, True)
    line.run(3.0)
    view = line.desk.view(line.now_us)
    assert (view.state, view.last_outcome) == (imc.PlanState.READY, imc.Outcome.SUCCESS)


def test_a_px4_boat_gets_its_own_mode_numbers_and_refuses_circles_by_name() -> None:
    line = Line(PX4)
    refused = line.sail(CIRCLE)
    assert refused.type == imc.ReplyType.FAILURE
    assert "Loiter1: a circular loiter is not one of PX4's boat manoeuvres" in refused.info
    assert not line.boat.items
    assert line.sail(STATION).type == imc.ReplyType.SUCCESS
    assert [item.command for item in line.boat.items] == [178, 19]
    assert line.boat.items[1].param3 == 0.0
    assert line.ask(imc.PlanControl(op=imc.PlanControlOp.STOP)).type == imc.ReplyType.SUCCESS
    assert line.boat.mode == (0x03040000, True)


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_an_abort_and_sticks_reach_them_too(autopilot: int) -> None:
    line = Line(autopilot)
    by_hand = imc.PlanControl(op=imc.PlanControlOp.START, plan_id="t", arg=imc.Teleoperation())
    assert line.ask(by_hand).type == imc.ReplyType.SUCCESS
    assert line.boat.mode == (0 if autopilot == ARDUPILOT else 0x00010000, True)
    line.desk.receive(imc.Abort(), line.asker, line.now_us)
    line.run(1.0)
    assert not line.boat.mode[1]
    assert line.boat.commands[-1] == (400, [0.0, 21196.0, 0.0])
