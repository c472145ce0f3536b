"""What the radio says in few bytes, so that no order waits long for it: answers without a body, differences of status, news."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mavlink_bridge.language.messages import Mode, PlanState
from mavlink_bridge.language.requests import Arm, Origin, RequestBody, Result, SetMode, SetParameter
from mavlink_bridge.mavlink.wire.codec import dialect
from mavlink_bridge.mavlink.wire.payload import payload
from mavlink_bridge.radio.codec.brief import brief_plan, encode_standing, with_brief
from mavlink_bridge.radio.codec.frames import frame_bytes
from mavlink_bridge.radio.codec.info import HomePlace, Kept, changed_params, encode, params_check
from mavlink_bridge.radio.codec.state_fields import RadioState
from mavlink_bridge.radio.codec.wire import BRIEF_AIMS, OVERHEAD, Kind
from mavlink_bridge.radio.shore.view import CachedParams
from mavlink_bridge.radio.transfer import BRIEF_NUMBERS, WholeMessage
from tools.benches.lora import compiled, settled, survey_items
from tools.lora_rig import Rig, Table

GUIDED, AUTO, RETURN, ARM, HOLD = BRIEF_AIMS
ORDERS: dict[bytes, tuple[RequestBody, Origin]] = {}
for order, body, params in (
    (GUIDED, SetMode(Mode.GUIDED), (176, 1, 15)),
    (AUTO, SetMode(Mode.AUTO), (176, 1, 10)),
    (ARM, Arm(True), (400, 1)),
    (HOLD, SetMode(Mode.HOLD), (176, 1, 4)),
):
    message = dialect.MAVLink_command_long_message(1, 1, params[0], 0, *params[1:], *[0.0] * (8 - len(params)))
    ORDERS[order] = body, Origin(message.get_msgId(), payload(message), (255, 190), home_item=True)


@pytest.fixture(scope="module")
def shared() -> Rig:
    rig = settled()
    assert rig.ask(compiled(survey_items(4)))[1].result is Result.ACCEPTED
    return rig


@pytest.fixture
def rig(shared: Rig) -> Rig:
    """A boat that sails its plan, and a link on which no order came for a while."""
    shared.vessel.mode, shared.vessel.armed = Mode.AUTO, True
    shared.run(15.0)
    shared.vessel.executed.clear()
    return shared


def sent_by_vessel(rig: Rig, since_us: int) -> list[int]:
    return [size for origin, size in rig.sent(since_us) if origin == "vessel"]


@pytest.mark.parametrize("order", ORDERS, ids=bytes.hex)
def test_an_order_without_a_body_is_accepted_without_one_and_shown(rig: Rig, order: bytes) -> None:
    rig.vessel.armed = order != ARM
    rig.run(10.0)
    since_us = rig.now_us
    assert rig.ask(ORDERS[order][0], origin=ORDERS[order][1])[1].result is Result.ACCEPTED
    assert OVERHEAD in sent_by_vessel(rig, since_us)
    assert rig.twin.state is not None
    assert (rig.twin.state.mode, rig.twin.state.armed) == (rig.vessel.mode, True)


@pytest.mark.parametrize(
    ("older", "speaker", "executed", "answered"),
    [
        (AUTO, (255, 190), [GUIDED], Result.REJECTED_NOW),
        (HOLD, (255, 190), [HOLD, GUIDED], Result.ACCEPTED),
        (AUTO, (7, 190), [AUTO, GUIDED], Result.ACCEPTED),
        (GUIDED, (255, 190), [GUIDED], Result.ACCEPTED),
    ],
    ids=["another mode", "a stop is carried out", "another station's", "the same mode"],
)
def test_a_stations_newer_mode_ends_its_older_one(rig: Rig, older, speaker, executed, answered) -> None:
    """It is not carried out, but for a stop, and not left without an answer."""
    rig.vessel.mode = Mode.RTL
    rig.run(20.0)
    rig.replies.clear()
    rig.pair.air.jammed = True
    rig.twin.submit("older", ORDERS[older][0], rig.now_us, replace(ORDERS[older][1], source=speaker))
    rig.run(3.5)
    rig.twin.submit("newer", ORDERS[GUIDED][0], rig.now_us, ORDERS[GUIDED][1])
    rig.pair.air.jammed = False
    rig.run(10.0)
    assert [body for _, body in rig.vessel.executed] == [ORDERS[order][0] for order in executed]
    assert {owner: reply.result for _, owner, reply in rig.replies} == {"older": answered, "newer": Result.ACCEPTED}


def test_an_answer_tells_all_when_more_has_changed_than_was_ordered(rig: Rig) -> None:
    """The boat was disarmed a moment ago, and no state has told it: "Guided" alone would leave "armed" on the screen."""
    rig.ask(ORDERS[GUIDED][0], origin=ORDERS[GUIDED][1])
    rig.vessel.armed = False
    since_us = rig.now_us
    rig.ask(ORDERS[AUTO][0], origin=ORDERS[AUTO][1])
    assert OVERHEAD not in sent_by_vessel(rig, since_us)
    assert rig.twin.state is not None
    assert (rig.twin.state.mode, rig.twin.state.armed) == (Mode.AUTO, False)


def test_a_refusal_and_an_answer_to_another_order_have_a_body(rig: Rig) -> None:
    rig.vessel.refuse = "no"
    since_us = rig.now_us
    reply = rig.ask(ORDERS[GUIDED][0], origin=ORDERS[GUIDED][1])[1]
    assert (reply.result, reply.reason) == (Result.DENIED, "no")
    rig.vessel.refuse = ""
    assert rig.ask(SetParameter("SPEED_MAX", 1.5))[1].result is Result.ACCEPTED
    assert OVERHEAD not in sent_by_vessel(rig, since_us)


@pytest.mark.parametrize("order", BRIEF_AIMS, ids=bytes.hex)
def test_what_an_answer_without_a_body_stands_for_is_what_the_vessel_meant(order: bytes) -> None:
    told = RadioState(mode=Mode.CIRCLE, plan_state=PlanState.PAUSED, seq=3, prearm_ok=True)
    for plan in (PlanState.ACTIVE, PlanState.PAUSED, PlanState.COMPLETE):
        now = replace(with_brief(told, order, 0), plan_state=plan)
        found = brief_plan(told, order, now)
        assert (found is None) == (plan is PlanState.COMPLETE)
        if found is not None:
            assert encode_standing(with_brief(told, order, found)) == encode_standing(now)
    for other in (replace(told, seq=4), replace(told, prearm_ok=False), replace(told, mode=Mode.MANUAL)):
        assert brief_plan(told, order, other) is None


def test_after_an_order_the_state_needs_no_key(rig: Rig) -> None:
    """A key is 23 bytes on the air, and the next order may have to wait for it."""
    rig.ask(ORDERS[GUIDED][0], origin=ORDERS[GUIDED][1])
    since_us = rig.now_us
    rig.run(6.5)
    sizes = sent_by_vessel(rig, since_us)
    assert sizes
    assert max(sizes) <= 15
    rig.run(20.0)
    assert min(sent_by_vessel(rig, rig.now_us - 5_000_000)) == 11


def test_a_hold_that_finds_no_answer_is_said_in_its_frozen_form_and_carried_out_once(rig: Rig) -> None:
    heard = rig.pair.shore.read
    rig.pair.shore.read = lambda: heard() and b""  # type: ignore[method-assign]
    since_us = rig.now_us
    rig.twin.submit("hold", ORDERS[HOLD][0], rig.now_us, ORDERS[HOLD][1])
    rig.run(3.0)
    rig.pair.shore.read = heard  # type: ignore[method-assign]
    rig.run(4.0)
    sizes = [size for origin, size in rig.sent(since_us) if origin == "shore"]
    assert sizes[:3] == [OVERHEAD, OVERHEAD, OVERHEAD + 4]
    assert [body for _, body in rig.vessel.executed] == [SetMode(Mode.HOLD)]
    assert [reply.result for _, owner, reply in rig.replies if owner == "hold"] == [Result.ACCEPTED]


def test_a_hold_voids_what_was_ordered_before_it_in_either_form(rig: Rig) -> None:
    """Of a number without a body five bits are known."""
    radio = rig.radio
    assert radio._overruling(WholeMessage(BRIEF_NUMBERS + 5, Kind.SAFE, HOLD), SetMode(Mode.HOLD), 0) is None
    for number, is_before in (
        (4, True),
        (100, True),
        (6, False),
        (BRIEF_NUMBERS + 4, True),
        (BRIEF_NUMBERS + 6, False),
    ):
        assert (
            radio._overruling(WholeMessage(number, Kind.ORDER, AUTO), SetMode(Mode.AUTO), 1) is not None
        ) is is_before


def test_news_of_what_is_kept_are_short() -> None:
    for told in (Kept(1, 2, 3, 4), HomePlace((1, 2), (0, 2, 0))):
        assert frame_bytes(Kind.INFO, b"\0" + encode(told)) <= 23


def test_a_home_that_moved_by_the_receivers_noise_is_the_same() -> None:
    home = HomePlace((411_850_126, -87_062_153))
    assert home.is_like(HomePlace((411_850_123, -87_062_157)))
    assert not home.is_like(HomePlace((411_850_126, -87_062_400)))
    assert not home.is_like(HomePlace(None))


def test_a_shore_whose_table_lacks_the_boats_own_parameters_keeps_them_all_the_same() -> None:
    """Else it finds its picture wrong for ever, and asks for the parameters again and again."""
    boat, shore = Table(GAIN=0.0, SPEED_MAX=2.0), CachedParams(Table(SPEED_MAX=2.0))
    boat.set("GAIN", 0.4)
    assert params_check(shore.changed) != params_check(changed_params(boat))
    shore.put_changed(changed_params(boat))
    assert params_check(shore.changed) == params_check(changed_params(boat))
    boat.set("SPEED_MAX", 1.5)
    shore.put("SPEED_MAX", 1.5)
    assert params_check(shore.changed) == params_check(changed_params(boat))
