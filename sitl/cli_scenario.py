"""``companion sim --scenario``, ``--list-scenarios`` and ``--campaign``: run, print what was expected and what was found, exit 0 or 1."""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import config as shipped
from companion.commands.progress import ProgressLine
from companion.io.log_file import make_own_folder
from companion.io.whole_file import write_whole
from companion.settings import ConfigError

from .campaign import make_page, read_campaign, run_campaign
from .campaign.campaign import Work, finished, summary
from .campaign.work import CampaignError, over_cores
from .scenario import ScenarioOutcome, read_scenario
from .scenario.expect import Finding
from .scenario.file import library
from .scenario.run import run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the scenario's options to ``companion sim``."""
    parser.add_argument(
        "--scenario",
        metavar="F.toml|NAME",
        help="run a scenario in lock-step and judge it; exit status 1 when an expectation fails",
    )
    parser.add_argument(
        "--campaign",
        type=Path,
        metavar="F.toml",
        help="run scenarios x seeds x vessels over all cores, into F.csv and F.html",
    )
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="with --campaign: over the Dask cluster there, such as tcp://host:8786"
    )
    parser.add_argument("--list-scenarios", action="store_true", help="list the scenarios that come along")


def command(arguments: argparse.Namespace) -> int:
    """Do what was asked. Raises ConfigError with every mistake of a file or of the options."""
    if arguments.list_scenarios:
        return list_scenarios(as_json=arguments.json)
    if arguments.campaign is not None:
        return campaign(arguments.campaign, cluster=arguments.cluster, as_json=arguments.json)
    if arguments.cluster is not None:
        raise ConfigError("--cluster", ["needs --campaign F.toml"])
    mistakes = _clashes(arguments)
    if mistakes:
        raise ConfigError("--scenario", mistakes)
    overrides = list(arguments.set)
    if arguments.arduino:
        overrides.append(f"world.arduino={arguments.arduino}")
    base: Path = arguments.config
    scenario = read_scenario(arguments.scenario, base=base, overrides=tuple(overrides))
    if arguments.run_dir is not None:
        make_own_folder(arguments.run_dir)
    began = time.monotonic()
    with ProgressLine("simulating", scenario.text.scenario.duration_s) as shown:
        outcome = run(scenario, seed=arguments.seed, run_dir=arguments.run_dir, watch=shown.at)
    wall_s = time.monotonic() - began
    if arguments.json:
        print(json.dumps(asdict(outcome) | {"wall_s": round(wall_s, 3)}))
    else:
        print("\n".join(table(outcome)))
        print(f"{outcome.duration_s:.0f} s simulated in {wall_s:.1f} s", end="")
        print(f"; see it: companion report {arguments.run_dir}" if arguments.run_dir else "")
    return 0 if outcome.passed else 1


def list_scenarios(*, as_json: bool) -> int:
    """Print the shipped scenarios, one line each."""
    about = {path.stem: read_scenario(path).text.scenario for path in library()}
    if as_json:
        print(json.dumps({name: {"title": item.title, "shows": item.shows} for name, item in about.items()}))
        return 0
    width = max(map(len, about))
    for name, item in about.items():
        print(f"{name:{width}}  {item.title}")
    return 0


def campaign(path: Path, *, cluster: str | None = None, as_json: bool = False) -> int:
    """Run a campaign, or what is left of it; the table is F.csv, the summary page F.html. Raises ConfigError, MissingExtraError."""
    jobs = read_campaign(path)
    results, page = path.with_suffix(".csv"), path.with_suffix(".html")
    began = time.monotonic()
    broken = ""
    try:
        with _progress(len(jobs)) as done:
            rows = run_campaign(jobs, results, work=_work(cluster), done=done)
    except (CampaignError, KeyboardInterrupt) as error:
        broken = str(error) or "stopped"
        rows = finished(jobs, results)
    held = sum(row["passed"] == "1" for row in rows)
    if rows:
        write_whole(page, make_page(path.stem, rows, len(jobs)).encode("utf-8"))
    if as_json:
        told = {"runs": len(rows), "passed": held, "wall_s": round(time.monotonic() - began, 1)}
        print(json.dumps(told | {"results": str(results), "page": str(page)}))
    elif rows:
        print("\n".join(summary(rows)))
        print(f"{held} of {len(rows)} runs hold; every figure is in {results}, the summary in {page}")
    if broken:
        print(broken, file=sys.stderr)
        print(f"{len(rows)} of {len(jobs)} runs are done; the same command goes on with the others", file=sys.stderr)
    return 0 if held == len(jobs) else 1


def _work(cluster: str | None) -> Work:
    """Who does the runs: this computer's cores, or the cluster at an address."""
    if cluster is None:
        return over_cores
    from .campaign.cluster import over_cluster

    return lambda jobs: over_cluster(jobs, cluster)


@contextmanager
def _progress(total: int) -> Iterator[Callable[[int, int], None] | None]:
    """A bar on a terminal, when rich is there; nothing elsewhere."""
    if not sys.stderr.isatty() or importlib.util.find_spec("rich") is None:
        yield None
        return
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress as Bar

    with Bar(*Bar.get_default_columns(), MofNCompleteColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task("campaign", total=total)
        yield lambda finished, every: bar.update(task, completed=finished)


def table(outcome: ScenarioOutcome) -> list[str]:
    """The findings as lines; what the vessel said follows when something failed."""
    rows = [("", "expectation", "found", "limit"), *map(_row, outcome.findings)]
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    lines = [f"{outcome.title} (seed {outcome.seed})"]
    lines += ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    if not outcome.passed:
        lines += ["what the vessel said:", *(f"  {text}" for text in outcome.texts)]
    lines.append("passed" if outcome.passed else "FAILED")
    return lines


def _row(finding: Finding) -> tuple[str, str, str, str]:
    return "ok" if finding.passed else "FAILED", finding.what, _cell(finding.found), _cell(finding.limit)


def _cell(value: Any) -> str:
    return "nothing" if value is None else f"{value:g}" if isinstance(value, float | int) else str(value)


def _clashes(arguments: argparse.Namespace) -> list[str]:
    """Options that make no sense beside a scenario."""
    given = {
        "--plan": arguments.plan is not None,
        "--start": arguments.start,
        "--duration": arguments.duration is not None,
        "--gateway": arguments.gateway,
        "--world-only": arguments.world_only,
        "--instance": bool(arguments.instance),
        "--speed": arguments.speed not in ("1", "max"),
    }
    mistakes = [f"{name}: the scenario says it; leave it out" for name, used in given.items() if used]
    if not arguments.config.is_file():
        mistakes.append(f"--config {arguments.config}: no such file (shipped: {shipped.path('sim.toml')})")
    return mistakes
