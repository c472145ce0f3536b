"""The failsafe engine: each row of the table acts in time, clears by its rule and yields as it says."""

from __future__ import annotations

import math
import re

import pytest

from companion.core.guard.failsafe import (
    FailsafeConfig,
    FailsafeMemory,
    FailsafeResult,
    Flags,
    barring,
    deaf_sticks,
    failsafe_table_markdown,
    holding,
    step,
    stopped_by,
)
from companion.core.guard.failsafe_config import reached
from companion.core.guard.failsafe_flags import ALARMS, changed, flags_of
from companion.core.guard.failsafe_orders import ENDS_STANDING, Order, names
from companion.core.guard.failsafe_row import Clear, Takeover
from companion.core.guard.failsafe_table import BY_NAME, TABLE
from mavlink_bridge.language.messages import Action, Severity

CONFIG = FailsafeConfig()
WELL = flags_of(armed=True, autonomous=True, gcs_required=True, gcs_age_s=0.1)
TICK_S = 0.05


FORETELLS = ("Until ", "RETURN in ", "STOP in ")


class Run:
    """Steps the engine and keeps its memory."""

    def __init__(self, config: FailsafeConfig = CONFIG) -> None:
        self.config = config
        self.memory = FailsafeMemory()
        self.now_us = 0
        self.texts: list[tuple[Severity, str]] = []
        """But for what foretells."""
        self.foretold: list[str] = []
        self.last: FailsafeResult | None = None

    def step(self, flags: Flags, after_s: float = TICK_S) -> Action:
        self.now_us += round(after_s * 1e6)
        self.last = step(self.memory, flags, self.now_us, self.config)
        self.memory = self.last.memory
        for severity, text in self.last.texts:
            if text.startswith(FORETELLS):
                self.foretold.append(text)
            else:
                self.texts.append((severity, text))
        return self.last.action

    @property
    def causes(self) -> tuple[str, ...]:
        assert self.last is not None
        return self.last.causes


def raised(name: str, flags: Flags = WELL) -> Flags:
    """Flags with exactly this row's cause."""
    ages = {
        "gcs_lost": {"gcs_age_s": 1e4},
        "gcs_degraded": {"gcs_age_s": 3.0},
        "radio_lost": {"gcs_age_s": None, "radio_age_s": 1e4},
        "manual_lost": {"manual_age_s": 1e4},
        "guided_lost": {"guided_age_s": 1e4},
    }
    return changed(flags, **ages.get(name, {name: True}))


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_each_row_acts_after_its_delay_and_not_before(row):
    run = Run()
    run.step(WELL)
    assert run.causes == ()
    delay_s = 0.0 if row.age is not None else row.delay_s
    run.step(raised(row.name))
    if delay_s > 0.0:
        assert row.name not in run.causes
        run.step(raised(row.name), delay_s - 1e-6)
        assert row.name not in run.causes
        run.step(raised(row.name), 1e-6)
    assert row.name in run.causes
    assert run.last.action >= row.action
    sentences = [text for _, text in run.texts if row.text in text.lower() or row.text in text]
    assert len(sentences) == 1


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_each_row_clears_by_its_rule(row):
    run = Run()
    run.step(raised(row.name))
    run.step(raised(row.name), row.delay_s + 0.05)
    assert row.name in run.causes
    run.step(WELL)
    if row.clear_s > 0.0:
        run.step(WELL, row.clear_s - 1e-6)
        assert row.name in run.causes
        run.step(changed(WELL, operator_order=Order.GUIDED, operator_arm=True), 0.0)
        assert row.name in run.causes, "an order before the cause has been gone long enough does not clear"
        run.step(WELL, 1e-6)
    gone_by_itself = row.name not in run.causes
    assert gone_by_itself == (row.clear in (Clear.GONE, Clear.ACTED))
    run.step(changed(WELL, operator_order=Order.GUIDED))
    assert (row.name not in run.causes) == (row.clear in (Clear.GONE, Clear.OPERATOR, Clear.ACTED))
    run.step(changed(WELL, operator_arm=True))
    assert (row.name not in run.causes) == (row.clear is not Clear.RESTART)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_each_row_yields_to_whom_it_says(row):
    run = Run()
    cause = raised(row.name)
    run.step(cause)
    run.step(cause, row.delay_s + 0.05)
    full = run.last.action
    by_hand = run.step(changed(cause, manual=True))
    assert (by_hand <= Action.WARN) == (row.takeover is not Takeover.NEVER or full <= Action.WARN)
    assert run.step(cause) == full, "manual control ends, the action is back"
    ordered = run.step(changed(cause, operator_order=Order.GUIDED))
    assert (ordered <= Action.WARN) == (row.takeover is Takeover.ORDER or full <= Action.WARN)
    after = run.step(cause)
    assert after == ordered, "a takeover lasts"


def test_the_takeover_is_told_once_and_the_end_too():
    run = Run()
    cause = changed(WELL, depth_shallow=True)
    run.step(cause)
    run.step(changed(cause, operator_order=Order.GUIDED))
    assert len(run.texts) == 2, "at once"
    run.step(changed(cause, operator_order=Order.GUIDED))
    run.step(WELL)
    run.step(WELL)
    assert [text for _, text in run.texts] == [
        "Too shallow: a correcting manoeuvre is allowed: STOP",
        "Operator takes over: too shallow: a correcting manoeuvre is allowed",
        "Over: too shallow: a correcting manoeuvre is allowed",
    ]
    assert [severity for severity, _ in run.texts] == [Severity.CRITICAL, Severity.WARNING, Severity.INFO]


def test_after_a_takeover_the_cause_gone_is_enough():
    run = Run()
    cause = changed(WELL, depth_shallow=True)
    run.step(cause)
    run.step(changed(cause, operator_arm=True))
    assert run.step(WELL) is Action.NONE
    assert run.step(cause) is Action.STOP, "a new cause counts anew"


def test_the_worst_action_wins_and_causes_come_most_urgent_first():
    run = Run()
    action = run.step(changed(WELL, fence_ahead=True, emergency_stop=True, tick_late=True))
    assert action is Action.DISARM
    assert run.causes == ("emergency_stop", "fence_ahead", "tick_late")


def test_a_flag_that_flickers_starts_its_delay_again():
    run = Run()
    low = changed(WELL, battery_empty=True)
    run.step(low)
    run.step(low, 4.9)
    run.step(WELL, 0.05)
    run.step(low, 0.05)
    assert run.step(low, 4.9) is Action.NONE
    assert run.step(low, 0.1) is Action.STOP
    assert [text for _, text in run.texts] == ["Battery empty: STOP"], "what never acted is never over"


