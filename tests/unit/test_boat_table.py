"""Every scenario of the list for boats has tests that exist, or a reason."""

from __future__ import annotations

import re

import pytest

from tools.boat_scenarios import TABLE, test_names as names_of_all

NAMES = names_of_all()
ROWS = [row for rows in TABLE.values() for row in rows]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.names[:50])
def test_a_row_has_tests_or_a_reason(row):
    assert row.tests or row.not_here
    missing = [name for name in row.tests if not any(found.startswith(name) for found in NAMES)]
    assert not missing


def test_the_list_is_whole():
    scenarios = [name for row in ROWS for name in row.names.split(", ")]
    assert len(scenarios) >= 100
    assert len(scenarios) == len(set(scenarios))


def test_each_of_the_68_checks_of_a_ground_station_is_a_test():
    found = {int(number) for name in NAMES for number in re.findall(r"check_(\d\d)_", f"{name}_")}
    assert found == set(range(1, 69))
