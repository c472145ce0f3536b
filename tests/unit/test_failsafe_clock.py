"""The clocks of the failsafe's second actions: they run only while the cause stands, and times in which it stood add up."""

from __future__ import annotations

import math
import random

import pytest

from companion.core.guard.failsafe import FailsafeConfig, FailsafeMemory, Flags
from companion.core.guard.failsafe_flags import changed
from companion.core.guard.failsafe_orders import Order
from companion.core.guard.failsafe_row import Clear
from companion.core.guard.failsafe_table import TABLE
from companion.core.guard.failsafe_words import BACK, DOING, SHORT, WAYS
from companion.core.guard.outlook import outlook
from mavlink_bridge.language.messages import Action, Severity
from tests.unit.test_failsafe import WELL, Run, raised

BEAT_S = 1.0
STEP_S = 0.5


class Link:
    """A station that beats once a second while its link is up, and the engine that hears it."""

    def __init__(self, config: FailsafeConfig | None = None, *, over: str = "gcs_age_s") -> None:
        self.run = Run(config or FailsafeConfig())
        self.over = over
        self.heard_s = self.now_s = 0.0
        self.actions: list[tuple[float, Action]] = []
        self.age_s = 0.0
        """Of the station's last beat, at the last change of action."""

    def go(self, seconds: float, *, up: bool, order: bool = False, **flags: bool) -> Action:
        end_s = self.now_s + seconds
        action = Action.NONE
        while self.now_s < end_s - 1e-9:
            self.now_s = round(self.now_s + STEP_S, 3)
            if up and (self.now_s % BEAT_S) < STEP_S / 2:
                self.heard_s = self.now_s
            age_s = round(self.now_s - self.heard_s, 3)
            seen = changed(
                WELL, **{"gcs_age_s": None, self.over: age_s}, operator_order=Order.GUIDED if order else None, **flags
            )
            order = False
            before = self.actions[-1][1] if self.actions else Action.NONE
            action = self.run.step(seen, STEP_S)
            if action is not before:
                self.actions.append((self.now_s, action))
                self.age_s = age_s
        return action

    def texts(self) -> list[str]:
        return [text for _, text in self.run.texts]


@pytest.mark.parametrize("outage_s", [1, 4, 6, 8, 20, 40, 59, 60])
def test_after_one_outage_of_up_to_a_minute_nothing_new_is_begun(outage_s):
    link = Link()
    link.go(10.0, up=True)
    link.go(outage_s, up=False)
    expected = link.go(600.0, up=True)
    assert expected is (Action.HOLD if outage_s > 5 else Action.NONE)
    assert Action.RETURN not in [action for _, action in link.actions]


def test_the_stopped_clock_is_told_once_with_the_order_that_goes_on():
    link = Link()
    link.go(10.0, up=True)
    link.go(8.0, up=False)
    link.go(60.0, up=True)
    told = [text for text in link.texts() if "clock" in text]
    assert told == ["Ground station is back: clock stopped at 4 of 60 s, holding: order Auto to go on"]


def test_outages_add_up():
    link = Link()
    link.go(10.0, up=True)
    link.go(35.0, up=False)
    link.go(100.0, up=True)
    assert link.go(28.0, up=False) is Action.HOLD
    assert link.go(6.0, up=False) is Action.RETURN


@pytest.mark.parametrize("off_s", [2, 3, 5, 8, 13, 20, 30])
@pytest.mark.parametrize("on_s", [2, 5, 9, 15, 30])
def test_a_link_that_flaps_leads_home_by_the_summed_silence(off_s, on_s):
    link = Link()
    link.go(10.0, up=True)
    link.go(6.0, up=False)
    gaps = 0
    while link.actions[-1][1] is not Action.RETURN:
        assert gaps * off_s < 60.0, "not by the summed silence"
        link.go(on_s, up=True)
        link.go(off_s, up=False)
        gaps += 1
    assert gaps * (off_s + 1.0) >= 58.0, "and not before"
    assert link.age_s >= 2.5, "in silence"


def test_a_voyage_of_short_gaps_does_not_even_hold():
    link = Link()
    for _ in range(100):
        link.go(2.0, up=False)
        assert link.go(3.0, up=True) <= Action.WARN