def test_a_cause_that_comes_back_while_clearing_does_not_start_anew():
    run = Run()
    lost = changed(WELL, position_lost=True)
    run.step(lost)
    run.step(WELL)
    run.step(lost)
    assert [text for _, text in run.texts] == ["Position lost: STOP"]
    run.step(WELL)
    run.step(WELL, 4.0)
    run.step(lost)
    run.step(WELL)
    assert run.step(changed(WELL, operator_order=Order.GUIDED), 4.0) is Action.STOP, (
        "five seconds count from the last loss"
    )


def test_hold_becomes_stop_without_position_or_heading():
    for lost in ("position_lost", "heading_lost"):
        run = Run()
        assert run.step(changed(WELL, gcs_age_s=9.0)) is Action.HOLD
        assert run.step(changed(WELL, gcs_age_s=9.0, autonomous=False, **{lost: True})) is Action.STOP
        assert Run().step(changed(WELL, autonomous=False, tick_late=True, **{lost: True})) is Action.WARN


def test_a_return_does_not_cross_the_fence():
    run = Run(FailsafeConfig(gcs_action=Action.RETURN))
    lost = changed(WELL, gcs_age_s=9.0)
    assert run.step(lost) is Action.RETURN
    assert run.step(changed(lost, fence_ahead=True)) is Action.HOLD
    assert run.step(changed(lost, fence_ahead=True, manual=True)) is Action.WARN
    run = Run(FailsafeConfig(gcs_action=Action.RETURN))
    run.step(changed(WELL, fence_ahead=True))
    assert run.step(changed(lost, manual=True, battery_critical=True)) is Action.WARN
    assert run.step(changed(WELL, fence_ahead=True, actuator_garbage=True)) is Action.STOP


def test_row_36_the_last_ground_station_lost():
    """Fault row 36: degraded at 2.5 s, hold at 5 s (neutral without a position), the next action a minute later."""
    run = Run()
    age_s, acted, warned = 0.0, None, None
    while age_s < 66.0:
        age_s = round(age_s + TICK_S, 3)
        action = run.step(changed(WELL, gcs_age_s=age_s))
        warned = age_s if warned is None and action is Action.WARN else warned
        acted = age_s if acted is None and action is Action.HOLD else acted
        if action is Action.RETURN:
            break
    assert (warned, acted, age_s) == (2.5, 5.0, 65.0)
    assert [text for _, text in run.texts] == [
        "Ground station silent",
        "Ground station lost: HOLD",
        "Ground station lost: RETURN",
    ]
    assert run.step(WELL) is Action.RETURN, "the return goes on until an operator speaks"
    assert run.step(changed(WELL, operator_order=Order.GUIDED)) is Action.WARN
    assert run.step(WELL, 30.0) is Action.NONE


def test_ground_loss_counts_from_the_first_requirement_when_never_heard():
    run = Run()
    silent = flags_of(armed=True, autonomous=True, gcs_required=True)
    run.step(changed(silent, armed=False), 100.0)
    run.step(silent)
    assert run.step(silent, 4.95) is Action.WARN
    assert run.step(silent, 0.05) is Action.HOLD


def test_ground_loss_is_forgotten_while_not_required():
    run = Run()
    silent = flags_of(armed=True, autonomous=True, gcs_required=True)
    run.step(silent)
    run.step(changed(silent, gcs_required=False), 3.0)
    run.step(silent, 0.05)
    assert run.step(silent, 4.9) is Action.WARN


def test_the_best_link_to_the_ground_decides():
    run = Run()
    assert run.step(changed(WELL, gcs_age_s=100.0, radio_age_s=60.0)) is Action.NONE
    assert run.step(changed(WELL, gcs_age_s=1.0, radio_age_s=1000.0)) is Action.NONE
    assert run.step(changed(WELL, gcs_age_s=100.0, radio_age_s=65.0)) is Action.HOLD
    assert run.causes == ("gcs_lost", "radio_lost", "gcs_degraded")


def test_row_51_radio_alone_has_its_own_time():
    """Fault row 51: where the radio is the only link, its own time counts (30 s when so configured)."""
    run = Run(FailsafeConfig(radio_timeout_s=30.0))
    radio = changed(WELL, gcs_age_s=None)
    assert run.step(changed(radio, radio_age_s=29.99)) is Action.NONE
    assert run.step(changed(radio, radio_age_s=30.0)) is Action.HOLD


def test_row_37_row_38_streams_that_stop():
    """Fault rows 37 and 38: sticks 0.5 s, streamed set-points 1 s; both come back with the stream."""
    run = Run()
    hand = changed(WELL, autonomous=False, manual=True)
    assert run.step(changed(hand, manual_age_s=0.499)) is Action.NONE
    assert run.step(changed(hand, manual_age_s=0.5)) is Action.STOP
    assert run.step(changed(hand, manual_age_s=0.0)) is Action.NONE
    assert run.step(changed(WELL, guided_age_s=0.99)) is Action.NONE
    assert run.step(changed(WELL, guided_age_s=1.0)) is Action.HOLD
    assert run.step(changed(WELL, guided_age_s=0.0)) is Action.NONE


@pytest.mark.parametrize("age_s", [math.inf, math.nan])
def test_an_age_that_is_no_number_counts_as_lost(age_s):
    assert Run().step(changed(WELL, gcs_age_s=age_s)) is Action.HOLD


def test_conditions_of_a_vessel_under_way_do_not_hold_a_disarmed_one():
    idle = flags_of(
        position_lost=True, heading_lost=True, gcs_required=True, gcs_age_s=99.0, fence_breach=True, stuck=True
    )
    assert Run().step(changed(idle, autonomous=True)) is Action.NONE


def test_what_is_wrong_counts_disarmed_and_unheard_too():
    assert Run().step(flags_of(gcs_required=True, emergency_stop=True)) is Action.DISARM


def test_every_age_belongs_to_an_armed_vessel():
    old = flags_of(
        armed=True, gcs_required=True, gcs_age_s=99.0, radio_age_s=99.0, manual_age_s=99.0, guided_age_s=99.0
    )
    for row in TABLE:
        if row.age is not None:
            assert row.age(old) == 99.0
            assert row.age(changed(old, armed=False)) is None


def test_row_63_a_stuck_vessel_is_stopped_in_the_end():
    """Fault row 63: the monitor reports after 10 s of thrust without speed; neutral 10 s later."""
    run = Run()
    stuck = changed(WELL, stuck=True)
    assert run.step(stuck) is Action.WARN
    assert run.step(stuck, 9.99) is Action.WARN
    assert run.step(stuck, 0.01) is Action.STOP


def test_row_59_oscillation_cuts_thrust():
    """Fault row 59, second half: with the monitor's flag up, thrust is capped in the same tick."""
    run = Run()
    run.step(WELL)
    assert run.last.thrust_share == 1.0
    run.step(changed(WELL, oscillating=True))
    assert (run.last.action, run.last.thrust_share) == (Action.WARN, 0.3)


