"""A text that crosses the radio keeps the order by which it is cleared, whatever its length."""

from __future__ import annotations

import pytest

from companion.core.guard.failsafe_table import TABLE
from companion.core.guard.failsafe_words import until
from mavlink_bridge.radio.words import fitted

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
