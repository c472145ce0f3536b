"""Mission transfers as a ground station sees them, for a link with and without ArduPilot's home item."""

from __future__ import annotations

import itertools
import math
import struct

import pytest

from mavlink_bridge.language.requests import ACCEPTED, PlanItem, PlanKind, Reply, Result
from mavlink_bridge.mavlink.missions.plan_rules import MissionResult, plan_id
from mavlink_bridge.mavlink.missions.service import MissionServer, MissionTiming, UploadLocks
from mavlink_bridge.mavlink.missions.wire import item_to_message, with_home
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer

S = 1_000_000
LAT, LON = 411_850_123, -87_062_154
QGC, SDK = (255, 190), (245, 190)
personas = pytest.mark.parametrize("home_item", [False, True], ids=["generic", "ardurover"])


class Store:
    """The vessel's memory."""

    def __init__(self):
        self.plans = dict.fromkeys(PlanKind, ())
        self.home = (math.radians(41.0), math.radians(-8.7))

    def items(self, kind):
        return self.plans[kind]

    def plan_id(self, kind):
        return plan_id(self.plans[kind])


def point(number=0, command=16, **fields):
    values = {"param1": 0.0, "param2": 0.0, "param3": 0.0, "param4": math.nan, "z": 50.0} | fields
    frame = values.pop("frame", 3)
    return PlanItem(command, frame, x=values.pop("x", LAT + 1_000 * number), y=values.pop("y", LON), **values)


def jump(target, repeats=2.0):
    return PlanItem(177, 2, float(target), repeats, 0.0, 0.0, 0, 0, 0.0)


HOME = point(frame=0, x=400_000_000, y=-80_000_000, param4=0.0, z=0.0)


class Link:
    """A ground station on one link, with the vessel behind it."""

    def __init__(self, store=None, sender=QGC, home_item=False, **options):
        self.store = store or Store()
        self.server = MissionServer(self.store, home_item=home_item, **options)
        self.sender = sender
        self.home_item = home_item
        self.now_us = 0
        self._codec, self._deframer = Codec(*sender), Deframer()

    def send(self, message):
        """Through real frames, as the vessel would get it; the vessel's answer comes back decoded alike."""
        (frame,) = self._deframer.receive(self._codec.encode(message), 0)
        return self.read(self.server.handle(decode(frame), self.now_us))

    def poll(self, seconds=0.0):
        self.now_us += int(seconds * S)
        return self.read(self.server.poll(self.now_us))

    def read(self, messages):
        vessel = Codec(1, 1)
        return [decode(frame) for message in messages for frame in Deframer().receive(vessel.encode(message), 0)]

    def count(self, number, kind=0, **fields):
        return self.send(dialect.MAVLink_mission_count_message(1, 1, number, kind, **fields))

    def item(self, item, seq, kind=PlanKind.MISSION):
        return self.send(item_to_message(item, seq, 1, 1, kind))

    def list(self, kind=0):
        return self.send(dialect.MAVLink_mission_request_list_message(1, 1, kind))

    def ack(self, result, kind=0):
        return self.send(dialect.MAVLink_mission_ack_message(1, 1, result, kind))

    def clear(self, kind):
        return self.send(dialect.MAVLink_mission_clear_all_message(1, 1, kind))

    def vessel_stores(self, reply=ACCEPTED):
        """What the vessel does at its next tick."""
        answers = []
        for handle, load in self.server.loads():
            if reply.result is Result.ACCEPTED:
                self.store.plans[load.kind] = load.items
            answers += self.server.finish(handle, reply, plan_id(load.items), self.now_us)
        return self.read(answers)

    def wire(self, items):
        """A mission as this persona's ground station numbers it."""
        return (HOME, *items) if self.home_item else tuple(items)

    def upload(self, items, kind=PlanKind.MISSION):
        """A whole clean upload; returns the MISSION_ACK and the order of the requests."""
        items = self.wire(items) if kind is PlanKind.MISSION else items
        asked, answers = [], self.count(len(items), kind.value)
        while answers and answers[0].get_type() == "MISSION_REQUEST_INT":
            asked.append(answers[0].seq)
            answers = self.item(items[answers[0].seq], answers[0].seq, kind)
        return (answers or self.vessel_stores())[0], asked

    def download(self, kind=PlanKind.MISSION, request="MISSION_REQUEST_INT"):
        (count,) = self.list(kind.value)
        make = getattr(dialect, f"MAVLink_{request.lower()}_message")
        got = [self.send(make(1, 1, seq, kind.value))[0] for seq in range(count.count)]
        self.ack(0, kind.value)
        return count, got


