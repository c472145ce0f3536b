"""Orders over a bad radio link: the last word of the shore is what the vessel does."""

import pytest

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, Reposition, Result, SetMode, SetParameter, SetSpeed, StartPlan
from mavlink_bridge.language.units import e7_to_rad
from mavlink_bridge.radio.codec.frames import Sealer
from mavlink_bridge.radio.codec.request import encode_request
from mavlink_bridge.radio.codec.wire import Kind
from tools.benches.lora import settled


def place(lat_e7):
    """A go-to, which crosses the air bit for bit."""
    return Reposition(e7_to_rad(lat_e7), e7_to_rad(-87_060_000))


def results(rig):
    """How each owner's request ended."""
    return {owner: reply.result for _, owner, reply in rig.replies}


@pytest.mark.parametrize(
    ("go", "stop"),
    [(SetMode(Mode.AUTO), SetMode(Mode.HOLD)), (Arm(True), Arm(False)), (StartPlan(), SetMode(Mode.HOLD))],
)
@pytest.mark.parametrize("again", [False, True])
def test_an_order_given_before_a_stop_is_not_carried_out_after_it(go, stop, again):
    rig = settled()
    rig.vessel.mode = Mode.HOLD
    rig.pair.air.jammed = True
    if again:
        rig.twin.submit("first stop", stop, rig.now_us)
    rig.twin.submit("go", go, rig.now_us)
    rig.run(3.0)
    rig.twin.submit("stop", stop, rig.now_us)
    rig.run(0.5)
    rig.pair.air.jammed = False
    rig.run(15.0)
    assert [body for _, body in rig.vessel.executed] == [stop]
    assert results(rig)["go"] is Result.REJECTED_NOW
    assert results(rig)["stop"] is Result.ACCEPTED


def test_a_stop_lets_parameters_go_on():
    rig = settled()
    rig.pair.air.jammed = True
    rig.twin.submit("parameter", SetParameter("DEPTH_MIN", 5.0), rig.now_us)
    rig.twin.submit("stop", Arm(False), rig.now_us)
    rig.run(1.0)
    rig.pair.air.jammed = False
    rig.run(10.0)
    assert results(rig) == {"parameter": Result.ACCEPTED, "stop": Result.ACCEPTED}
    assert rig.vessel.params.get("DEPTH_MIN").value == 5.0


def test_an_order_after_a_stop_is_carried_out():
    rig = settled()
    rig.ask(Arm(False))
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED
    assert rig.vessel.armed


def heard_aboard(rig, orders):
    """Let frames of a shore that does not withdraw its orders reach the vessel: (kind, number, request), one after the other."""
    shore = rig.twin.link.pairing
    sealer = Sealer(shore)
    rig.pair.air.jammed = True
    for kind, number, body in orders:
        rig.radio.receive(
            sealer.seal(kind, bytes((number,)) + encode_request(body), rig.now_us, shore.current), rig.now_us
        )
        rig.run(0.2)
    return sealer


def test_the_vessel_refuses_an_order_numbered_before_its_last_stop():
    rig = settled()
    heard_aboard(
        rig, [(Kind.STOP, 3, Arm(False)), (Kind.ORDER, 1, Arm(True)), (Kind.ORDER, 2, SetParameter("DEPTH_MIN", 5.0))]
    )
    assert not rig.vessel.armed
    assert rig.vessel.params.get("DEPTH_MIN").value != 4.0


def test_numbers_that_have_come_round_are_not_older_than_the_stop():
    rig = settled()
    sealer = heard_aboard(rig, [(Kind.STOP, 3, Arm(False))])
    rig.run(60.0)
    rig.radio.receive(
        sealer.seal(Kind.ORDER, b"\1" + encode_request(Arm(True)), rig.now_us, rig.twin.link.pairing.current),
        rig.now_us,
    )
    rig.run(0.2)
    assert rig.vessel.armed


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (SetMode(Mode.AUTO), SetMode(Mode.GUIDED)),
        (place(411_940_000), place(411_740_000)),
        (SetSpeed(2.0), SetSpeed(0.5)),
        (SetParameter("DEPTH_MIN", 2.0), SetParameter("DEPTH_MIN", 5.0)),
        (StartPlan(), SetMode(Mode.GUIDED)),
    ],
    ids=lambda body: type(body).__name__,
)
@pytest.mark.parametrize("is_deaf", [False, True])
def test_the_last_of_three_orders_is_the_last_that_is_carried_out(first, second, is_deaf):
    """The first one is on its way, or its answer was lost, when it is asked for again."""
    rig = settled()
    hear = rig.pair.shore.read
    if is_deaf:
        rig.pair.shore.read = lambda: hear() and b""
    for owner, body in enumerate((first, second, first)):
        rig.twin.submit(owner, body, rig.now_us, station="the same")
        rig.run(1.0 if is_deaf else 0.2)
    rig.pair.shore.read = hear
    rig.run(15.0)
    done = [body for _, body in rig.vessel.executed]
    assert done[-1] == first
    assert results(rig)[2] is Result.ACCEPTED
    assert len(results(rig)) == 3, "each has an answer"


def test_an_order_that_is_repeated_is_carried_out_once_and_each_is_answered():
    rig = settled()
    there = place(411_940_000)
    for owner, body in enumerate((there, SetSpeed(1.0), there, SetMode(Mode.GUIDED), there)):
        rig.twin.submit(owner, body, rig.now_us, station="the same")
        rig.run(0.2)
    rig.run(10.0)
    assert [body for _, body in rig.vessel.executed] == [there, SetSpeed(1.0)]
    assert set(results(rig).values()) == {Result.ACCEPTED}
    assert len(results(rig)) == 5


def test_what_another_station_waits_for_is_carried_out_all_the_same():
    rig = settled()
    rig.twin.submit("a", SetSpeed(1.0), rig.now_us, station="a")
    rig.twin.submit("b", SetSpeed(2.0), rig.now_us, station="b")
    rig.run(10.0)
    assert [body for _, body in rig.vessel.executed] == [SetSpeed(1.0), SetSpeed(2.0)]
    assert set(results(rig).values()) == {Result.ACCEPTED}
