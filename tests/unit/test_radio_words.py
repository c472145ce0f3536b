"""A text that crosses the radio keeps the order by which it is cleared, whatever its length."""

from __future__ import annotations

import pytest

from companion.core.guard.failsafe_row import Clear
from companion.core.guard.failsafe_table import TABLE
from companion.core.guard.failsafe_words import BACK, capital, until
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.radio.words import Waiting, crosses, fitted

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


def test_of_texts_that_wait_the_gravest_goes_first_and_the_mildest_is_given_up():
    waiting = Waiting()
    for severity, text in [(4, "a"), (6, "b"), (2, "c"), (4, "d"), (0, "e"), (6, "f")]:
        waiting.put(Severity(severity), text)
    assert [waiting.take(50)[1] for _ in range(len(waiting))] == [b"e", b"c", b"a", b"d"]
    with pytest.raises(ValueError, match="empty"):
        waiting.take(50)