@personas
def test_check_12_an_empty_plan_lists_as_0_and_0_empties_it(home_item):
    link = Link(home_item=home_item)
    for kind in PlanKind:
        (count,) = link.list(kind.value)
        assert (count.get_type(), count.count, count.mission_type) == ("MISSION_COUNT", 0, kind.value)
        assert (count.target_system, count.target_component) == QGC
    link.upload([point()])
    assert link.count(0) == []
    (ack,) = link.vessel_stores()
    assert (ack.get_type(), ack.type, ack.mission_type) == ("MISSION_ACK", 0, 0)
    assert link.store.plans[PlanKind.MISSION] == ()


@personas
def test_check_13_items_are_asked_for_in_order_and_acknowledged_once_with_a_new_id(home_item):
    link = Link(home_item=home_item)
    ack, asked = link.upload([point(number) for number in range(5)])
    assert asked == list(range(5 + home_item))
    assert (ack.type, ack.mission_type, ack.opaque_id) == (0, 0, plan_id(link.store.plans[PlanKind.MISSION]))
    other, _ = link.upload([point(number) for number in range(4)])
    assert other.opaque_id not in (0, ack.opaque_id)
    assert link.poll(60.0) == []


@personas
def test_the_acknowledgement_waits_for_the_vessel(home_item):
    link = Link(home_item=home_item)
    items = link.wire([point()])
    link.count(len(items))
    for seq, item in enumerate(items):
        answers = link.item(item, seq)
    assert answers == []
    assert link.poll(0.2) == []
    assert link.vessel_stores(Reply(Result.DENIED, "not while armed"))[0].type == MissionResult.DENIED
    assert "not while armed" in link.server.drain_texts()[-1][1]
    assert link.store.plans[PlanKind.MISSION] == ()


@personas
def test_check_14_a_lost_item_is_asked_for_again_at_most_5_times_and_the_old_plan_stays(home_item):
    link = Link(home_item=home_item)
    link.upload([point(7)])
    old = link.store.plans[PlanKind.MISSION]
    (first,) = link.count(3)
    assert first.seq == 0
    repeats = []
    while not repeats or repeats[-1].get_type() == "MISSION_REQUEST_INT":
        repeats += link.poll(0.1)
        assert link.now_us < 60 * S
    assert [message.seq for message in repeats[:-1]] == [0, 0, 0, 0, 0]
    assert repeats[-1].type == MissionResult.OPERATION_CANCELLED
    assert link.now_us == pytest.approx(6 * 1.5 * S, abs=S)
    assert link.store.plans[PlanKind.MISSION] == old
    assert link.upload([point(1)])[0].type == 0


@personas
def test_check_15_duplicates_are_silent_and_items_out_of_order_are_ignored(home_item):
    link = Link(home_item=home_item)
    items = link.wire([point(number) for number in range(4)])
    link.count(len(items))
    assert link.item(items[0], 0)[0].seq == 1
    assert link.item(items[0], 0) == []
    assert link.item(items[3], 3) == []
    for seq in range(1, len(items)):
        answers = link.item(items[seq], seq)
    assert answers == []
    (ack,) = link.vessel_stores()
    assert ack.type == 0
    assert plan_id(link.store.plans[PlanKind.MISSION]) == plan_id(items[home_item:])


