"""The plans that a console keeps on the vessel, written and read by a codec that nobody here made."""

from __future__ import annotations

import hashlib

import imcpy
import pytest

from companion.imc.desk import Desk, DeskConfig
from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker, Udp
from mavlink_bridge.mavlink.client import VehicleClient
from tests.imc_messages import captured


class Foreign:
    """A console whose every packet is made and read by imcpy."""

    def __init__(self, saved: str = "", **config) -> None:
        self.saved = saved
        self.number = 0
        self.now_us = 1_000_000
        self.begin(**config)

    def begin(self, **config) -> None:
        def save(text: str) -> None:
            self.saved = text

        self.desk = Desk(DeskConfig(**config), VehicleClient(), saved=self.saved, save=save)

    def ask(self, op: str, plan_id: str = "", arg=None, *, number: int | None = None, sent_s: float | None = None):
        request = imcpy.PlanDB()
        request.type = imcpy.PlanDB.TypeEnum.REQUEST
        request.op = getattr(imcpy.PlanDB.OperationEnum, op)
        self.number += 1
        request.request_id = self.number if number is None else number
        request.plan_id = plan_id
        if arg is not None:
            request.arg = arg
        return self.send(bytes(request.serialize()), sent_s)

    def send(self, raw: bytes, sent_s: float | None = None):
        self.now_us += 100_000
        packet = imc.decode(raw)
        at = self.now_us * 1e-6 if sent_s is None else sent_s
        asker = Asker(0x4001, 0xFF, "ccu", Udp("10.77.0.1", 6001), sent_utc_s=at)
        self.desk.receive(packet.message, asker, self.now_us)
        answers = [
            imcpy.Packet.deserialize(imc.encode(imc.Packet(imc.Header(0x0803, 0x4001), out.message)))
            for out in self.desk.take(self.now_us)
        ]
        assert all(out is not None for out in answers)
        return answers


def spec(name: str, maneuver=None, *, depth_m: float = 0.0):
    if maneuver is None:
        maneuver = imcpy.Loiter()
        maneuver.radius, maneuver.duration = 20.0, 60
        maneuver.type = imcpy.Loiter.LoiterTypeEnum.CIRCULAR
        maneuver.z, maneuver.z_units = depth_m, imcpy.ZUnits.DEPTH
        maneuver.speed = 1.2
    maneuver.lat, maneuver.lon = 0.7188, -0.1518
    node = imcpy.PlanManeuver()
    node.maneuver_id, node.data = "L1", maneuver
    made = imcpy.PlanSpecification()
    made.plan_id, made.start_man_id = name, "L1"
    made.maneuvers.append(node)
    return made


def fields(message) -> bytes:
    return bytes(message.serialize())[20:-2]


def only(answers):
    assert len(answers) == 1
    return answers[0]


def test_a_plan_comes_back_byte_for_byte_with_the_sum_that_consoles_reckon() -> None:
    console, made = Foreign(), spec("p1")
    kept = only(console.ask("SET", "p1", made))
    assert (int(kept.type), kept.request_id, kept.plan_id) == (imc.ReplyType.SUCCESS, 1, "p1")
    assert kept.info == "OK (new entry)"
    assert bytes(kept.arg.md5) == hashlib.md5(fields(made)).digest()
    back = only(console.ask("GET", "p1"))
    assert fields(back.arg) == fields(made)
    info = only(console.ask("GET_INFO", "p1"))
    assert bytes(info.arg.md5) == hashlib.md5(fields(made)).digest()
    assert info.arg.plan_size == len(fields(made))
    assert only(console.ask("SET", "p1", made)).info == "OK (updated)"


def test_the_consoles_own_plan_with_its_own_sum() -> None:
    """A packet of the real console, and the MD5 that the real vehicle answered it with."""
    packets = captured()
    name = next(each for each in packets if each.startswith("PlanDB type=0 op=0"))
    console = Foreign(full_speed_mps=2.0)
    kept = only(console.send(packets[name]))
    assert int(kept.type) == imc.ReplyType.SUCCESS
    request = imc.decode(packets[name]).message
    back = only(console.ask("GET", request.plan_id))
    assert fields(back.arg) == imc.fields_bytes(request.arg)


