"""What a station at the gateway is told when the vessel refuses, was ended, or waits for an order: by radio alone, in lock-step."""

from __future__ import annotations

from typing import Any

from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.mavlink.telemetry.ages import AHRS
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.ashore import Ashore

WAYPOINT, CHANGE_SPEED = 16, 178
ARM, TERMINATE = 400, 185
ACCEPTED, REJECTED_NOW, IN_PROGRESS = 0, 1, 5
EMERGENCY = 6
DENIED = 14


def answer(shore: Ashore, command: int, *params: float, limit_s: float) -> int | None:
    """The final answer to a command, None when there is none in time."""
    before = len(shore.operator.inbox)

    def finals() -> list[int]:
        heard = [m for m in shore.operator.inbox[before:] if m.get_type() == "COMMAND_ACK" and m.command == command]
        return [ack.result for ack in heard if ack.result != IN_PROGRESS]

    shore.give(command, *params)
    return finals()[0] if shore.until(lambda: bool(finals()), limit_s) else None


def upload(shore: Ashore, begin: Any, items: list[tuple[float, ...]], limit_s: float = 60.0) -> int:
    """Send what begins an upload, then each item that is asked for; returns the acknowledgement's type."""
    shore.operator.clear()
    shore.link.write(0, shore.operator.codec.encode(begin))
    began_us, sent = shore.world.now_us, set()
    while not shore.operator.all("MISSION_ACK"):
        assert shore.world.now_us - began_us < limit_s * 1e6
        shore.step()
        for seq in {asked.seq for asked in shore.operator.all("MISSION_REQUEST_INT")} - sent:
            sent.add(seq)
            frame, command, *numbers = items[seq]
            item = dialect.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *numbers, 0)
            shore.link.write(0, shore.operator.codec.encode(item))
    return shore.operator.last("MISSION_ACK").type


def place(frame: int, north_e7: int, east_e7: int) -> tuple[float, ...]:
    return (frame, WAYPOINT, *[0.0] * 4, 411_850_000 + north_e7, -87_062_000 + east_e7, 0.0)


def test_a_refusal_with_its_reason_comes_through_after_answers_that_were_short(tmp_path):
    """The gateway has learned how soon short answers come, and asks again just then: its question met the reason each time."""
    shore = Ashore(tmp_path)
    shore.run(40.0)
    assert answer(shore, ARM, 1.0, limit_s=3.0) == ACCEPTED
    shore.run(6.0)
    assert answer(shore, TERMINATE, 1.0, limit_s=3.0) == ACCEPTED
    for pause_s in (30.0, 10.3, 10.7):
        shore.run(pause_s)
        assert answer(shore, ARM, 1.0, limit_s=4.0) == REJECTED_NOW
    assert "Terminated: restart first" in shore.texts()


def test_a_boat_that_was_ended_is_shown_so_and_the_gravest_text_comes_first(tmp_path):
    shore = Ashore(tmp_path)
    shore.run(40.0)
    shore.order(ARM, 1.0)
    before = len(shore.texts())
    shore.order(TERMINATE, 1.0)
    shore.run(20.0)
    assert shore.operator.last("HEARTBEAT").system_status == EMERGENCY
    told = [text for text in shore.texts()[before:] if "erminated" in text or "depth guard" in text]
    assert told[:2] == ["terminated by the operator", "Terminated by the operator: TERMINATE"]


def test_a_boat_that_holds_tells_which_order_goes_on_when_its_station_is_back(tmp_path):
    shore = Ashore(tmp_path)
    shore.run(40.0)
    shore.order(ARM, 1.0)
    shore.present = False
    shore.run(90.0)
    shore.present = True
    assert shore.until(lambda: any("Ground station is back" in text for text in shore.texts()), 60.0)
    assert shore.texts()[-1].startswith("Ground station is back")
    assert shore.texts()[-1].endswith("order Hold to go on"), "no plan is loaded: Auto would be refused"


def test_no_text_that_is_always_sent_is_cut(tmp_path):
    shore = Ashore(tmp_path)
    shore.run(40.0)
    shore.order(ARM, 1.0)
    shore.run(20.0)
    assert shore.texts().count("depth guard OFF: nothing watches the depth") == 2, "at the start and at the arming"


def test_a_sound_boat_without_a_roll_and_pitch_sensor_has_no_sick_sensor_ashore(tmp_path):
    shore = Ashore(tmp_path)
    shore.run(40.0)
    status = shore.operator.last("SYS_STATUS")
    enabled, healthy = status.onboard_control_sensors_enabled, status.onboard_control_sensors_health
    assert enabled & ~healthy == 0
    assert not status.onboard_control_sensors_present & AHRS


def test_a_plan_that_the_vessel_refuses_ends_with_its_reason_and_the_vessel_stays_in_sight(tmp_path):
    """The gateway's repeats met the reason each time: 19 s, and "nothing from the vessel" meanwhile."""
    shore = Ashore(tmp_path)
    shore.run(40.0)
    home = place(0, 0, 0)
    items = [home, (2, CHANGE_SPEED, 1.0, 40.0, -1.0, 0.0, 0, 0, 0.0), (3, *home[1:])]
    count = dialect.MAVLink_mission_count_message(1, 1, len(items), 0)
    assert upload(shore, count, items, limit_s=18.0) != 0
    assert "Plan refused: item 1: 40.0 m/s is more than the" in "".join(shore.texts())
    assert "nothing from the vessel" not in "".join(shore.texts())


def test_a_part_of_a_plan_does_not_bring_back_the_plan_that_was_aboard_before(tmp_path):
    """The plan is replaced over another link, and at once an item of the one before is moved at the gateway, from memory."""
    shore = Ashore(tmp_path)
    shore.run(40.0)
    old, new = ([place(0, 0, 0), *(place(3, 4_000 * row, east) for row in range(1, 5))] for east in (0, 9_000))
    assert upload(shore, dialect.MAVLink_mission_count_message(1, 1, len(old), 0), old) == 0
    shore.run(10.0)
    plan = load_plan(PlanKind.MISSION, [PlanItem(command, frame, *rest) for frame, command, *rest in new[1:]])
    assert isinstance(plan, LoadPlan)
    shore.world.app.submit(plan, lambda reply: None)
    shore.run(1.0)
    partial = dialect.MAVLink_mission_write_partial_list_message(1, 1, 2, 2, 0)
    assert upload(shore, partial, [*old[:2], place(3, 8_000, 700), *old[3:]]) == DENIED
    assert "Plan refused: another one is aboard; read it first" in shore.texts()
    shore.run(60.0)
    assert shore.world.app.facade.plans.plan_id(PlanKind.MISSION) == plan_id(plan.items)
    assert shore.gateway.twin.plans.plan_id(PlanKind.MISSION) == plan_id(plan.items), "and can be read ashore"