def bits(item):
    return struct.pack("<5f2i", item.param1, item.param2, item.param3, item.param4, item.z, item.x, item.y)


@personas
def test_check_16_a_download_returns_every_bit(home_item):
    link = Link(home_item=home_item)
    odd = struct.unpack("<f", b"\x12\x34\xc0\x7f")[0]
    items = [
        point(0, param3=odd, z=math.nan),
        point(1, 18, param1=1.1, param3=-20.3, frame=6),
        point(2, 19, param1=3.3, frame=0, z=-0.0),
        PlanItem(206, 2, 25.0, 0.1, math.nan, math.inf, 0x7FFFFFFF, -5, math.nan, 0),
    ]
    link.upload(items)
    count, got = link.download()
    assert count.opaque_id == plan_id(items)
    got = got[home_item:]
    assert [bits(item) for item in got] == [bits(item) for item in items]
    assert [(item.command, item.frame, item.autocontinue) for item in got] == [
        (item.command, item.frame, item.autocontinue) for item in items
    ]


@personas
def test_check_17_the_old_request_is_answered_with_the_int_item(home_item):
    link = Link(home_item=home_item)
    link.upload([point(), point(1)])
    _, got = link.download(request="MISSION_REQUEST")
    assert {item.get_type() for item in got} == {"MISSION_ITEM_INT"}


@personas
@pytest.mark.parametrize(
    ("bad", "result", "words"),
    [
        (point(1, 22), MissionResult.UNSUPPORTED, "NAV_TAKEOFF"),
        (point(1, frame=1), MissionResult.UNSUPPORTED_FRAME, "frame 1"),
        (point(1, 18, param1=math.nan), MissionResult.INVALID_PARAM1, "NAV_LOITER_TURNS"),
        (point(1, x=900_000_001), MissionResult.INVALID_PARAM5_X, "latitude"),
        (jump(90), MissionResult.INVALID_PARAM1, "jump"),
    ],
)
def test_check_18_a_bad_item_ends_the_upload_with_its_reason_and_the_old_plan_stays(home_item, bad, result, words):
    link = Link(home_item=home_item)
    link.upload([point(5)])
    old = link.store.plans[PlanKind.MISSION]
    ack, _ = link.upload([point(0), bad, point(2)])
    assert ack.type == result
    text = link.server.drain_texts()[-1][1]
    assert words in text
    assert f"item {1 + home_item}" in text
    assert link.store.plans[PlanKind.MISSION] == old
    assert link.server.loads() == []
    assert not link.server.busy


@personas
def test_check_18_too_many_items_are_refused_before_the_first(home_item):
    link = Link(home_item=home_item)
    (ack,) = link.count(830 + home_item)
    assert ack.type == MissionResult.NO_SPACE
    assert link.count(65_535)[0].type == MissionResult.NO_SPACE
    assert link.count(829 + home_item)[0].get_type() == "MISSION_REQUEST_INT"


@personas
def test_check_21_jump_targets_are_counted_as_the_persona_counts(home_item):
    link = Link(home_item=home_item)
    ack, _ = link.upload([point(0), point(1), jump(1 + home_item), point(3)])
    assert ack.type == 0
    assert link.store.plans[PlanKind.MISSION][2].param1 == 1.0
    _, got = link.download()
    assert got[2 + home_item].param1 == 1.0 + home_item


@personas
@pytest.mark.parametrize("kind", [*PlanKind, None])
def test_check_23_clear_empties_what_it_names_and_nothing_else(home_item, kind):
    link = Link(home_item=home_item)
    link.upload([point()])
    link.upload([PlanItem(5003, 0, 20.0, 0, 0, 0, LAT, LON, 0.0)], PlanKind.FENCE)
    link.upload([point(0, 5100)], PlanKind.RALLY)
    wanted = 255 if kind is None else kind.value
    assert link.clear(wanted) == []
    acks = link.vessel_stores()
    assert [(ack.type, ack.mission_type) for ack in acks] == [(0, wanted)]
    assert {each for each in PlanKind if not link.store.plans[each]} == (set(PlanKind) if kind is None else {kind})


