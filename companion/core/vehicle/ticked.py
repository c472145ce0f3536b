"""What the steps of one tick hand on: each a frozen value, made by one step, read by those after it, never changed.

A tick folds them: sensed → course → demand → guarded → verdict → output. All together are ``Ticked``, which the view, the refusals and
the next tick read; what a step needs of the tick before it takes from there.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Final

from mavlink_bridge.language.messages import (
    Action,
    ActuatorDemand,
    ActuatorOutput,
    Desired,
    EstimatedState,
    GuardState,
)
from mavlink_bridge.language.snapshot import ControlTrace, FenceStatus, Outlook
from mavlink_bridge.language.traffic import NO_TRAFFIC, TrafficPicture
from mavlink_bridge.language.value import value

from ..guard.board_watch import BoardReport
from ..guard.depth.guard import GuardOutput
from ..guard.failsafe import FailsafeMemory, FailsafeResult
from ..guard.failsafe_words import SHORT
from ..guard.fence import FenceOutput
from ..guard.monitors import MonitorFlags
from ..guide import GuidanceOutput
from .config import TickInputs
from .navigator import Intent

_BACK_MPS: Final = -0.4
"""Backing out from a shoal: as fast as station keeping goes astern."""


@value
class Sensed:
    """What is known at the beginning of a tick."""

    now_us: int
    dt_s: float
    """Since the tick before; 0 in the first."""
    inputs: TickInputs
    state: EstimatedState
    board: BoardReport = field(default_factory=BoardReport)
    utc_us: int | None = None
    """UTC of this tick, microseconds since 1970; None = unknown."""
    others: TrafficPicture = NO_TRAFFIC
    """Other vessels."""


@value
class Pursuit:
    """What the mode in force wants."""

    intent: Intent = None
    """None: disarmed or stopped, or nothing to do."""
    desired: Desired | None = None
    """None: nothing for the loops to do."""
    guided: GuidanceOutput | None = None
    """What guidance said; None where no path is sailed."""
    generation: int | None = None
    """The number of the leg that guidance sails."""

    def over(self, depth: GuardOutput) -> Pursuit:
        """What is left of it over the water that the guard has found."""
        desired, slow, back_rad = self.desired, depth.slow_to_mps, depth.back_rad
        if desired is None:
            return self
        if depth.neutral:
            return replace(self, desired=Desired(None, None))
        if back_rad is not None and desired.psi_rad is not None:
            return replace(self, desired=Desired(back_rad, _BACK_MPS, brake=True, gentle=True))
        if slow is None or desired.speed_mps is None:
            return self
        return replace(self, desired=replace(desired, speed_mps=min(slow, desired.speed_mps)))


@value
class Demand:
    """What the actuators are asked for, and why."""

    actuators: ActuatorDemand | None = None
    """None: nothing, of which the gate makes neutral."""
    trace: ControlTrace = field(default_factory=ControlTrace)


@value
class Guarded:
    """What those who look ahead and watch have found."""

    depth: GuardOutput
    fence: FenceOutput
    monitors: MonitorFlags = field(default_factory=MonitorFlags)


@value
class FailsafeVerdict:
    """What the failsafe makes of it."""

    result: FailsafeResult
    outlook: tuple[Outlook, ...] = ()

    @property
    def authors(self) -> tuple[str, ...]:
        """The conditions that ask for what is done, in words."""
        done = SHORT[self.result.action]
        return tuple(each.cause for each in self.outlook if each.doing == done) or ("failsafe",)

    @property
    def author(self) -> str:
        """The most urgent of them."""
        return self.authors[0]


@value
class Ticked:
    """One whole tick."""

    number: int
    """Ticks so far, this one with them; 0 = before the first."""
    sensed: Sensed
    course: Pursuit
    demand: Demand
    guarded: Guarded
    verdict: FailsafeVerdict
    output: ActuatorOutput
    """What the gate let pass."""


def before_the_first(output: ActuatorOutput) -> Ticked:
    """What the first tick finds behind it: nothing is known. ``output``: the gate's neutral."""
    return Ticked(
        number=0,
        sensed=Sensed(0, 0.0, TickInputs(), EstimatedState(0)),
        course=Pursuit(),
        demand=Demand(),
        guarded=Guarded(GuardOutput(GuardState.UNKNOWN, None, None, None), FenceOutput(FenceStatus())),
        verdict=FailsafeVerdict(FailsafeResult(FailsafeMemory(), Action.NONE)),
        output=output,
    )
