"""Campaigns: scenarios x seeds x vessels over all cores, one CSV row for each run, resumable, with a summary at the end.

Runs are independent processes' work; rows are written by the parent alone as they come in, so that an interruption
loses no finished run. A run that raises is a row that says so.
"""

from __future__ import annotations

import csv
import multiprocessing
import time
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from companion.core.config import Config
from companion.settings import ConfigError, explain

from .scenario import run_scenario
from .scenario_file import find, library, read_scenario


class CampaignText(Config):
    """What is combined."""

    scenarios: tuple[str, ...] = ()
    """Names or files beside the campaign's; empty = all that come along."""
    seeds: tuple[int, ...] = Field((1,), min_length=1)
    vessels: tuple[str, ...] = ("",)
    """Hulls by name or file; empty = each scenario's own."""


class CampaignFile(Config):
    """A campaign file as written."""

    campaign: CampaignText


@dataclass(frozen=True, slots=True)
class Job:
    """One run."""

    scenario: str
    vessel: str
    seed: int

    @property
    def key(self) -> tuple[str, str, str]:
        """How a row names it."""
        return self.scenario, self.vessel, str(self.seed)


@dataclass(frozen=True, slots=True)
class Row:
    """What came of one run, as the CSV has it."""

    scenario: str
    vessel: str
    seed: int
    passed: int
    distance_m: float
    wall_s: float
    failed: str
    """What did not hold: quantity = found (limit); the findings that held are in ``found``."""
    found: str


COLUMNS = tuple(field.name for field in fields(Row))


def read_campaign(path: Path) -> list[Job]:
    """Read a campaign and check every scenario with every vessel. Raises ConfigError with every mistake."""
    try:
        text = CampaignFile.model_validate(tomllib.loads(path.read_text(encoding="utf-8"))).campaign
    except OSError as error:
        raise ConfigError(str(path), [f"cannot be read: {error}"]) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), [f"not valid TOML: {error}"]) from None
    except ValidationError as error:
        raise ConfigError(str(path), [explain(item) for item in error.errors()]) from None
    names = [_beside(name, path.parent) for name in text.scenarios] or [item.stem for item in library()]
    mistakes: list[str] = []
    for name in names:
        for vessel in text.vessels:
            try:
                read_scenario(find(name), overrides=_overrides(vessel))
            except ConfigError as error:
                mistakes += [f"{name}: {mistake}" for mistake in error.mistakes]
    if mistakes:
        raise ConfigError(str(path), mistakes)
    return [Job(name, vessel, seed) for name in names for vessel in text.vessels for seed in text.seeds]


def run_campaign(
    jobs: Sequence[Job], results: Path, *, workers: int | None = None, done: Callable[[int, int], None] | None = None
) -> list[dict[str, str]]:
    """Run what is not yet in ``results`` and return all rows of these jobs. ``done`` is told (finished, all) after each run."""
    _drop_cut_line(results)
    rows = {_key(row): row for row in _finished(results)}
    missing = [job for job in jobs if job.key not in rows]
    if done is not None:
        done(len(jobs) - len(missing), len(jobs))
    fresh = not results.is_file() or results.stat().st_size == 0
    with results.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if fresh:
            writer.writeheader()
        for count, row in enumerate(_work(missing, workers), len(jobs) - len(missing) + 1):
            writer.writerow(asdict(row))
            file.flush()
            if done is not None:
                done(count, len(jobs))
    rows = {_key(row): row for row in _finished(results)}
    return [rows[job.key] for job in jobs]


def summary(rows: Sequence[dict[str, str]]) -> list[str]:
    """One line for each scenario and vessel, and what failed."""
    groups: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in rows:
        groups.setdefault((row["scenario"], row["vessel"] or "own"), []).append(row)
    width = max((len(name) for name, _ in groups), default=0)
    lines = []
    for (name, vessel), group in groups.items():
        held = sum(row["passed"] == "1" for row in group)
        lines.append(f"{name:{width}}  {vessel:10}  {held}/{len(group)}")
        lines += [f"  seed {row['seed']}: {row['failed']}" for row in group if row["passed"] != "1"]
    return lines


def _work(jobs: Sequence[Job], workers: int | None) -> Iterable[Row]:
    count = min(workers or multiprocessing.cpu_count(), len(jobs))
    if count <= 1:
        yield from map(_run, jobs)
        return
    # spawned, so that a worker starts the same everywhere and inherits nothing
    with multiprocessing.get_context("spawn").Pool(count) as pool:
        yield from pool.imap_unordered(_run, jobs)


def _run(job: Job) -> Row:
    began = time.monotonic()
    try:
        outcome = run_scenario(job.scenario, seed=job.seed, overrides=_overrides(job.vessel))
    except Exception as error:  # a run that breaks is a result too; the others go on
        failed = " ".join(f"{type(error).__name__}: {error}".split())  # a row is a line
        return Row(job.scenario, job.vessel, job.seed, 0, 0.0, round(time.monotonic() - began, 2), failed, "")
    failures = [f"{item.what} = {item.found} ({item.limit})" for item in outcome.findings if not item.passed]
    found = [f"{item.what} = {item.found}" for item in outcome.findings if item.passed]
    return Row(
        job.scenario,
        job.vessel,
        job.seed,
        int(outcome.passed),
        outcome.distance_m,
        round(time.monotonic() - began, 2),
        "; ".join(failures),
        "; ".join(found),
    )


def _overrides(vessel: str) -> tuple[str, ...]:
    return (f'vessel="{vessel}"',) if vessel else ()


def _beside(name: str, folder: Path) -> str:
    return str(folder / name) if name.endswith(".toml") else name


def _drop_cut_line(results: Path) -> None:
    """Forget a last row that an interruption cut off: that run is done again."""
    if results.is_file():
        with results.open("r+b") as file:
            file.truncate(file.read().rfind(b"\n") + 1)


def _finished(results: Path) -> list[dict[str, str]]:
    """Rows of earlier starts."""
    if not results.is_file():
        return []
    with results.open(newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if all(row.get(name) is not None for name in COLUMNS)]


def _key(row: dict[str, Any]) -> tuple[str, str, str]:
    return row["scenario"], row["vessel"], row["seed"]
