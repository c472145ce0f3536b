"""The hour's airtime over restarts of the vessel, whatever protocol and profile it is started with."""

import json

import pytest

from companion.facade import Shared
from companion.io.keeping.content import SaveValue
from companion.io.keeping.store import MemoryStore
from companion.radio import MEMORY_KEY, radio_conversation, stops_of
from companion.settings.schema import Settings
from mavlink_bridge.language.requests import Arm, Result
from mavlink_bridge.radio.air.ledger import Ledger
from sitl.radio import RadioConfig
from tools.benches.lora import compiled, loiter_items
from tools.lora_rig import KEY, BookVessel, Rig, profile

STOP_US = 312_000
GIVES_UP_US = 13_000_000


@pytest.fixture
def start(tmp_path):
    """Start the radio's protocol on a store that outlives it."""
    key = tmp_path / "radio.key"
    key.write_bytes(KEY)
    key.chmod(0o600)
    store = MemoryStore()

    shared = Shared(lambda severity, text: None)

    def make(protocol, profile):
        store.completions()
        settings = Settings()
        radio = settings.radio.model_copy(update={"protocol": protocol, "profile": profile, "key_file": str(key)})
        return radio_conversation(settings.model_copy(update={"radio": radio}), BookVessel(), store, shared)(0, "")

    make.store = store
    return make


def transmit(talk, seconds):
    """Note so much airtime, a second at a time."""
    now_us = 0
    for _ in range(seconds):
        now_us += 2_000_000
        talk.ledger.charge(1_000_000, now_us)


def used_s(talk):
    return talk.ledger.used_us(0) * 1e-6


@pytest.mark.parametrize("first", ["compact", "json"])
@pytest.mark.parametrize("then", ["compact", "json"])
def test_another_protocol_finds_the_hour_as_it_was_left(start, first, then):
    transmit(start(first, "o-10"), 200)
    assert 195.0 < used_s(start(then, "o-10")) < 215.0


def test_what_was_sent_without_a_limit_counts_for_a_profile_with_one(start):
    transmit(start("compact", "o-10"), 100)
    transmit(start("compact", "bench"), 100)
    assert 190.0 < used_s(start("compact", "o-10")) < 220.0


@pytest.mark.parametrize("protocol", ["compact", "json"])
def test_the_hour_that_earlier_software_kept_counts_once(start, protocol):
    fields = {"tx": 9, "rx": 9, "id": 1, "session": 1, "other": 2, "known": [], "air": [[60, 150_000_000]]}
    start.store.submit(SaveValue(MEMORY_KEY, json.dumps(fields)))
    for _ in range(3):
        assert 149.0 < used_s(start(protocol, "o-10")) < 165.0


def test_five_stops_with_their_answers_are_never_spent_on_a_mission():
    """The original's channel, 3.6 s an hour: plans are uploaded until they are refused, then five stops still stop the boat."""
    rig = Rig(profile("n-0.1"))
    rig.run(30.0)
    while rig.ask(compiled(loiter_items()))[1].result is Result.ACCEPTED:
        rig.run(20.0)
    told = []
    stops = 0
    while rig.twin.link.ledger.stops_left(rig.now_us):
        stops += 1
        rig.vessel.under_way_again()
        rig.twin.drain_texts()
        assert rig.ask(Arm(False))[1].result is Result.ACCEPTED
        assert rig.vessel.neutral_us is not None
        told += [text for _, text in rig.twin.drain_texts()]
        rig.run(11.0)
    assert any("this hour holds 1 more stop" in text for text in told)
    assert stops >= 5
    assert any("the last stop for " in text and "sails its plan to the end and holds there" in text for text in told)
    assert rig.pair.air.worst_hour_us("shore") <= 3_600_000
    assert rig.pair.air.worst_hour_us("vessel") <= 3_600_000


def test_stops_that_nobody_hears_leave_the_hour_one_for_the_next_press():
    """The original's channel, a hole of 25 s, Disarm twice in it: the next press comes aboard, and what is put off was told before."""
    rig = Rig(profile("n-0.1"), step_us=25_000)
    rig.settle()
    rig.pair.air.configure(RadioConfig(loss=1.0))
    for seconds in (21.0, 4.0):
        rig.twin.submit("operator", Arm(False), rig.now_us)
        rig.run(seconds)
    told = [text for _, text in rig.twin.drain_texts()]
    assert any("nobody answers" in text and "the hour's airtime" in text for text in told)
    rig.pair.air.configure(RadioConfig())
    seconds, reply = rig.ask(Arm(False))
    assert reply.result is Result.ACCEPTED
    assert seconds < 10.0
    assert rig.twin.link.ledger.stops_left(rig.now_us) >= 3
    assert rig.pair.air.worst_hour_us("shore") <= 3_600_000


@pytest.mark.parametrize(("limit_us", "hole_s"), [(3_600_000, 150), (36_000_000, 400), (360_000_000, 1500)])
def test_repeats_slow_down_with_what_is_left_of_the_hour(limit_us, hole_s):
    """As fast as an answer may come, for the whole of a hole in the air, with a press each time that the gateway gives up."""
    ledger, now_us, pressed_us = Ledger(limit_us, STOP_US), 0, 0
    while True:
        ledger.charge(STOP_US, now_us)
        again_us = now_us + max(ledger.stop_gap_us(now_us, again=True), 1_200_000)
        pressed_us = max(pressed_us + GIVES_UP_US, now_us + ledger.stop_gap_us(now_us, again=False))
        now_us = min(again_us, pressed_us)
        if now_us > hole_s * 1_000_000:
            break
    assert ledger.stops_left(now_us) >= 1


def test_check_tells_how_many_stops_an_hour_holds():
    assert (
        stops_of(profile("n-0.1")) == "an hour's airtime holds 11 at most, 5 of them are never spent on anything else"
    )


def test_arming_tells_how_many_stops_the_hour_holds():
    rig = Rig(profile("n-0.1"))
    rig.run(30.0)
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED
    assert any("more stops" in text for _, text in rig.twin.drain_texts())