def test_the_collection_is_told_as_consoles_compare_it() -> None:
    console = Foreign()
    empty = only(console.ask("GET_STATE"))
    assert empty.arg.plan_count == 0
    assert bytes(empty.arg.md5) == hashlib.md5(b"").digest()
    for name in ("b", "a", "c"):
        console.ask("SET", name, spec(name))
    console.ask("DEL", "c")
    state = only(console.ask("GET_STATE")).arg
    assert [each.plan_id for each in state.plans_info] == ["a", "b"]
    sums = b"".join(hashlib.md5(fields(spec(name))).digest() for name in ("a", "b"))
    assert bytes(state.md5) == hashlib.md5(sums).digest()
    assert int(only(console.ask("CLEAR")).type) == imc.ReplyType.SUCCESS
    assert only(console.ask("GET_STATE")).arg.plan_count == 0


@pytest.mark.parametrize(
    ("op", "name", "arg", "words"),
    [
        ("GET", "nosuch", None, "undefined plan"),
        ("GET_INFO", "nosuch", None, "undefined plan"),
        ("DEL", "nosuch", None, "undefined plan"),
        ("SET", "other", spec("p1"), "plan id mismatch"),
        ("SET", "p1", None, "there is no plan in it"),
    ],
)
def test_what_is_not_there_is_said(op, name, arg, words) -> None:
    answer = only(Foreign().ask(op, name, arg))
    assert (int(answer.type), answer.info) == (imc.ReplyType.FAILURE, words)


def test_plans_outlive_a_restart() -> None:
    console = Foreign()
    for name in ("one", "two"):
        console.ask("SET", name, spec(name))
    before = only(console.ask("GET_STATE")).arg
    console.begin()
    after = only(console.ask("GET_STATE")).arg
    assert bytes(after.md5) == bytes(before.md5)
    assert fields(only(console.ask("GET", "two")).arg) == fields(spec("two"))


@pytest.mark.parametrize("damage", ["", "{", '{"version": 9}', '{"version": 1, "plans": {"x": ["!", 1, 2, "n"]}}'])
def test_a_damaged_memory_is_an_empty_one(damage) -> None:
    assert only(Foreign(damage).ask("GET_STATE")).arg.plan_count == 0


def test_a_request_that_comes_again_is_answered_again_and_a_copy_is_not() -> None:
    console = Foreign()
    assert len(console.ask("SET", "p1", spec("p1"), number=7, sent_s=50.0)) == 1
    assert console.ask("SET", "p1", spec("p1"), number=7, sent_s=50.0) == []
    again = only(console.ask("SET", "p1", spec("p1"), number=7, sent_s=52.0))
    assert again.info == "OK (new entry)"
    assert only(console.ask("SET", "p1", spec("p1"), number=7, sent_s=90.0)).info == "OK (updated)"


def test_a_plan_that_cannot_be_sailed_is_kept_and_said_at_once() -> None:
    answer = only(Foreign().ask("SET", "p1", spec("p1", depth_m=3.0)))
    assert int(answer.type) == imc.ReplyType.SUCCESS
    assert "START will refuse it: L1: depth 3 m" in answer.info


def test_a_large_plan_is_kept_whole_and_too_many_are_refused_in_words() -> None:
    console = Foreign(max_plans=2)
    points = imcpy.FollowPath()
    points.speed = 1.0
    for number in range(4100):
        point = imcpy.PathPoint()
        point.x = float(number)
        points.points.append(point)
    large = spec("large", points)
    assert len(fields(large)) > 49_000
    assert int(only(console.ask("SET", "large", large)).type) == imc.ReplyType.SUCCESS
    assert fields(only(console.ask("GET", "large")).arg) == fields(large)
    console.ask("SET", "two", spec("two"))
    full = only(console.ask("SET", "three", spec("three")))
    assert (int(full.type), "2 plans are the most" in full.info) == (imc.ReplyType.FAILURE, True)


def test_a_plan_with_something_unread_is_refused_by_its_name() -> None:
    answer = only(Foreign().ask("SET", "p", spec("p", imcpy.ScheduledGoto())))
    assert (int(answer.type), "ScheduledGoto" in answer.info) == (imc.ReplyType.FAILURE, True)