def test_row_64_emergency_stop_is_latched():
    """Fault row 64: same tick, whatever else goes on; only a re-arm with the cause gone ends it."""
    run = Run()
    assert run.step(changed(WELL, emergency_stop=True, manual=True)) is Action.DISARM
    assert run.step(changed(WELL, emergency_stop=True, operator_arm=True)) is Action.DISARM
    assert run.step(changed(WELL, operator_order=Order.GUIDED)) is Action.DISARM
    assert run.step(changed(WELL, operator_arm=True)) is Action.NONE


def test_termination_is_for_ever():
    run = Run()
    run.step(changed(WELL, terminate=True))
    assert run.step(changed(WELL, operator_arm=True, operator_order=Order.GUIDED, manual=True), 1e6) is Action.TERMINATE


def test_holding_names_what_arming_cannot_clear():
    run = Run()
    flags = changed(WELL, depth_locked=True, battery_low=True, overruns=True, actuator_lost=True)
    run.step(flags)
    run.step(flags, 9.0)
    assert holding(run.memory, CONFIG) == ("actuator_lost", "depth_locked")
    run.step(flags, 1.0)
    assert "overruns" in holding(run.memory, CONFIG), "after it has grown to STOP"
    run.step(changed(flags, actuator_lost=False))
    assert "actuator_lost" not in holding(run.memory, CONFIG)
    assert holding(FailsafeMemory(), CONFIG) == ()


def test_holding_passes_over_what_waits_and_what_was_taken_over():
    run = Run()
    flags = changed(WELL, battery_empty=True, depth_shallow=True)
    run.step(flags)
    assert holding(run.memory, CONFIG) == ("depth_shallow",)
    run.step(changed(flags, operator_order=Order.GUIDED))
    assert holding(run.memory, CONFIG) == ()


def test_an_order_is_barred_by_what_it_could_not_lift():
    run = Run()
    run.step(changed(WELL, heading_lost=True))
    assert barring(run.memory, run.now_us, CONFIG) == "heading lost"
    run.step(WELL, 1.0)
    run.step(WELL, 4.95)
    assert barring(run.memory, run.now_us, CONFIG) == "heading is back for 4 of 5 s", "not for long enough"
    run.step(WELL, 0.05)
    assert "heading_lost" in run.causes
    assert barring(run.memory, run.now_us, CONFIG) == "", "an order lifts it now"
    assert barring(FailsafeMemory(), 0, CONFIG) == ""


def _acting(row):
    """A vessel that the condition has stopped or holds."""
    run = Run()
    for after_s in (0.0, 60.0, 3600.0):
        run.step(raised(row.name), after_s)
    return run


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_manual_is_offered_only_where_it_is_obeyed_and_who_takes_it_is_told_where_it_is_not(row):
    """The actuator line was unreadable, Manual "is obeyed", and the sticks moved nothing."""
    run = _acting(row)
    barred = barring(run.memory, run.now_us, CONFIG, Order.AUTO, by_hand="Manual is obeyed")
    deaf = deaf_sticks(run.memory, CONFIG)
    held = run.step(changed(raised(row.name), manual=True)) >= Action.HOLD
    if "Manual is obeyed" in barred:
        assert not held
        assert deaf == ""
    elif barred and "arm again" not in barred:
        assert held
    if held and (row.clear is not Clear.GONE or row.clear_s):
        assert deaf.startswith("until ")


def test_what_only_a_new_arming_lifts_says_so():
    run = Run()
    run.step(changed(WELL, depth_locked=True))
    for flags in (changed(WELL, depth_locked=True), WELL):
        run.step(flags, 60.0)
        assert barring(run.memory, run.now_us, CONFIG) == "too shallow: locked, no manoeuvre: arm again first"


ORDERS = """
depth_shallow    Return Guided Auto Arm
fence_breach     Return Guided Auto
plan_invalid     Return Guided Auto
battery_empty    Return Guided
battery_critical Hold Bystander_Hold Return Guided
"""
"""Row, and the orders that go on in spite of its standing cause: written twice on purpose."""


def test_which_order_ends_which_standing_condition_is_what_was_agreed():
    agreed = {
        line.split()[0]: {Order[name.upper()] for name in line.split()[1:]} for line in ORDERS.strip().splitlines()
    }
    assert agreed == ENDS_STANDING
    assert {row.name for row in TABLE if row.takeover is Takeover.ORDER} == set(agreed)
    assert names("battery_critical") == "Hold or Return or a go-to"


@pytest.mark.parametrize("order", Order)
@pytest.mark.parametrize("name", ENDS_STANDING)
def test_an_order_goes_on_only_where_the_table_says_so(name, order):
    run = Run()
    flags = raised(name)
    run.step(flags)
    acting = run.step(flags, 6.0)
    bars = barring(run.memory, run.now_us, CONFIG, order)
    arms = order is Order.ARM
    after = run.step(changed(flags, operator_order=None if arms else order, operator_arm=arms))
    may = order in ENDS_STANDING[name]
    assert after is (Action.WARN if may else acting)
    assert bars == ("" if may or order is Order.HOLD else f"{BY_NAME[name].text}: order {names(name)}")
    assert barring(run.memory, run.now_us, CONFIG, Order.AUTO) == "" or not may
    assert barring(run.memory, run.now_us, CONFIG) == "", "a stream is no order"
    if not may:
        run.step(WELL)
        assert barring(run.memory, run.now_us, CONFIG, order) == "", "the cause is gone: the order ends it"


def test_a_warning_bars_no_order():
    run = Run(FailsafeConfig(conditions={"battery_critical": {"action": "WARN"}}))
    run.step(raised("battery_critical"))
    run.step(raised("battery_critical"), 6.0)
    assert "battery_critical" in run.causes
    assert barring(run.memory, run.now_us, run.config, Order.AUTO) == ""


def test_a_lost_station_bars_no_order_because_the_order_ends_the_silence():
    run = Run()
    run.step(raised("gcs_lost"))
    assert run.last.action is Action.HOLD
    assert barring(run.memory, run.now_us, CONFIG, Order.AUTO) == ""
    assert run.step(changed(WELL, gcs_age_s=0.0, operator_order=Order.AUTO)) is Action.WARN
    assert run.step(raised("gcs_lost"), 6.0) is Action.HOLD, "the timer starts anew"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("depth_shallow", "an operator takes over"),
        ("plan_invalid", "an operator takes over"),
        ("actuator_lost", "it disarms: modes are chosen before arming"),
        ("oscillating", "a warning"),
        ("manual_lost", "another mode needs no sticks"),
        ("guided_lost", "another mode needs no set-points"),
    ],
)
def test_what_an_order_lifts_or_need_not_does_not_bar(name, why):
    run = Run()
    run.step(WELL)
    run.step(raised(name), 2.0)
    assert name in run.causes
    assert barring(run.memory, run.now_us, CONFIG) == "", why


