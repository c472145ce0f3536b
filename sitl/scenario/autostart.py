"""Load a plan, arm and start it without a ground station: what ``companion sim --plan F --start`` does.

It asks like an operator would, through the app's own requests, and waits for the vessel's checks. A refusal ends
the run with the reason.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from companion.io.links import Link
from companion.settings.device import no_device
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanKind, Reply, RequestBody, Result, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import PlanError as ItemError, load_plan
from mavlink_bridge.plans import PlanFileError, read_plan

from ..world import World

log = logging.getLogger(__name__)
PATIENCE_S = 30.0
"""Simulated time that the vessel has to pass its checks."""


class AutostartError(Exception):
    """A plan file that cannot be sailed: every mistake."""

    def __init__(self, mistakes: Sequence[str]) -> None:
        super().__init__("; ".join(mistakes))
        self.mistakes = list(mistakes)


def read_plan_file(path: Path) -> list[LoadPlan]:
    """Read and compile a plan file. Raises AutostartError with every mistake."""
    try:
        plan = read_plan(no_device(path).read_bytes(), path.name)
    except OSError as error:
        raise AutostartError([f"cannot be read: {error.strerror or error}"]) from None
    except PlanFileError as error:
        raise AutostartError(error.problems) from None
    loads, mistakes = [], []
    for kind in PlanKind:
        items = plan.items(kind)
        if not items:
            continue
        load = load_plan(kind, items)
        if isinstance(load, ItemError):
            mistakes.append(f"{kind.name.lower()} item {load.seq}: {load.reason}")
        else:
            loads.append(load)
    if mistakes or not loads:
        raise AutostartError(mistakes or ["holds no items"])
    return loads


class AutoStart:
    """A world with an impatient operator. Driven by the loop in the world's place."""

    def __init__(self, world: World, plans: Sequence[LoadPlan], *, start: bool) -> None:
        self._world = world
        self._steps: list[RequestBody] = [*plans]
        if start:
            self._steps += [Arm(True), StartPlan(0)]
        self._asked = False
        self._last_refusal = ""
        self.failure = ""

    @property
    def links(self) -> Sequence[Link]:
        return self._world.links

    @property
    def stop_wanted(self) -> bool:
        return self._world.stop_wanted

    def pump(self, now_us: int) -> None:
        self._world.pump(now_us)

    def shutdown(self, now_us: int) -> None:
        self._world.shutdown(now_us)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        if self._steps and not self.failure:
            self._ask(now_us)
        return self._world.tick(now_us, late_s=late_s, load=load)

    def _ask(self, now_us: int) -> None:
        if not self._asked:
            self._asked = True
            self._world.app.submit(self._steps[0], self._answered)
        if now_us > PATIENCE_S * 1e6:
            self._fail(self._last_refusal or "no answer")

    def _answered(self, reply: Reply) -> None:
        self._asked = False
        if reply.result is Result.ACCEPTED:
            self._steps.pop(0)
        elif reply.result is Result.REJECTED_NOW:
            self._last_refusal = reply.reason
        else:
            self._fail(reply.reason)

    def _fail(self, reason: str) -> None:
        self.failure = f"{type(self._steps[0]).__name__}: {reason}"
        log.error("the plan was not started: %s", self.failure)