@pytest.mark.parametrize("seed", range(100))
def test_walks_of_outages_and_orders_never_move_while_the_station_is_there(seed):
    """What is begun without an order is begun in silence; with the station steadily back nothing is."""
    dice = random.Random(seed)
    link = Link(FailsafeConfig(gcs_then_s=float(dice.choice((5, 20, 60)))))
    for _ in range(8):
        count = len(link.actions)
        link.go(dice.choice((0.5, 3.0, 7.0, 30.0, 70.0)), up=False)
        for at_s, action in link.actions[count:]:
            assert action is not Action.NONE or at_s - link.heard_s < 2.5
        count = len(link.actions)
        link.go(dice.choice((1.2, 4.0, 11.0, 60.0)), up=True)
        assert all(action <= Action.WARN for _, action in link.actions[count + 1 :])
        if dice.random() < 0.5 and link.now_s - link.heard_s < 2.0:
            assert link.go(STEP_S, up=True, order=True) <= Action.WARN
            assert link.go(1.0, up=True) <= Action.WARN


def test_the_radios_clock_stands_too():
    link = Link(over="radio_age_s")
    link.go(10.0, up=True)
    link.go(100.0, up=False)
    assert link.go(900.0, up=True) is Action.HOLD
    assert any("clock stopped" in text for text in link.texts())
    link.go(60.0, up=False)
    assert link.go(60.0, up=False) is Action.RETURN


def test_an_order_with_the_station_back_starts_all_anew():
    link = Link()
    link.go(10.0, up=True)
    link.go(60.0, up=False)
    link.go(3.0, up=True)
    assert link.go(1.0, up=True, order=True) is Action.WARN
    link.go(60.0, up=False)
    assert link.actions[-1][1] is Action.HOLD


def test_silence_that_has_no_number_counts_from_when_the_station_was_last_well():
    for age_s in (math.inf, math.nan):
        run = Run()
        run.step(changed(WELL, gcs_age_s=age_s))
        run.step(WELL)
        run.step(WELL, 59.0)
        assert run.step(WELL, 1.0) is Action.HOLD
        assert run.step(changed(WELL, gcs_age_s=age_s)) is Action.RETURN


def test_thrust_without_speed_that_ends_is_forgotten_and_what_stopped_the_boat_is_not():
    stuck = changed(WELL, stuck=True)
    run = Run()
    run.step(stuck)
    run.step(stuck, 6.0)
    assert run.step(WELL) is Action.WARN
    assert run.step(WELL, 9.0) is Action.WARN, "the clock stands while the boat moves"
    assert run.step(stuck) is Action.WARN
    assert run.step(stuck, 5.0) is Action.STOP, "and goes on"
    run.step(WELL)
    assert run.step(WELL, 60.0) is Action.STOP
    assert run.step(changed(WELL, operator_order=Order.GUIDED)) is Action.NONE
    run.step(stuck)
    run.step(WELL)
    assert run.step(WELL, 10.0) is Action.NONE, "a mere warning ends by itself"


def test_an_overloaded_loop_that_has_recovered_is_not_stopped():
    run = Run()
    run.step(changed(WELL, overruns=True))
    run.step(WELL)
    assert run.step(WELL, 9.99) is Action.WARN
    assert run.step(changed(WELL, overruns=True)) is Action.WARN


def steps(run: Run, flags: Flags, seconds: float) -> None:
    for _ in range(round(seconds / 0.5)):
        run.step(flags, 0.5)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("position_lost", "Position is back: stopped: order Auto to go on"),
        ("depth_locked", "It is deep enough again: stopped: arm again to go on"),
        ("fence_breach", "The boat is inside the fence again: holding: order Auto to go on"),
        ("battery_critical", "Battery voltage is back: returning: order Auto to go on"),
    ],
)
def test_what_goes_on_is_said_when_a_cause_is_gone(name, told):
    run = Run()
    flags = changed(WELL, resume="Auto")
    steps(run, changed(flags, **{name: True}), 8.0)
    steps(run, flags, 60.0)
    assert [text for severity, text in run.texts if severity is Severity.INFO and not text.startswith("Over")] == [told]
    steps(run, changed(flags, **{name: True}), 1.0)
    steps(run, flags, 60.0)
    assert [text for severity, text in run.texts if severity is Severity.INFO and not text.startswith("Over")] == [
        told
    ] * 2, "each time"


