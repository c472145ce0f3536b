"""Who may move the boat by radio: what was recorded, held back, spliced or meant for another moves nothing; a stop of now always stops."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator

import pytest

from mavlink_bridge.language.messages import Mode, Severity
from mavlink_bridge.language.requests import Arm, Reposition, RequestBody, Result, SetMode, StartPlan
from mavlink_bridge.radio.aboard import VesselRadio
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.codec.old_format import OldEar, OldVoice
from mavlink_bridge.radio.codec.wire import MAX_BODY, OVERHEAD, TAG_BYTES, Kind
from mavlink_bridge.radio.session import NONCE_BYTES, SLACK_US, TICK_US, RadioDirection
from tools.benches.lora import settled
from tools.lora_rig import KEY, Rig, acquainted, profile

MOTIONS: tuple[RequestBody, ...] = (Arm(True), SetMode(Mode.AUTO), StartPlan(), Reposition(0.7188, -0.1519))
STOPS: tuple[RequestBody, ...] = (SetMode(Mode.HOLD), Arm(False), SetMode(Mode.LOITER))


def recorded(rig: Rig, since_us: int = 0, origin: str = "shore") -> list[bytes]:
    """Frames of one end as a listener would have them."""
    return [item.data for item in rig.pair.air.log if item.origin == origin and item.start_us >= since_us]


def day_one() -> tuple[Rig, list[bytes]]:
    """A day's traffic with every kind of order in it."""
    rig = settled()
    for body in (*MOTIONS, *STOPS, *MOTIONS):
        rig.ask(body)
    return rig, recorded(rig)


def obeyed(rig: Rig, before: int = 0) -> list[RequestBody]:
    return [body for _, body in rig.vessel.executed[before:]]


def moved(bodies: list[RequestBody]) -> list[RequestBody]:
    return [body for body in bodies if not body.nature.stops]


