"""``companion replay``: run a recording again through the same program and show the first difference."""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from pathlib import Path
from typing import Any

from ..replay import ReplayError, replay, summary
from .progress import ProgressLine, recorded_s


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("replay", help="run a recording again and compare", description=__doc__)
    parser.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="a run directory (or its inputs.bin)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="what would have happened with this setting"
    )
    parser.add_argument(
        "--tolerant", action="store_true", help="allow what another kind of processor's arithmetic makes"
    )
    parser.add_argument("--json", action="store_true", help="print one object")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Replay; exit status 0 identical, 1 different, 2 nothing to replay."""
    began = time.monotonic()
    try:
        with ProgressLine("replaying", recorded_s(arguments.run_dir)) as shown:
            outcome = replay(
                arguments.run_dir, changes=arguments.set, tolerant=arguments.tolerant, on_tick=shown.update
            )
    except ReplayError as error:
        print(error, file=sys.stderr)
        return 2
    wall_s = time.monotonic() - began
    if arguments.json:
        found = {
            "identical": outcome.identical,
            "ticks": outcome.ticks,
            "duration_s": outcome.duration_s,
            "wall_s": round(wall_s, 3),
            "cut": outcome.cut,
            "fault": outcome.fault,
            "differences": [str(difference) for difference in outcome.differences],
        }
        print(json.dumps(found))
    else:
        print(summary(outcome, wall_s))
        if outcome.differences and not arguments.tolerant:
            print(f"(this is {platform.machine()}; for a recording from another kind of processor add --tolerant)")
    return 0 if outcome.identical else 1
