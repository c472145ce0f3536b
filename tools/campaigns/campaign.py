"""What a campaign is: independent runs, each with its figures, and what of them misses its bar."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any, Final

from companion.core.hull import VesselConfig
from tools.benches.cells.foreign_hulls import any_hull, bare

Job = tuple[Any, ...]
"""Hull first, seed last; the campaign knows what stands between."""
Figures = dict[str, float]

TURNING: Final = ("otter", "blueboat", "wamv", "plant_b", "bare", "launch", "rudderless", "lopsided")
"""Hulls that turn at rest."""
HULLS: Final = (*TURNING, "single", "crooked")
"""Shipped ones, an Otter without rudders that turns away by itself, and the five that no law was made on."""


def hull(name: str) -> VesselConfig:
    """Return one of ``HULLS``. Raises ``ValueError`` for another name."""
    if name not in HULLS:
        raise ValueError(f"no hull {name!r}: one of {', '.join(HULLS)}")
    return bare("otter", 1.0) if name == "bare" else any_hull(name)


@dataclass(frozen=True, slots=True)
class Campaign:
    """A line of claims."""

    told: str
    """What is sailed, in one sentence."""
    jobs: Callable[[tuple[str, ...], range], Iterator[Job]]
    """Every run of these hulls and seeds."""
    sail: Callable[..., Figures]
    """Sails one run: called with a job's parts, at the top of a module, so that another process can."""
    misses: Callable[[Job, Figures], list[str]]
    """What misses its bar, in words; nothing where all of it holds."""
    share: float = 1.0
    """Of the runs that must hold; a run without figures does not count."""
    together: Callable[[list[Figures]], list[str]] = lambda _: []
    """What misses a bar that is set for all runs together."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One run."""

    job: Job
    figures: Figures
    misses: list[str]


def sail_all(campaign: Campaign, jobs: list[Job], processes: int | None = None) -> Iterator[Outcome]:
    """Sail every run, as many at a time as there are cores, and give each out in the order of the jobs."""
    with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
        for job, figures in zip(jobs, pool.map(campaign.sail, *zip(*jobs, strict=True), chunksize=1), strict=True):
            yield Outcome(job, figures, campaign.misses(job, figures) if figures else [])
