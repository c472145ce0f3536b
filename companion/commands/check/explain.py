"""``companion explain``: the tables that the software itself runs on, and what a failsafe history leads to."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, Final

from ...core.guard.failsafe import FailsafeConfig, FailsafeMemory, Flags, failsafe_table_markdown, step
from ...core.guard.failsafe_flags import HOME, changed, now
from ...core.guard.failsafe_orders import Order
from ...settings import Settings, load
from ..numbers import number

LONGEST_S: Final = 36_000.0
"""A chain of events may last ten hours: it is stepped as the vessel steps."""


def register(subparsers: Any) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser("explain", help="tables: failsafe conditions and more")
    kinds = parser.add_subparsers(metavar="WHAT", required=True)
    table = kinds.add_parser("failsafe", help="the failsafe table, or what a chain of events leads to")
    table.add_argument("config", nargs="?", type=Path, help="with this configuration's times and actions")
    table.add_argument(
        "--play",
        nargs="+",
        metavar="SECONDS:FLAG[=VALUE],...",
        help="at each time set flags, e.g. 0:armed,autonomous 5:position_lost 20:-position_lost 26:operator_order",
    )
    table.set_defaults(run=failsafe)


def failsafe(arguments: argparse.Namespace) -> int:
    """Print the table; with ``--play`` the actions that a chain of events leads to."""
    config = load(arguments.config, model=Settings).failsafe if arguments.config else FailsafeConfig()
    if not arguments.play:
        print(failsafe_table_markdown(config), end="")
        return 0
    try:
        for line in play(arguments.play, config):
            print(line)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def play(words: list[str], config: FailsafeConfig, tail_s: float = 90.0) -> list[str]:
    """Step the engine through events at 20 Hz; one line for every change of the action and every text.

    Raises ``ValueError`` for a word that names no flag.
    """
    events = sorted(_events(words), key=lambda event: event[0])
    memory, flags, action, lines = FailsafeMemory(), Flags(), None, []
    for tick in range(round(20 * (events[-1][0] + tail_s))):
        now_us = tick * 50_000
        momentary: dict[str, Any] = {}
        while events and events[0][0] * 1e6 <= now_us:
            changes = events.pop(0)[1]
            momentary |= {name: value for name, value in changes.items() if name.startswith("operator")}
            flags = changed(flags, **{k: v for k, v in changes.items() if not k.startswith("operator")})
        result = step(memory, changed(flags, **momentary), now_us, config)
        memory = result.memory
        lines += [f"{now_us / 1e6:7.2f} s  {severity.name.lower()}: {text}" for severity, text in result.texts]
        if result.action is not action:
            action = result.action
            lines.append(f"{now_us / 1e6:7.2f} s  => {action.name} ({', '.join(result.causes) or 'all well'})")
    return lines


def _events(words: list[str]) -> list[tuple[float, dict[str, Any]]]:
    """All events. Raises ``ValueError`` with every mistake."""
    found, mistakes = [], []
    for word in words:
        try:
            found.append(_event(word))
        except ValueError as error:
            mistakes.append(str(error))
    if mistakes:
        raise ValueError("\n".join(mistakes))
    return found


def _event(word: str) -> tuple[float, dict[str, Any]]:
    when, _, what = word.partition(":")
    changes = dict(_change(part) for part in what.split(","))
    try:
        return number(0.0, LONGEST_S)(when), changes
    except argparse.ArgumentTypeError:
        raise ValueError(f"{word!r}: SECONDS:FLAG expected, seconds from 0 to {LONGEST_S:g}") from None


def _change(part: str) -> tuple[str, Any]:
    """A flag that is set or cleared, or one that has a value. Raises ``ValueError``."""
    name, equals, value = part.lstrip("-").partition("=")
    if name not in HOME:
        raise ValueError(f"{name!r} is no flag; there are {', '.join(HOME)}")
    if name == "operator_order":
        if value and value.upper() not in Order.__members__:
            raise ValueError(f"{part!r}: an order is one of {', '.join(Order.__members__).lower()}")
        return name, Order[value.upper()] if value else Order.GUIDED
    if name == "resume":
        return name, value
    if isinstance(now(Flags(), name), bool):
        if equals:
            raise ValueError(f"{part!r}: {name} has no value; write {name} or -{name}")
        return name, not part.startswith("-")
    try:
        return name, number()(value) if equals else None
    except argparse.ArgumentTypeError as error:
        raise ValueError(f"{name}={error}, or leave the value out: not known") from None
