"""An arming on an air that loses: said twice, answered twice, in a station's patience whichever one of each two is lost."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, Origin, RequestBody, Result, SetMode, StartPlan
from mavlink_bridge.mavlink.wire.codec import dialect
from mavlink_bridge.mavlink.wire.payload import payload
from mavlink_bridge.radio.codec.frames import Opener, Saying, Sealer, frame_bytes
from mavlink_bridge.radio.codec.wire import BRIEF_ARM, OVERHEAD, Kind
from mavlink_bridge.radio.session import RadioDirection
from tools.benches.lora import compiled, settled, survey_items
from tools.lora_rig import Rig, acquainted

PATIENCE_S = 1.5
"""QGroundControl's, from the arming to the HEARTBEAT that shows it."""
FORGOTTEN_S = 301.0


def command(number: int, *params: float) -> Origin:
    """As QGroundControl sends it."""
    message = dialect.MAVLink_command_long_message(1, 1, number, 0, *params, *[0.0] * (7 - len(params)))
    return Origin(message.get_msgId(), payload(message), (255, 190), home_item=True)


ARM = Arm(True), command(400, 1)
GUIDED = SetMode(Mode.GUIDED), command(176, 1, 15)


class Losses:
    """Loses packets of an end by their place in a row that is counted anew; what they would have met is told."""

    def __init__(self, rig: Rig) -> None:
        self._air = rig.pair.air
        self._fate = self._air._fate
        self._air._fate = self._judge  # type: ignore[method-assign]
        self.count({})

    def count(self, lost: dict[str, set[int]]) -> None:
        """From now on, so many packets of each end on, from 0."""
        self._lost, self._came = lost, {"vessel": 0, "shore": 0}

    def _judge(self, flight) -> str:  # type: ignore[no-untyped-def]
        place = self._came[flight.sender.name]
        self._came[flight.sender.name] += 1
        return "faded" if place in self._lost.get(flight.sender.name, ()) else self._fate(flight)


@pytest.fixture(scope="module")
def shared() -> Rig:
    rig = settled()
    assert rig.ask(compiled(survey_items(4)))[1].result is Result.ACCEPTED
    return rig


@pytest.fixture
def rig(shared: Rig) -> Iterator[Rig]:
    """Disarmed in Hold; no state of the vessel is in the way."""
    fate = shared.pair.air._fate
    shared.vessel.mode, shared.vessel.armed = Mode.HOLD, False
    shared.run(12.0)
    quiet(shared)
    shared.vessel.executed.clear()
    yield shared
    shared.pair.air._fate = fate  # type: ignore[method-assign]


def quiet(rig: Rig) -> None:
    """Run until a state is over, and no other is due for some seconds."""
    state_us = rig.radio.link.state_us
    while rig.radio.link.state_us == state_us:
        rig.step()
    rig.run(1.2)


def lose_a_question(rig: Rig) -> None:
    """The shore learns that the air loses."""
    Losses(rig).count({"shore": {0}})
    assert rig.ask(GUIDED[0], origin=GUIDED[1])[1].result is Result.ACCEPTED
    Losses(rig).count({})
    rig.run(3.0)
    quiet(rig)


def told_s(rig: Rig, order: tuple[RequestBody, Origin]) -> tuple[float, list[str]]:
    """Seconds until it is answered, and who then had the air in turn until all was said."""
    since_us = rig.now_us
    seconds, reply = rig.ask(order[0], origin=order[1])
    assert reply.result is Result.ACCEPTED
    rig.run(0.6)
    return seconds, [item.origin for item in rig.pair.air.log if item.start_us >= since_us]


def test_on_a_clean_air_it_is_said_once(rig: Rig) -> None:
    rig.run(FORGOTTEN_S)
    quiet(rig)
    seconds, talked = told_s(rig, ARM)
    assert talked == ["shore", "vessel"]
    assert seconds <= 0.7


@pytest.mark.parametrize("answers", [set(), {0}, {1}], ids=["both answers", "second answer", "first answer"])
@pytest.mark.parametrize("sayings", [set(), {0}, {1}], ids=["both sayings", "second saying", "first saying"])
def test_any_one_of_each_two_is_enough(rig: Rig, sayings: set[int], answers: set[int]) -> None:
    lose_a_question(rig)
    rig.vessel.executed.clear()
    Losses(rig).count({"shore": sayings, "vessel": answers})
    seconds, talked = told_s(rig, ARM)
    assert talked == ["shore", "shore", "vessel", "vessel"]
    assert seconds <= PATIENCE_S
    assert [body for _, body in rig.vessel.executed] == [Arm(True)]
    fates = {item.fate for item in list(rig.pair.air.log)[-4:]}
    assert fates <= {"received", "faded"}


