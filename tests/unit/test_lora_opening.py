"""The original's channel, 3.6 s of air an hour: whoever starts first, the vessel is shown within a minute, or the station is told when."""

import pytest

from mavlink_bridge.radio.air.ledger import Ledger
from mavlink_bridge.radio.codec.wire import Kind
from mavlink_bridge.radio.shore.showing import Showing
from tools.lora_rig import Rig, profile

ORDERS = [("both", 0.0)] + [(first, gap_s) for first in ("vessel", "shore") for gap_s in (30.0, 600.0, 1900.0)]
ALONE_STEP_US = 500_000
STEP_US = 50_000


class Starts(Rig):
    """One end may be off."""

    off = ""

    def _vessel(self, now_us):
        if self.off == "vessel":
            self.pair.vessel.read()
        else:
            super()._vessel(now_us)

    def _shore(self, now_us):
        if self.off == "shore":
            self.pair.shore.read()
        else:
            super()._shore(now_us)


def started(first, gap_s, seed):
    """A link one end of which has been alone for so long."""
    rig = Starts(profile("n-0.1"), seed=seed, step_us=ALONE_STEP_US)
    rig.off = {"vessel": "shore", "shore": "vessel", "both": ""}[first]
    rig.run(gap_s)
    rig.step_us = STEP_US
    if rig.off == "shore":
        rig.start_shore()
    elif rig.off == "vessel":
        rig.start_vessel()
    rig.off = ""
    return rig


def shown_s(rig, limit_s=60.0):
    """Seconds until the shore has a state, None = none in time."""
    began_us = rig.now_us
    while rig.now_us - began_us < limit_s * 1e6:
        rig.step()
        if rig.twin.state is not None:
            return (rig.now_us - began_us) * 1e-6
    return None


def assert_opened(first, gap_s, seed):
    rig = started(first, gap_s, seed)
    seconds = shown_s(rig)
    assert seconds is not None
    assert seconds <= 60.0
    for ledger in (rig.radio.ledger, rig.twin.link.ledger):
        assert ledger.stops_left(rig.now_us) >= 5


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("first", "gap_s"), ORDERS)
def test_the_first_opening_shows_the_vessel_within_a_minute(first, gap_s, seed):
    assert_opened(first, gap_s, seed)


@pytest.mark.parametrize("seed", [26, 86])
def test_two_greetings_that_cross_are_not_answered_at_once(seed):
    """The vessel's is sent before the shore's has come whole, or the other way round; two answers would meet on the air."""
    assert_opened("both", 0.0, seed)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(2, 40))
@pytest.mark.parametrize(("first", "gap_s"), ORDERS)
def test_the_first_opening_shows_the_vessel_within_a_minute_whatever_chance_says(first, gap_s, seed):
    assert_opened(first, gap_s, seed)


class Told(Starts):
    """What the gateway tells its stations of the wait, and how many stops each hour ever held at least."""

    def start_shore(self):
        super().start_shore()
        keeps = getattr(self, "theirs", None) if self.keeps else None
        self.theirs = keeps or Ledger(self.profile.hour_us, self.profile.stop_us)
        self.showing = Showing(self.twin.link, self.theirs, self.now_us)
        self.words, self.fewest = [], 99

    keeps = True

    def _shore(self, now_us):
        super()._shore(now_us)
        if now_us // 1_000_000 != (now_us - self.step_us) // 1_000_000:
            word = self.showing.word(now_us, self.twin.state_us)
            self.words += [(now_us, word)] if word else []
            left = [ledger.stops_left(now_us) for ledger in (self.radio.ledger, self.twin.link.ledger)]
            self.fewest = min([self.fewest, *left])


def reopened(who, seed, *, keeps, after_s=600.0):
    """An opening, and another one ten minutes later."""
    rig = Told(profile("n-0.1"), seed=seed, step_us=STEP_US)
    assert shown_s(rig) is not None
    rig.step_us = ALONE_STEP_US
    rig.run(after_s)
    rig.step_us, rig.keeps = STEP_US, keeps
    if who != "shore":
        rig.start_vessel()
    if who != "vessel":
        rig.start_shore()
    rig.words.clear()
    return rig


def minutes_in(word):
    return next(int(before) for before, after in zip(word.split(), word.split()[1:], strict=False) if after == "min")


@pytest.mark.parametrize(
    ("who", "keeps"), [("shore", True), ("shore", False), ("vessel", True), ("both", True), ("both", False)]
)
def test_a_later_opening_is_shown_or_told_of_within_a_minute_and_the_promise_is_kept(who, keeps):
    rig = reopened(who, 1, keeps=keeps)
    began_us, state_us = rig.now_us, rig.twin.state_us
    rig.run(60.0)
    if rig.twin.state_us != state_us:
        return
    said_us, word = rig.words[0]
    assert "the vessel answers" in word
    rig.step_us = ALONE_STEP_US
    while rig.twin.state_us == state_us:
        rig.step()
        assert rig.now_us <= said_us + minutes_in(word) * 60e6
    assert rig.now_us - began_us < 3700e6
    assert rig.fewest >= 5


BATCHES_S = 14 * 129.0


def assert_shown_after_batches(who, seed, hours, *, keeps):
    """With the hour full of batches the next one that is an hour old makes room. A vessel alone cannot say that it started."""
    rig = reopened(who, seed, keeps=keeps, after_s=hours * 3600.0 + 397.0 * seed)
    began_us = rig.now_us
    assert rig.radio.ledger.used_us(began_us) > 0.9e6
    before_us = rig.twin.state_us
    rig.run(60.0)
    is_shown = rig.twin.state_us != before_us
    assert is_shown or who == "vessel" or "vessel. If it is on" in rig.words[0][1]
    promise_us = rig.words[0][0] + minutes_in(rig.words[0][1]) * 60e6 if rig.words else began_us + BATCHES_S * 1e6
    rig.step_us = ALONE_STEP_US
    while rig.twin.state_us == before_us:
        rig.step()
        assert rig.now_us <= min(promise_us, began_us + BATCHES_S * 1e6)
    shown_us = rig.twin.state_us
    while rig.twin.state_us == shown_us:
        rig.step()
        assert rig.now_us - shown_us < 3600e6 + 60e6, "batches go on, and the new start reads them"
    assert rig.fewest >= 5


def test_a_gateway_that_restarts_after_hours_of_batches_is_told_when_the_vessel_is_shown():
    assert_shown_after_batches("shore", 1, 1.1, keeps=True)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("keeps", [True, False])
@pytest.mark.parametrize("who", ["shore", "vessel", "both"])
def test_an_end_that_restarts_after_hours_of_batches_is_shown_when_the_next_is_an_hour_old(who, keeps, seed):
    assert_shown_after_batches(who, seed, 3.0, keeps=keeps)


def test_batches_are_put_off_until_an_opening_is_paid_for_and_are_not_older_for_it():
    rig = started("vessel", 600.0, 1)
    assert shown_s(rig) is not None
    opened_us, before_us = rig.now_us, rig.twin.state_us
    rig.step_us = ALONE_STEP_US
    while rig.twin.state_us == before_us:
        rig.step()
        assert rig.radio.ledger.stops_left(rig.now_us) >= 5
    batch = [item for item in rig.pair.air.log if item.origin == "vessel" and item.data[0] >> 4 == Kind.BATCH]
    assert len(batch) == 1
    assert 1800e6 < rig.now_us - opened_us < 3600e6
    assert rig.now_us // 1_000_000 - rig.twin.state.t_s < 10