def test_a_condition_bars_when_it_acts_and_as_it_acts():
    run = Run(FailsafeConfig(conditions={"heading_lost": {"delay_s": 1.0}}))
    run.step(changed(WELL, heading_lost=True))
    assert barring(run.memory, run.now_us, run.config) == "", "its delay runs"
    run.step(changed(WELL, heading_lost=True), 1.0)
    assert barring(run.memory, run.now_us, run.config) == "heading lost"
    run = Run()
    run.step(changed(WELL, overruns=True))
    run.step(changed(WELL, overruns=True), 9.9)
    assert barring(run.memory, run.now_us, CONFIG) == "", "a warning as yet"
    run.step(changed(WELL, overruns=True), 0.1)
    assert barring(run.memory, run.now_us, CONFIG) == "control loop overloaded"
    run.step(WELL, 1.0)
    assert barring(run.memory, run.now_us, CONFIG) == "the control loop keeps its time for 0 of 10 s"


def test_a_fence_ahead_that_is_gone_bars_nothing():
    run = Run()
    run.step(changed(WELL, fence_ahead=True))
    assert barring(run.memory, run.now_us, CONFIG) == "fence ahead"
    run.step(WELL)
    assert barring(run.memory, run.now_us, CONFIG) == ""


def test_the_texts_say_what_is_done():
    def told(run):
        return [text for severity, text in run.texts if "station lost" in text]

    lost = raised("gcs_lost")
    by_hand = Run()
    by_hand.step(WELL)
    by_hand.step(changed(lost, manual=True, manual_age_s=0.1))
    by_hand.step(changed(lost, manual=True, manual_age_s=0.1), 60.0)
    assert told(by_hand) == ["Ground station lost"] * 2, "nothing is done about it while an operator steers"
    grown = Run()
    grown.step(WELL)
    grown.step(lost)
    grown.step(lost, 60.0)
    assert told(grown) == ["Ground station lost: HOLD", "Ground station lost: RETURN"]


# ---- configuration


def test_a_row_can_be_made_stricter_or_later_within_its_floor():
    config = FailsafeConfig(conditions={"fence_breach": {"action": "STOP", "delay_s": 0.5}})
    run = Run(config)
    outside = changed(WELL, fence_breach=True)
    assert run.step(outside) is Action.NONE
    assert run.step(outside, 0.5) is Action.STOP


@pytest.mark.parametrize(
    ("name", "over", "message"),
    [
        ("position_lost", {"action": Action.HOLD}, "position_lost.action = hold: must be at least stop"),
        ("position_lost", {"delay_s": 2.1}, "delay_s = 2.1: must be at most 2"),
        ("gcs_lost", {"delay_s": 7}, "own keys"),
        ("thruster_weak", {"action": Action.STOP}, "its own key, thruster_action"),
        ("gps", {"delay_s": 7}, "no such condition"),
        ("battery_low", {"action": "SINK"}, "must be one of none, warn|Input should be"),
        ("battery_low", {"action": []}, "must be one of none, warn|Input should be"),
    ],
)
def test_what_lies_below_a_floor_is_refused(name, over, message):
    with pytest.raises(ValueError, match=message):
        FailsafeConfig(conditions={name: over})


def test_a_floor_itself_is_allowed():
    config = FailsafeConfig(conditions={"position_lost": {"action": Action.STOP, "delay_s": 2.0}})
    assert Run(config).step(changed(WELL, position_lost=True)) is Action.NONE


def test_ground_loss_by_parameters():
    config = FailsafeConfig(gcs_timeout_s=2.0, gcs_action="return", gcs_then_action=Action.STOP, gcs_then_s=1.0)
    run = Run(config)
    assert run.step(changed(WELL, gcs_age_s=1.0)) is Action.WARN
    assert run.step(changed(WELL, gcs_age_s=2.0)) is Action.RETURN
    assert run.step(changed(WELL, gcs_age_s=3.0), 1.0) is Action.STOP
    config = FailsafeConfig(gcs_then_action=Action.NONE)
    run = Run(config)
    run.step(changed(WELL, gcs_age_s=5.0))
    assert run.step(changed(WELL, gcs_age_s=999.0), 999.0) is Action.HOLD, "no second action"
    run = Run(FailsafeConfig(gcs_action=Action.RETURN, gcs_then_action=Action.RETURN))
    run.step(changed(WELL, gcs_age_s=5.0))
    run.step(changed(WELL, gcs_age_s=99.0), 99.0)
    assert [text for _, text in run.texts].count("Ground station lost: RETURN") == 1


def test_an_age_is_compared_to_the_microsecond():
    assert not reached(4.999999, 5_000_000)
    assert reached(4.9999996, 5_000_000), "rounding, not cutting"
    assert reached(5e-7, 1)
    assert not reached(4.9e-7, 1)


def test_the_settings_have_these_defaults_and_ranges():
    schema = FailsafeConfig.model_json_schema()["properties"]
    fields = {name: field for name, field in schema.items() if "minimum" in field}
    assert {name: (field["default"], field["minimum"], field["maximum"]) for name, field in fields.items()} == {
        "gcs_timeout_s": (5.0, 2, 120),
        "gcs_then_s": (60.0, 0, 3600),
        "radio_timeout_s": (65.0, 5, 3600),
        "manual_timeout_s": (0.5, 0.1, 5),
        "guided_timeout_s": (1.0, 0.1, 5),
        "oscillation_thrust": (0.3, 0, 1),
    }


@pytest.mark.parametrize(("key", "allowed"), [("gcs_action", (1, 2, 3, 4)), ("gcs_then_action", (0, 1, 2, 3, 4))])
def test_the_actions_on_ground_loss_are_limited(key, allowed):
    for value in range(7):
        if value in allowed:
            assert getattr(FailsafeConfig(**{key: float(value)}), key) == value
        else:
            with pytest.raises(ValueError, match=key):
                FailsafeConfig(**{key: value})


# ---- the table


def test_the_table_is_sound():
    assert len(BY_NAME) == len(TABLE)
    for row in TABLE:
        assert (row.flag is None) != (row.age is None)
        assert row.floor <= row.action
        assert row.delay_s <= row.delay_max_s
        assert (row.then_after_s is None) == (row.then_action is Action.NONE)
        assert len(row.text) <= 46, "fits a status text with its action"