def test_who_follows_the_first_answer_does_not_talk_over_the_second(rig: Rig) -> None:
    lose_a_question(rig)
    since_us = rig.now_us
    rig.ask(ARM[0], origin=ARM[1])
    assert rig.ask(StartPlan(), origin=command(300))[1].result is Result.ACCEPTED
    assert not [item for item in rig.pair.air.log if item.start_us >= since_us and item.fate == "collision"]


def test_a_stop_takes_the_second_sayings_place(rig: Rig) -> None:
    lose_a_question(rig)
    since_us = rig.now_us
    rig.twin.submit("arm", ARM[0], rig.now_us, ARM[1])
    rig.run(0.2)
    rig.twin.submit("stop", Arm(False), rig.now_us, command(400, 0))
    rig.run(6.0)
    first, second = [item.data for item in rig.pair.air.log if item.start_us >= since_us and item.origin == "shore"][:2]
    assert len(first) == OVERHEAD
    assert second[0] >> 4 == Kind.SAFE
    assert not rig.vessel.armed
    assert [reply.result for _, owner, reply in rig.replies if owner == "stop"] == [Result.ACCEPTED]


def test_no_state_is_sent_over_the_second_saying(rig: Rig) -> None:
    """At every tenth of a second of the vessel's rhythm; the state that is due waits."""
    lose_a_question(rig)
    for phase in range(8):
        rig.vessel.armed = False
        rig.run(9.0 + 0.4 * phase)
        since_us = rig.now_us
        rig.ask(ARM[0], origin=ARM[1])
        rig.run(6.0)
        assert not [item for item in rig.pair.air.log if item.start_us >= since_us and item.fate == "collision"]


def test_other_orders_are_said_once_and_an_air_is_forgiven(rig: Rig) -> None:
    lose_a_question(rig)
    rig.vessel.mode = Mode.AUTO
    rig.run(8.0)
    quiet(rig)
    assert told_s(rig, GUIDED)[1] == ["shore", "vessel"]
    rig.run(FORGOTTEN_S)
    rig.vessel.armed = False
    rig.run(8.0)
    quiet(rig)
    assert told_s(rig, ARM)[1] == ["shore", "vessel"]


def test_a_refusal_is_said_once(rig: Rig) -> None:
    lose_a_question(rig)
    rig.vessel.refuse = "no"
    since_us = rig.now_us
    assert rig.ask(ARM[0], origin=ARM[1])[1].reason == "no"
    rig.run(0.6)
    rig.vessel.refuse = ""
    assert [item.origin for item in rig.pair.air.log if item.start_us >= since_us] == ["shore", "shore", "vessel"]


@pytest.mark.parametrize("saying", [Saying.FIRST, Saying.SECOND], ids=lambda saying: saying.value)
def test_a_saying_tells_its_number_and_its_place_in_the_shortest_frame(saying: Saying) -> None:
    ends = acquainted()
    shore, vessel = ends[RadioDirection.TO_VESSEL], ends[RadioDirection.TO_SHORE]
    assert shore.current is not None
    down, aboard, at_us = Sealer(shore), Opener(vessel), 0
    for number in range(256):
        at_us += 500_000
        body = bytes((number,)) + BRIEF_ARM
        raw = down.seal(Kind.ORDER, body, at_us, shore.current, saying)
        assert len(raw) == OVERHEAD == frame_bytes(Kind.ORDER, body)
        (frame,) = aboard.receive(raw, at_us)
        assert (frame.kind, frame.body, frame.is_brief) == (Kind.ORDER, bytes((number & 31,)) + BRIEF_ARM, True)
        assert frame.saying is saying


def test_one_saying_cannot_be_made_into_another() -> None:
    ends = acquainted()
    shore, vessel = ends[RadioDirection.TO_VESSEL], ends[RadioDirection.TO_SHORE]
    assert shore.current is not None
    raw = Sealer(shore).seal(Kind.ORDER, b"\5" + BRIEF_ARM, 500_000, shore.current, Saying.FIRST)
    for bit in range(16):
        head = int.from_bytes(raw[:2], "big") ^ 1 << bit
        assert Opener(vessel).receive(head.to_bytes(2, "big") + raw[2:], 500_000) == []