@personas
def test_check_24_cancel_returns_to_idle_at_once(home_item):
    link = Link(home_item=home_item)
    link.count(10)
    assert link.ack(MissionResult.OPERATION_CANCELLED) == []
    assert not link.server.busy
    assert link.poll(20.0) == []
    assert link.upload([point()])[0].type == 0
    link.list()
    link.ack(MissionResult.OPERATION_CANCELLED)
    assert link.upload([point()])[0].type == 0


@personas
@pytest.mark.parametrize("same_link", [True, False], ids=["one link", "two links"])
def test_check_25_a_second_uploader_is_denied_and_plans_never_mix(home_item, same_link):
    locks, store = UploadLocks(), Store()
    first = Link(store, QGC, home_item, locks=locks)
    second = Link(store, SDK, home_item, locks=locks)
    if same_link:
        second.server = first.server
    mine = first.wire([point(number) for number in range(3)])
    first.count(len(mine))
    first.item(mine[0], 0)
    (ack,) = second.count(5)
    assert (ack.type, ack.target_system) == (MissionResult.DENIED, SDK[0])
    assert second.item(point(99), 1) in ([], [ack])
    for seq in range(1, len(mine)):
        first.item(mine[seq], seq)
    assert first.vessel_stores()[0].type == 0
    assert plan_id(store.plans[PlanKind.MISSION]) == plan_id(mine[home_item:])
    assert second.upload([point(4)])[0].type == 0


def test_a_silent_uploader_does_not_lock_the_others_out():
    locks, store = UploadLocks(), Store()
    gone, here = Link(store, QGC, locks=locks), Link(store, SDK, locks=locks)
    gone.count(5)
    here.now_us = 4 * S
    assert here.upload([point()])[0].type == 0
    gone.now_us = 4 * S
    assert gone.poll()[0].type == MissionResult.DENIED


@pytest.mark.parametrize("kind", [0, 255])
def test_what_is_uploaded_on_another_link_is_not_cleared_meanwhile(kind):
    locks, store = UploadLocks(), Store()
    first, second = Link(store, QGC, locks=locks), Link(store, SDK, locks=locks)
    first.count(2)
    (ack,) = second.clear(kind)
    assert ack.type == MissionResult.DENIED
    assert "not cleared: an upload is under way" in second.server.drain_texts()[0][1]
    first.item(point(0), 0)
    first.item(point(1), 1)
    (ack,) = first.vessel_stores()
    assert ack.type == 0
    assert second.clear(kind) == []
    assert second.vessel_stores()[0].type == 0
    first.count(2)  # and is heard of no more
    second.now_us += 10 * S
    assert second.clear(kind) == []
    assert second.vessel_stores()[0].type == 0


@personas
def test_check_29_fences_round_trip(home_item):
    link = Link(home_item=home_item)
    corners = [PlanItem(5001, 0, 3.0, 0, 0, 0, LAT + 1000 * n, LON + 1000 * (n % 2), 0.0) for n in range(3)]
    hole = [PlanItem(5002, 0, 4.0, 0, 0, 0, LAT + n, LON + n, 0.0) for n in range(4)]
    fence = [*corners, *hole, PlanItem(5003, 0, 33.3, 0, 0, 0, LAT, LON, 0.0)]
    link.count(len(fence), 1)
    for seq, item in enumerate(fence):
        link.item(item, seq, PlanKind.FENCE)
    ((handle, load),) = link.server.loads()
    assert [(area.inclusion, len(area.vertices_rad)) for area in load.fence] == [(True, 3), (False, 4), (True, 0)]
    link.store.plans[PlanKind.FENCE] = load.items
    assert link.read(link.server.finish(handle, ACCEPTED, plan_id(load.items)))[0].mission_type == 1
    _, got = link.download(PlanKind.FENCE)
    assert [bits(item) for item in got] == [bits(item) for item in fence]
    assert link.upload(fence[:-2], PlanKind.FENCE)[0].type == MissionResult.INVALID