def test_every_alarm_has_a_row_and_every_row_its_cause():
    names = {row.name for row in TABLE if row.flag is not None}
    assert names == set(ALARMS)
    for row in TABLE:
        if row.flag is not None:
            assert not row.flag(WELL)
            assert row.flag(changed(WELL, **{row.name: True}))


def test_the_markdown_has_a_line_per_row():
    table = failsafe_table_markdown()
    assert table.count("\n") == len(TABLE) + 2
    assert "| `gcs_lost`: ground station lost | 5 | HOLD | RETURN after 60 s |" in table
    assert "for 5 s | manual control | STOP | 2 |" in table
    assert "| 30 | HOLD" in failsafe_table_markdown(FailsafeConfig(radio_timeout_s=30.0))


CONTRACT = """
terminate              TERMINATE 0    -            restart   0  never    TERMINATE 0
emergency_stop         DISARM    0    -            rearm     0  never    DISARM    0
aborted                DISARM    0    -            rearm     0  never    DISARM    0
time_jump              DISARM    0    -            rearm     0  never    STOP      0
task_failing           DISARM    0    -            rearm     0  never    STOP      0
actuator_lost          DISARM    0    -            rearm     0  never    STOP      0.2
actuator_reset         DISARM    0    -            rearm     0  never    STOP      0
actuator_mismatch      DISARM    0    -            rearm     0  never    STOP      0.5
actuator_garbage       STOP      0    -            gone      2  never    STOP      1
position_lost          STOP      0    -            operator  5  manual   STOP      2
heading_lost           STOP      0    -            operator  5  manual   STOP      2
depth_locked           STOP      0    -            rearm     0  manual   STOP      0
depth_shallow          STOP      0    -            operator  0  order    STOP      0
depth_ahead            STOP      0    -            operator  0  manual   HOLD      0
depth_braking          HOLD      0    -            operator  0  manual   HOLD      0
depth_blind            STOP      0    -            operator  0  manual   WARN      30
fence_ahead            HOLD      0    -            operator  0  manual   HOLD      0
fence_breach           HOLD      0    -            operator  0  order    WARN      0.5
manual_lost            STOP      0.5  -            gone      0  never    STOP      5
guided_lost            HOLD      1    -            gone      0  manual   HOLD      5
gcs_lost               HOLD      5    60:RETURN    operator  0  manual   WARN      120
radio_lost             HOLD      65   120:RETURN   operator  0  manual   WARN      3600
gcs_degraded           WARN      2.5  -            gone     30  never    WARN      120
tick_very_late         STOP      0    -            gone      10 never    STOP      0
overruns               WARN      0    10:STOP      gone      10 never    WARN      10
tick_late              WARN      0    -            gone      10 never    WARN      120
plan_invalid           HOLD      0    -            operator  0  order    HOLD      120
battery_empty          STOP      5    -            operator  0  order    WARN      30
battery_critical       RETURN    5    -            operator  0  order    WARN      60
battery_low            WARN      5    -            gone      5  never    WARN      120
battery_lost           WARN      1    -            gone      0  never    WARN      120
stuck                  WARN      0    10:STOP      acted     10 manual   WARN      120
moving_in_neutral      WARN      0    -            gone      0  never    WARN      120
drifting_while_stopped WARN      0    -            gone      0  never    WARN      120
oscillating            WARN      0    -            gone      0  never    WARN      120
thruster_reversed      STOP      0    -            operator  0  manual   WARN      120
thruster_alone         STOP      0    -            operator  0  manual   WARN      120
thruster_weak          WARN      0    -            acted     10 never    WARN      120
person_in_water        WARN      0    -            gone      5  never    WARN      120
traffic_close          WARN      0    -            gone      5  never    WARN      120
traffic_lost           WARN      0    -            gone      5  never    WARN      120
ais_lost               WARN      0    -            gone      5  never    WARN      120
depth_lost             WARN      0    -            gone      2  never    WARN      120
position_frozen        WARN      0    -            gone      0  never    WARN      120
sources_disagree       WARN      0    -            gone      0  never    WARN      120
actuator_noise         WARN      0    -            gone      2  never    WARN      120
storage_fault          WARN      0    -            gone      0  never    WARN      120
"""
"""name, action, delay, later action, clears, for, takeover, least action, longest delay: written twice on purpose."""


def test_the_table_says_what_was_agreed():
    agreed = [line.split() for line in CONTRACT.strip().splitlines()]
    assert [
        [
            row.name,
            row.action.name,
            f"{row.delay_s:g}",
            "-" if row.then_after_s is None else f"{row.then_after_s:g}:{row.then_action.name}",
            row.clear.name.lower(),
            f"{row.clear_s:g}",
            row.takeover.name.lower(),
            row.floor.name,
            f"{row.delay_max_s:g}",
        ]
        for row in TABLE
    ] == agreed


def test_the_defaults_of_the_parameters_are_the_tables():
    for rule in CONFIG.rules:
        assert rule.delay_us == round(rule.row.delay_s * 1e6)
        assert rule.then_us == (None if rule.row.then_after_s is None else round(rule.row.then_after_s * 1e6))


def test_the_radio_counts_only_armed_and_required():
    for flags in (changed(WELL, armed=False), changed(WELL, gcs_required=False)):
        run = Run()
        assert run.step(changed(flags, gcs_age_s=None, radio_age_s=1e4)) is Action.NONE


@pytest.mark.parametrize("action", [Action.WARN, Action.HOLD, Action.RETURN, Action.STOP])
def test_a_weak_thruster_does_what_its_parameter_says(action):
    run = Run(FailsafeConfig(thruster_action=action))
    assert run.step(raised("thruster_weak")) is action


@pytest.mark.parametrize("action", [Action.NONE, Action.DISARM])
def test_a_weak_thruster_is_never_passed_over_and_never_disarms(action):
    with pytest.raises(ValueError, match="thruster_action"):
        FailsafeConfig(thruster_action=action)


SILENT = changed(WELL, gcs_age_s=100.0)


@pytest.mark.parametrize("name", ["position_lost", "heading_lost", "depth_blind"])
def test_a_stop_whose_cause_is_gone_does_not_wait_for_an_order_that_nobody_can_give(name):
    """GNSS, or a sounder, was away for some seconds on the way home of a boat without a station: adrift for good."""
    run = Run()
    run.step(SILENT)
    assert run.step(SILENT, 61.0) is Action.RETURN
    assert run.step(changed(SILENT, **{name: True})) is Action.STOP
    assert run.step(SILENT, 1.0) is Action.STOP
    assert run.step(SILENT, 9.9) is Action.STOP, "not steadily gone"
    assert run.step(SILENT, 0.2) is Action.RETURN
    assert f"Over: {BY_NAME[name].text}" in [text for _, text in run.texts]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_what_ends_without_an_order_is_a_sense_that_is_back(row):
    assert row.ends_alone == (row.name in ("position_lost", "heading_lost", "depth_blind"))