def test_what_lets_go_by_itself_needs_no_order_and_a_hand_on_the_sticks_none_either():
    run = Run()
    steps(run, changed(WELL, manual=True, manual_age_s=1.0), 1.0)
    steps(run, WELL, 30.0)
    assert [text for _, text in run.texts] == ["Manual control lost: STOP", "Over: manual control lost"]
    run = Run()
    by_hand = changed(WELL, manual=True, manual_age_s=0.1)
    steps(run, changed(by_hand, fence_breach=True), 1.0)
    steps(run, by_hand, 30.0)
    assert [text for _, text in run.texts] == ["Outside the fence"]


def test_every_row_that_waits_for_an_order_or_does_more_than_warn_has_words_for_it():
    for row in TABLE:
        acts = row.action > Action.WARN or row.then_action > Action.WARN
        assert (row.name in BACK) == ((row.clear in WAYS or acts) and row.clear is not Clear.RESTART)
        assert row.action in DOING or row.clear not in WAYS
        assert row.action in SHORT


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_every_row_that_grows_or_waits_for_an_order_is_foretold(row):
    run = Run()
    flags = changed(WELL, resume="Guided")
    run.step(raised(row.name, flags))
    run.step(raised(row.name, flags), 0.1 if row.age is not None else row.delay_s + 0.05)
    seen = {each.name: each for each in outlook(run.memory, flags, run.now_us, run.config)}[row.name]
    waits = row.clear in (Clear.OPERATOR, Clear.REARM)
    if row.then_after_s is not None:
        left_s = f"{row.then_after_s:g}"
        assert f"{row.then_action.name} in {left_s} s; until {BACK[row.name]}" in " ".join(run.foretold)
        run.step(raised(row.name, flags), row.then_after_s / 2)
        (seen,) = [each for each in outlook(run.memory, flags, run.now_us, run.config) if each.name == row.name]
        assert 0 < seen.next_in_s < row.then_after_s
        assert f", {row.then_action.name} in " in seen.sentence()
    if waits:
        assert ("arm again" if row.clear is Clear.REARM else "order Guided") in seen.sentence()
        assert ("arm again" if row.clear is Clear.REARM else "order Guided") in " ".join(run.foretold)
    elif row.clear is Clear.RESTART:
        assert "until the program is started again" in seen.sentence()
    assert "_" not in seen.sentence(), "words, not code names"


def test_a_second_action_is_told_again_shortly_before_it_comes():
    link = Link()
    link.go(10.0, up=True)
    link.go(62.0, up=False)
    assert link.run.foretold == [
        "RETURN in 60 s; until ground station is back, then order Auto",
        "RETURN in 10 s: ground station lost",
    ]
    link.go(60.0, up=True)
    (seen,) = outlook(link.run.memory, WELL, link.run.now_us, link.run.config)
    assert seen.sentence() == (
        "ground station lost: holding, clock stands (RETURN in 2 s); until ground station is back, then order Auto"
    )


def test_what_was_taken_over_is_said_so_and_nothing_is_foretold_of_it():
    run = Run()
    steps(run, changed(WELL, fence_breach=True), 1.0)
    flags = changed(WELL, fence_breach=True, operator_order=Order.RETURN)
    run.step(flags)
    (seen,) = outlook(run.memory, WELL, run.now_us, run.config)
    assert seen.sentence().startswith("outside the fence: taken over; until the boat is inside the fence again")
    assert outlook(FailsafeMemory(), WELL, 0, run.config) == ()
    run = Run()
    run.step(changed(WELL, battery_low=True))
    assert outlook(run.memory, WELL, run.now_us, run.config) == (), "its delay runs"


def test_what_is_done_for_another_condition_is_said_so_and_is_not_taken_over():
    """Of a boat that was stopped without a position "ground station lost: taken over" was shown, and nobody had taken over."""
    run = Run()
    flags = changed(WELL, position_lost=True, gcs_age_s=6.0)
    steps(run, flags, 1.0)
    said = [each.sentence() for each in outlook(run.memory, flags, run.now_us, run.config, Action.STOP)]
    assert said[0].startswith("position lost: stopped; until")
    assert said[1].startswith(
        "ground station lost: stopped (position lost), RETURN in 60 s; until ground station is back"
    )


