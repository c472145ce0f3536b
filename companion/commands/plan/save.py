"""A plan into a file, in the format that the end of its name says."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from mavlink_bridge.language.messages import ChangeSpeed, Loiter
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.plans import PlanFile, seed_json, write_plan
from mavlink_bridge.plans.files import write_wpl

from ...io.whole_file import write_whole
from ...settings import ConfigError

_WPL: Final = (".txt", ".waypoints", ".wpl")
_WHOLE: Final = ".plan"
"""The one format that holds fence and rally points too."""
_MEND: Final = f"end it in {_WHOLE}, which holds every plan"


def check_ending(out: Path) -> None:
    """Raise ConfigError for a name whose end says no format."""
    if out.suffix.lower() not in (".plan", ".json", *_WPL):
        mend = f"end it in .plan (QGroundControl), .json (the seed's) or {', '.join(_WPL)} (WPL 110)"
        raise ConfigError(str(out), [f"{out.suffix or 'no ending'}: no plan format; {mend}"])


def write_file(plan: PlanFile, out: Path) -> None:
    """Write a plan in the format that the name's end says. Raises ConfigError for another end."""
    check_ending(out)
    if out.suffix.lower() == _WHOLE:
        write_whole(out, write_plan(plan).encode("utf-8"))
    elif out.suffix.lower() == ".json":
        write_whole(out, _seed_text(plan, out.stem).encode("utf-8"))
    else:
        write_whole(out, write_wpl(plan).encode("utf-8"))
    if out.suffix.lower() != _WHOLE and (plan.fence or plan.rally):
        print(f"{out}: the format holds only the mission; fence and rally points are left out", file=sys.stderr)


def save(plan: PlanFile, out: Path) -> None:
    """Write a plan and print what the file holds. Raises ConfigError for a plan that its format cannot hold."""
    holds = plan if out.suffix.lower() == _WHOLE else PlanFile(plan.mission)
    if holds is not plan and not plan.mission:
        raise ConfigError(str(out), [f"a plan without a mission, and the format holds nothing else; {_MEND}"])
    try:
        write_file(plan, out)
    except seed_json.SeedJsonError as error:
        raise ConfigError(str(out), [f"{error}; or {_MEND}"]) from None
    print(f"{out}: {len(holds.mission)} items, fence {len(holds.fence)}, rally {len(holds.rally)}")


def _seed_text(plan: PlanFile, name: str) -> str:
    compiled = compile_items(plan.mission)
    lines: list[str] = []
    speed: float | None = None
    for maneuver in compiled.plan.maneuvers:
        if isinstance(maneuver, ChangeSpeed):
            speed = maneuver.speed_mps
        elif isinstance(maneuver, Loiter):
            lines.append(seed_json.write(f"{name}-{len(lines) + 1}", maneuver, speed))
        else:
            raise seed_json.SeedJsonError(f"item {maneuver.seq} is no loiter, and the seed's JSON holds only loiters")
    if compiled.errors or not lines:
        raise seed_json.SeedJsonError("the plan has no loiter that the vessel would sail")
    return lines[0] + "\n" if len(lines) == 1 else "[" + ",\n".join(lines) + "]\n"
