"""The compact link over the simulated air: what was ordered is done once, what was not done is never called done."""

import random

import pytest

from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import (
    Arm,
    GuidedHeading,
    LoadPlan,
    ManualInput,
    Orbit,
    PlanItem,
    PlanKind,
    Reposition,
    Result,
    SetMode,
    SetParameter,
    StartPlan,
)
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.codec.request import decode_request, encode_request
from mavlink_bridge.radio.codec.wire import Kind
from mavlink_bridge.radio.session import RadioDirection
from sitl.radio.air import RadioConfig
from tools.benches.lora import compiled, loiter_items, settled, survey_items, upload
from tools.lora_rig import Rig, acquainted, profile


def test_a_loiter_plan_is_confirmed_in_few_bytes_and_soon():
    seconds, size, done = upload(loiter_items(), loss=0.0, seed=0)
    assert done
    assert size <= 35
    assert seconds <= 1.5


def test_a_hundred_waypoints_arrive_exactly():
    rig = settled()
    seconds, reply = rig.ask(compiled(survey_items(100)))
    assert reply.result is Result.ACCEPTED
    assert seconds <= 8.5
    assert [repr(item) for item in rig.vessel.plans.items(PlanKind.MISSION)] == [
        repr(item) for item in survey_items(100)
    ]
    assert rig.twin.plans.plan_id(PlanKind.MISSION) == rig.vessel.plans.plan_id(PlanKind.MISSION) != 0


def test_row_53_the_starved_profile_refuses_and_states_the_airtime():
    rig = Rig(profile("n-0.1"))
    rig.run(20.0)
    since_us = rig.now_us
    seconds, reply = rig.ask(compiled(survey_items(100)))
    assert reply.result is Result.DENIED
    assert "s of airtime" in reply.reason
    assert seconds < 0.1
    assert not [size for origin, size in rig.sent(since_us) if origin == "shore"]


def test_stop_is_short_and_quick():
    rig = settled()
    since_us = rig.now_us
    seconds, _ = rig.ask(Arm(False))
    assert rig.vessel.neutral_us is not None
    assert rig.vessel.neutral_us - since_us <= 1_000_000
    assert max(size for _, size in rig.sent(since_us)) <= 12
    assert seconds < 1.5


def test_row_53_stop_goes_before_a_long_upload():
    rig = settled()
    rig.twin.submit("plan", compiled(survey_items(100)), rig.now_us)
    rig.run(1.3)
    start_us = rig.now_us
    rig.ask(Arm(False))
    assert rig.vessel.neutral_us - start_us <= 1_600_000
    rig.run(20.0)
    assert ("plan", Result.ACCEPTED) in [(owner, reply.result) for _, owner, reply in rig.replies]


def test_what_the_vessel_refuses_is_refused_with_its_reason():
    rig = settled()
    rig.vessel.refuse = "no GNSS fix"
    _, reply = rig.ask(Arm(True))
    assert reply.result is Result.DENIED
    assert reply.reason == "no GNSS fix"


def test_row_54_lost_answers_do_not_execute_twice():
    rig = settled(loss=0.6, seed=4)
    for number in range(20):
        rig.ask(SetParameter("LOIT_RADIUS", 10.0 + number))
    done = [body.value for _, body in rig.vessel.executed if isinstance(body, SetParameter)]
    assert len(done) == len(set(done))
    assert len(done) > 5


def test_a_silent_vessel_ends_heartbeats_and_commands():
    rig = settled()
    rig.pair.air.jammed = True
    cut_us = rig.now_us
    rig.run(rig.profile.link.stale_after_s + 0.2)
    assert rig.twin.snapshot(rig.now_us, 1) is None
    _, reply = rig.ask(Arm(True))
    assert reply.result is Result.FAILED
    assert rig.now_us - cut_us < 60e6
    assert not any(isinstance(body, Arm) for _, body in rig.vessel.executed)


def test_after_a_long_silence_the_ends_find_each_other_again():
    rig = settled()
    rig.pair.air.jammed = True
    rig.run(700.0)
    rig.pair.air.jammed = False
    rig.run(120.0)
    assert rig.twin.is_fresh(rig.now_us)
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED


@pytest.mark.parametrize("who", ["vessel", "shore", "both"])
def test_a_restart_keeps_counters_and_nothing_old_is_executed(who):
    rig = settled()
    rig.ask(SetMode(Mode.HOLD))
    recorded = [item.data for item in rig.pair.air.log if item.origin == "shore"]
    done = len(rig.vessel.executed)
    if who != "shore":
        rig.start_vessel()
    if who != "vessel":
        rig.start_shore()
    rig.settle()
    for data in recorded:
        rig.radio.receive(data, rig.now_us)
    rig.run(1.0)
    assert len(rig.vessel.executed) == done
    assert rig.ask(Arm(True))[1].result is Result.ACCEPTED


