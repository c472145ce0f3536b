"""The whole vessel on its actuator board: at rest, on a loiter on twin and chip, and when the operator stops it."""

from __future__ import annotations

import math
import os

import pytest
from pymavlink.dialects.v20 import all as dialect

import config
from companion.io.keeping.content import StoreContent
from companion.io.keeping.store import MemoryStore
from companion.io.links.link import Received
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, SetParameter, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.board import avr
from sitl.board.arduino_twin import ArduinoTwin
from sitl.world.settings import SimSettings
from sitl.world.world import World

CHANGE_SPEED, LOITER_UNLIMITED = 178, 17
TOLERANCE_US = 10.0


@pytest.fixture(params=["twin", "firmware"])
def board(request):
    if request.param == "twin":
        return ArduinoTwin()
    require_avr()
    return avr.AvrArduino()


def require_avr():
    missing = avr.missing_packages()
    if missing and os.environ.get("REQUIRE_ALL") == "1":
        pytest.fail(f"missing packages: {' '.join(missing)}", pytrace=False)
    if missing:
        pytest.skip(f"missing packages: {' '.join(missing)}")


def make_world(board, *overrides, store=None):
    settings = load(config.path("sim.toml"), ["operator.gcs_required=false", *overrides], SimSettings)
    return World(settings, 1, board=board, store=store)


def ask(world, request):
    replies = []
    world.app.submit(request, replies.append)
    world.run(0.3)
    return replies[0]


