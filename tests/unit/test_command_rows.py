"""One row per command; a row without its parts, or a request without an order, fails by name where it is imported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import get_args

import pytest

from companion.core.vehicle.orders import without_order
from mavlink_bridge.language.requests import RequestBody
from mavlink_bridge.mavlink.commands.command import Command, Refused
from mavlink_bridge.mavlink.commands.table import MEANINGS, ROWS, Context, flaws
from mavlink_bridge.mavlink.missions.plan_mapping import _COMPILERS as PLANNED

HERE = Context(home_item=True, plan_length=3, plan_seq=0, psi_rad=0.0)


@dataclass(frozen=True)
class Whistle:
    """A request that nobody carries out."""


@pytest.mark.parametrize(
    ("row", "says"),
    [
        (replace(ROWS[0], number=34), "two rows"),
        (replace(ROWS[0], name="NAV_LOITER"), "not NAV_LOITER"),
        (replace(ROWS[0], brings=(Whistle,)), "Whistle, which is no request"),
        (replace(ROWS[0], number=29999, name="WHISTLE"), "in no dialect"),
    ],
)
def test_a_row_without_its_parts_is_named(row, says):
    assert any(says in flaw for flaw in flaws([row, *ROWS[1:]]))
    assert flaws(ROWS) == []


def test_a_request_that_the_union_forgets_is_named():
    assert flaws(ROWS, [Whistle]) == ["Whistle is missing in RequestBody"]


def test_a_request_without_an_order_is_named():
    assert without_order([*get_args(RequestBody), Whistle]) == ["Whistle"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_what_a_command_becomes_is_what_its_row_says(row):
    places = [(0.0, 0.0), (41.0, -8.0), (float("nan"), float("nan"))]
    numbers = (0.0, 1.0, 2.0, 5.0, float("nan"))
    found = set()
    for x, y in places:
        for first in numbers:
            for second in numbers:
                command = Command(row.number, (first, second, 0.0, 0.0), x, y, 0.0, None, (255, 190))
                try:
                    body = MEANINGS[row.number](command, HERE)
                except Refused:
                    continue
                found.add(type(body))
    assert found - {type(None)} <= set(row.brings)
    assert row.brings == () or found & set(row.brings)


def test_what_is_planned_is_in_the_plans_table():
    assert {row.number for row in ROWS if row.planned} == {row.number for row in ROWS} & {int(cmd) for cmd in PLANNED}
