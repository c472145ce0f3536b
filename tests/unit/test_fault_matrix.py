"""Every row of the fault matrix has a test or a reason, and the page says so."""

from __future__ import annotations

from tools.fault_matrix import ABSENT, PAGE, ROWS, named_tests


def test_at_least_58_of_68_rows_are_held_and_the_rest_have_a_reason():
    tests = named_tests()
    assert len(ROWS) == 68
    assert sum(bool(names) for row, names in tests.items() if row not in ABSENT) >= 58
    assert not [row for row, names in tests.items() if not names and row not in ABSENT]


def test_the_page_lists_them_all():
    text = PAGE.read_text("utf-8")
    for row, (fault, deadline) in ROWS.items():
        assert f"| {row} | {fault} | {deadline} |" in text
