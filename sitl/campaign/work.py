"""A campaign's single run, and the workers of this computer: one process for each core.

A run is a plain function of its job, so that it may be done anywhere: here, or on a cluster (``campaign_cluster``). Runs of a
worker process that is killed (out of memory, say) are done again by new ones.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Final

import companion
import config as shipped
import mavlink_bridge
from companion.io.interpreter import cores
from companion.settings import load_vessel

from ..scenario import Scenario
from ..scenario.run import run

ROUNDS_WITHOUT_A_RUN: Final = 3
"""So often may the worker processes die before one of them has finished a run."""


class CampaignError(Exception):
    """A campaign cannot go on; what is done is kept."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run: its names as the campaign file writes them, and all that it takes to do it."""

    scenario: str
    vessel: str
    """Empty: the scenario's own."""
    seed: int
    ready: Scenario = field(repr=False, compare=False)
    basis: str = field(compare=False)
    """Which scenario, vessel and program in truth: a result stands for as long as this does."""

    @property
    def key(self) -> tuple[str, str, str, str]:
        """How a row names it."""
        return self.scenario, self.vessel, str(self.seed), self.basis


@dataclass(frozen=True, slots=True)
class RunRow:
    """What came of one run, as the CSV has it."""

    scenario: str
    vessel: str
    seed: int
    basis: str
    passed: int
    distance_m: float
    wall_s: float
    failed: str
    """What did not hold: quantity = found (limit)."""
    findings: str
    """Every expectation as JSON: [[quantity, found, limit, holds], ...]."""


COLUMNS: Final = tuple(item.name for item in fields(RunRow))


def basis_of(scenario: Scenario) -> str:
    """A short name of what a result rests on: the scenario as read, the hulls, and the program."""
    settings = scenario.settings
    hulls = sorted({settings.vessel, settings.world.vessel or settings.vessel})
    parts = (
        scenario.text.model_dump_json(),
        settings.model_dump_json(),
        repr(scenario.plans),
        *(load_vessel(name).model_dump_json() for name in hulls),
        program(),
    )
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]


@functools.cache
def program() -> str:
    """A short name of this very program: the text of all its modules."""
    text = hashlib.sha256()
    for module in (companion, mavlink_bridge, shipped):
        text.update(_modules(Path(str(module.__file__)).parent))
    text.update(_modules(Path(__file__).resolve().parents[1]))
    return text.hexdigest()[:12]


def _modules(folder: Path) -> bytes:
    text = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        text.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return text.digest()


def run_job(job: Job) -> RunRow:
    """Do one run. A run that breaks is a row that says so."""
    began = time.monotonic()
    try:
        outcome = run(job.ready, seed=job.seed)
    except Exception as error:  # a run that breaks is a result too; the others go on
        failed = " ".join(f"{type(error).__name__}: {error}".split())  # a row is a line
        return RunRow(
            scenario=job.scenario,
            vessel=job.vessel,
            seed=job.seed,
            basis=job.basis,
            passed=0,
            distance_m=0.0,
            wall_s=_since(began),
            failed=failed,
            findings="[]",
        )
    failures = [f"{item.what} = {item.found} ({item.limit})" for item in outcome.findings if not item.passed]
    findings = [[item.what, item.found, item.limit, item.passed] for item in outcome.findings]
    return RunRow(
        scenario=job.scenario,
        vessel=job.vessel,
        seed=job.seed,
        basis=job.basis,
        passed=int(outcome.passed),
        distance_m=outcome.distance_m,
        wall_s=_since(began),
        failed="; ".join(failures),
        findings=json.dumps(findings),
    )


def _since(began: float) -> float:
    return round(time.monotonic() - began, 2)


def over_cores(jobs: Sequence[Job], workers: int | None = None) -> Iterator[RunRow]:
    """Do the runs on this computer, one process for each core that it may use. Raises CampaignError."""
    count = min(workers or cores(), len(jobs))
    if count <= 1:
        yield from map(run_job, jobs)
        return
    left = {job.key: job for job in jobs}
    barren = 0
    while left:
        before = len(left)
        for row in _one_pool(list(left.values()), count):
            del left[row.scenario, row.vessel, str(row.seed), row.basis]
            yield row
        barren = 0 if len(left) < before else barren + 1
        if barren == ROUNDS_WITHOUT_A_RUN:
            raise CampaignError(
                f"the worker processes are killed before they finish a run (memory?); {len(left)} not done"
            )
        # those that were under way when the pool broke go last: one of them may be what breaks it
        left = dict([*list(left.items())[count:], *list(left.items())[:count]])


def _one_pool(jobs: Sequence[Job], count: int) -> Iterator[RunRow]:
    """Rows as they come in; when a worker is killed, those that are done by then."""
    others = set(multiprocessing.active_children())
    # spawned, so that a worker starts the same everywhere and inherits nothing
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_live_with_the_parent)
    futures: list[Future[RunRow]] = []
    try:
        with contextlib.suppress(BrokenProcessPool):  # a worker may die while jobs are still handed in
            futures.extend(pool.submit(run_job, job) for job in jobs)
        for future in as_completed(futures):
            if not isinstance(future.exception(), BrokenProcessPool):
                yield future.result()
    except BaseException:
        for child in set(multiprocessing.active_children()) - others:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _live_with_the_parent() -> None:
    """In a worker: leave Ctrl-C to the parent, and end when the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