@pytest.mark.parametrize("over", ["gcs_age_s", "radio_age_s"])
@pytest.mark.parametrize("action", [Action.WARN, Action.HOLD, Action.RETURN])
def test_nobody_can_order_either_where_the_return_is_the_first_action(over, action):
    """With a return at once the stop for a GNSS blip was for good: the second action was asked for, and there is none."""
    run = Run(FailsafeConfig(gcs_action=action))
    silent = changed(WELL, **{"gcs_age_s": None, over: 100.0})
    run.step(silent)
    assert run.step(silent, 121.0) is Action.RETURN
    assert run.step(changed(silent, position_lost=True)) is Action.STOP
    run.step(silent)
    assert run.step(silent, 9.9) is Action.STOP
    assert run.step(silent, 0.2) is Action.RETURN


def test_a_station_that_stops_the_boat_by_its_silence_ends_no_stop():
    run = Run(FailsafeConfig(gcs_action=Action.STOP))
    run.step(SILENT)
    run.step(changed(SILENT, position_lost=True))
    run.step(SILENT)
    assert run.step(SILENT, 600.0) is Action.STOP
    assert "position_lost" in run.causes


def test_a_sensor_that_is_lost_again_and_again_ends_no_stop_any_more():
    """A compass that was truly wrong, and a place that was spoofed, were believed anew each minute: 1200 m in 20 minutes."""
    run = Run()
    run.step(SILENT)
    assert run.step(SILENT, 61.0) is Action.RETURN
    for wait_s in (10.0, 20.0, 40.0):
        assert run.step(changed(SILENT, position_lost=True), 5.0) is Action.STOP
        run.step(SILENT)
        assert run.step(SILENT, wait_s - 0.1) is Action.STOP
        assert run.step(SILENT, 0.2) is Action.RETURN
    run.step(changed(SILENT, position_lost=True), 5.0)
    run.step(SILENT)
    assert run.step(SILENT, 600.0) is Action.STOP
    # an order from a station that is back begins anew
    run.step(changed(WELL, operator_order=Order.RETURN))
    assert run.causes == ("gcs_degraded",)


def an_hour_of_outages(away_s, every_s):
    """A silent station and a position that is away for a while again and again: share of the time that she returns, and its last."""
    run, returns, last_s = Run(), 0, 0
    run.step(SILENT)
    run.step(SILENT, 61.0)
    for second in range(3600):
        if run.step(changed(SILENT, position_lost=second % every_s < away_s), 1.0) is Action.RETURN:
            returns, last_s = returns + 1, second
    return returns / 3600.0, last_s


@pytest.mark.parametrize(("every_s", "least"), [(120, 0.1), (200, 0.4), (300, 0.8), (600, 0.9)])
def test_a_sensor_that_is_sound_but_for_a_second_at_times_is_not_the_end_of_the_way_home(every_s, least):
    """By the fourth bridge, or the fourth second without fix in a night at the pier, she was cast adrift."""
    share, last_s = an_hour_of_outages(1, every_s)
    assert share >= least
    assert last_s > 3600 - 2 * 600


@pytest.mark.parametrize("heard_each_s", [30, 60, 300])
def test_a_station_that_is_heard_for_a_moment_gives_no_order(heard_each_s):
    """With one heartbeat a minute a place that was lost again and again was returned by 118 times in an hour, for 3 without."""
    run, began, before = Run(), 0, Action.NONE
    for second in range(3600):
        heard = changed(SILENT, gcs_age_s=0.0 if second % heard_each_s == 0 else float(second % heard_each_s))
        action = run.step(changed(heard, position_lost=second % 30 < 3), 1.0)
        began += before is Action.STOP and action is Action.RETURN
        before = action
    assert began <= 3


@pytest.mark.parametrize(("away_s", "every_s"), [(8, 25), (1, 15), (20, 50)])
def test_a_sensor_that_is_never_soundly_back_meets_the_limit(away_s, every_s):
    share, last_s = an_hour_of_outages(away_s, every_s)
    assert share < 0.01
    assert last_s < 300


def test_an_end_is_forgotten_after_ten_minutes_of_sound_time():
    run = Run()
    run.step(SILENT)
    run.step(SILENT, 61.0)
    for wait_s in (10.1, 20.1, 40.1):
        assert run.step(changed(SILENT, position_lost=True), 5.0) is Action.STOP
        run.step(SILENT)
        assert run.step(SILENT, wait_s) is Action.RETURN
    run.step(changed(SILENT, position_lost=True), 5.0)
    run.step(SILENT)
    assert run.step(SILENT, 630.0) is Action.STOP
    assert run.step(SILENT, 12.0) is Action.RETURN


def test_somebody_who_holds_the_boat_from_the_page_is_there_to_order():
    run = Run()
    run.step(SILENT)
    run.step(SILENT, 61.0)
    run.step(changed(SILENT, operator_order=Order.BYSTANDER_HOLD))
    run.step(changed(SILENT, position_lost=True))
    run.step(SILENT)
    assert run.step(SILENT, 600.0) is Action.STOP


def test_a_hold_on_the_page_leaves_a_stopped_boat_stopped_and_a_stations_hold_does_not():
    run = Run()
    assert run.step(changed(WELL, position_lost=True), 5.0) is Action.STOP
    run.step(WELL)
    run.step(WELL, 11.0)
    run.step(changed(WELL, operator_order=Order.BYSTANDER_HOLD))
    assert run.step(WELL, 1.0) is Action.STOP
    assert stopped_by(run.memory, CONFIG) == "position lost"
    run.step(changed(WELL, operator_order=Order.HOLD))
    assert run.step(WELL, 1.0) is Action.NONE
    assert stopped_by(run.memory, CONFIG) == ""


def test_a_boat_that_is_let_drift_in_manual_is_not_held_but_brought_home():
    idle = changed(WELL, autonomous=False, manual_idle=True)
    run = Run()
    assert run.step(changed(idle, fence_breach=True)) is Action.WARN
    run = Run()
    assert run.step(changed(idle, gcs_age_s=100.0)) is Action.WARN
    assert run.step(changed(idle, gcs_age_s=100.0), 61.0) is Action.RETURN
    assert "Ground station lost" in [text for _, text in run.texts]


def by_hand(sticks_s, station_s):
    """Flags of Manual in which sticks were heard so long ago, and the station."""
    return changed(WELL, autonomous=False, manual=sticks_s < 0.5, manual_age_s=sticks_s, gcs_age_s=station_s)