@personas
def test_check_30_ids_of_the_three_kinds_are_independent(home_item):
    link = Link(home_item=home_item)
    mission, _ = link.upload([point()])
    rally, _ = link.upload([point(0, 5100)], PlanKind.RALLY)
    assert mission.opaque_id != rally.opaque_id
    link.upload([point(1, 5100)], PlanKind.RALLY)
    assert link.list(0)[0].opaque_id == mission.opaque_id


@personas
def test_check_32_rally_points_round_trip(home_item):
    link = Link(home_item=home_item)
    rally = [point(number, 5100) for number in range(3)]
    assert link.upload(rally, PlanKind.RALLY)[0].type == 0
    _, got = link.download(PlanKind.RALLY)
    assert [bits(item) for item in got] == [bits(item) for item in rally]


@personas
def test_check_07_two_stations_at_once_each_get_their_own_answers(home_item):
    link, other = Link(home_item=home_item), Link(sender=SDK, home_item=home_item)
    link.upload([point(), point(1)])
    other.server = link.server
    (to_qgc,), (to_sdk,) = link.list(), other.list()
    assert [(m.target_system, m.target_component) for m in (to_qgc, to_sdk)] == [QGC, SDK]
    # the kinds do not disturb each other either
    other.count(1, 1)
    assert link.download()[0].count == 2 + home_item


def test_check_08_messages_for_others_are_ignored():
    link = Link()
    for system, component in ((2, 1), (1, 2), (2, 0)):
        message = dialect.MAVLink_mission_count_message(system, component, 3, 0)
        assert link.send(message) == []
    assert link.send(dialect.MAVLink_mission_count_message(0, 0, 3, 0))[0].seq == 0


def test_the_home_item_is_the_vessels_home_and_item_numbers_shift():
    link = Link(home_item=True)
    link.upload([point(1), point(2)])
    count, got = link.download()
    assert count.count == 3
    assert (got[0].command, got[0].frame, got[0].x, got[0].y) == (16, 0, 410_000_000, -87_000_000)
    assert [item.current for item in got] == [1, 0, 0]
    assert with_home(link.store.plans[PlanKind.MISSION], None)[0].x == 0


@pytest.mark.parametrize(
    ("first", "words"),
    [(point(0, 18, param1=1.0), "not a waypoint"), (point(0), "frame 3"), (jump(2), "not a waypoint")],
)
def test_an_upload_without_a_home_item_is_refused_where_one_is_due(first, words):
    link = Link(home_item=True)
    link.count(2)
    (ack,) = link.item(first, 0)
    assert ack.type == MissionResult.INVALID
    text = link.server.drain_texts()[0][1]
    assert "item 0" in text
    assert words in text


@pytest.mark.parametrize(
    "home",
    # the second is what MAVSDK sends to an ArduPilot to clear it
    [HOME, PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0, 0)],
    ids=["home", "MAVSDK"],
)
def test_a_mission_of_only_a_home_item_is_an_empty_mission(home):
    link = Link(home_item=True)
    link.upload([point()])
    link.count(1)
    link.item(home, 0)
    assert link.vessel_stores()[0].type == 0
    assert link.store.plans[PlanKind.MISSION] == ()
    assert link.list()[0].count == 0


def test_a_repeated_last_item_gets_the_acknowledgement_again():
    link = Link()
    link.upload([point(), point(1)])
    link.now_us += S
    (ack,) = link.item(point(1), 1)
    assert (ack.get_type(), ack.type) == ("MISSION_ACK", 0)
    link.now_us += 60 * S
    assert link.item(point(1), 1) == []


