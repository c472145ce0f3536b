"""A text that crosses the radio keeps the order by which it is cleared, whatever its length."""

from __future__ import annotations

import pytest

from companion.core.guard.failsafe_row import Clear
from companion.core.guard.failsafe_table import TABLE
from companion.core.guard.failsafe_words import BACK, capital, until
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.radio.words import Waiting, crosses, fitted, shortened

FRAME = 50
"""Bytes of a text in a frame."""


@pytest.mark.parametrize("resume", ["", "Auto", "Manual", "Guided", "Return"])
@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_every_foretelling_crosses_with_the_order_that_clears_it(row, resume):
    end = until(row, resume)
    for begin in ("RETURN in 57 s; ", "DISARM in 600 s; ", "Holding: "):
        text = begin + end
        sent = fitted(text, FRAME).decode()
        assert len(sent.encode()) <= FRAME
        assert sent.startswith(begin[:5])
        for order in (f"then order {resume or 'Auto'}", "then arm again"):
            assert (order in sent) == (order in text)


def test_no_character_is_cut_in_half():
    assert fitted("ü" * 40, 51).decode() == "ü" * 25
    assert fitted("short", 50) == b"short"
    assert fitted("x" * 60 + ", then order Auto", 50).endswith(b".. then order Auto")


def test_warnings_cross_and_the_order_that_a_held_boat_waits_for():
    assert crosses(Severity.WARNING, "Actuator board is silent")
    assert not crosses(Severity.NOTICE, "the voyage goes on")
    assert not crosses(Severity.INFO, "Nothing stands against arming: disarmed: arm again to go on")
    for row in TABLE:
        if row.clear in (Clear.OPERATOR, Clear.ACTED):
            assert crosses(Severity.INFO, f"{capital(BACK[row.name])}: holding: order Auto to go on")


def test_a_text_that_waits_already_is_not_put_in_twice():
    waiting = Waiting()
    for _ in range(3):
        waiting.put(Severity.CRITICAL, "Actuator board is silent")
    assert len(waiting) == 1


def test_of_texts_that_wait_the_gravest_goes_first_and_the_mildest_is_given_up():
    waiting = Waiting()
    for severity, text in [(4, "a"), (6, "b"), (2, "c"), (4, "d"), (0, "e"), (6, "f")]:
        waiting.put(Severity(severity), text)
    assert [waiting.take(50)[1] for _ in range(len(waiting))] == [b"e", b"c", b"a", b"d"]
    with pytest.raises(ValueError, match="empty"):
        waiting.take(50)


@pytest.mark.parametrize(
    ("text", "most", "sent"),
    [
        ("item 2 is 40 m outside the fence; FENCE_ENABLE=0 insists", 40, "item 2 is 40 m outside the fence"),
        (
            "Plan: item 1 is 40 m outside the fence; it will not be started",
            50,
            "Plan: item 1 is 40 m outside the fence",
        ),
        ("item 1: 40.0 m/s is more than the vessel's 3.1 m/s", 40, "item 1: 40.0 m/s is more than the"),
        ("terminated: restart first", 40, "terminated: restart first"),
        ("x" * 60, 40, "x" * 40),
        ("no, " + "y" * 60, 40, "no, " + "y" * 36),
    ],
)
def test_what_has_no_room_ends_with_a_part_of_the_sentence_or_a_word(text, most, sent):
    assert shortened(text, most).decode() == sent


def test_what_fits_to_its_last_byte_is_whole_and_a_word_that_just_fits_stays():
    assert shortened("a" * 40, 40) == b"a" * 40
    assert shortened("holding here until further notice comes along", 33) == b"holding here until further notice"