def let_go(config=CONFIG, until_s=80.0, steers_s=0.0):
    """By hand, then station and sticks are silent, the sticks some time later: what is done at each half second."""
    run, found = Run(config), []
    for half in range(round(2.0 * until_s)):
        silent_s = 0.5 * half
        found.append(run.step(by_hand(max(silent_s - steers_s, 0.1), silent_s), 0.5))
        if found[-1] is Action.RETURN:
            break
    return run, found


@pytest.mark.parametrize("then_s", [0.0, 20.0, 60.0, 600.0])
def test_sticks_and_station_that_fall_silent_together_are_nobodys_hand(then_s):
    """A laptop that died under the steering hand: stopped for good, and set 126 m farther out in 400 s."""
    run, found = let_go(FailsafeConfig(gcs_then_s=then_s), 5.0 + then_s + 20.0)
    assert found[-1] is Action.RETURN
    assert {*found[2:-1]} == {Action.STOP}
    assert len(found) * 0.5 == pytest.approx(max(5.0 + then_s, 10.5), abs=1.0)
    texts, ahead = [text for _, text in run.texts], [text for text in run.foretold if "RETURN in" in text]
    assert "Ground station lost (stopped: manual control lost)" in texts
    assert ahead, "told before"
    if then_s > 10.0:
        assert ahead == [
            f"RETURN in {then_s:g} s; until ground station is back, then order Auto",
            "RETURN in 10 s: ground station lost",
        ]
        assert "Ground station lost: RETURN" in texts


@pytest.mark.parametrize("steers_s", [62.0, 64.0, 300.0])
def test_a_hand_that_lets_go_long_after_the_station_fell_silent_is_told_of_the_return_too(steers_s):
    run, found = let_go(until_s=steers_s + 20.0, steers_s=steers_s)
    assert found[-1] is Action.RETURN
    assert len(found) * 0.5 == pytest.approx(steers_s + 10.5, abs=1.0)
    assert [text for text in run.foretold if text.startswith("RETURN in")]


def test_a_stick_that_is_heard_again_is_obeyed_and_a_link_with_bad_moments_is_not_taken_from_the_hand():
    run = Run()
    for beat in range(400):
        action = run.step(by_hand(float(beat % 9) or 0.1, float(beat)), 1.0)
        assert (action is Action.STOP) == (beat % 9 > 0), "obeyed whenever a stick is heard"


def test_sticks_alone_that_are_silent_bring_nobody_home():
    run = Run()
    for second in range(600):
        run.step(by_hand(float(second), 0.1), 1.0)
    assert run.last.action is Action.STOP


def test_with_a_station_it_waits():
    run = Run()
    run.step(changed(WELL, position_lost=True))
    run.step(WELL)
    assert run.step(WELL, 600.0) is Action.STOP


def test_what_is_told_of_one_condition_is_what_the_worst_one_does():
    """ "Ground station lost: RETURN" was told of a boat that lay stopped, and an order that was then refused."""
    run = Run()
    stopped = changed(WELL, position_lost=True)
    run.step(stopped)
    run.texts.clear()
    run.foretold.clear()
    run.step(changed(stopped, gcs_age_s=100.0))
    run.step(changed(stopped, gcs_age_s=100.0), 61.0)
    assert [text for _, text in run.texts if "lost" in text] == ["Ground station lost (stopped: position lost)"] * 2
    assert run.foretold == []
    run.step(stopped)
    run.step(stopped, 11.0)
    assert run.texts[-1][1] == "Ground station is back (stopped: position lost)"


@pytest.mark.parametrize(
    "name", ["depth_ahead", "depth_blind", "fence_ahead", "fence_breach", "battery_critical", "battery_empty"]
)
def test_a_boat_that_was_disarmed_is_not_told_that_all_is_well_and_armed_again_it_is_told_anew(name):
    """ "The boat is inside the fence again: holding" was told 35 m outside, disarmed; and nothing when she was armed there again."""
    run, cause = Run(), raised(name)
    run.step(cause)
    run.step(cause, 10.0)
    told = len(run.texts)
    off = changed(cause, armed=False)
    run.step(off)
    run.step(off, 30.0)
    assert len(run.texts) == told
    run.step(changed(cause, operator_arm=True))
    run.step(cause, 10.0)
    assert len(run.texts) == told + 1


def test_a_plan_that_nobody_sails_has_not_shown_that_it_can_go_on():
    run, cause = Run(), raised("plan_invalid")
    run.step(cause)
    told = len(run.texts)
    off = changed(WELL, armed=False)
    run.step(off)
    run.step(off, 30.0)
    assert len(run.texts) == told, "sailed by nobody, it is judged by nobody"
    run.step(changed(cause, operator_arm=True))
    assert len(run.texts) == told + 1


@pytest.mark.parametrize("name", ["gcs_lost", "radio_lost"])
def test_a_silent_station_is_not_back_because_the_boat_was_disarmed(name):
    run, cause = Run(), raised(name)
    run.step(cause)
    told = [text for _, text in run.texts]
    off = changed(cause, armed=False)
    run.step(off)
    run.step(off, 30.0)
    assert [text for _, text in run.texts] == told


def test_a_return_begins_again_when_the_fence_has_let_go():
    run, critical = Run(), changed(WELL, battery_critical=True)
    run.step(critical)
    assert run.step(critical, 6.0) is Action.RETURN
    assert run.step(changed(critical, fence_ahead=True)) is Action.HOLD
    assert run.foretold[-1] == "Until no fence is ahead, then returning"
    assert run.step(critical, 4.0) is Action.HOLD, "the way is not off yet"
    assert run.step(critical, 2.0) is Action.HOLD
    assert run.step(critical, 3.0) is Action.RETURN
    assert run.step(changed(critical, return_shut_off=True), 60.0) is Action.HOLD
    assert run.step(changed(critical, fence_ahead=True)) is Action.HOLD
    run.step(critical)
    assert run.step(critical, 9.0) is Action.HOLD, "stopped again, she tries again later"
    assert run.step(critical, 2.0) is Action.RETURN


@pytest.mark.parametrize("every_s", [1.0, 5.0, 20.0, 60.0, 200.0])
def test_a_flicker_of_the_fence_in_hold_does_not_put_off_the_return(every_s):
    """Twenty minutes near an edge in gusts, and a boat with a good way inward was not brought home in the half hour after."""
    run = Run()
    for _ in range(round(1200.0 / every_s)):
        assert run.step(changed(WELL, fence_ahead=True), 0.5) is Action.HOLD
        run.step(WELL, every_s - 0.5)
    critical = changed(WELL, battery_critical=True)
    run.step(critical, 0.1)
    assert run.step(critical, 5.0) is Action.RETURN
    assert run.step(changed(critical, fence_ahead=True), 60.0) is Action.HOLD
    run.step(critical, 0.1)
    assert run.step(changed(critical, fence_ahead=True), 4.0) is Action.HOLD
    assert run.step(critical, 0.8) is Action.HOLD, "she rests, once stopped on her way"
    assert run.step(critical, 0.3) is Action.RETURN, "and a flicker meanwhile does not begin that anew"


