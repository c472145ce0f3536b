"""What ``companion check`` says of the heading loop: the margins over the speed range, and the top speed that they leave."""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING

from ...core.hull import VesselConfig
from ...core.steer import SteeringConfig, gains_problem
from ...core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from ...core.steer.law import lowered_text
from ...core.steer.model import ModelController
from ...core.steer.yaw_loop import DELAY_S

if TYPE_CHECKING:
    from ...tuning.margins import Margins


def heading_loop(config: SteeringConfig, vessel: VesselConfig) -> list[str]:
    """Say what margins the law leaves over the speed range, and how fast the vessel is sailed because of them."""
    if config.profile != "model":
        return _other_law(config, vessel)
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


def _other_law(config: SteeringConfig, vessel: VesselConfig) -> list[str]:
    said, found = f"  heading     law '{config.profile}'", _seed_margins(config, vessel)
    if not found:
        return [f"{said}: see `companion tune margins`"]
    gain, phase = min(each.gain_db for each in found), min(each.phase_deg for each in found)
    return [
        f"{said}: at least {gain:.0f} dB and {phase:.0f} deg up to {found[-1].speed_mps:.1f} m/s "
        f"(bars {GAIN_BAR_DB:g} dB, {PHASE_BAR_DEG:g} deg)"
    ]


def seed_warnings(config: SteeringConfig, vessel: VesselConfig) -> list[str]:
    """Say at what speeds the gains of the seed's law miss the bars with this hull: nothing else asks before she sails by them."""
    missed = ", ".join(f"{each.speed_mps:g}" for each in _seed_margins(config, vessel) if not each.holds)
    mend = "companion tune gains finds others, or sail by profile model"
    return [f"SEED_HDG_P, _I, _D miss their margins at {missed} m/s: {mend}"] if missed else []


def _seed_margins(config: SteeringConfig, vessel: VesselConfig) -> list[Margins]:
    """Margins of the seed's law over the speeds; none of another law, or without python-control."""
    if config.profile != "seed" or config.seed.heading_gains is None or importlib.util.find_spec("control") is None:
        return []
    from ...tuning.margins import heading_margins

    return heading_margins(config, vessel, config.profile)
