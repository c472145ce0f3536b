"""The radio's code page: golden vectors that only a deliberate change may touch.

tests/data/radio/*.hex hold what the first end of format 2 sent. A vector that differs means that ends in the field stop
understanding each other: raise ``wire.VERSION`` instead, or append. Nothing writes these files.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from hashlib import sha256
from pathlib import Path

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.figures import Circle, Racetrack
from mavlink_bridge.language.messages import (
    Action,
    FixType,
    GuardState,
    LoiterDirection,
    Mode,
    PlanState,
    Severity,
)
from mavlink_bridge.language.traffic import Role
from mavlink_bridge.radio.codec import wire
from mavlink_bridge.radio.codec.batch import decode_batch, encode_batch
from mavlink_bridge.radio.codec.brief import decode_position, encode_position, encode_standing
from mavlink_bridge.radio.codec.command import decode_command
from mavlink_bridge.radio.codec.frames import Opener, RadioFrame, Saying, Sealer, frame_bytes
from mavlink_bridge.radio.codec.info import HomePlace, Kept, decode as decode_info, encode as encode_info
from mavlink_bridge.radio.codec.request import decode_request, encode_request, name_code
from mavlink_bridge.radio.codec.state import decode_delta, decode_key, encode_delta, encode_key, reached_in, settle
from mavlink_bridge.radio.codec.state_fields import RadioState
from mavlink_bridge.radio.codec.threat import Threat, decode_threat, encode_threat
from mavlink_bridge.radio.session import RadioDirection
from mavlink_bridge.radio.transfer import Inbox
from tools.lora_rig import acquainted

FOLDER = Path(__file__).parents[1] / "data" / "radio"
CODES = (
    *(wire.MODE, wire.RESULT, wire.ACTION, wire.GUARD, wire.PLAN_STATE, wire.FIX),
    *(wire.PLAN_KIND, wire.SEVERITY, wire.LOITER_DIRECTION),
)
VOCABULARIES: tuple[type[Enum], ...] = (
    *(Mode, ask.Result, Action, GuardState, PlanState, FixType),
    *(ask.PlanKind, Severity, LoiterDirection),
)
REQUESTS: dict[str, ask.RequestBody] = {
    "arm": ask.Arm(True),
    "disarm": ask.Arm(False),
    "abort": ask.Arm(False, force=True),
    **{f"mode {mode.value}": ask.SetMode(mode) for mode in Mode},
    "start": ask.StartPlan(),
    "start 3 to 200": ask.StartPlan(3, 200),
    "pause": ask.PausePlan(True),
    "continue": ask.PausePlan(False),
    "item": ask.SetCurrent(7, reset=True),
    "go to": ask.Reposition(math.radians(41.185), math.radians(-8.706), 1.5, 20.0),
    "hold here": ask.Reposition(None, None),
    "orbit": ask.Orbit(math.radians(41.185), math.radians(-8.706), Circle(20.0, LoiterDirection.CCW)),
    "racetrack here": ask.Orbit(None, None, Racetrack(100.0, 20.0, 0.5, LoiterDirection.VESSEL), 1.5, 2.0),
    "speed": ask.SetSpeed(1.5),
    "throttle": ask.SetSpeed(throttle=0.5),
    "heading": ask.GuidedHeading(1.25, speed_mps=0.5, course=True),
    "home": ask.SetHomePosition(math.radians(41.185), math.radians(-8.706)),
    "terminate": ask.Terminate(),
    "fence on": ask.EnableFence(True),
    "parameter": ask.SetParameter("DEPTH_MIN", 4.25),
    "reboot": ask.Reboot(),
    "checks": ask.RunPrearmChecks(),
    "unlock": ask.UnlockGuard(),
    "forget here": ask.ForgetDepth(),
    "forget there": ask.ForgetDepth(math.radians(41.185), math.radians(-8.706), 5.0),
}
STATE = RadioState(
    t_s=1234,
    lat_rad=math.radians(41.185),
    lon_rad=math.radians(-8.706),
    sog_mps=1.5,
    psi_rad=1.0,
    phi_rad=0.1,
    theta_rad=-0.1,
    alt_m=8.0,
    mode=Mode.AUTO,
    armed=True,
    action=Action.WARN,
    guard=GuardState.OK,
    plan_state=PlanState.ACTIVE,
    seq=5,
    plan_hash=33,
    battery=0.8,
    fix=FixType.RTK_FIXED,
    gps_ok=True,
    heading_ok=True,
    actuators_ok=True,
    prearm_ok=True,
    satellites=17,
)


def states() -> dict[str, bytes]:
    delta = encode_delta(settle(STATE), 1, STATE)
    assert delta is not None
    return {
        "key": encode_key(STATE, 1),
        "key with time": encode_key(STATE, 1, timed=True),
        "difference": delta,
        "batch": encode_batch([STATE] * 14, 129),
        "standing": encode_standing(STATE),
        "position": encode_position(STATE),
        "nothing known": encode_key(RadioState()),
        "key with a threat": encode_key(replace(STATE, threat=CROSSING), 1),
        "difference that brings a threat": threat_change(None, CROSSING),
        "difference that ends a threat": threat_change(CROSSING, None),
        "difference of status": difference(HELD),
        "difference of status, with an item": difference(HELD, b"\4"),
        "difference with items": difference(STATE, b"\2\3\4"),
        "kept": encode_info(KEPT),
        "place": encode_info(PLACE),
    }


HELD = replace(STATE, mode=Mode.HOLD, plan_state=PlanState.PAUSED, seq=6, gps_ok=False)
KEPT = Kept(0xC355_1234, 0xFE4C_0001, 0, params=0x6217)
PLACE = HomePlace((411_850_126, -87_062_153), (0, 2, 0))


def difference(state: RadioState, reached: bytes = b"") -> bytes:
    told = encode_delta(settle(STATE), 1, state, reached=reached)
    assert told is not None
    return told


def threat_change(before: Threat | None, after: Threat | None) -> bytes:
    known = settle(replace(STATE, threat=before))
    told = encode_delta(known, 1, replace(known, threat=after))
    assert told is not None
    return told


def crossing(role: Role) -> Threat:
    return Threat(False, role, True, 244_123_456 & 0xFF, math.radians(60), 800.0, math.radians(270), 4.5, 20.0, 95.0)


CROSSING = crossing(Role.GIVE_WAY)
ALMOST_NORTH = math.radians(359.9)


def test_every_order_without_a_body_says_which_one_it_is_whatever_its_number() -> None:
    ends = acquainted()
    shore, vessel = ends[RadioDirection.TO_VESSEL], ends[RadioDirection.TO_SHORE]
    assert shore.current is not None
    assert vessel.current is not None
    down, up, aboard, ashore = Sealer(shore), Sealer(vessel), Opener(vessel), Opener(shore)
    now_us = 0
    for number in range(256):
        for order in wire.BRIEF_AIMS:
            now_us += 500_000
            (frame,) = aboard.receive(
                down.seal(wire.Kind.ORDER, bytes((number,)) + order, now_us, shore.current), now_us
            )
            kind = wire.Kind.SAFE if order == wire.BRIEF_HOLD else wire.Kind.ORDER
            assert (frame.kind, frame.body) == (kind, bytes((number & 31,)) + order)
        for plan in range(4):
            now_us += 500_000
            body = bytes((number << 3 & 255, plan))
            (frame,) = ashore.receive(up.seal(wire.Kind.REPLY, body, now_us, vessel.current), now_us)
            assert (frame.kind, frame.body, frame.is_brief) == (wire.Kind.REPLY, body, True)


THREATS = {
    **{role.value: crossing(role) for role in Role},
    "close astern": Threat(True, Role.OVERTAKEN, False, 265_000_001 & 0xFF, math.pi, 30.0, 0.0, 6.0, 0.0, 12.0),
    "nearest of all": Threat(True, Role.OBSTACLE, False, 1, 0.0, 0.0, 0.0, 0.0, -8.0, 0.0),
    "farthest of all": Threat(False, Role.HEAD_ON, True, 255, ALMOST_NORTH, 1e5, ALMOST_NORTH, 60.0, 1e4, 1e4),
}


def frames() -> dict[str, bytes]:
    """Whole frames with key, nonces and times given: the frozen ones and one of each purpose."""
    ends = acquainted()
    shore, vessel = ends[RadioDirection.TO_VESSEL], ends[RadioDirection.TO_SHORE]
    assert shore.current is not None
    assert vessel.current is not None
    down, up = Sealer(shore), Sealer(vessel)
    return {
        "hello shore": down.hello(*shore.hello(0, please=True, proof=False)),
        "hello vessel": up.hello(*vessel.hello(7_000_000, please=False, proof=True)),
        "hold": down.seal(wire.Kind.SAFE, bytes((9, 1, 255)), 7_000_000, shore.current),
        "disarm": down.seal(wire.Kind.SAFE, bytes((10, 2, 255)), 7_000_000, shore.current),
        "abort": down.seal(wire.Kind.SAFE, bytes((11, 3, 255)), 7_000_000, shore.current),
        "order": down.seal(wire.Kind.ORDER, b"\1" + encode_request(ask.Arm(True)), 7_500_000, shore.current),
        "position": up.seal(wire.Kind.POSITION, encode_position(STATE), 8_000_000, vessel.current),
        "reply": up.seal(wire.Kind.REPLY, bytes((9 << 3,)) + encode_standing(STATE), 8_500_000, vessel.current),
        "guided": down.seal(wire.Kind.ORDER, bytes((25,)) + wire.BRIEF_ORDERS[0], 9_000_000, shore.current),
        "hold without a body": down.seal(wire.Kind.ORDER, bytes((25,)) + wire.BRIEF_HOLD, 9_250_000, shore.current),
        "accepted": up.seal(wire.Kind.REPLY, bytes((25 << 3, 2)), 9_500_000, vessel.current),
        **{
            f"arming, {saying.value}": down.seal(
                wire.Kind.ORDER, bytes((25,)) + wire.BRIEF_ARM, at_us, shore.current, saying
            )
            for saying, at_us in ((Saying.FIRST, 9_750_000), (Saying.SECOND, 10_250_000))
        },
    }


def vectors(name: str) -> dict[str, str]:
    lines = (FOLDER / f"{name}.hex").read_text("utf-8").splitlines()
    return dict(line.rsplit(": ", 1) for line in lines if line and not line.startswith("#"))


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("requests", lambda: {name: encode_request(body) for name, body in REQUESTS.items()}),
        ("states", states),
        ("frames", frames),
        ("threats", lambda: {name: encode_threat(threat) for name, threat in THREATS.items()}),
    ],
)
def test_what_goes_on_the_air_is_as_it_always_was(name: str, made) -> None:  # type: ignore[no-untyped-def]
    assert {title: data.hex() for title, data in made().items()} == vectors(name)


def test_what_was_always_sent_is_read_as_it_always_was() -> None:
    names = {name_code("DEPTH_MIN"): "DEPTH_MIN"}
    for title, text in vectors("requests").items():
        back = decode_request(bytes.fromhex(text), names.get)
        assert encode_request(back).hex() == text
        assert type(back) is type(REQUESTS[title])
    told = {title: bytes.fromhex(text) for title, text in vectors("states").items()}
    assert decode_key(told["key"]).status == STATE.status
    assert decode_key(told["key with time"]).t_s == 1234
    assert decode_delta(settle(STATE), told["difference"]).sog_mps == 1.5
    assert len(decode_batch(told["batch"])[0]) == 14
    assert decode_key(told["key with a threat"]).threat == decode_threat(bytes.fromhex(vectors("threats")["give way"]))
    assert decode_delta(settle(STATE), told["difference that brings a threat"]).threat is not None
    assert decode_delta(settle(replace(STATE, threat=CROSSING)), told["difference that ends a threat"]).threat is None
    assert decode_delta(settle(STATE), told["difference of status"]).status == HELD.status
    assert not decode_delta(settle(STATE), told["difference of status, with an item"]).gps_ok
    assert reached_in(told["difference of status, with an item"]) == b"\4"
    assert reached_in(told["difference with items"]) == b"\2\3\4"
    assert (decode_info(told["kept"]), decode_info(told["place"])) == (KEPT, PLACE)
    assert (decode_position(told["position"]).mode, decode_position(told["position"]).armed) == (Mode.AUTO, True)


@pytest.mark.parametrize("name", THREATS)
def test_a_threat_that_was_always_sent_is_read_as_it_always_was(name: str) -> None:
    read, meant = decode_threat(bytes.fromhex(vectors("threats")[name])), THREATS[name]
    assert (read.close, read.role, read.ship, read.number) == (meant.close, meant.role, meant.ship, meant.number)
    assert abs(math.remainder(read.bearing_rad - meant.bearing_rad, math.tau)) <= math.tau / 256
    assert read.range_m == pytest.approx(min(max(meant.range_m, 5.0), 8_182.0), rel=0.031)
    assert read.sog_mps == pytest.approx(min(meant.sog_mps, 23.25), abs=0.38)
    assert (read.cpa_m, read.tcpa_s) == pytest.approx(
        (min(max(meant.cpa_m, 0.0), 124.0), min(meant.tcpa_s, 186.0)), abs=3.0
    )


def test_the_frozen_stops_are_heard() -> None:
    vessel = acquainted()[RadioDirection.TO_SHORE]
    opener = Opener(vessel)
    for number, title in ((1, "hold"), (2, "disarm"), (3, "abort")):
        (frame,) = opener.receive(bytes.fromhex(vectors("frames")[title]), 7_000_000)
        assert wire.SAFE_STOPS[frame.body[1]].nature.stops
        assert (frame.kind, frame.body[1]) == (wire.Kind.SAFE, number)


@pytest.mark.parametrize(
    ("codes", "vocabulary"), list(zip(CODES, VOCABULARIES, strict=True)), ids=[kind.__name__ for kind in VOCABULARIES]
)
def test_every_word_has_a_number_of_its_own(codes, vocabulary) -> None:  # type: ignore[no-untyped-def]
    assert {codes.member(codes.number(member)) for member in vocabulary} == set(vocabulary)


def test_a_word_without_a_number_fails_at_once_by_name() -> None:
    class Weather(Enum):
        CALM = "calm"
        ROUGH = "rough"

    with pytest.raises(ValueError, match=r"Weather\.ROUGH"):
        wire.Codes(Weather, 3, {Weather.CALM: 0})


def test_a_field_that_the_page_forgets_fails_at_once_by_name() -> None:
    with pytest.raises(ValueError, match="force"):
        wire.RequestRow(ask.Arm, (wire.WireField("arm", wire.Form.FLAG),))


def test_numbers_that_are_agreed_on_are_not_taken() -> None:
    assert not set(wire.RESERVED) & set(wire.REQUESTS)
    assert not {wire.RAW_CODE, wire.COMMAND_CODE} & set(wire.REQUESTS)


def test_the_codebooks_only_grow() -> None:
    """Their places are numbers: what stands there stays there."""
    books = (wire.COMMANDS, wire.STATIONS, wire.COMMAND_FRAMES, wire.PLAN_COMMANDS, wire.PLAN_FRAMES)
    text = "\n".join(repr(book) for book in books)
    assert sha256(text.encode()).hexdigest() == BOOKS, text


BOOKS = "83f5651c906b9dfc163ea0f816928c671304f030c2f8ceca144a06e0b4a4dea5"


def test_the_orders_with_the_least_patience_go_without_a_body() -> None:
    """One step of airtime less each; read as the very order, with five bits of its number, and of no use under another head."""
    ends = acquainted()
    shore, vessel = ends[RadioDirection.TO_VESSEL], ends[RadioDirection.TO_SHORE]
    assert shore.current is not None
    sealer, at_us = Sealer(shore), 7_500_000
    for number in (0, 9, 21, 31, 200):
        for payload in wire.BRIEF_ORDERS:
            at_us += 1_000_000
            raw = sealer.seal(wire.Kind.ORDER, bytes((number,)) + payload, at_us, shore.current)
            assert len(raw) == wire.OVERHEAD == frame_bytes(wire.Kind.ORDER, bytes((number,)) + payload)
            assert Opener(vessel).receive(bytes((raw[0] ^ 0x10,)) + raw[1:], at_us) == []
            (frame,) = Opener(vessel).receive(b"\xff\xee" + raw, at_us)
            assert (frame.kind, frame.body) == (wire.Kind.ORDER, bytes((number & 31,)) + payload)
            assert frame.is_brief
    meanings = [decode_command(payload, (1, 1)) for payload in wire.BRIEF_ORDERS]
    assert {meaning.source for meaning in meanings} == {(255, 190)}
    assert len({meaning.payload for meaning in meanings}) == 4


def test_a_short_number_that_comes_round_is_a_new_order() -> None:
    inbox = Inbox(45_000_000, 12_000_000)
    order = RadioFrame(wire.Kind.ORDER, b"\x05" + wire.BRIEF_ORDERS[3], 7, is_brief=True)
    first, _ = inbox.frame(order, 0)
    assert first is not None
    inbox.answered(first.id, ask.Reply(ask.Result.ACCEPTED), 40)
    again, reply = inbox.frame(order, 11_900_000)
    assert again is None
    assert reply is not None
    inbox.whole(wire.Kind.ORDER, b"\x05" + b"other")
    restored = Inbox(45_000_000, 12_000_000)
    restored.restore(inbox.save(), 20_000_000)
    assert restored.frame(order, 20_500_000)[0] is None
    assert restored.frame(order, 33_000_000)[0] is not None
