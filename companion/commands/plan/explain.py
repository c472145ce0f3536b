"""A plan in words: what each item means to the vessel, how far and how long, and what would be refused."""

from __future__ import annotations

import math
from collections.abc import Iterator

from mavlink_bridge.language import messages as imc
from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items, load_plan
from mavlink_bridge.mavlink.missions.plan_rules import PlanError, PlanLimits
from mavlink_bridge.mavlink.missions.wire import command_name, describe
from mavlink_bridge.plans import PlanFile

from ...core.guard.fence import Fence, FenceConfig
from ...core.guide import GuidanceConfig
from ...core.vehicle.plan_fence import PlanFence, Trespass
from ...core.vehicle.plan_reach import MissionConfig, long_legs


def refusals(plan: PlanFile, limits: PlanLimits) -> list[str]:
    """Every reason for which the vessel would refuse the plan; items counted from 0."""
    texts = [describe(error, _at(plan, error)) for error in compile_items(plan.mission, limits).errors]
    for kind, name in ((PlanKind.FENCE, "fence"), (PlanKind.RALLY, "rally")):
        result = load_plan(kind, plan.items(kind), limits)
        if isinstance(result, PlanError):
            texts.append(f"{name} {describe(result, None)}")
    return texts or [f"{found.text}: it is not started" for found in trespasses(plan, limits)]


def trespasses(plan: PlanFile, limits: PlanLimits) -> tuple[Trespass, ...]:
    """Items that lead out of the plan's own fence."""
    fence, loaded = Fence(FenceConfig()), load_plan(PlanKind.FENCE, plan.fence, limits)
    compiled = compile_items(plan.mission, limits).plan
    first = next((item for item in compiled.maneuvers if isinstance(item, imc.Goto | imc.Loiter)), None)
    if isinstance(loaded, PlanError) or first is None:
        return ()
    fence.load(loaded.fence)
    check = PlanFence(fence)
    about = imc.EstimatedState(0, origin_lat_rad=first.lat_rad, origin_lon_rad=first.lon_rad)
    check.step(0, compiled, about, GuidanceConfig().loiter_radius_m)
    return check.trespasses()


def far_legs(plan: PlanFile, config: MissionConfig) -> list[str]:
    """Legs that the vessel does not sail without being asked, each with both lengths."""
    compiled = compile_items(plan.mission).plan
    return [leg.words for _, leg in long_legs(compiled.maneuvers, config.leg_distance_m)]


def _at(plan: PlanFile, error: PlanError) -> PlanItem | None:
    return plan.mission[error.seq] if 0 <= error.seq < len(plan.mission) else None


def explain(plan: PlanFile, limits: PlanLimits) -> Iterator[str]:
    """One line for each item, then the length of the way."""
    last: tuple[float, float] | None = None
    total_m = 0.0
    for maneuver in compile_items(plan.mission, limits).plan.maneuvers:
        leg = ""
        if isinstance(maneuver, imc.Goto | imc.Loiter):
            here = (maneuver.lat_rad, maneuver.lon_rad)
            if last is not None:
                distance_m, bearing_rad = inverse(*last, *here)
                total_m += distance_m
                leg = f"  {distance_m:.0f} m on {math.degrees(bearing_rad) % 360.0:03.0f}"
            last = here
        yield f"{maneuver.seq:4d}  {sentence(maneuver)}{leg}"
    if total_m:
        yield f"      {total_m:.0f} m between the points, jumps not counted"


def sentence(maneuver: imc.Maneuver) -> str:
    """What a manoeuvre does."""
    match maneuver:
        case imc.Goto():
            hold = f", hold {maneuver.hold_s:g} s" if maneuver.hold_s else ""
            return f"sail to {_place(maneuver)}{hold}"
        case imc.Loiter():
            return _loiter(maneuver)
        case imc.ChangeSpeed():
            return "speed: default" if maneuver.speed_mps is None else f"speed {maneuver.speed_mps:g} m/s"
        case imc.Delay():
            until = maneuver.until_utc_s_of_day
            return f"hold {maneuver.duration_s or 0:g} s" if until is None else f"hold until {_clock(until)} UTC"
        case imc.Jump():
            times = "for ever" if maneuver.repeats < 0 else f"{maneuver.repeats} times"
            return f"jump to item {maneuver.target_seq}, {times}"
        case imc.ReturnHome():
            return "return to the nearest rally point or home"
        case imc.SetHome():
            return "set home" + ("" if maneuver.lat_rad is not None else " here")
        case imc.FenceEnable():
            return f"fence {'on' if maneuver.enable else 'off'}"
        case imc.Noted():
            return f"{command_name(maneuver.command)}: noted and passed over"


def _loiter(loiter: imc.Loiter) -> str:
    parts = [f"{loiter.figure.name} loiter about {_place(loiter)}", *loiter.figure.words()]
    if loiter.turns is not None:
        parts.append(f"{loiter.turns:g} turns")
    elif loiter.duration_s is not None:
        parts.append(f"{loiter.duration_s:g} s from reaching it")
    else:
        parts.append("for ever")
    return ", ".join(parts)


def _place(point: imc.Goto | imc.Loiter) -> str:
    return f"{math.degrees(point.lat_rad):.7f} {math.degrees(point.lon_rad):.7f}"


def _clock(second_of_day: float) -> str:
    minute, second = divmod(round(second_of_day), 60)
    return f"{minute // 60:02d}:{minute % 60:02d}:{second:02d}"
