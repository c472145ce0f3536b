"""Sail one plan in the simulated world and bring home what happened: the shortest way from a plan to figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import config as shipped
from companion.settings import load
from mavlink_bridge.language.requests import LoadPlan, PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import PlanError as ItemError, load_plan
from mavlink_bridge.plans import PlanFile

from .plant import Truth
from .scenario.autostart import AutoStart, AutostartError
from .world import SimSettings, World


@dataclass(frozen=True, slots=True)
class VoyageOutcome:
    """What came of it."""

    track: tuple[Truth, ...]
    """Where the boat really was, one value a tick (20 Hz)."""
    texts: tuple[str, ...]
    """What the vessel said."""
    items: tuple[dict[str, Any], ...]
    """Each plan item sailed: ``kind``, and the RMS and worst error in m against ``truth`` and the vessel's own ``estimate``."""
    distance_m: float


def simulate(
    plan: PlanFile, *, duration_s: float, seed: int = 0, settings: tuple[str, ...] = (), run_dir: Path | None = None
) -> VoyageOutcome:
    """Sail ``plan`` for ``duration_s`` of simulated time, with no ground station. Equal seeds give equal voyages.

    ``settings`` are ``key=value`` over the shipped simulator's, as with ``companion sim --set``; ``run_dir`` records the run.
    Raises ConfigError for a bad setting, AutostartError for a plan that the vessel refuses, with every mistake or its reason.
    """
    loaded = load(shipped.path("sim.toml"), ("operator.gcs_required=false", *settings), SimSettings)
    world = World(loaded, seed, run_dir=run_dir)
    starter = AutoStart(world, _loads(plan), start=True)
    track: list[Truth] = []
    texts: list[str] = []
    try:
        while world.now_us < duration_s * 1e6 and not starter.failure:
            starter.tick(world.now_us)
            track.append(world.surroundings.truth)
            texts += [text.text for text in (world.snapshot.texts if world.snapshot else ())]
    finally:
        world.shutdown(world.now_us)
    if starter.failure:
        raise AutostartError([starter.failure])
    return VoyageOutcome(tuple(track), tuple(texts), tuple(world.metrics.summary()), world.metrics.distance_m)


def _loads(plan: PlanFile) -> list[LoadPlan]:
    loads = [load_plan(kind, items) for kind in PlanKind if (items := plan.items(kind))]
    mistakes = [f"item {load.seq}: {load.reason}" for load in loads if isinstance(load, ItemError)]
    if mistakes:
        raise AutostartError(mistakes)
    return [load for load in loads if isinstance(load, LoadPlan)]
