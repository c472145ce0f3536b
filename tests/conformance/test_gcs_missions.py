"""Missions, fences and rally points through a whole endpoint, both faces (checks 12 to 30)."""

import math
import struct

import pytest

from mavlink_bridge.language.messages import ChangeSpeed, Jump, Loiter, LoiterDirection, PlanState
from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Station

NAN = math.nan
LAT, LON = 411_850_000, -87_060_000
ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE, INVALID = range(6)
DENIED, CANCELLED = 14, 15


def item(command, p1=0.0, p2=0.0, p3=0.0, p4=NAN, x=LAT, y=LON, z=0.0, frame=3):
    return (frame, command, p1, p2, p3, p4, x, y, z)


WAYPOINT = item(16)
TRIANGLE = [item(5001, 3.0), item(5001, 3.0, x=LAT + 5000), item(5001, 3.0, y=LON + 5000)]
"""A fence of 50 m."""


def with_home(bench, items, kind=0):
    return [item(16, p4=0.0, frame=0), *items] if bench.shift and kind == 0 else list(items)


def message(number, content, kind):
    frame, command, p1, p2, p3, p4, x, y, z = content
    return dialect.MAVLink_mission_item_int_message(1, 1, number, frame, command, 0, 1, p1, p2, p3, p4, x, y, z, kind)


def upload(bench, items, kind=0, station=None):
    """Upload and return the type of the MISSION_ACK."""
    station = station or bench.gcs
    content = with_home(bench, items, kind)
    bench.send(dialect.MAVLink_mission_count_message(1, 1, len(content), kind), station)
    for number in range(len(content)):
        asked = [m for m in bench.gcs.inbox if m.get_type() == "MISSION_REQUEST_INT" and m.mission_type == kind]
        if not asked or asked[-1].seq != number:
            break
        bench.send(message(number, content[number], kind), station)
    bench.tick()
    return bench.gcs.last("MISSION_ACK").type


@pytest.mark.parametrize("kind", [0, 1])
def test_an_item_that_is_to_wait_for_somebody_is_told_of_and_not_refused(bench, kind):
    """Clients that fill fields with zeros mean nothing by it; who means it must not believe that the boat waits."""
    content = with_home(bench, [WAYPOINT] * 3 if kind == 0 else TRIANGLE, kind)
    bench.send(dialect.MAVLink_mission_count_message(1, 1, len(content), kind))
    for number, each in enumerate(content):
        made = message(number, each, kind)
        made.autocontinue = 0 if number >= len(content) - 2 else 1
        bench.send(made)
    bench.tick()
    assert bench.gcs.last("MISSION_ACK").type == 0
    told = f"Item {bench.shift + 1}: autocontinue = 0 is not heeded, the plan goes on by itself"
    assert (told.lower() in bench.texts().replace("\n", "").lower()) == (kind == 0)


def download(bench, kind=0):
    bench.send(dialect.MAVLink_mission_request_list_message(1, 1, kind))
    count = bench.gcs.last("MISSION_COUNT")
    assert count.mission_type == kind
    items = []
    for number in range(count.count):
        bench.send(dialect.MAVLink_mission_request_int_message(1, 1, number, kind))
        got = bench.gcs.last("MISSION_ITEM_INT")
        assert got.seq == number
        items.append(got)
    bench.send(dialect.MAVLink_mission_ack_message(1, 1, 0, kind))
    return items


def bits(content):
    return (
        struct.pack("<4f", *content[2:6]),
        content[6],
        content[7],
        struct.pack("<f", content[8]),
        content[0],
        content[1],
    )


def got_bits(m):
    return (
        struct.pack("<4f", m.param1, m.param2, m.param3, m.param4),
        m.x,
        m.y,
        struct.pack("<f", m.z),
        m.frame,
        m.command,
    )


def test_check_12_empty_plans(bench):
    for kind in range(3):
        bench.send(dialect.MAVLink_mission_request_list_message(1, 1, kind))
        assert (bench.gcs.last("MISSION_COUNT").count, bench.gcs.last("MISSION_COUNT").mission_type) == (0, kind)
        bench.send(dialect.MAVLink_mission_count_message(1, 1, 0, kind))
        bench.tick()
        assert (bench.gcs.last("MISSION_ACK").type, bench.gcs.last("MISSION_ACK").mission_type) == (ACCEPTED, kind)


