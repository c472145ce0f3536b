"""Two gateways of one key and one vessel: whose station's silence counts, and what each of them is shown."""

from __future__ import annotations

import itertools
import json
import math
from collections import deque
from collections.abc import Collection

import pytest

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, Result, SetMode, SetParameter
from mavlink_bridge.radio.air import Ledger
from mavlink_bridge.radio.codec.state_fields import RadioState, metres_between
from mavlink_bridge.radio.codec.wire import Kind
from mavlink_bridge.radio.memory import Inboxes, read, write
from mavlink_bridge.radio.shore import ShoreTwin
from tests.soaked import in_the_soak
from tests.two_gateways import TwoGateways, met

LOST_S = 65.0
"""As ``failsafe.radio_timeout_s``: from this age on the boat holds."""
AUTO, HOLD = SetMode(Mode.AUTO), SetMode(Mode.HOLD)
SEEDS = pytest.mark.parametrize("seed", [0, *in_the_soak(1)])


def sailing(seed: int) -> TwoGateways:
    """The station at the first gateway has set the boat going; the one at the second has ordered nothing."""
    rig = met(seed=seed)
    assert rig.ask(AUTO)[1].result is Result.ACCEPTED
    rig.run(35.0)
    return rig


@SEEDS
def test_a_gateway_that_watches_keeps_the_loss_of_the_commanding_one_from_nobody(seed: int) -> None:
    rig = sailing(seed)
    rig.first_is_on = False
    rig.run(LOST_S + 5.0)
    assert rig.station_age_s > LOST_S
    rig.first_is_on = True
    rig.run(60.0)
    assert rig.station_age_s < LOST_S, "it is back"


@SEEDS
def test_while_the_commanding_gateway_speaks_its_station_is_never_lost(seed: int) -> None:
    rig = sailing(seed)
    for _ in range(200):
        rig.run(1.0)
        assert rig.station_age_s < LOST_S


def test_before_anybody_has_ordered_each_gateway_counts() -> None:
    rig = met()
    rig.first_is_on = False
    rig.run(LOST_S + 30.0)
    assert rig.station_age_s < LOST_S


@SEEDS
def test_the_commanding_gateway_counts_again_after_a_restart_and_unasked(seed: int) -> None:
    rig = sailing(seed)
    rig.first_is_on = False
    rig.run(10.0)
    rig.start_shore()
    rig.first_is_on = True
    for _ in range(100):
        rig.run(1.0)
        assert rig.station_age_s < LOST_S


def test_who_orders_motion_at_the_other_gateway_commands_and_that_is_told() -> None:
    rig = sailing(0)
    assert not [text for text in rig.told if "another gateway" in text]
    assert rig.ask(AUTO, twin=rig.second)[1].result is Result.ACCEPTED
    assert len([text for text in rig.told if "another gateway commands now" in text]) == 1
    rig.run(20.0)
    rig.first_is_on = False
    rig.run(LOST_S + 30.0)
    assert rig.station_age_s < LOST_S
    rig.first_is_on, rig.second = True, None
    rig.run(LOST_S + 5.0)
    assert rig.station_age_s > LOST_S, "the first one watches now"


@pytest.mark.parametrize("body", [HOLD, Arm(False), SetParameter("SPEED_MAX", 1.0)])
def test_what_stops_or_only_sets_passes_no_command_while_the_other_is_there(body: SetMode | Arm | SetParameter) -> None:
    rig = sailing(0)
    assert rig.ask(body, twin=rig.second)[1].result is Result.ACCEPTED
    rig.first_is_on = False
    rig.run(LOST_S + 5.0)
    assert rig.station_age_s > LOST_S


def test_a_hold_from_the_other_gateway_passes_the_command_of_who_is_gone() -> None:
    rig = sailing(0)
    rig.first_is_on = False
    rig.run(LOST_S + 5.0)
    assert rig.ask(HOLD, twin=rig.second)[1].result is Result.ACCEPTED
    rig.run(LOST_S)
    assert rig.station_age_s < LOST_S


def deafen_the_first(rig: TwoGateways, seconds: float) -> None:
    """For so long the first gateway hears nothing, and says its orders again."""
    module = next(each for each in rig.pair.air.modules if each.name == "shore")
    until_us, hear = rig.now_us + round(seconds * 1e6), module.to_host

    def to_host(data: bytes, at_us: int) -> None:
        if rig.now_us >= until_us:
            hear(data, at_us)

    module.to_host = to_host


@pytest.mark.parametrize("phase_s", [0.0, 1.7, *in_the_soak(3.3)])
@pytest.mark.parametrize("apart_s", [1.0, *in_the_soak(1.5, 2.0, 3.0)])
@pytest.mark.parametrize(
    ("order", "stop"), [(Arm(True), Arm(False)), (AUTO, HOLD), *in_the_soak((SetMode(Mode.GUIDED), HOLD))]
)
def test_an_order_that_is_said_again_after_the_stop_of_another_gateway_does_not_undo_it(
    order: Arm | SetMode, stop: Arm | SetMode, apart_s: float, phase_s: float
) -> None:
    rig = met()
    assert rig.second is not None
    rig.run(phase_s)
    rig.vessel.armed, rig.vessel.mode = not isinstance(order, Arm), Mode.HOLD
    rig.run(12.0)
    deafen_the_first(rig, 1.5 + apart_s)
    rig.twin.submit("order", order, rig.now_us)
    rig.run(apart_s)
    rig.second.submit("stop", stop, rig.now_us)
    rig.run(25.0)
    done = [body for _, body in rig.vessel.executed]
    assert done[-1] == stop, "its answer may be lost between the two that talk"
    assert not rig.vessel.armed if isinstance(order, Arm) else rig.vessel.mode is Mode.HOLD