def test_a_new_count_from_the_same_station_starts_again_with_new_items():
    link = Link()
    link.count(3)
    link.item(point(0), 0)
    assert link.count(2)[0].seq == 0
    link.item(point(8), 0)
    link.item(point(9), 1)
    assert link.vessel_stores()[0].type == 0
    assert [item.x for item in link.store.plans[PlanKind.MISSION]] == [LAT + 8_000, LAT + 9_000]


def test_a_plan_changed_by_another_station_does_not_mix_into_a_running_download():
    link, other = Link(), Link(sender=SDK)
    other.server, other.store = link.server, link.store
    link.upload([point(number) for number in range(3)])
    (count,) = link.list()
    other.upload([point(90), point(91)])
    got = [link.send(dialect.MAVLink_mission_request_int_message(1, 1, seq, 0))[0].x for seq in range(count.count)]
    assert got == [LAT, LAT + 1_000, LAT + 2_000]


def test_requests_outside_the_plan_and_unknown_kinds_are_answered():
    link = Link()
    assert link.send(dialect.MAVLink_mission_request_int_message(1, 1, 0, 0))[0].type == MissionResult.INVALID_SEQUENCE
    assert link.list(77)[0].type == MissionResult.UNSUPPORTED
    assert link.list(255)[0].type == MissionResult.UNSUPPORTED
    assert link.count(3, 255)[0].type == MissionResult.UNSUPPORTED
    assert link.clear(9)[0].type == MissionResult.UNSUPPORTED


def test_float_items_of_old_stations_are_taken():
    link = Link()
    link.count(1)
    old = dialect.MAVLink_mission_item_message(1, 1, 0, 3, 16, 1, 1, 0, 0, 0, 0, 41.1850123, -8.7062154, 50.0, 0)
    link.send(old)
    assert link.vessel_stores()[0].type == 0
    (item,) = link.store.plans[PlanKind.MISSION]
    # a float carries 24 bits: 0.2 m at this latitude
    assert item.x == pytest.approx(LAT, abs=20)


def test_part_of_a_plan_can_be_written():
    link = Link(home_item=True)
    link.upload([point(number) for number in range(4)])
    answers = link.send(dialect.MAVLink_mission_write_partial_list_message(1, 1, 2, 3, 0))
    assert answers[0].seq == 2
    assert link.item(point(50), 2)[0].seq == 3
    link.item(point(51), 3)
    assert link.vessel_stores()[0].type == 0
    assert [item.x - LAT for item in link.store.plans[PlanKind.MISSION]] == [0, 50_000, 51_000, 3_000]
    assert (
        link.send(dialect.MAVLink_mission_write_partial_list_message(1, 1, 3, 9, 0))[0].type
        == MissionResult.INVALID_SEQUENCE
    )


@pytest.mark.parametrize("kind", [PlanKind.MISSION, PlanKind.RALLY])
def test_part_of_a_plan_that_was_changed_meanwhile_is_not_written(kind):
    """What stands around it would come back."""
    command = 16 if kind is PlanKind.MISSION else 5100
    link = Link()
    link.upload([point(number, command) for number in range(4)], kind)
    link.send(dialect.MAVLink_mission_write_partial_list_message(1, 1, 2, 2, kind.value))
    link.store.plans[kind] = tuple(point(number, command) for number in range(20, 24))
    (ack,) = link.item(point(50, command), 2, kind)
    assert ack.type == MissionResult.DENIED
    assert link.server.loads() == []
    assert "another one is aboard; read it first" in link.server.drain_texts()[-1][1]