def test_check_13_and_16_up_and_down_bit_for_bit(bench):
    sent = [
        item(16, 1.5, 2.5, -0.0, NAN),
        item(18, 3, 0, -20, 1, z=50.0),
        item(178, 1, 2.0, -1, 0, 0, 0, frame=2),
        item(20, x=0, y=0, frame=2),
    ]
    assert upload(bench, sent) == ACCEPTED
    asked = [m.seq for m in bench.gcs.all("MISSION_REQUEST_INT")]
    assert asked == list(range(len(with_home(bench, sent))))
    assert bench.gcs.last("MISSION_ACK").opaque_id
    assert [got_bits(m) for m in download(bench)][bench.shift :] == [bits(content) for content in sent]


def test_check_14_a_lost_item_is_asked_for_again_and_the_old_plan_stays(bench):
    assert upload(bench, [WAYPOINT] * 2) == ACCEPTED
    bench.gcs.clear()
    bench.send(dialect.MAVLink_mission_count_message(1, 1, 5, 0))
    bench.run(30)
    asked = bench.gcs.all("MISSION_REQUEST_INT")
    assert 2 <= len(asked) <= 6
    assert {m.seq for m in asked} == {0}
    assert len(bench.vessel.plans.items(PlanKind.MISSION)) == 2
    assert upload(bench, [WAYPOINT] * 3) == ACCEPTED


def test_check_15_copies_and_disorder(bench):
    content = with_home(bench, [WAYPOINT, item(16, x=LAT + 10), item(16, x=LAT + 20)])
    bench.send(dialect.MAVLink_mission_count_message(1, 1, len(content), 0))
    for number in range(len(content)):
        bench.send(
            message(len(content) - 1, content[-1], 0)
            if number < len(content) - 1
            else message(number, content[number], 0)
        )
        bench.send(message(number, content[number], 0))
        bench.send(message(number, content[number], 0))
    bench.tick()
    assert bench.gcs.last("MISSION_ACK").type == ACCEPTED
    assert [got_bits(m) for m in download(bench)][bench.shift :] == [bits(c) for c in content][bench.shift :]
    assert [i.x for i in bench.vessel.plans.items(PlanKind.MISSION)] == [LAT, LAT + 10, LAT + 20]