def memories(rig: Rig) -> Iterator[str]:
    """The vessel's memory kept, lost, half, and of before the traffic."""
    kept = rig.memory["vessel"]
    yield from (
        kept,
        "",
        kept[: len(kept) // 2],
        '{"key":"00000000","tx":4096,"rx":0,"id":0,"session":3,"other":4,"known":[],"air":[]}',
    )


@pytest.mark.parametrize("again", [True, False], ids=["greetings too", "orders only"])
@pytest.mark.parametrize("state", range(4), ids=["kept", "lost", "half", "first release"])
def test_traffic_of_an_earlier_start_moves_nothing(state: int, again: bool) -> None:
    rig, frames = day_one()
    rig.memory["vessel"] = next(itertools.islice(memories(rig), state, None))
    rig.pair.air.jammed = True
    rig.start_vessel()
    before = len(rig.vessel.executed)
    for data in frames:
        if again or data[0] >> 4 != Kind.HELLO:
            rig.radio.receive(data, rig.now_us)
            rig.run(0.5)
    assert obeyed(rig, before) == []
    rig.pair.air.jammed = False
    rig.run(60.0)
    if state != 2:  # of the hour whose record is half nothing is left
        assert rig.ask(Arm(False))[1].result is Result.ACCEPTED


def test_traffic_of_an_earlier_start_of_the_gateway_moves_nothing_and_shuts_nobody_out() -> None:
    """The vessel did not start anew: an old greeting that proves itself is its own, and must not take the place of the live gateway."""
    rig, frames = day_one()
    rig.start_shore()
    rig.run(60.0)
    before = len(rig.vessel.executed)
    for data in frames:
        rig.radio.receive(data, rig.now_us)
        rig.run(0.2)
    assert moved(obeyed(rig, before)) == []
    assert rig.twin.is_fresh(rig.now_us)
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED


def test_another_boat_with_the_same_key_obeys_nobody_elses_orders() -> None:
    rig, frames = day_one()
    for system_id in (1, 2):
        other = VesselRadio(
            profile=rig.profile, key=KEY, vehicle=rig.vessel, rng=random.Random(1), nonce=b"other!", system_id=system_id
        )
        for data in frames:
            other.receive(data, rig.now_us)
        assert other.requests() == []


def test_what_the_vessel_said_is_no_order_and_spliced_frames_are_none() -> None:
    rig, frames = day_one()
    before = len(rig.vessel.executed)
    spliced = [one[:cut] + two[cut:] for one, two in itertools.pairwise(frames) for cut in (2, 3, len(one) - TAG_BYTES)]
    for data in (*recorded(rig, 0, "vessel"), *spliced, *frames):
        rig.radio.receive(data, rig.now_us)
    rig.run(1.0)
    assert obeyed(rig, before) == []


@pytest.mark.parametrize("body", MOTIONS, ids=repr)
def test_an_order_that_was_held_back_dies(body: RequestBody) -> None:
    """Jammed and recorded while the operator waits, and played after he was told that it failed."""
    rig = settled()
    rig.vessel.armed, rig.vessel.mode = False, Mode.HOLD
    rig.pair.air.jammed = True
    since_us = rig.now_us
    _, reply = rig.ask(body)
    assert reply.result is Result.FAILED
    frames = recorded(rig, since_us)
    assert len(frames) > 5
    rig.run(2.0)
    for data in frames:
        rig.radio.receive(data, rig.now_us)
        rig.run(0.1)
    assert obeyed(rig) == []


def test_each_frame_of_an_order_dies_by_itself() -> None:
    """The latest time at which each try is still believed, while nothing newer is heard."""
    ends = acquainted()
    shore, vessel = ends[RadioDirection.TO_VESSEL], ends[RadioDirection.TO_SHORE]
    frame = Sealer(shore).seal(Kind.ORDER, bytes(8), 0, shore.current)
    span_us = profile("o-10").span_us(len(frame))
    assert not Opener(vessel).receive(frame, span_us + SLACK_US + 4 * TICK_US + 1)
    assert Opener(vessel).receive(frame, span_us + SLACK_US)


@pytest.mark.parametrize("body", STOPS, ids=repr)
@pytest.mark.parametrize("late_s", [1.0, 3600.0, 86_400.0])
def test_a_stop_of_the_live_session_is_obeyed_however_late(body: RequestBody, late_s: float) -> None:
    rig = settled()
    rig.pair.air.jammed = True
    since_us = rig.now_us
    rig.twin.submit("stop", body, rig.now_us)
    rig.run(1.0)
    frame = recorded(rig, since_us)[0]
    rig.radio.receive(frame, rig.now_us + round(late_s * 1e6))
    assert [request.body for request in rig.radio.requests()] == [body]


def test_two_hundred_jammed_stops_do_not_hide_the_next() -> None:
    rig = settled()
    rig.pair.air.jammed = True
    for number in range(12):
        rig.twin.submit(number, STOPS[number % 2], rig.now_us)
        rig.run(13.0)
    rig.pair.air.jammed = False
    assert rig.ask(Arm(False))[1].result is Result.ACCEPTED


def test_greetings_recorded_elsewhere_buy_little_air() -> None:
    rig, frames = day_one()
    rig.start_shore()
    rig.start_vessel()
    rig.run(60.0)
    hellos = [data for data in frames if data[0] >> 4 == Kind.HELLO]
    assert hellos
    used_us = rig.radio.ledger.used_us(rig.now_us)
    rig.run(300.0)
    usual_us = rig.radio.ledger.used_us(rig.now_us) - used_us
    for _ in range(100):
        for data in hellos:
            rig.radio.receive(data, rig.now_us)
        rig.run(3.0)
    assert rig.radio.ledger.used_us(rig.now_us) - used_us - 2 * usual_us < 0.02 * 300e6
    assert rig.twin.is_fresh(rig.now_us)


@pytest.mark.parametrize("seed", range(3))
def test_a_forger_succeeds_as_often_as_he_tries(seed: int) -> None:
    """With one byte of tag one trial in 256 is believed: the trials that an offset offers are counted right, none more."""
    rng = random.Random(seed)
    trials = believed = 0
    for _ in range(12):
        opener = Opener(acquainted(seed=seed, tag_bytes=1)[RadioDirection.TO_SHORE], tag_bytes=1)
        # crafted: each byte may be the first of a short order, so that each offset costs the most trials
        stream = bytes(
            rng.choice((0x60, 0x61, 0xC0, 0xD0)) if index % 2 == 0 else rng.randrange(256) for index in range(4000)
        )
        for at in range(0, len(stream), 200):
            believed += len(opener.receive(stream[at : at + 200], at * 12_000))
        trials += opener.trials
    expected = trials / 256.0
    assert trials <= 2 * 12 * 4000
    assert trials > 1000
    assert abs(believed - expected) <= 3.0 * expected**0.5 + 1.0


def test_years_until_a_forged_frame() -> None:
    """At 5.5 kbit/s, each byte an offset with two tags."""
    trials_per_s = 2.0 * 5469.0 / 8.0
    years = 2.0 ** (8 * TAG_BYTES) / trials_per_s / (365.25 * 86_400.0)
    assert years >= 20.0
    assert MAX_BODY + OVERHEAD == 62
    assert NONCE_BYTES == 6


@pytest.mark.parametrize("newer", ["vessel", "shore"])
def test_ends_of_different_versions_know_it_and_can_stop_the_boat(newer: str) -> None:
    rig = Rig(profile("o-10"))
    said: list[str] = []
    rig.radio._say = lambda severity, text: said.append(text)
    (rig.radio.link if newer == "vessel" else rig.twin.link).pairing.own_version = 3
    rig.run(60.0)
    told = [text for _, text in rig.twin.drain_texts()]
    assert any("format" in text and "Hold and Disarm" in text for text in told)
    assert any("format" in text and "Hold and Disarm" in text for text in said)
    # where it is and what it does is shown, nothing else is read
    assert rig.twin.is_fresh(rig.now_us)
    assert rig.twin.state is not None
    assert (rig.twin.state.mode, rig.twin.state.armed) == (Mode.AUTO, True)
    assert {data[0] >> 4 for data in recorded(rig, 30_000_000, "vessel")} <= {Kind.HELLO, Kind.POSITION}
    refusal = rig.ask(Arm(True))[1]
    assert refusal.result is Result.DENIED
    assert "format" in refusal.reason
    assert rig.ask(SetMode(Mode.HOLD))[1].result is Result.ACCEPTED
    assert rig.ask(Arm(False))[1].result is Result.ACCEPTED
    assert obeyed(rig) == [SetMode(Mode.HOLD), Arm(False)]


def test_an_old_gateway_is_told_and_so_are_the_people_aboard() -> None:
    rig = Rig(profile("o-10"))
    rig.memory["vessel"] = '{"key":"00000000","tx":4096,"rx":0,"id":0,"session":3,"other":4,"known":[],"air":[]}'
    rig.start_vessel()
    said: list[str] = []
    rig.radio._say = lambda severity, text: said.append(text)
    since_us = rig.now_us
    rig.radio.receive(OldVoice(KEY, RadioDirection.TO_VESSEL, 77).say(Severity.WARNING, "x")[0], rig.now_us)
    rig.run(20.0)
    assert any("first release" in text for text in said)
    ear = OldEar(KEY, RadioDirection.TO_SHORE)
    for data in recorded(rig, since_us, "vessel"):
        ear.receive(data)
    assert ear.hellos == 1
    assert any(b"update this gateway" in data for data in recorded(rig, since_us, "vessel"))


def test_an_old_vessel_is_told_on_shore() -> None:
    rig = Rig(profile("o-10"))
    rig.twin.receive(OldVoice(KEY, RadioDirection.TO_SHORE, 77).say(Severity.WARNING, "x")[0], rig.now_us)
    assert any("first release" in text for _, text in rig.twin.drain_texts())
