"""Truths about the failsafe engine for any history of flags."""

from __future__ import annotations

from hypothesis import given, settings, strategies as st

from companion.core.guard.failsafe import FailsafeConfig, FailsafeMemory, Flags, judge, step
from companion.core.guard.failsafe_flags import ALARMS, HOME, changed, flags_of, now as content_of
from companion.core.guard.failsafe_row import Clear
from companion.core.guard.failsafe_table import BY_NAME, TABLE
from mavlink_bridge.language.messages import Action

BOOLS = [name for name in HOME if isinstance(content_of(Flags(), name), bool)]
AGES = [name for name in HOME if not isinstance(content_of(Flags(), name), bool | str)]
CONFIG = FailsafeConfig()


@st.composite
def some_flags(draw: st.DrawFn) -> Flags:
    up = draw(st.sets(st.sampled_from(BOOLS), max_size=4))
    ages = draw(st.dictionaries(st.sampled_from(AGES), st.sampled_from([0.0, 0.4, 1.2, 3.0, 6.0, 70.0]), max_size=3))
    resume = draw(st.sampled_from(["", "Hold", "Auto", "Return", "Guided"]))
    return flags_of(armed=draw(st.booleans()), resume=resume, **{name: True for name in up if name != "armed"}, **ages)


HISTORY = st.lists(st.tuples(some_flags(), st.sampled_from([0, 50_000, 1_000_000, 6_000_000, 70_000_000])), max_size=15)


@settings(max_examples=150, deadline=None)
@given(HISTORY)
def test_the_short_cut_changes_nothing(history):
    quick = slow = FailsafeMemory()
    now = 0
    for flags, dt in history:
        now += dt
        fast, full = step(quick, flags, now, CONFIG), judge(slow, flags, now, CONFIG)
        assert (fast.action, fast.causes, fast.texts, fast.thrust_share) == (
            full.action,
            full.causes,
            full.texts,
            full.thrust_share,
        )
        assert dict(fast.memory.entries) == dict(full.memory.entries)
        assert fast.memory.required_since_us == full.memory.required_since_us
        quick, slow = fast.memory, full.memory


@settings(max_examples=150, deadline=None)
@given(HISTORY)
def test_the_engine_is_pure_and_consistent(history):
    memory, now = FailsafeMemory(), 0
    terminated = False
    for flags, dt in history:
        now += dt
        before = dict(memory.entries)
        result = step(memory, flags, now, CONFIG)
        assert step(memory, flags, now, CONFIG) == result
        assert dict(memory.entries) == before, "the memory handed in is untouched"
        assert set(result.causes) <= set(result.memory.entries)
        assert list(result.causes) == [row.name for row in TABLE if row.name in result.causes]
        assert (result.action is Action.NONE) == (not result.causes)
        terminated = terminated or flags.stop.terminate
        if terminated:
            assert result.action is Action.TERMINATE
        if flags.board.emergency_stop:
            assert result.action >= Action.DISARM
        memory = result.memory


@settings(max_examples=100, deadline=None)
@given(HISTORY)
def test_with_every_cause_gone_and_an_operator_all_but_termination_clears(history):
    memory, now = FailsafeMemory(), 0
    for flags, dt in history:
        now += dt
        memory = step(memory, flags, now, CONFIG).memory
    well = flags_of(armed=True, autonomous=True, gcs_required=True, gcs_age_s=0.0, radio_age_s=0.0)
    for dt in (0, 40_000_000):  # longer than any row waits until it lets go
        now += dt
        memory = step(memory, well, now, CONFIG).memory
    result = step(memory, changed(well, operator_arm=True), now, CONFIG)
    assert all(BY_NAME[name].clear is Clear.RESTART for name in result.causes)


@settings(max_examples=100, deadline=None)
@given(HISTORY, st.sampled_from(ALARMS))
def test_one_more_cause_never_makes_the_action_weaker(history, name):
    memory, now = FailsafeMemory(), 0
    for flags, dt in history:
        now += dt
        alone = step(memory, flags, now, CONFIG)
        more = step(memory, changed(flags, **{name: True}), now, CONFIG)
        # A cause that stands keeps an entry that would clear; it never weakens what the others ask.
        assert more.action >= alone.action
        memory = alone.memory
