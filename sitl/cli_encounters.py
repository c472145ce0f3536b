"""``companion sim --encounters``: sets of encounters sailed by a boat that watches, over all cores, into a tally and a page."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from companion.commands.numbers import whole
from companion.commands.progress import ProgressLine
from companion.io.interpreter import cores
from companion.io.whole_file import write_whole
from companion.settings import ConfigError

from .traffic.many import failures, judge_all, lines, tally_of
from .traffic.pictures import make_page
from .traffic.sets import SETS, Encounter, by_name, dnv


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options to ``companion sim``."""
    parser.add_argument(
        "--encounters",
        metavar="SET",
        help=f"judge what the boat tells of other vessels: {', '.join(SETS)}, dnv:F.csv, or one encounter by its name",
    )
    parser.add_argument(
        "--count", type=whole(1), default=100, metavar="N", help="with --encounters: how many (default: 100)"
    )
    parser.add_argument("--page", type=Path, metavar="F.html", help="with --encounters: pictures of the ten worst")


def encounters_of(name: str, count: int, seed: int) -> list[Encounter]:
    """Return a set by its name. Raises ConfigError."""
    if name.startswith("dnv:"):
        path = Path(name[4:])
        if not path.is_file():
            raise ConfigError(
                "--encounters", [f"{path}: no such file; the situations are a table with a row for each vessel"]
            )
        return [*dnv(path), *dnv(path, similar=True)][:count]
    if name in SETS:
        return list(SETS[name](count, seed))
    if (one := by_name(name)) is not None:
        return [one]
    raise ConfigError(
        "--encounters",
        [f"{name}: no such set; there are {', '.join(SETS)}, dnv:F.csv, or one by its name: random-1-24"],
    )


def command(arguments: argparse.Namespace) -> int:
    """Sail and judge. 0: done; what it finds is told, not judged."""
    if arguments.count < 1:
        raise ConfigError("--count", [f"{arguments.count}: at least 1"])
    encounters = encounters_of(arguments.encounters, arguments.count, arguments.seed or 1)
    with ProgressLine("judged", None) as shown:
        verdicts = judge_all(
            encounters, min(cores(), len(encounters)), lambda count, total: shown.count(count, total, "encounters")
        )
    tally = tally_of(verdicts)
    if arguments.page is not None:
        try:
            write_whole(arguments.page, make_page(arguments.encounters, verdicts, encounters).encode("utf-8"))
        except OSError as error:
            raise ConfigError("--page", [f"{arguments.page}: cannot be written: {error.strerror}"]) from None
    failed = failures(verdicts)
    if arguments.json:
        print(json.dumps({**asdict(tally), "failures": failed}))
        return 0
    print("\n".join(lines(tally)))
    for what, names in failed.items():
        if names and what != "hit":
            print(f"{what}: {', '.join(names)}")
    return 0