def test_each_return_that_the_fence_breaks_off_waits_longer_and_a_stop_is_forgotten_in_time():
    run, critical = Run(), changed(WELL, battery_critical=True)
    run.step(critical)
    run.step(critical, 6.0)

    def waits_s():
        assert run.step(changed(critical, fence_ahead=True), 1.0) is Action.HOLD
        run.step(critical)
        waited_s = 0
        while run.step(critical, 1.0) is Action.HOLD:
            waited_s += 1
        return waited_s + 1

    assert [waits_s() for _ in range(6)] == [5, 10, 20, 40, 80, 160]
    assert max(waits_s() for _ in range(10)) <= 300, "no return waits for longer than it takes to forget a stop"
    run.step(critical, 2400.0)
    assert waits_s() == 5


def test_a_return_by_order_goes_on_as_the_failsafes_own_when_the_fence_has_let_go():
    """Three seconds after "Return to home" she was held, turning about, and lay there for good."""
    run, ordered = Run(), changed(WELL, return_ordered=True, resume="Return")
    run.step(changed(ordered, operator_order=Order.RETURN))
    held = changed(WELL, resume="Return")
    for wait_s in (5.0, 10.0, 20.0):
        assert run.step(changed(held, fence_ahead=True, return_ordered=wait_s == 5.0)) is Action.HOLD
        assert run.foretold[-1] == "Until no fence is ahead, then returning"
        run.step(held)
        assert run.step(held, wait_s - 0.1) is Action.HOLD
        assert run.step(held, 0.2) is Action.RETURN
    assert run.step(changed(held, gcs_age_s=100.0)) is Action.RETURN, "she is on her way"
    assert not any("to go on" in text for text in told(run))
    run.step(changed(held, fence_ahead=True))
    run.step(held)
    assert run.step(held, 60.0) is Action.HOLD, "each stop may set her out"
    assert "No fence is ahead: holding: order Return to go on" in told(run)


def test_a_return_by_order_waits_before_a_fence_that_shuts_it_off():
    run, flags = Run(), changed(WELL, return_ordered=True, return_shut_off=True, resume="Return")
    run.step(changed(flags, fence_ahead=True))
    assert told(run)[-1] == ACROSS
    flags = changed(flags, return_ordered=False)
    assert run.step(flags, 60.0) is Action.HOLD
    assert run.step(changed(flags, return_shut_off=False), 60.0) is Action.RETURN
    assert run.step(changed(flags, operator_order=Order.HOLD)) is Action.NONE


@pytest.mark.parametrize(
    "stopped",
    [
        {"operator_order": Order.HOLD, "fence_ahead": True},
        {"armed": False},
        {"plan_invalid": True},
        {"position_lost": True},
        {"fence_breach": True},
    ],
)
def test_a_return_by_order_that_something_else_has_ended_does_not_go_on(stopped):
    run, fence = Run(), changed(WELL, fence_ahead=True)
    run.step(changed(fence, return_ordered=True))
    run.step(fence)
    run.step(changed(WELL, **stopped))
    run.step(changed(WELL, **stopped), 1.0)
    for _ in range(10):
        assert run.step(WELL, 5.0) is not Action.RETURN


ACROSS = "Fence across the way back: holding: order a go-to round it, or change the fence"


def told(run):
    return [text for _, text in run.texts]


def test_a_way_back_that_the_fence_shuts_off_is_told_with_what_clears_it():
    """ "No fence is ahead: holding: order Return to go on" was told 2 m before it, and who obeyed was stopped again, six times."""
    run, critical = Run(), changed(WELL, battery_critical=True, resume="Return")
    run.step(critical)
    run.step(critical, 6.0)
    run.foretold.clear()
    run.step(changed(critical, fence_ahead=True, return_shut_off=True))
    assert told(run)[-2:] == ["Fence ahead: HOLD", ACROSS]
    assert run.foretold == [], "it is not over when no fence is ahead"
    run.step(changed(critical, return_shut_off=True))
    run.step(changed(critical, return_shut_off=True), 11.0)
    assert told(run)[-1] == ACROSS
    assert not any("to go on" in text for text in told(run))
    run.step(changed(critical, return_shut_off=True, gcs_age_s=100.0))
    run.step(changed(critical, return_shut_off=True, gcs_age_s=161.0), 61.0)
    assert told(run)[-2:] == ["Ground station lost (holding: fence ahead)", ACROSS]


def test_a_plan_that_the_fence_stops_waits_for_its_order_wherever_home_is():
    run = Run()
    flags = changed(WELL, return_shut_off=True, resume="Auto")
    run.step(changed(flags, fence_ahead=True))
    run.step(flags)
    run.step(flags, 11.0)
    assert told(run)[-1] == "No fence is ahead: holding: order Auto to go on"


def test_a_return_that_goes_on_by_itself_asks_for_no_order_and_says_when():
    run, critical = Run(), changed(WELL, battery_critical=True, resume="Return")
    run.step(critical)
    run.step(critical, 6.0)
    for wait_s in (5.0, 10.0, 20.0):
        run.step(changed(critical, fence_ahead=True))
        run.step(critical)
        assert run.step(critical, min(wait_s - 0.1, 10.0)) is Action.HOLD
        said = told(run)[-1]
        assert run.step(critical, wait_s - 9.9 if wait_s > 10.0 else 0.2) is Action.RETURN
    assert said == "No fence is ahead: holding: returning in 10 s"
    assert not any("to go on" in text for text in told(run))


def test_a_stop_that_ends_by_itself_asks_for_no_order_and_says_when():
    """ "Position is back: stopped: order Return to go on" was told to a station that was silent, some seconds before it went on."""
    run = Run()
    silent = changed(SILENT, resume="Return")
    run.step(silent)
    run.step(silent, 61.0)
    run.foretold.clear()
    ahead = []
    for wait_s in (10.0, 20.0, 40.0, 650.0):
        run.step(changed(silent, position_lost=True))
        run.step(silent)
        run.step(silent, 10.0)
        ahead.append(told(run)[-1])
        assert run.step(silent, wait_s - 9.9) is Action.RETURN
    assert run.foretold == ["Until position is back, then returning"] * 4
    assert ahead[1:3] == [f"Position is back: stopped: returning in {left_s} s" for left_s in (10, 30)]
    assert re.fullmatch("Position is back: stopped: returning in 6[0-9][0-9] s", ahead[3])
    assert not any("to go on" in text for text in told(run))
