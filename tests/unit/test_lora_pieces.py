"""Long messages that end half way: they hinder nobody, and leave nothing behind."""

import random
import re

from mavlink_bridge.language.requests import PlanItem, PlanKind, Result
from mavlink_bridge.radio.codec.frames import Sealer
from mavlink_bridge.radio.codec.wire import Kind
from tools.benches.lora import compiled, settled, survey_items


def heard_of(rig, origin, kind):
    """How many frames of a kind got through."""
    return sum(
        item.origin == origin and item.fate == "received" and item.data[0] >> 4 == kind for item in rig.pair.air.log
    )


def test_a_message_given_up_half_way_does_not_silence_the_gateways_beacons():
    rig = settled()
    rig.vessel.plans.put(PlanKind.MISSION, survey_items(100))
    while heard_of(rig, "vessel", Kind.PIECE) < 3:
        rig.step()
    rig.pair.air.jammed = True
    rig.run(60.0)
    rig.pair.air.jammed = False
    rig.vessel.plans.put(PlanKind.MISSION, ())  # nothing more to be told: the rest never comes
    before = heard_of(rig, "shore", Kind.BEACON)
    rig.run(300.0)
    assert heard_of(rig, "shore", Kind.BEACON) - before >= 300.0 / rig.profile.link.beacon_s - 2
    assert rig.now_us - rig.radio.last_heartbeat_us <= 2.5e6 * rig.profile.link.beacon_s


def test_rows_of_a_message_given_up_do_not_mix_with_a_later_one_of_its_number():
    rig = settled()
    shore = rig.twin.link.pairing
    sealer = Sealer(shore)
    rig.pair.air.jammed = True

    def send(row, data):
        """One of two pieces of message 9, with a question for what has come."""
        rig.radio.receive(sealer.seal(Kind.PIECE, bytes((9, row, 0x81)) + data, rig.now_us, shore.current), rig.now_us)
        since_us = rig.now_us
        rig.run(2.0)
        return [
            item.data[3]
            for item in rig.pair.air.log
            if item.start_us >= since_us and item.origin == "vessel" and item.data[0] >> 4 == Kind.MISSING
        ]

    assert send(0, b"old rows") == [1]
    rig.run(rig.profile.link.upload_s + 5.0)
    assert send(1, b"new rows") == [1]


STATES = (Kind.KEY, Kind.DELTA)


def scattered(count):
    """Points of which none tells anything of the next: the longest that a plan can be."""
    rng = random.Random(5)
    return tuple(
        PlanItem(
            command=16,
            frame=3,
            param1=rng.uniform(0.0, 50.0),
            param2=0.0,
            param3=0.0,
            param4=0.0,
            x=411_850_000 + rng.randrange(-80_000, 80_000),
            y=-87_060_000 + rng.randrange(-100_000, 100_000),
            z=0.0,
        )
        for _ in range(count)
    )


def shown_ages_s(rig, seconds):
    """How old the newest state ashore is at each moment of so many seconds."""
    ages = []
    end_us = rig.now_us + seconds * 1e6
    while rig.now_us < end_us:
        rig.step()
        ages.append(rig.twin.age_s(rig.now_us))
    return ages


def test_the_vessel_is_shown_while_a_long_plan_comes_and_meets_none_of_its_pieces():
    rig = settled()
    since_us = rig.now_us
    rig.twin.submit("plan", compiled(scattered(150)), rig.now_us)
    ages = shown_ages_s(rig, 30.0)
    assert not rig.replies, "it is still on its way"
    assert max(ages) < 10.0
    rig.run(15.0)
    assert [reply.result for _, _, reply in rig.replies] == [Result.ACCEPTED]
    log = [item for item in rig.pair.air.log if item.start_us >= since_us]
    assert {item.fate for item in log} == {"received"}, "nothing is said twice for it"
    told = [item for item in log if item.origin == "vessel" and item.data[0] >> 4 in STATES]
    pieces = [item for item in log if item.data[0] >> 4 == Kind.PIECE]
    assert len(told) >= len(pieces) // 6


def test_a_disarming_aboard_is_shown_while_a_long_plan_comes():
    rig = settled()
    rig.vessel.armed = True
    rig.run(10.0)
    rig.twin.submit("plan", compiled(scattered(150)), rig.now_us)
    rig.run(3.0)
    assert rig.twin.state.armed
    rig.vessel.armed = False
    rig.run(8.0)
    assert not rig.replies, "the plan is still on its way"
    assert not rig.twin.state.armed


def test_a_plan_that_is_too_long_for_its_time_is_refused_at_once_with_what_would_pass():
    rig = settled()
    items = scattered(829)
    before = rig.twin.link.voice.bytes_out
    took_s, reply = rig.ask(compiled(items))
    assert reply.result is Result.DENIED
    assert took_s < 1.0
    assert rig.twin.link.voice.bytes_out == before, "no air is spent on it"
    share = int(re.search(r"about (\d+) % of it would pass", reply.reason)[1])
    assert 10 < share < 50
    _, reply = rig.ask(compiled(items[: 829 * share // 100 - 1]))
    assert reply.result is Result.ACCEPTED, "so much does pass"


def test_a_short_plan_is_not_held_up_by_states():
    rig = settled()
    since_us = rig.now_us
    _, reply = rig.ask(compiled(survey_items(100)))
    assert reply.result is Result.ACCEPTED
    kinds = [item.data[0] >> 4 for item in rig.pair.air.log if item.start_us >= since_us]
    assert Kind.KEY not in kinds
    assert Kind.DELTA not in kinds


def test_plans_pressed_again_and_again_do_not_make_the_vessel_take_its_station_for_lost():
    rig = settled(loss=0.3, seed=3)
    plans = 0
    ages_s = []
    for _ in range(24_000):
        if len(rig.replies) == plans:
            plans += 1
            rig.twin.submit(plans, compiled(scattered(189 + plans % 2)), rig.now_us)
        rig.step()
        ages_s.append((rig.now_us - rig.radio.last_heartbeat_us) * 1e-6)
    assert plans > 3
    assert max(ages_s) < 65.0, "the time-out of the radio's station"
