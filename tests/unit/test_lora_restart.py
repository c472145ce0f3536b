"""Ends of the compact link that start anew: what was said before is not believed again, and the link finds itself."""

import pytest

from mavlink_bridge.language.requests import Arm, Result
from mavlink_bridge.radio.codec.wire import Kind
from tests.soaked import in_the_soak
from tools.benches.lora import settled
from tools.lora_rig import Rig, profile


def recorded(rig, origin, since_us):
    """Frames of one end as a listener would have them."""
    return [item.data for item in rig.pair.air.log if item.origin == origin and item.start_us >= since_us]


@pytest.mark.parametrize("name", ["o-10", "bench"])
def test_states_recorded_before_a_restart_of_the_gateway_are_not_shown(name):
    rig = settled(name)
    rig.run(30.0)
    since_us = rig.now_us
    rig.run(130.0)
    frames = recorded(rig, "vessel", since_us)
    rig.pair.air.jammed = True
    rig.run(30.0)
    rig.start_shore()
    for data in frames:
        rig.twin.receive(data, rig.now_us)
    assert len(frames) > 20
    assert rig.twin.state is None
    assert not rig.twin.is_fresh(rig.now_us)


def test_an_answer_recorded_before_a_restart_does_not_answer_a_stop():
    rig = settled()
    since_us = rig.now_us
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED
    replies = [data for data in recorded(rig, "vessel", since_us) if data[0] >> 4 == Kind.REPLY]
    rig.start_shore()
    rig.pair.air.jammed = True
    rig.replies.clear()
    rig.twin.submit("stop", Arm(False), rig.now_us)
    for _ in range(100):
        rig.run(0.1)
        rig.twin.receive(replies[-1], rig.now_us)
    rig.run(10.0)
    assert [reply.result for _, _, reply in rig.replies] == [Result.FAILED]


def test_beacons_recorded_before_a_restart_of_the_vessel_prove_nobody():
    rig = settled("bench")
    since_us = rig.now_us
    rig.run(200.0)
    frames = recorded(rig, "shore", since_us)
    rig.pair.air.jammed = True
    rig.start_vessel()
    for data in frames:
        rig.radio.receive(data, rig.now_us)
    assert len(frames) > 10
    assert rig.radio.last_heartbeat_us is None


@pytest.mark.parametrize("who", ["vessel", "shore", "both"])
@pytest.mark.parametrize("seed", [0, 1, *in_the_soak(2, 3)])
def test_after_restarts_the_ends_hear_each_other_soon(who, seed):
    rig = settled(seed=seed)
    for _ in range(3):
        rig.run(20.0 + 7.0 * seed)
        if who != "shore":
            rig.start_vessel()
        if who != "vessel":
            rig.start_shore()
        rig.run(45.0)
        assert rig.twin.is_fresh(rig.now_us)
        assert rig.ask(Arm(True))[1].result is Result.ACCEPTED


def test_a_gateway_that_starts_anew_shows_nothing_before_the_vessel_has_answered_it():
    """States recorded earlier in the vessel's own session would look the same."""
    rig = settled()
    rig.run(100.0)
    rig.twin.link.keep(rig.now_us, at_once=True)
    deaf = rig.pair.vessel.read
    rig.pair.vessel.read = lambda: deaf() and b""
    rig.start_shore()
    rig.run(30.0)
    assert not rig.twin.is_fresh(rig.now_us)
    rig.pair.vessel.read = deaf
    rig.run(30.0)
    assert rig.twin.is_fresh(rig.now_us)


@pytest.mark.parametrize("name", ["n-0.1", "o-10"])
@pytest.mark.parametrize("lost_s", [60.0, *in_the_soak(2.0)])
def test_a_stop_reaches_a_vessel_that_did_not_hear_of_the_gateways_start(name, lost_s):
    rig = Rig(profile(name))
    rig.run(700.0)
    rig.ask(Arm(True))
    rig.run(100.0)
    rig.start_shore()
    rig.pair.air.jammed = True
    rig.run(lost_s)
    rig.pair.air.jammed = False
    before_us = rig.twin.link.ledger.used_us(rig.now_us)
    seconds, reply = rig.ask(Arm(False))
    assert reply.result is Result.ACCEPTED
    assert not rig.vessel.armed
    assert seconds < 6.0
    assert rig.twin.link.ledger.used_us(rig.now_us) - before_us < 1_500_000


def test_a_stop_reaches_a_vessel_that_started_and_did_not_hear_the_gateways_answer():
    rig = Rig(profile("n-0.1"))
    rig.run(700.0)
    rig.ask(Arm(True))
    rig.start_vessel()
    deaf = rig.pair.vessel.read
    rig.pair.vessel.read = lambda: deaf() and b""
    rig.run(30.0)
    rig.pair.vessel.read = deaf
    seconds, reply = rig.ask(Arm(False))
    assert reply.result is Result.ACCEPTED
    assert seconds < 6.0


def restarted_twice():
    """A link both of whose ends have stored counters worth losing."""
    rig = settled()
    for _ in range(2):
        rig.start_vessel()
        rig.start_shore()
        rig.run(60.0)
    return rig


def texts_of(rig, seconds):
    """What the stations are told in this time."""
    found = []
    for _ in range(round(seconds)):
        rig.run(1.0)
        found += [text for _, text in rig.twin.drain_texts()]
    return found


@pytest.mark.parametrize("who", ["vessel", "shore"])
def test_an_end_that_has_lost_its_memory_is_believed_after_the_greeting(who):
    rig = restarted_twice()
    rig.memory[who] = ""
    rig.start_vessel() if who == "vessel" else rig.start_shore()
    rig.run(30.0)
    assert rig.twin.is_fresh(rig.now_us)
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED


def test_nobody_is_warned_of_ends_that_started_in_order():
    rig = settled()
    told = []
    for _ in range(5):
        rig.start_vessel()
        rig.start_shore()
        told += texts_of(rig, 40.0)
        rig.start_shore()
        told += texts_of(rig, 40.0)
    assert not [text for text in told if "format" in text or "radio key" in text]


def test_a_new_key_on_both_ends_makes_a_new_link(monkeypatch):
    rig = restarted_twice()
    rig.memory["shore"] = ""
    used_us = rig.radio.ledger.used_us(rig.now_us)
    monkeypatch.setattr("tools.lora_rig.KEY", bytes(range(2, 34)))
    rig.start_vessel()
    rig.start_shore()
    rig.run(60.0)
    assert rig.ask(Arm(False))[1].result is Result.ACCEPTED
    assert rig.radio.ledger.used_us(rig.now_us) > used_us