def test_a_single_item_that_changes_a_plan_is_held_until_the_vessel_has_it():
    """The vessel is asked first, and takes longer than a one-item plan can be held; who changes items bears it."""
    link = Link(timing=MissionTiming(hold_us=400_000, store_us=90 * S))
    link.upload([point(number) for number in range(4)])
    link.send(dialect.MAVLink_mission_write_partial_list_message(1, 1, 2, 2, 0))
    link.item(point(50), 2)
    heard = [message.get_type() for _ in range(60) for message in link.poll(0.1)]
    assert set(heard) == {"MISSION_REQUEST_INT"}
    assert link.vessel_stores()[-1].type == MissionResult.ACCEPTED


def test_a_mission_item_with_current_2_is_a_guided_go_to():
    link = Link(home_item=True)
    message = dialect.MAVLink_mission_item_message(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, 41.185, -8.706, 0.0, 0)
    assert link.send(message) == link.send(message) == []
    first, copy = link.server.go_tos.asked()
    link.server.go_tos.begun(first.handle)
    link.server.go_tos.forget(copy.handle)
    (ack,) = link.server.finish(first.handle, Reply(Result.DENIED, "outside the fence"))
    assert (ack.type, ack.target_system) == (MissionResult.DENIED, 255)
    assert link.server.finish(first.handle, ACCEPTED) == link.server.finish(copy.handle, ACCEPTED) == []
    assert math.degrees(first.target.lat_rad) == pytest.approx(41.185, abs=1e-5)
    assert (
        link.send(dialect.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, 0, 0, 0.0, 0))[0].type == 5
    )


def test_a_gateway_holds_an_upload_open_by_asking_for_the_last_two_in_turn():
    timing = MissionTiming(hold_us=400_000, store_us=None)
    link = Link(timing=timing)
    link.count(4)
    for number in range(4):
        link.item(point(number), number)
    asked = [message.seq for _ in range(100) for message in link.poll(0.1)]
    assert len(asked) == 25
    assert set(asked) == {2, 3}
    assert all(left != right for left, right in itertools.pairwise(asked))
    # the station answers, the server keeps what it has; the end comes while the station is at its last item
    assert link.item(point(3), 3) == []
    answers = [(message.get_type(), getattr(message, "seq", None)) for message in link.vessel_stores()]
    assert answers[-1][0] == "MISSION_ACK"
    assert asked[-1] == 3 or answers[0] == ("MISSION_REQUEST_INT", 3)
    assert link.poll(1.0) == []


def held(count=2):
    """An upload that is complete and on its way over the radio."""
    link = Link(timing=MissionTiming(hold_us=400_000, store_us=300 * S))
    link.count(count)
    for number in range(count):
        link.item(point(number), number)
    link.poll(0.5)
    link.server.drain_texts()
    return link


@pytest.mark.parametrize("count", [2, 3], ids=["as many items", "more"])
def test_an_upload_that_comes_while_another_is_on_its_way_is_refused_and_ends_with_a_text(count):
    link = held()
    (ack,) = link.count(count)
    assert ack.type == MissionResult.DENIED
    assert [message.get_type() for message in link.poll(5.0)] == [], "nothing of the new plan is asked for"
    assert link.vessel_stores() == [], "the first plan's end is no answer to the second"
    assert [text for _, text in link.server.drain_texts()] == [
        "Plan not taken: the one before is on its way; wait until it is stored",
        "Plan now stored on the vessel",
    ]
    ack, _ = link.upload([point(7)])
    assert ack.type == 0
    assert [item.x for item in link.store.plans[PlanKind.MISSION]] == [point(7).x]


def test_a_late_copy_of_the_request_that_began_an_upload_changes_nothing():
    link = Link(timing=MissionTiming(hold_us=400_000, store_us=None))
    codec = link._codec
    first, again = (codec.encode(dialect.MAVLink_mission_count_message(1, 1, 2, 0)) for _ in range(2))
    for frame in (first, again):
        link.server.handle(decode(Deframer().receive(frame, 0)[0]), link.now_us)
    for number in range(2):
        link.item(point(number), number)
    for frame in (first, again):
        assert link.server.handle(decode(Deframer().receive(frame, 0)[0]), link.now_us) == []
    assert link.server.drain_texts() == []
    assert link.vessel_stores()[-1].type == MissionResult.ACCEPTED