def test_an_order_to_return_is_not_stopped_by_a_lost_station():
    run = Run()
    home = changed(WELL, return_ordered=True)
    run.step(home)
    assert run.step(changed(home, gcs_age_s=6.0)) is Action.WARN
    assert run.step(changed(home, gcs_age_s=600.0), 600.0) is Action.WARN
    assert run.step(changed(home, gcs_age_s=None, radio_age_s=600.0), 600.0) is Action.WARN
    assert run.step(changed(home, gcs_age_s=600.0, fence_breach=True)) is Action.HOLD, "other causes stop it"
    assert run.step(changed(home, return_ordered=False, gcs_age_s=601.0, radio_age_s=601.0), 1.0) >= Action.HOLD


@pytest.mark.parametrize("name", ["fence_breach", "position_lost"])
def test_a_cause_is_steadily_gone_after_ten_seconds_and_not_before(name):
    """Also where the row itself asks for less."""
    run = Run()
    run.step(changed(WELL, **{name: True}))
    run.step(changed(WELL, **{name: True}), 1.0)
    run.step(WELL)
    run.step(WELL, 9.999999)
    assert not [text for _, text in run.texts if "to go on" in text]
    run.step(WELL, 1e-6)
    assert len([text for _, text in run.texts if "to go on" in text]) == 1


def test_the_clock_adds_up_to_the_microsecond():
    stuck = changed(WELL, stuck=True)
    run = Run()
    run.step(stuck)
    run.step(stuck, 4.0)
    run.step(WELL, 1.0)
    run.step(WELL, 3.0)
    run.step(stuck, 1.0)
    assert run.step(stuck, 4.999999) is Action.WARN
    assert run.step(stuck, 1e-6) is Action.STOP


def test_silence_hidden_by_another_link_counts_from_when_that_link_fell_silent():
    run = Run()
    run.step(changed(WELL, gcs_age_s=5.0))
    run.step(changed(WELL, gcs_age_s=None, radio_age_s=1.0))
    run.step(changed(WELL, gcs_age_s=None, radio_age_s=1.0), 10.0)
    assert run.step(changed(WELL, gcs_age_s=1000.0)) is Action.HOLD, "10 s on the clock, not 1000"


def heard_each(period_s, hours=1.0, config=None):
    """An hour with a station of which a sign of life comes each so many seconds; what is told, with the time."""
    run, heard_s, told = Run(config or FailsafeConfig()), 0.0, []
    for k in range(1, round(3600.0 * hours / STEP_S)):
        now_s = k * STEP_S
        heard_s = now_s - now_s % period_s
        before = len(run.texts)
        run.step(changed(WELL, gcs_age_s=now_s - heard_s), STEP_S)
        told += [(now_s, text) for _, text in run.texts[before:]]
    return told


@pytest.mark.parametrize("period_s", [3.0, 3.5, 4.0, 5.0])
def test_a_station_that_is_heard_each_few_seconds_is_told_as_silent_once(period_s):
    """Silent, over, silent, over: up to 2400 texts an hour, and none of them was news."""
    assert [text for _, text in heard_each(period_s)] == ["Ground station silent"]


@pytest.mark.parametrize("period_s", [8.0, 10.0, 15.0, 30.0, 45.0, 60.0])
def test_a_station_that_comes_and_goes_floods_nobody(period_s):
    """Lost or only silent: at most one pair of texts of it in half a minute."""
    told = [now_s for now_s, text in heard_each(period_s) if "silent" in text]
    assert all(later - earlier >= 30.0 for earlier, later in zip(told, told[2:], strict=False))
    assert len(told) <= 2 + 2 * 3600.0 / max(period_s, 32.0)


def test_a_station_that_is_heard_steadily_again_is_told_so_once():
    link = Link()
    link.go(10.0, up=True)
    link.go(4.0, up=False)
    link.go(29.0, up=True)
    assert link.texts() == ["Ground station silent"]
    link.go(3.0, up=True)
    assert link.texts() == ["Ground station silent", "Over: ground station silent"]
