"""What the half that takes orders tells the half that shows the state: the plan's life, as a console should see it."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_bridge.imc import NULL_MESSAGE, OpMode, Outcome, PlanState


@dataclass(frozen=True)
class PlanView:
    """The plan and the mode now. Times are the bridge's monotonic clock."""

    state: PlanState = PlanState.READY
    plan_id: str = ""
    """Kept when the plan has ended: a console passes over a state without it."""
    maneuver_id: str = ""
    maneuver_type: int = NULL_MESSAGE
    """Number of the manoeuvre's message, 452 under sticks; 0xFFFF outside manoeuvres."""
    maneuver_started_us: int | None = None
    progress_pct: float | None = None
    plan_eta_s: int | None = None
    maneuver_eta_s: int | None = None
    maneuver_done: bool = False
    last_outcome: Outcome = Outcome.NONE
    operation: OpMode = OpMode.SERVICE
    last_error: str = ""
    last_error_us: int | None = None
