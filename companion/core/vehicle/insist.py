"""Every refusal in one table: whether it stops only a departure or a vessel under way too, and by what a person insists.

A new check refuses a departure, never a way back. Whoever adds one adds its row; the texts of refusals take from here what lifts them,
and docs/REFUSALS.md is made of it. What can be insisted on can be over every link, the radio too: arming with force, a parameter, or a
command are requests like all others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

FORCE: Final = "arm with force to insist"
"""MAV_CMD_COMPONENT_ARM_DISARM with parameter 2 = 21196 (QGroundControl: Force Arm; MAVProxy: arm throttle force)."""
FENCE: Final = "FENCE_ENABLE=0 insists"
CHART: Final = "DEPTH_ENABLE=0 insists"
REQUIRED: Final = "DEPTH_REQUIRED=0 insists"
UNLOCK: Final = "USER_1 (command 31010) unlocks it"
MANUAL: Final = "Manual is obeyed"
FAR: Final = "PLAN_FAR_OK=<number> accepts this plan"
FAR_TARGET: Final = "MIS_DIST_WPS=<metres> allows it"
NEVER: Final = "cannot be insisted on"


@dataclass(frozen=True, slots=True)
class Refusal:
    """One refusal."""

    asked: str
    """What was asked for."""
    why: str
    under_way: str
    """What it does on a voyage: refuses as well, or what is let through."""
    insist: str
    """By what a person insists."""


_NOT_THEN: Final = "not asked: only what the gate needs"
TABLE: Final = (
    Refusal("arming", "terminated", "refuses", f"{NEVER}: restart"),
    Refusal(
        "arming",
        "actuator board not open, mute, silent, of another protocol, or its emergency stop pressed",
        "refuses",
        NEVER,
    ),
    Refusal("arming", "store: another world's was set aside, or cannot be written", _NOT_THEN, FORCE),
    Refusal("arming", "no ground station heard", _NOT_THEN, FORCE),
    Refusal("arming", "battery low, battery sensor lost", _NOT_THEN, FORCE),
    Refusal(
        "arming",
        "position sources or compasses disagree; no position, no heading (where it would steer itself)",
        _NOT_THEN,
        FORCE,
    ),
    Refusal("arming", "depth guard locked; water depth unknown and required", _NOT_THEN, FORCE),
    Refusal("arming", "outside the fence", _NOT_THEN, FORCE),
    Refusal("arming in Auto", "no plan loaded; the plan leaves the fence", _NOT_THEN, FORCE),
    Refusal("arming", "a failsafe's cause still stands", _NOT_THEN, FORCE),
    Refusal("Auto, start, go on", "an item, or the way there, lies outside the fence", "refuses", FENCE),
    Refusal(
        "Auto, start",
        "the plan lies far away or has a long leg",
        "a plan that has begun goes on; items nearer home pass",
        FAR,
    ),
    Refusal(
        "Auto, Return, Guided, Circle",
        "no position; no plan; no home",
        "refuses",
        f"{NEVER}: there is nothing to sail by; {MANUAL}",
    ),
    Refusal("go-to, orbit", "the target lies outside the fence", "refuses", FENCE),
    Refusal("go-to, orbit", "the target is charted too shallow", "a target nearer home passes", CHART),
    Refusal(
        "go-to, orbit", "the target lies farther away than a leg may be", "a target nearer home passes", FAR_TARGET
    ),
    Refusal("any order to move", "the depth guard is locked", "refuses", UNLOCK),
    Refusal("Hold", "the depth guard is locked, and has stopped the vessel", "refuses; it stops sticks", UNLOCK),
    Refusal(
        "Hold",
        "a thruster pushes the wrong way, or one alone cannot steer, and that has stopped the vessel",
        "refuses; it stops sticks",
        f"disarm and arm again; {MANUAL}",
    ),
    Refusal("any order to move", "water depth unknown, and depth.required is set", "Return passes", REQUIRED),
    Refusal(
        "Auto, Return, go-to, orbit",
        "the way there leads over the shoal that stopped the vessel, and the sounder is silent",
        "refuses; sailed with depth.unknown_policy = slow",
        MANUAL,
    ),
    Refusal("any order to move", "a failsafe disarmed the vessel", "refuses", "arm again"),
    Refusal(
        "any order to move",
        "a failsafe holds or stops it, and its cause stands or is not gone for long enough",
        "refuses",
        f"{MANUAL}; where takeover is *nobody* (SAFETY.md): {NEVER}",
    ),
    Refusal("any order to move", "terminated", "refuses", f"{NEVER}: restart"),
    Refusal("plan upload", "the plan leads over charted shoals", "refuses; the old plan stays", CHART),
    Refusal("plan upload, go-to, speed", "faster than the vessel can go", "refuses", "ask for less"),
    Refusal("parameter", "a file with it would be refused (gains of nothing, no thrust, no pulse)", "refuses", NEVER),
    Refusal(
        "any order to move; plan, fence, rally points, home, parameters; erasing logs; restart, shutdown",
        "the sender is not in operator.ids",
        "refuses; Hold, Return, Disarm pass",
        f"{NEVER}: another station",
    ),
    Refusal("sticks", "another station has them", "refuses", "take Manual; free after OWNER_TIMEOUT"),
    Refusal("erasing logs", "armed", "refuses", "disarm first"),
    Refusal("restart", "armed", "refuses", "disarm first"),
    Refusal("shutdown", "by radio; armed; not where it was started", "refuses", f"{NEVER}: a restart is obeyed"),
)


def table_markdown() -> str:
    """The table for people."""
    head = "| asked for | refused because | on a voyage | by what one insists |\n| --- | --- | --- | --- |\n"
    return head + "".join(f"| {row.asked} | {row.why} | {row.under_way} | {row.insist} |\n" for row in TABLE)