def test_check_17_old_requests_get_int_items(bench):
    upload(bench, [WAYPOINT])
    bench.send(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    bench.gcs.clear()
    bench.send(dialect.MAVLink_mission_request_message(1, 1, 0, 0))
    assert bench.gcs.all("MISSION_ITEM_INT")
    assert not bench.gcs.all("MISSION_ITEM")
    assert not bench.gcs.all("MISSION_REQUEST")


@pytest.mark.parametrize(
    ("bad", "wanted"),
    [
        (item(22), {UNSUPPORTED}),
        (item(16, frame=1), {UNSUPPORTED_FRAME}),
        (item(178, 1, -7.0, frame=2, x=0, y=0), {5, 6, 7, 8, 9}),
        (item(16, x=950_000_000), {5, 10, 11}),
    ],
)
def test_check_18_a_bad_item_ends_the_upload_and_is_named(bench, bad, wanted):
    assert upload(bench, [WAYPOINT] * 2) == ACCEPTED
    bench.gcs.clear()
    assert upload(bench, [WAYPOINT, bad, WAYPOINT]) in wanted
    assert str(1 + bench.shift) in bench.texts()
    assert len(bench.vessel.plans.items(PlanKind.MISSION)) == 2


def test_check_18_too_many_items(bench):
    bench.send(dialect.MAVLink_mission_count_message(1, 1, 65535, 0))
    bench.tick()
    assert bench.gcs.last("MISSION_ACK").type == NO_SPACE


@pytest.mark.parametrize("z", [50.0, -10.0, NAN])
def test_check_19_any_altitude(bench, z):
    assert upload(bench, [item(16, z=z), item(19, 30, z=z)]) == ACCEPTED


def test_check_20_turns_and_direction(bench):
    assert upload(bench, [item(18, 2, 0, -20, 1), item(18, 2, 0, 0, 1), item(18, 2, 0, NAN, 1)]) == ACCEPTED
    plan = next(request.body for request in bench.vessel.handled if isinstance(request.body, LoadPlan)).plan
    first, second, third = (maneuver for maneuver in plan.maneuvers if isinstance(maneuver, Loiter))
    assert (first.figure.radius_m, first.figure.direction, first.turns) == (20.0, LoiterDirection.CCW, 2.0)
    assert second.figure.radius_m is None
    assert third.figure.radius_m is None


def test_check_21_jumps_count_as_the_wire_counts(bench):
    assert upload(bench, [WAYPOINT, WAYPOINT, item(177, 1 + bench.shift, 2, x=0, y=0, frame=2)]) == ACCEPTED
    plan = bench.vessel.handled[-1].body.plan
    (jump,) = (maneuver for maneuver in plan.maneuvers if isinstance(maneuver, Jump))
    assert (jump.target_seq, jump.repeats) == (1, 2)
    for target in (2 + bench.shift, 99):
        assert upload(bench, [WAYPOINT, WAYPOINT, item(177, target, 2, x=0, y=0, frame=2)]) not in (ACCEPTED,)


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize(("speed", "means"), [(2.5, 2.5), (-2.0, None)])
def test_check_22_speed_changes(bench, kind, speed, means):
    assert upload(bench, [WAYPOINT, item(178, kind, speed, -1, 0, 0, 0, frame=2), WAYPOINT]) == ACCEPTED
    plan = bench.vessel.handled[-1].body.plan
    changes = [maneuver.speed_mps for maneuver in plan.maneuvers if isinstance(maneuver, ChangeSpeed)]
    assert changes == [means]


def test_check_22_minus_one_changes_nothing(bench):
    assert upload(bench, [WAYPOINT, item(178, 1, -1, -1, 0, 0, 0, frame=2), WAYPOINT]) == ACCEPTED
    plan = bench.vessel.handled[-1].body.plan
    assert not [maneuver for maneuver in plan.maneuvers if isinstance(maneuver, ChangeSpeed)]


def test_check_23_clearing(bench):
    for kind, content in ((0, [WAYPOINT]), (1, [item(5003, 30.0)]), (2, [item(5100)])):
        assert upload(bench, content, kind) == ACCEPTED
    for kind in (1, 2, 0):
        bench.send(dialect.MAVLink_mission_clear_all_message(1, 1, kind))
        bench.tick()
        assert (bench.gcs.last("MISSION_ACK").type, bench.gcs.last("MISSION_ACK").mission_type) == (ACCEPTED, kind)
        assert bench.vessel.plans.items(PlanKind(kind)) == ()
    assert upload(bench, [WAYPOINT]) == ACCEPTED
    bench.send(dialect.MAVLink_mission_clear_all_message(1, 1, 255))
    bench.tick()
    assert bench.gcs.last("MISSION_ACK").mission_type == 255
    assert bench.vessel.plans.items(PlanKind.MISSION) == ()


def test_check_24_cancelling(bench):
    bench.send(dialect.MAVLink_mission_count_message(1, 1, 5, 0))
    bench.send(dialect.MAVLink_mission_ack_message(1, 1, CANCELLED, 0))
    bench.gcs.clear()
    bench.run(5)
    assert not bench.gcs.all("MISSION_REQUEST_INT")
    assert upload(bench, [WAYPOINT]) == ACCEPTED


def test_check_25_a_second_uploader(bench):
    second = Station(245, 190)
    bench.send(dialect.MAVLink_mission_count_message(1, 1, 3, 0))
    bench.send(dialect.MAVLink_mission_count_message(1, 1, 2, 0), second)
    ack = bench.gcs.last("MISSION_ACK")
    assert (ack.target_system, ack.type) == (245, DENIED)
    bench.gcs.clear()
    content = with_home(bench, [WAYPOINT] * (3 - bench.shift))
    for number in range(3):
        bench.send(message(number, content[number], 0))
    bench.tick()
    assert bench.gcs.last("MISSION_ACK").type == ACCEPTED


def stored(bench, count):
    wp = PlanItem(16, 3, 0.0, 0.0, 0.0, NAN, LAT, LON, 0.0)
    bench.vessel.plans.stored[PlanKind.MISSION] = (wp,) * count
    bench.tick()


@pytest.mark.parametrize("by_message", [False, True])
def test_check_26_setting_the_current_item(bench, by_message):
    stored(bench, 4)
    wire = 2 + bench.shift
    bench.gcs.clear()
    if by_message:
        bench.send(dialect.MAVLink_mission_set_current_message(1, 1, wire))
    else:
        bench.long(224, wire)
    bench.tick(2)
    assert bench.vessel.seq == 2
    assert bench.gcs.last("MISSION_CURRENT").seq == wire
    if not by_message:
        assert bench.acked(224) == [0]
    bench.gcs.clear()
    if by_message:
        bench.send(dialect.MAVLink_mission_set_current_message(1, 1, wire))
        bench.tick(2)
        assert bench.gcs.last("MISSION_CURRENT").seq == wire, "repeated for a station that did not hear it"


@pytest.mark.parametrize("seq", [4, 65535])
def test_check_26_out_of_range(bench, seq):
    stored(bench, 4)
    bench.gcs.clear()
    bench.long(224, seq + bench.shift if seq < 65535 else seq)
    bench.send(dialect.MAVLink_mission_set_current_message(1, 1, min(seq + bench.shift, 65535)))
    bench.tick(2)
    assert bench.acked(224) == [2]
    assert bench.vessel.seq == 0
    assert "not in the mission" in bench.texts()


def test_check_27_on_the_last_item_a_station_that_counts_home_reads_the_total(bench):
    """common.xml: 'on last item, sequence == total', home left out of the total."""
    stored(bench, 4)
    bench.vessel.plan_state, bench.vessel.seq = PlanState.ACTIVE, 3
    bench.run(2)
    last = bench.gcs.last("MISSION_CURRENT")
    assert last.total == 4
    assert last.seq == (last.total if bench.shift else last.total - 1)
    stored(bench, 0)
    bench.run(2)
    assert bench.gcs.last("MISSION_CURRENT").total == 0xFFFF


def test_check_27_progress(bench):
    stored(bench, 4)
    bench.vessel.plan_state = PlanState.ACTIVE
    bench.vessel.seq = 1
    bench.gcs.clear()
    bench.run(5)
    currents = bench.gcs.all("MISSION_CURRENT")
    assert len(currents) >= 5
    last = currents[-1]
    assert (last.seq, last.total, last.mission_state) == (1 + bench.shift, 4, 3)
    assert last.mission_id
    bench.vessel.reached.append(1)
    bench.run(3)
    assert [m.seq for m in bench.gcs.all("MISSION_ITEM_REACHED")] == [1 + bench.shift]


def test_check_29_a_fence_goes_up_and_down(bench):
    square = [(0, 0), (0, 9000), (9000, 9000), (9000, 0)]
    content = [item(5001, 4, x=LAT + x, y=LON + y, frame=0) for x, y in square]
    content += [item(5002, 3, x=LAT + x // 3, y=LON + y // 3, frame=0) for x, y in square[:3]]
    content += [item(5003, 40.0, frame=0)]
    assert upload(bench, content, 1) == ACCEPTED
    assert [got_bits(m) for m in download(bench, 1)] == [bits(c) for c in content]
    assert upload(bench, content[:3], 1) != ACCEPTED
    assert len(bench.vessel.plans.items(PlanKind.FENCE)) == len(content)


def test_check_30_ids_are_independent(bench):
    upload(bench, [WAYPOINT])
    bench.run(1)
    mission_id = bench.gcs.last("MISSION_CURRENT").mission_id
    upload(bench, [item(5003, 40.0)], 1)
    bench.run(1)
    current = bench.gcs.last("MISSION_CURRENT")
    assert current.mission_id == mission_id != 0
    assert current.fence_id not in (0, mission_id)
    assert current.rally_points_id == 0


def test_check_32_rally_points(bench):
    content = [item(5100), item(5100, x=LAT + 900)]
    assert upload(bench, content, 2) == ACCEPTED
    assert [(m.x, m.y, m.command) for m in download(bench, 2)] == [(LAT, LON, 5100), (LAT + 900, LON, 5100)]
