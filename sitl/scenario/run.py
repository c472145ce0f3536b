"""Run a scenario in lock-step and judge it: ``run_scenario("first-loiter")`` from Python, ``companion sim --scenario`` from the shell.

Equal file and seed give equal findings. Without a run directory nothing is written.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.commands.run import describe
from companion.settings import load_vessel

from ..world import World
from .acts import Actor
from .autostart import AutoStart
from .expect import Finding, judge
from .file import Scenario, read_scenario
from .log import Logbook


@dataclass(frozen=True, slots=True)
class ScenarioOutcome:
    """What came of a scenario."""

    name: str
    title: str
    seed: int
    duration_s: float
    passed: bool
    findings: tuple[Finding, ...]
    """Every expectation; orders that were refused; a plan that did not start."""
    texts: tuple[str, ...]
    """What the vessel said, each with its time."""
    distance_m: float


def run_scenario(
    path: str | Path,
    *,
    seed: int | None = None,
    run_dir: Path | None = None,
    base: Path | None = None,
    overrides: tuple[str, ...] = (),
    watch: Callable[[float], None] | None = None,
) -> ScenarioOutcome:
    """Read, run and judge a scenario, by the name of a shipped one or by its file.

    ``seed`` instead of the file's; ``run_dir`` records the run; ``base`` is the configuration under it (config/sim.toml),
    ``overrides`` are ``key=value``; ``watch`` is called with the seconds sailed, once a simulated second.
    Raises ConfigError with every mistake of the file.
    """
    return run(read_scenario(path, base=base, overrides=overrides), seed=seed, run_dir=run_dir, watch=watch)


def run(
    scenario: Scenario,
    *,
    seed: int | None = None,
    run_dir: Path | None = None,
    watch: Callable[[float], None] | None = None,
) -> ScenarioOutcome:
    """Run and judge a scenario that has been read."""
    text, settings = scenario.text, scenario.settings
    number = text.scenario.seed if seed is None else seed
    about: dict[str, Any] = describe(settings, seed=number) | {"scenario": scenario.name} if run_dir else {}
    world = World(settings, number, run_dir=run_dir, about=about)
    starter = AutoStart(world, scenario.plans, start=text.plan.start) if scenario.plans else None
    actor = Actor(scenario, world)
    log = Logbook(world.surroundings.plant.frame, load_vessel(settings.world.vessel or settings.vessel).keel_depth_m)
    texts: list[str] = []
    end_us = round(text.scenario.duration_s * 1e6)
    try:
        while world.now_us < end_us:
            actor.tick()
            (starter or world).tick(world.now_us)
            _note(world, log, texts)
            if watch is not None and world.now_us % 1_000_000 < world.period_us:
                watch(world.now_us * 1e-6)
    finally:
        world.shutdown(world.now_us)
    findings = actor.findings() + judge(text.expect, log)
    if starter is not None and starter.failure:
        findings = (Finding("plan starts", starter.failure, "started", False), *findings)
    return ScenarioOutcome(
        name=scenario.name,
        title=text.scenario.title,
        seed=number,
        duration_s=text.scenario.duration_s,
        passed=all(finding.passed for finding in findings),
        findings=findings,
        texts=tuple(texts),
        distance_m=round(world.metrics.distance_m, 2),
    )


def _note(world: World, log: Logbook, texts: list[str]) -> None:
    snapshot = world.snapshot
    if snapshot is None:
        return
    surroundings = world.surroundings
    truth, plan = surroundings.truth, world.app.vehicle.parts.mission.plan.maneuvers
    clearance_m = surroundings.fleet.nearest_m(truth.north_m, truth.east_m)
    log.add(truth, snapshot, plan, surroundings.plant.board.pulses_us, clearance_m)
    texts += [f"{world.now_us * 1e-6:7.2f} s  {text.text}" for text in snapshot.texts]
