"""The original's JSON over the radio, against a vessel that only keeps books."""

import json

import pytest

from mavlink_bridge.language.messages import Mode, Severity
from mavlink_bridge.language.requests import Arm, LoadPlan, SetMode, StartPlan
from mavlink_bridge.radio.air import Priority
from mavlink_bridge.radio.json_radio import JsonRadio, state_json
from tools.lora_rig import BookVessel, profile

PLAN = (
    b'{"ID":"loiter-1","Latitude":41.1852,"Longitude":-8.706,"Duration":600,'
    b'"Loiter type":"Circular","Speed":3.0,"Length":0,"Radius":20}\n'
)
HOLD, RESUME, DISARM = (b'{"command":"%s"}\n' % word for word in (b"hold", b"resume", b"disarm"))


class Boat:
    """A vessel behind the JSON protocol, and all that it answers."""

    def __init__(self, name="bench"):
        self.told = []
        self.radio = JsonRadio(profile(name), say=lambda severity, text: self.told.append((severity, text)))
        self.vessel = BookVessel()
        self.now_us = 0
        self.answers = []

    def hears(self, line, seconds=5.0, *, steps=99):
        """Let it hear a line, carry out some of what that asks, and answer."""
        self.radio.receive(line, self.now_us)
        for _ in range(steps):
            for request in self.radio.requests():
                self.radio.reply(request.id, self.vessel.handle(request, self.now_us), self.now_us)
        self.waits(seconds)

    def waits(self, seconds):
        for _ in range(round(seconds * 20)):
            self.now_us += 50_000
            line = self.radio.take(self.now_us, 1200)
            if line:
                self.answers.append(json.loads(line))

    @property
    def done(self):
        return [type(body) if isinstance(body, LoadPlan | StartPlan) else body for _, body in self.vessel.executed]


def test_the_second_hold_is_carried_out_like_the_first():
    boat = Boat()
    for line in (HOLD, RESUME, HOLD):
        boat.hears(line)
    assert boat.vessel.mode is Mode.HOLD
    assert [answer["result"] for answer in boat.answers] == ["accepted"] * 3


def test_a_plan_after_a_stop_is_sailed_and_the_next_stop_carried_out():
    boat = Boat()
    for line in (PLAN, DISARM, PLAN, DISARM):
        boat.hears(line)
    sail = [LoadPlan, Arm(True), StartPlan]
    assert boat.done == [*sail, Arm(False), *sail, Arm(False)]
    assert not boat.vessel.armed


def test_a_plan_repeated_by_its_sender_is_answered_and_not_sailed_anew():
    boat = Boat()
    for _ in range(3):
        boat.hears(PLAN)
    assert boat.done == [LoadPlan, Arm(True), StartPlan]
    assert [answer["result"] for answer in boat.answers] == ["accepted"] * 3


def test_what_was_refused_is_tried_again():
    boat = Boat()
    boat.vessel.refuse = "no GNSS fix"
    boat.hears(PLAN)
    boat.vessel.refuse = ""
    boat.hears(PLAN)
    assert [answer["result"] for answer in boat.answers] == ["denied", "accepted"]


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_stop_ends_a_plan_that_is_half_way(steps):
    boat = Boat()
    boat.hears(PLAN, steps=steps)
    boat.hears(HOLD)
    assert boat.done[-1] == SetMode(Mode.HOLD)
    assert StartPlan not in boat.done
    assert [(answer["ack"], answer["result"]) for answer in boat.answers] == [
        ("loiter-1", "temporarily rejected"),
        ("hold", "accepted"),
    ]


def test_an_answer_that_no_hour_has_room_for_does_not_hold_up_the_others():
    boat = Boat("n-0.1")
    boat.vessel.refuse = "é" * 120  # six bytes each in JSON
    boat.hears(b'{"command":"resume"}\n')
    boat.vessel.refuse = ""
    boat.hears(b'{"ID":"' + "é".encode() * 64 + PLAN[len(b'{"ID":"loiter-1') :])
    boat.hears(HOLD)
    assert [(answer["ack"], answer["result"], "reason" in answer) for answer in boat.answers] == [
        ("resume", "denied", False),
        ("hold", "accepted", False),
    ]


def test_only_an_accepted_order_is_the_operators_presence():
    boat = Boat()
    assert boat.radio.heard == {}
    boat.hears(PLAN)
    (accepted_us,) = boat.radio.heard.values()
    boat.waits(70.0)
    boat.hears(b"\x81\xfe garbage \xff\n")
    boat.hears(PLAN.replace(b"Circular", b"Spiral"))
    boat.vessel.refuse = "not now"
    boat.hears(PLAN.replace(b"600", b"700"))
    assert list(boat.radio.heard.values()) == [accepted_us]
    boat.vessel.refuse = ""
    boat.hears(HOLD)
    (again_us,) = boat.radio.heard.values()
    assert again_us > accepted_us


def test_an_order_that_is_being_carried_out_is_presence_enough_to_arm():
    boat = Boat()
    boat.radio.receive(PLAN, 0)
    assert boat.radio.heard


def test_what_comes_is_told_aboard():
    boat = Boat()
    boat.hears(PLAN)
    boat.hears(PLAN.replace(b"Circular", b"Spiral"))
    boat.hears(b"\x81\xfe\xff\n")
    assert boat.told[0] == (Severity.INFO, "Radio: loiter-1 accepted")
    assert "Spiral" in boat.told[1][1]
    assert boat.told[2] == (Severity.WARNING, "Radio: no JSON in what comes: 3 stray bytes, 0 broken values so far")
    assert boat.radio.bad_frames == 3
    for _ in range(20):
        boat.hears(b"\x81\xfe\xff\n", 1.0)
    assert len(boat.told) == 3


def test_two_boats_in_hearing_do_not_answer_each_other():
    boats = Boat(), Boat()
    for boat, other in (boats, boats[::-1]):
        state = state_json(other.vessel.snapshot(0, 0), "other", None)
        boat.hears(state)
        for word in (b'{"ack":"?","result":"denied"}\n', b'{"ack":"hold","crc":"0","result":"accepted"}\n', state):
            boat.hears(word)
        assert boat.answers == []
        assert boat.done == []
        assert len(boat.told) == 1, "once, not with each word"
        assert "another boat" in boat.told[0][1]
        assert boat.radio.heard == {}


def test_what_is_no_order_is_refused_a_few_times_and_then_once_a_minute():
    boat = Boat("bench")
    for number in range(120):
        boat.hears(b'{"noise":%d}\n' % number)
    assert 4 <= len(boat.answers) <= 4 + 120 * 5 / 60 + 1
    boat.hears(HOLD)
    assert (boat.answers[-1]["ack"], boat.answers[-1]["result"]) == ("hold", "accepted")
    boat.waits(300.0)
    before = len(boat.answers)
    boat.hears(PLAN.replace(b"Circular", b"Spiral"))
    assert "Spiral" in boat.answers[before]["reason"], "who mends a plan is told"


def test_a_stop_is_answered_out_of_what_the_hour_keeps_and_does_not_wait_behind_others():
    boat = Boat("o-10")
    ledger = boat.radio.ledger
    ledger.charge(ledger.left_us(Priority.COMMAND, 0) - 1, 0)
    boat.hears(RESUME)
    assert boat.answers == []
    for _ in range(3):
        boat.hears(HOLD)
    assert [(answer["ack"], answer["result"]) for answer in boat.answers] == [("hold", "accepted")] * 3
