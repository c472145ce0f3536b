"""What ``companion check`` says of the heading loop: the margins over the speed range, and the top speed that they leave."""

from __future__ import annotations

from ...core.hull import VesselConfig
from ...core.steer import SteeringConfig, gains_problem
from ...core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from ...core.steer.law import lowered_text
from ...core.steer.model import ModelController
from ...core.steer.yaw_loop import DELAY_S


def heading_loop(config: SteeringConfig, vessel: VesselConfig) -> list[str]:
    """Say what margins the law leaves over the speed range, and how fast the vessel is sailed because of them."""
    if config.profile != "model":
        return [f"  heading     law '{config.profile}': see `companion tune margins`"]
    controller = ModelController(config, vessel)
    schedule = controller.schedule
    worst, delay_s = schedule.worst, DELAY_S + config.model.heading_late_s
    lines = [
        f"  heading     at least {worst.margins.gain_db:.0f} dB and {worst.margins.phase_deg:.0f} deg at {delay_s:g} s of delay "
        f"up to {schedule.steady_mps:.1f} m/s (bars {GAIN_BAR_DB:g} dB, {PHASE_BAR_DEG:g} deg)"
    ]
    problem = gains_problem(config, vessel)
    lines += [f"  WARNING     {problem}"] if problem else []
    told = lowered_text(schedule.steady_mps, controller.top_mps)
    return [*lines, f"  WARNING     {told}"] if told else lines
