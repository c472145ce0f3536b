"""Two conditions at once: an order that a text names is obeyed when it is given, and once all causes are gone one has been named."""

from __future__ import annotations

import itertools
import re

import pytest

from companion.core.guard.failsafe import Flags, barring
from companion.core.guard.failsafe_flags import changed
from companion.core.guard.failsafe_orders import Order
from companion.core.guard.failsafe_row import Clear, Condition
from companion.core.guard.failsafe_table import TABLE
from companion.core.guard.outlook import outlook
from mavlink_bridge.language.messages import Action
from tests.unit.test_failsafe import WELL, Run, raised

ACTS = [row for row in TABLE if Action.HOLD <= max(row.action, row.then_action) <= Action.STOP]
BESIDE = [row for row in ACTS if not row.station and (row.clear is not Clear.GONE or row.clear_s)]
"""What an order to another mode lets go of stands in no order's way."""
WAITS = [row for row in ACTS if row.clear is Clear.OPERATOR and not row.station]
PAIRS = [(mine, other) for mine, other in itertools.product(WAITS, BESIDE) if mine is not other]
ORDERS = {order.value: order for order in Order}


def go(run: Run, flags: Flags, seconds: float) -> list[str]:
    """The texts of so many seconds."""
    texts: list[str] = []
    for _ in range(round(seconds / 2.0)):
        run.step(flags, 2.0)
        assert run.last is not None
        texts += [text for _, text in run.last.texts]
    return texts


def both(first: str, second: str, flags: Flags) -> Run:
    """Both have acted, one after the other."""
    run = Run()
    go(run, raised(first, flags), 12.0)
    go(run, raised(first, raised(second, flags)), 12.0)
    return run


def offered(text: str) -> list[Order]:
    """The orders that a text says go on."""
    found = re.search(r"order (.+) to go on", text)
    return [ORDERS[name] for name in found[1].split(" or ")] if found else []


def obeys(run: Run, flags: Flags, order: Order) -> bool:
    """Whether an order is accepted and the vessel does as it says, not what stops her."""
    if order is not Order.HOLD and barring(run.memory, run.now_us, run.config, order):
        return False
    does = run.step(changed(flags, operator_order=order))
    return does < Action.STOP if order is Order.HOLD else does < Action.HOLD


@pytest.mark.parametrize("resume", ["Auto", "Hold"])
@pytest.mark.parametrize(("mine", "other"), PAIRS, ids=lambda row: row.name)
def test_what_is_named_while_another_cause_stands_is_obeyed(mine: Condition, other: Condition, resume: str) -> None:
    """ "Heading is back: stopped: order Auto to go on" was told, and Auto refused: "position lost"."""
    flags = changed(WELL, resume=resume)
    left = raised(other.name, flags)
    run = both(other.name, mine.name, flags)
    for order in {order for text in go(run, left, 20.0) for order in offered(text)}:
        anew = both(other.name, mine.name, flags)
        go(anew, left, 20.0)
        assert obeys(anew, left, order)


@pytest.mark.parametrize(("mine", "other"), PAIRS, ids=lambda row: row.name)
def test_once_both_are_gone_an_order_has_been_named_that_goes_on(mine: Condition, other: Condition) -> None:
    flags = changed(WELL, resume="Auto")
    run = both(other.name, mine.name, flags)
    texts = go(run, raised(other.name, flags), 20.0) + go(run, flags, 20.0)
    named = [text for text in texts if "to go on" in text]
    assert named
    if "arm again" in named[-1]:
        assert run.step(changed(flags, operator_arm=True)) < Action.HOLD
    else:
        assert obeys(run, flags, offered(named[-1])[0])


@pytest.mark.parametrize(
    ("mine", "other", "told"),
    [
        ("heading_lost", "position_lost", "Heading is back (stopped: position lost)"),
        ("position_lost", "heading_lost", "Position is back (stopped: heading lost)"),
        ("position_lost", "thruster_reversed", "Position is back (stopped: a thruster pushes the wrong way)"),
        ("position_lost", "depth_locked", "Position is back (stopped: too shallow: locked, no manoeuvre)"),
        ("position_lost", "fence_ahead", "Position is back (stopped: fence ahead)"),
        ("position_lost", "battery_empty", "Position is back: stopped: order Return or a go-to to go on"),
    ],
)
def test_the_other_cause_is_named_in_place_of_the_order(mine, other, told):
    flags = changed(WELL, resume="Auto")
    run = both(other, mine, flags)
    assert go(run, raised(other, flags), 20.0) == [told]


def test_what_ends_by_itself_names_no_order_so_the_one_that_waits_does():
    flags = changed(WELL, resume="Auto")
    run = both("actuator_garbage", "position_lost", flags)
    assert go(run, raised("actuator_garbage", flags), 30.0) == ["Position is back (stopped: actuator line unreadable)"]
    assert go(run, flags, 30.0) == [
        "Over: actuator line unreadable",
        "Position is back: stopped: order Auto to go on",
    ]


def test_what_is_foretold_names_no_order_either():
    flags = changed(WELL, resume="Auto")
    run = both("position_lost", "heading_lost", flags)
    assert run.foretold == ["Until position is back, then order Auto", "Until heading is back (also: position lost)"]
    shown = raised("heading_lost", raised("position_lost", flags))
    assert [each.until for each in outlook(run.memory, shown, run.now_us, run.config)] == [
        "until position is back (also: heading lost)",
        "until heading is back (also: position lost)",
    ]


def test_a_refusal_names_no_order_that_another_cause_refuses():
    run = both("battery_empty", "thruster_reversed", WELL)
    assert barring(run.memory, run.now_us, run.config, Order.AUTO) == (
        "a thruster pushes the wrong way: disarm and arm again to try"
    )
    run = both("fence_breach", "battery_critical", WELL)
    assert (
        barring(run.memory, run.now_us, run.config, Order.AUTO) == "battery critical: order Hold or Return or a go-to"
    )


def test_one_disarm_ends_all_that_only_thrust_shows():
    run = both("thruster_alone", "thruster_reversed", changed(WELL, resume="Auto"))
    assert run.foretold == ["Until disarmed and armed again, then order Auto"] * 2