def under_way(board, sailed_s=20.0):
    """A vessel on its way to a circle of 20 m, 1.5 m/s."""
    world = make_world(board)
    lat_rad, lon_rad = world.surroundings.plant.frame.to_geodetic(40.0, 15.0)
    x, y = round(math.degrees(lat_rad) * 1e7), round(math.degrees(lon_rad) * 1e7)
    items = [
        PlanItem(CHANGE_SPEED, 2, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
        PlanItem(LOITER_UNLIMITED, 3, 0.0, 0.0, 20.0, 1.0, x, y, 0.0),
    ]
    plan = load_plan(PlanKind.MISSION, items)
    assert isinstance(plan, LoadPlan)
    world.run(2.0)
    for request in (plan, Arm(arm=True), StartPlan(0)):
        assert ask(world, request).reason == ""
    world.run(sailed_s)
    return world


def stopped(world):
    return all(abs(pulse - 1500.0) <= TOLERANCE_US for pulse in world.surroundings.plant.board.pulses_us)


def test_at_rest_all_four_pins_are_at_1500(board):
    world = make_world(board)
    world.run(5.0)
    assert stopped(world)
    assert world.snapshot.actuator.state == "active-checked"


class Ground:
    """A ground station's end of the first endpoint, in MAVLink bytes."""

    def __init__(self, world):
        self.world = world
        self.link = world.ground("gcs")
        self.mav = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
        self.mav.robust_parsing = True

    def send(self, message):
        self.link.write(0, message.pack(self.mav))

    def heard(self):
        data = b"".join(event.data for event in self.link.poll(self.world.now_us) if isinstance(event, Received))
        return self.mav.parse_buffer(data) or []

    def beat(self, seconds):
        messages = []
        for _ in range(round(seconds)):
            self.send(self.mav.heartbeat_encode(6, 8, 0, 0, 0))
            self.world.run(1.0)
            messages += self.heard()
        return messages


def test_emergency_stop_from_a_ground_station_within_100_ms_and_a_frame(board):
    world = under_way(board)
    ground = Ground(world)
    ground.beat(3)
    assert not stopped(world)
    # Sent just after a tick: the worst moment.
    asked_us = world.now_us
    ground.send(ground.mav.command_long_encode(1, 1, dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 21196, 0, 0, 0, 0, 0))
    world.step()
    for now_us in range(world.now_us, asked_us + 120_000, 1_000):
        board.step(now_us)
        if stopped(world):
            break
    assert stopped(world)
    assert not world.snapshot.armed
    world.run(3.0)
    assert stopped(world)


def test_supply_voltage_reaches_the_ground_station(board):
    world = make_world(board)
    ground = Ground(world)
    board.set_voltage(12.6)
    messages = ground.beat(6)
    volts = [message.voltages[0] / 1000 for message in messages if message.get_type() == "BATTERY_STATUS"]
    assert volts
    assert volts[-1] == pytest.approx(12.6, abs=0.1)


def test_stop_switch_on_the_board_disarms(board):
    world = under_way(board)
    board.set_estop(True)
    world.run(0.3)
    assert stopped(world)
    assert not world.snapshot.armed
    board.set_estop(False)
    world.run(3.0)
    assert stopped(world)  # released: nothing moves until an operator arms again
    assert not world.snapshot.armed


def test_board_reset_under_way_disarms_and_stays_stopped(board):
    world = under_way(board)
    board.reset(world.now_us)
    world.run(0.3)
    assert stopped(world)
    assert not world.snapshot.armed
    assert "actuator_reset" in world.snapshot.causes
    world.run(3.0)
    assert stopped(world)
    assert world.snapshot.actuator.state == "active-checked"
    assert ask(world, Arm(arm=True)).reason == ""


def test_port_pulled_and_back(board):
    world = under_way(board)
    cable = world.app.actuators.link
    cable.unplug()
    world.run(0.15)
    assert not world.snapshot.armed
    world.run(0.5)
    assert stopped(world)
    cable.plug()
    world.run(4.0)
    assert stopped(world)
    assert not world.snapshot.armed
    assert ask(world, Arm(arm=True)).reason == ""


def test_the_message_frequency_is_live_and_says_what_it_costs():
    world = make_world(ArduinoTwin())
    world.run(2.0)
    said = []
    assert "the board stops between two commands" in ask(world, SetParameter("ACT_FREQ", 1.0)).reason
    world.app.submit(SetParameter("ACT_FREQ", 4.0), lambda reply: None)
    for _ in range(40):
        world.step()
        said += [text.text for text in world.snapshot.texts]
    assert any("steering acts up to 250 ms late" in text or "250 ms" in text for text in said)


def test_a_mute_line_never_arms_whatever_a_parameter_or_a_stored_one_says():
    """A dead board looks like a sketch that never answers: neither arms, and neither is told how to."""
    store = MemoryStore(StoreContent(params={"ACT_LEVEL0_OK": 1.0}))
    world = make_world(ArduinoTwin(level1=False), store=store)
    world.step()
    assert any("ACT_LEVEL0_OK" in text.text and "left out" in text.text for text in world.snapshot.texts)
    for body in (Arm(arm=True), Arm(arm=True, force=True), SetParameter("ACT_LEVEL0_OK", 1.0), Arm(arm=True)):
        world.run(6.0)
        reason = ask(world, body).reason
        assert "LEVEL0" not in reason or isinstance(body, SetParameter)
        assert "baud" in reason or isinstance(body, SetParameter)
        assert reason
        assert not world.snapshot.armed
        assert all(abs(pulse - 1500.0) < 1.0 for pulse in world.surroundings.plant.board.pulses_us)


def test_the_owners_level_0_board_arms_in_a_simulation_and_warns_every_station_again_and_again():
    world = make_world(ArduinoTwin(level1=False), "actuators.board.level='0'")
    world.run(6.0)
    ground = Ground(world)
    messages = ground.beat(2)
    assert ask(world, Arm(arm=True)).reason == ""
    messages += ground.beat(70)
    warned = [item for item in messages if item.get_type() == "STATUSTEXT" and "does not stop if this" in item.text]
    assert len(warned) >= 2


def track(board, duration_s):
    world = under_way(board, sailed_s=0.0)
    points = []
    while world.now_us < duration_s * 1e6:
        truth = world.step()
        points.append((truth.north_m, truth.east_m))
    return points


def rms_m(one, two):
    apart_m = math.sqrt(sum(math.dist(a, b) ** 2 for a, b in zip(one, two, strict=True)) / len(one))
    print(f"tracks differ by {apart_m:.4f} m RMS")
    return apart_m


def test_a_minute_on_the_chip_differs_by_less_than_a_decimetre():
    require_avr()
    assert rms_m(track(ArduinoTwin(), 60.0), track(avr.AvrArduino(), 60.0)) < 0.1


@pytest.mark.soak
def test_twenty_minutes_on_the_chip_differ_by_less_than_a_decimetre():
    require_avr()
    assert rms_m(track(ArduinoTwin(), 1200.0), track(avr.AvrArduino(), 1200.0)) < 0.1
