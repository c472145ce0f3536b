"""The failsafe engine at its edges: clocks to the microsecond, what is foretold and how loudly, and what is not said."""

from __future__ import annotations

import pytest

from companion.core.guard.failsafe import SOON_US, Entry, clock_us
from companion.core.guard.failsafe_flags import changed
from companion.core.guard.failsafe_row import Clear
from companion.core.guard.failsafe_table import BY_NAME, TABLE
from companion.core.guard.failsafe_words import capital, until
from mavlink_bridge.language.messages import Action, Severity
from tests.unit.test_failsafe import WELL, Run, raised

GROWS = [row for row in TABLE if row.then_after_s is not None]


def fired(row, **flags):
    """The row has just acted; the texts of that step."""
    run = Run()
    run.step(changed(WELL, **flags))
    run.step(raised(row.name, changed(WELL, **flags)))
    texts = list(run.last.texts)
    if row.age is None and row.delay_s:
        run.step(raised(row.name, changed(WELL, **flags)), row.delay_s)
        texts = list(run.last.texts)
    assert row.name in run.causes
    return run, texts


def is_of(row, text):
    """Whether a text says that the row acts."""
    return text.lower().startswith(row.text.lower())


def test_a_clock_that_stands_shows_what_it_came_to():
    assert clock_us(Entry(0, fired_us=1, gone_us=5, stood_us=7, stands_us=1), 9) == 7
    assert clock_us(Entry(0, fired_us=1, stood_us=7, stands_us=4), 9) == 12


def test_silence_that_another_link_had_hidden_counts_from_where_that_one_fell_silent():
    run = Run()
    run.step(WELL, 1000.0)
    run.step(changed(WELL, gcs_age_s=5.1))
    run.step(changed(WELL, gcs_age_s=15.1), 10.0)
    run.step(changed(WELL, gcs_age_s=0.1), 0.1)
    assert run.step(changed(WELL, gcs_age_s=50.0), 2.0) is Action.HOLD, "12 s of 60, not 60"
    assert run.step(changed(WELL, gcs_age_s=97.0), 47.0) is Action.HOLD
    assert run.step(changed(WELL, gcs_age_s=98.5), 1.5) is Action.RETURN


@pytest.mark.parametrize("row", GROWS, ids=lambda row: row.name)
def test_the_second_action_is_foretold_ten_seconds_ahead_and_once(row):
    run, _ = fired(row)
    soon = f"{row.then_action.name} in {SOON_US // 1_000_000} s: {row.text}"
    wait_s = row.then_after_s - SOON_US * 1e-6

    def told(after_s):
        run.step(raised(row.name), after_s)
        return [text for _, text in run.last.texts if text == soon]

    if wait_s > 0.0:
        assert told(wait_s - 1e-6) == []
        assert told(1e-6) == [soon]
    assert told(1e-6) in ([], [soon])
    assert told(1.0) == []


@pytest.mark.parametrize("row", GROWS, ids=lambda row: row.name)
def test_an_action_is_as_severe_as_its_row_and_what_it_grows_to_is_critical(row):
    run, texts = fired(row)
    assert [severity for severity, text in texts if is_of(row, text)] == [row.severity]
    run.step(raised(row.name), row.then_after_s)
    assert [severity for severity, text in run.last.texts if is_of(row, text)] == [Severity.CRITICAL]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_what_ends_an_action_is_told_where_there_is_an_action_to_end(row):
    _, texts = fired(row)
    end = until(row, "")
    others = [text for _, text in texts if not any(is_of(each, text) for each in TABLE)]
    assert all(text for _, text in texts), "no empty line"
    if row.then_after_s is not None:
        assert len(others) == 1
        assert others[0].startswith(f"{row.then_action.name} in {row.then_after_s:g} s")
    else:
        does = row.action > Action.WARN or row.clear is not Clear.GONE
        assert others == ([capital(end)] if does and end else [])


def test_a_warning_that_an_operator_steers_through_foretells_nothing():
    row = BY_NAME["gcs_lost"]
    _, texts = fired(row, manual=True)
    assert [text for _, text in texts if not any(is_of(each, text) for each in TABLE)] == []