@pytest.mark.parametrize("between", [[], ["cancel"], ["other"]], ids=["", "cancelled before", "after a refusal"])
def test_a_clearing_by_a_count_of_0_that_is_asked_for_again_is_acknowledged_once(between):
    link = Link(timing=MissionTiming(hold_us=400_000, store_us=None))
    link.upload([point(1)], PlanKind.RALLY)
    assert link.count(0, PlanKind.RALLY.value) == []
    for each in between:
        if each == "cancel":
            link.ack(MissionResult.OPERATION_CANCELLED, PlanKind.RALLY.value)
        else:
            assert link.count(3, PlanKind.RALLY.value)[0].type == MissionResult.DENIED
    link.server.drain_texts()
    for _ in range(3):
        link.poll(0.7)
        assert link.count(0, PlanKind.RALLY.value) == []
    assert link.server.drain_texts() == []
    assert [message.type for message in link.vessel_stores()] == [MissionResult.ACCEPTED]
    assert link.store.plans[PlanKind.RALLY] == ()


def test_a_cancel_while_a_plan_is_on_its_way_is_told_and_an_upload_after_it_refused():
    link = held()
    assert link.ack(MissionResult.OPERATION_CANCELLED) == []
    assert link.ack(MissionResult.OPERATION_CANCELLED) == []
    assert link.poll(5.0) == [], "who has given up is asked for nothing"
    (ack,) = link.count(2)
    assert ack.type == MissionResult.DENIED
    assert link.vessel_stores() == []
    assert [text for _, text in link.server.drain_texts()] == [
        "Plan not cancelled: it is on its way; a text says when it is stored",
        "Plan not taken: the one before is on its way; wait until it is stored",
        "Plan now stored on the vessel",
    ]
    given_up = held()
    given_up.ack(MissionResult.OPERATION_CANCELLED)
    assert given_up.poll(301.0) == []
    assert given_up.count(2)[0].get_type() == "MISSION_REQUEST_INT", "the next one may come"


@personas
@pytest.mark.parametrize("count", [0, 1, 3])
def test_without_holding_the_end_is_one_acknowledgement_and_nothing_else(home_item, count):
    link = Link(home_item=home_item)
    link.now_us = 90 * S
    items = link.wire([point(number) for number in range(count)]) if count else ()
    link.count(len(items))
    for seq, item in enumerate(items):
        link.item(item, seq)
    assert [message.get_type() for message in link.vessel_stores()] == ["MISSION_ACK"]


def test_a_held_single_item_ends_in_an_error_and_a_later_text():
    link = Link(timing=MissionTiming(hold_us=400_000, hold_single_us=1_500_000, store_us=None))
    link.count(1)
    link.item(point(), 0)
    answers = [message for _ in range(20) for message in link.poll(0.1)]
    assert [message.get_type() for message in answers] == ["MISSION_REQUEST_INT"] * 3 + ["MISSION_ACK"]
    assert answers[-1].type == MissionResult.ERROR
    link.server.drain_texts()
    assert link.vessel_stores() == []
    assert "now stored" in link.server.drain_texts()[0][1]


def test_829_items_take_well_under_a_second_of_the_processor():
    link = Link()
    ack, asked = link.upload([point(number) for number in range(829)])
    assert ack.type == 0
    assert asked == list(range(829))
    assert link.download()[0].count == 829


def test_silence_after_any_count_ends_cleanly():
    for count in (1, 2, 829):
        link = Link()
        link.count(count)
        answers = [message for _ in range(300) for message in link.poll(0.1)]
        assert answers[-1].type == MissionResult.OPERATION_CANCELLED
        assert not link.server.busy
        assert len(answers) <= 5 * 8 + 1