@pytest.mark.parametrize("apart_s", [0.05, 0.4, *in_the_soak(0.8, 1.2)])
@pytest.mark.parametrize("seed", [0, *in_the_soak(1, 2)])
def test_of_two_orders_on_their_way_neither_is_obeyed_after_the_stop_of_another_gateway(
    seed: int, apart_s: float
) -> None:
    rig = met(seed=seed)
    assert rig.second is not None
    rig.vessel.mode = Mode.HOLD
    rig.run(10.0)
    rig.second.submit("mode", AUTO, rig.now_us)
    rig.second.submit("arm", Arm(True), rig.now_us)
    rig.run(apart_s)
    rig.twin.submit("stop", Arm(False), rig.now_us)
    rig.run(60.0)
    done = [body for _, body in rig.vessel.executed]
    assert Arm(True) not in done[done.index(Arm(False)) :] if Arm(False) in done else True


def test_two_gateways_without_listening_modules_are_told_of_once_and_a_restart_is_not() -> None:
    rig = met()
    said = [text for text in rig.told if "two gateways speak" in text]
    for twin in (rig.twin, rig.second, rig.twin, rig.second):
        rig.ask(HOLD, twin=twin)
    assert len([text for text in rig.told if "two gateways speak" in text]) == 1 >= len(said)
    alone = TwoGateways()
    alone.settle()
    alone.start_shore()
    alone.settle()
    assert not [text for text in alone.told if "two gateways" in text]


def test_an_order_on_its_way_while_another_gateway_stops_her_is_refused_once_and_obeyed_when_it_is_given_again() -> (
    None
):
    rig = met()
    rig.vessel.mode = Mode.HOLD
    assert rig.ask(HOLD, twin=rig.second)[1].result is Result.ACCEPTED
    refused = rig.ask(AUTO)[1]
    assert (refused.result, refused.reason) == (Result.REJECTED_NOW, "stopped from another gateway: again")
    assert rig.ask(AUTO)[1].result is Result.ACCEPTED
    assert rig.ask(HOLD)[1].result is Result.ACCEPTED
    assert rig.ask(AUTO)[1].result is Result.ACCEPTED, "its own stop is older than its next order"


def test_what_was_answered_to_each_gateway_outlives_a_restart_and_an_older_text_is_read() -> None:
    inboxes, ledger = Inboxes(45_000_000, 12_000_000), Ledger(None)
    for other in (b"first.", b"second"):
        assert inboxes.turn_to(other)
        assert inboxes.current.whole(Kind.ORDER, b"\x05" + other)[0] is not None
    text = write(inboxes, ledger, 0)
    fields = json.loads(text)
    older = json.dumps({"v": fields["v"], "other": b"second".hex(), "known": fields["starts"][1][1], "air": []})
    for kept, starts in ((text, (b"first.", b"second")), (older, (b"second",))):
        anew = Inboxes(45_000_000, 12_000_000)
        read(kept, anew, ledger, 0)
        for other in starts:
            assert not anew.turn_to(other)
            assert anew.current.whole(Kind.ORDER, b"\x05" + other)[0] is None, "it is not carried out again"


class Eyes:
    """What one gateway shows, against what the vessel was in the last seconds: a state waits for the air that long."""

    def __init__(self, rig: TwoGateways, twin: ShoreTwin) -> None:
        self._rig, self._twin, self._seen_us = rig, twin, twin.state_us
        self.states = 0

    def look(self, was: Collection[RadioState]) -> None:
        """Judge the newest state, and how long it is shown."""
        twin, age_s = self._twin, self._twin.age_s(self._rig.now_us)
        assert age_s is not None
        assert not twin.is_fresh(self._rig.now_us) or age_s <= twin.profile.link.stale_after_s
        shown = twin.state
        if shown is None or twin.state_us == self._seen_us:
            return
        self._seen_us, self.states = twin.state_us, self.states + 1
        alike = [state for state in was if (state.mode, state.armed) == (shown.mode, shown.armed)]
        assert alike, f"{shown.mode}, armed {shown.armed}: she was not"
        assert min(math.hypot(*(metres_between(shown, state) or (math.inf, 0.0))) for state in alike) < 2.0


@SEEDS
def test_neither_gateway_is_shown_a_boat_that_is_not_so(seed: int) -> None:
    """Orders from both, so that the vessel speaks to one and the other by turns; differences must not be put to the wrong state."""
    rig = met(seed=seed)
    assert rig.second is not None
    eyes = [Eyes(rig, twin) for twin in (rig.twin, rig.second)]
    bodies = itertools.cycle((AUTO, Arm(True), HOLD, SetMode(Mode.GUIDED), Arm(False)))
    was: deque[RadioState] = deque(maxlen=50)
    for count, body in enumerate(itertools.islice(bodies, 15)):
        (rig.second if count % 3 == 2 else rig.twin).submit(count, body, rig.now_us)
        for _ in range(140 + 10 * count):
            rig.run(0.1)
            was.append(RadioState.of(rig.vessel.snapshot(rig.now_us, 0)))
            for each in eyes:
                each.look(was)
    assert all(each.states > 10 for each in eyes)


def test_answers_alone_keep_no_picture_alive() -> None:
    """The boat speaks to somebody else, or her states are lost: where she is, is then not known any more."""
    rig = met()
    rig.second = None
    rig.run(20.0)
    rig.radio.link.post = lambda *frame: None  # type: ignore[method-assign]
    for _ in range(6):
        assert rig.ask(HOLD)[1].result is Result.ACCEPTED
        rig.run(5.0)
    assert not rig.twin.is_fresh(rig.now_us)