def test_the_twin_learns_what_others_changed():
    rig = settled()
    rig.vessel.plans.put(PlanKind.MISSION, survey_items(10))
    rig.vessel.params.set("DEPTH_MIN", 6.5)
    rig.radio.param_changed("DEPTH_MIN")
    rig.run(120.0)
    assert rig.twin.plans.plan_id(PlanKind.MISSION) == rig.vessel.plans.plan_id(PlanKind.MISSION)
    assert rig.twin.params.get("DEPTH_MIN").value == pytest.approx(6.5)


def test_an_upload_given_up_and_stored_after_all_is_told():
    rig = settled()
    end = rig.pair.shore
    plan = compiled(loiter_items())
    heard = end.read
    end.read = lambda: heard() and b""  # the vessel hears, the shore does not
    _, reply = rig.ask(plan)
    assert reply.result is Result.FAILED
    assert rig.vessel.plans.plan_id(PlanKind.MISSION) != 0
    end.read = heard
    texts = []
    for _ in range(200):
        rig.run(1.0)
        texts += [text for _, text in rig.twin.drain_texts()]
    assert any("stored the plan that was not confirmed" in text for text in texts)


def test_equal_orders_of_two_stations_are_one_on_the_air():
    rig = settled()
    since_us = rig.now_us
    rig.twin.submit("one", Arm(True), rig.now_us)
    rig.twin.submit("two", Arm(True), rig.now_us)
    rig.run(3.0)
    assert {owner for _, owner, reply in rig.replies if reply.result is Result.ACCEPTED} == {"one", "two"}
    assert sum(origin == "shore" for origin, _ in rig.sent(since_us)) == 1


def test_sticks_do_not_cross():
    rig = settled()
    assert rig.ask(ManualInput(0.5, 0.0, 255))[1].result is Result.DENIED


@pytest.mark.parametrize(
    "body",
    [
        Arm(True),
        Arm(False, force=True),
        SetMode(Mode.GUIDED),
        StartPlan(),
        StartPlan(3, 200),
        Reposition(0.7188, -0.1519, speed_mps=1.5, radius_m=None),
        Orbit(None, None, Circle(25.0), turns=2.0),
        GuidedHeading(1.25, speed_mps=0.5),
        SetParameter("DEPTH_MIN", 4.25),
    ],
)
def test_requests_come_back_as_they_were(body):
    back = decode_request(
        encode_request(body),
        {__import__("mavlink_bridge.radio.codec.request", fromlist=["x"]).name_code("DEPTH_MIN"): "DEPTH_MIN"}.get,
    )
    if isinstance(body, Reposition):
        assert back.lat_rad == pytest.approx(body.lat_rad, abs=1e-9)
        assert back.speed_mps == body.speed_mps
    else:
        assert back == body


def test_forged_replayed_and_flipped_frames_are_not_believed():
    from tools.benches.lora import forged

    assert forged(6000) == 0


def test_row_52_frames_are_found_in_noise_whole_bytewise_and_in_chunks():
    rng = random.Random(8)
    stream, sent, ends = b"", [], acquainted()
    sealer = Sealer(ends[RadioDirection.TO_SHORE])
    for _ in range(24):
        body = rng.randbytes(rng.randrange(0, 56))
        stream += rng.randbytes(rng.randrange(0, 30)) + sealer.seal(
            Kind.TEXT, body, 0, ends[RadioDirection.TO_SHORE].current
        )
        sent.append(body)
    for size in (len(stream), 1, 7, 61):
        opener = Opener(acquainted()[RadioDirection.TO_VESSEL])
        got = [
            frame.body
            for at in range(0, len(stream), size)
            for frame in opener.receive(stream[at : at + size], 1_500_000)
        ]
        assert got == sent


def test_another_key_direction_or_boat_hears_nothing():
    ends = acquainted()
    frame = Sealer(ends[RadioDirection.TO_VESSEL]).seal(Kind.STOP, b"\0\1", 0, ends[RadioDirection.TO_VESSEL].current)
    other = bytes(32 - len(b"x")) + b"x"
    assert not Opener(acquainted(key=other)[RadioDirection.TO_SHORE]).receive(frame, 0)
    assert not Opener(ends[RadioDirection.TO_VESSEL]).receive(frame, 0)
    assert not Opener(acquainted(system_id=2)[RadioDirection.TO_SHORE]).receive(frame, 0)
    assert Opener(ends[RadioDirection.TO_SHORE]).receive(frame, 0)


def test_split_and_merged_reads_do_no_harm():
    rig = Rig(profile("o-10"), RadioConfig(split=True, corrupt=0.1), seed=3)
    rig.settle()
    assert rig.ask(compiled(survey_items(30)))[1].result is Result.ACCEPTED


def test_a_plan_out_of_bounds_is_the_vessels_refusal():
    rig = settled()
    bad = LoadPlan(PlanKind.MISSION, (PlanItem(9999, 3, 0, 0, 0, 0, 1, 1, 0.0),))
    _, reply = rig.ask(bad)
    assert reply.result is not Result.ACCEPTED
    assert rig.vessel.plans.plan_id(PlanKind.MISSION) == 0
