"""Campaigns: scenarios x seeds x vessels, one CSV row for each run, resumable, with a summary at the end.

Who does the runs (this computer's cores, a cluster) is handed in; rows are written by this process alone as they come in, so
that an interruption loses no finished run. A row stands for as long as its scenario, vessel and program are what they were.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from pydantic import Field, ValidationError

from companion.core.config import Config
from companion.settings import ConfigError, explain
from companion.settings.device import no_device
from companion.settings.schema import unreadable

from ..scenario import Scenario, read_scenario
from ..scenario.file import find, library
from .work import COLUMNS, Job, RunRow, basis_of, over_cores

Work = Callable[[Sequence[Job]], Iterable[RunRow]]
"""Does jobs, in any order."""


class CampaignText(Config):
    """What is combined."""

    scenarios: tuple[str, ...] = ()
    """Names, or files beside the campaign's; empty = all that come along."""
    seeds: tuple[int, ...] = Field((1,), min_length=1)
    vessels: tuple[str, ...] = ("",)
    """Hulls by name, or files beside the campaign's; empty = each scenario's own."""


class CampaignFile(Config):
    """A campaign file as written."""

    campaign: CampaignText


def read_campaign(path: Path) -> list[Job]:
    """Read a campaign and check every scenario with every vessel. Raises ConfigError with every mistake."""
    text = _read(path)
    names = text.scenarios or [item.stem for item in library()]
    ready: dict[tuple[str, str], tuple[Scenario, str]] = {}
    mistakes: list[str] = []
    for name in names:
        for vessel in text.vessels:
            hull = _beside(vessel, path)
            overrides = (f'vessel="{hull}"',) if hull else ()
            try:
                scenario = read_scenario(find(_beside(name, path)), overrides=overrides)
                ready[name, vessel] = scenario, basis_of(scenario)
            except ConfigError as error:
                mistakes += [f"{name}: {mistake}" for mistake in error.mistakes]
    if mistakes:
        raise ConfigError(str(path), list(dict.fromkeys(mistakes)))
    return [Job(*names, seed, *made) for names, made in ready.items() for seed in dict.fromkeys(text.seeds)]


def _read(path: Path) -> CampaignText:
    try:
        return CampaignFile.model_validate(tomllib.loads(no_device(path).read_text(encoding="utf-8-sig"))).campaign
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(str(path), [unreadable(error)]) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), [f"not valid TOML: {error}"]) from None
    except ValidationError as error:
        raise ConfigError(str(path), [explain(item) for item in error.errors()]) from None


def _beside(name: str, campaign: Path) -> str:
    return str((campaign.parent / name).resolve()) if name.endswith(".toml") else name


def run_campaign(
    jobs: Sequence[Job],
    results: Path,
    *,
    work: Work = over_cores,
    done: Callable[[int, int], None] | None = None,
) -> list[dict[str, str]]:
    """Run what is not yet in ``results`` and return all rows of these jobs, in their order.

    ``done`` is told (finished, all) after each run. Raises ConfigError when the file is another table, OSError when it has no room for
    a row, and what ``work`` raises.
    """
    missing = _missing(jobs, results)
    count = len(jobs) - len(missing)
    if done is not None:
        done(count, len(jobs))
    _append(results)
    # the longest first, so that no core is left alone with a long run at the end
    longest_first = sorted(missing, key=lambda job: -job.ready.text.scenario.duration_s)
    for row in work(longest_first) if missing else ():
        _append(results, row)
        count += 1
        if done is not None:
            done(count, len(jobs))
    return finished(jobs, results)


def _append(results: Path, *rows: RunRow) -> None:
    """Add whole rows, and the names of the columns above the first. Raises OSError with ``results`` as its name."""
    try:
        with results.open("a", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if not file.tell():
                writer.writeheader()
            writer.writerows(asdict(row) for row in rows)
    except OSError as error:
        _drop_cut_line(results)
        if results.is_file() and not results.stat().st_size:
            results.unlink()
        raise type(error)(error.errno, error.strerror, str(results)) from None


def _missing(jobs: Sequence[Job], results: Path) -> list[Job]:
    _drop_cut_line(results)
    found = {_key(row) for row in _rows(results)}
    return [job for job in jobs if job.key not in found]


def finished(jobs: Sequence[Job], results: Path) -> list[dict[str, str]]:
    """Rows of those jobs that are done, in the jobs' order. Raises ConfigError when the file is another table."""
    rows = {_key(row): row for row in _rows(results)}
    return [rows[job.key] for job in jobs if job.key in rows]


def _drop_cut_line(results: Path) -> None:
    """Forget a last row that an interruption cut off: that run is done again."""
    if results.is_file():
        with results.open("r+b") as file:
            file.truncate(file.read().rfind(b"\n") + 1)


def _rows(results: Path) -> Iterator[dict[str, str]]:
    """Rows of earlier starts. Raises ConfigError."""
    if not results.is_file() or not results.stat().st_size:
        return
    with results.open(newline="", encoding="utf-8", errors="replace") as file:
        reader = csv.DictReader(file)
        if tuple(reader.fieldnames or ()) != COLUMNS:
            raise ConfigError(str(results), ["not a table of this version's campaigns; move it away and start again"])
        yield from (row for row in reader if all(row.get(name) is not None for name in COLUMNS))


def _key(row: dict[str, str]) -> tuple[str, str, str, str]:
    return row["scenario"], row["vessel"], row["seed"], row["basis"]


def groups(rows: Sequence[dict[str, str]]) -> dict[tuple[str, str], list[dict[str, str]]]:
    """Rows by scenario and vessel ("own": the scenario's)."""
    found: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in rows:
        found.setdefault((row["scenario"], row["vessel"] or "own"), []).append(row)
    return found


def summary(rows: Sequence[dict[str, str]]) -> list[str]:
    """One line for each scenario and vessel, and what failed."""
    found = groups(rows)
    width = max((len(name) for name, _ in found), default=0)
    lines = []
    for (name, vessel), group in found.items():
        held = sum(row["passed"] == "1" for row in group)
        lines.append(f"{name:{width}}  {vessel:10}  {held}/{len(group)}")
        lines += [f"  seed {row['seed']}: {row['failed']}" for row in group if row["passed"] != "1"]
    return lines
