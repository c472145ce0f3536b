"""``python -m tools.campaigns LINE [--hulls otter,launch] [--seeds 1:5] [--jobs 2]``: sail a line of claims and print what holds.

Each run that misses its bar is a line; then come, by hull, the runs, those that hold, and mean and worst of each figure.
Exit status 1 where too few hold. The PyPy environment (``make pypy``) takes a third of the time, but has no fits.
"""

from __future__ import annotations

import argparse
import importlib
import math
import sys
import time
from typing import Final

from .campaign import HULLS, Campaign, Outcome, hull, sail_all

LINES: Final = {
    "hover": ("hover", "HOVER"),
    "drawn": ("drawn", "DRAWN"),
    "joint": ("wrong_files", "JOINT"),
    "each": ("wrong_files", "EACH"),
    "health": ("health", "HEALTH"),
    "health-on-station": ("health", "HEALTH_ON_STATION"),
    "clean": ("health", "CLEAN"),
    "fit": ("trials", "FIT"),
    "after-trial": ("trials", "AFTER"),
}
"""Module and name of each; fits need packages that other lines do without."""
_PROGRESS_S: Final = 60.0


def campaign(line: str) -> Campaign:
    """Return the campaign of one of ``LINES``."""
    module, name = LINES[line]
    found = getattr(importlib.import_module(f"{__package__}.{module}"), name)
    assert isinstance(found, Campaign)
    return found


def _span(text: str) -> range:
    first, _, last = text.partition(":")
    try:
        return range(int(first), int(last or first) + 1)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no span of seeds: write 1:5, or 3 for one") from None


def _hulls(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    try:
        for name in names:
            hull(name)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return names


def table(outcomes: list[Outcome]) -> list[str]:
    """Return a line a hull, and one of all: runs that hold, mean and worst of each figure."""
    lines = []
    by_hull = {
        name: [one for one in outcomes if one.job[0] == name] for name in dict.fromkeys(o.job[0] for o in outcomes)
    }
    for name, some in [*by_hull.items(), ("all", outcomes)]:
        counted = [one for one in some if one.figures]
        holding = sum(not one.misses for one in counted)
        lines.append(f"{name:12} {holding:5} of {len(counted):5} hold  {_figures_of(counted)}")
    return lines


def _figures_of(outcomes: list[Outcome]) -> str:
    told = []
    for name in outcomes[0].figures if outcomes else ():
        values = [one.figures[name] for one in outcomes if math.isfinite(one.figures[name])]
        if values:
            told.append(f"{name} {math.fsum(values) / len(values):.3f} / {max(values):.3f}")
    return ", ".join(told)


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m tools.campaigns", description=__doc__.split("\n")[0])
    parser.add_argument("line", choices=LINES)
    parser.add_argument("--hulls", type=_hulls, default=HULLS, help=f"of {', '.join(HULLS)}")
    parser.add_argument("--seeds", type=_span, default=range(1, 6), help="or draws: 1:5")
    parser.add_argument("--jobs", type=int, default=None, help="at a time; all cores where left out")
    arguments = parser.parse_args()
    line = campaign(arguments.line)
    print(line.told, flush=True)
    jobs = list(line.jobs(arguments.hulls, arguments.seeds))
    outcomes: list[Outcome] = []
    told_s = time.monotonic()
    for outcome in sail_all(line, jobs, arguments.jobs):
        outcomes.append(outcome)
        if outcome.misses:
            print(f"NOT {' '.join(map(str, outcome.job))}: {', '.join(outcome.misses)}", flush=True)
        if time.monotonic() > told_s + _PROGRESS_S:
            told_s = time.monotonic()
            print(f"... {len(outcomes)} of {len(jobs)}", flush=True)
    print("\n".join(table(outcomes)))
    counted = [one for one in outcomes if one.figures]
    holding = sum(not one.misses for one in counted)
    missed = line.together([one.figures for one in counted]) if counted else ["no run counts"]
    for text in missed:
        print(f"NOT all: {text}")
    return 0 if holding >= line.share * len(counted) and not missed else 1


if __name__ == "__main__":
    sys.exit(main())
