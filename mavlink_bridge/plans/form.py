"""One form for every plan file: what a file holds, and how seven numbers become an item and come back.

Inside there is no home item: the planned home stands beside the mission, and DO_JUMP targets count from 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.units import E7

from ..language.requests import PlanItem, PlanKind
from ..mavlink.missions.plan_rules import GLOBAL_FRAMES
from ..mavlink.wire.mapping import INT32_UNKNOWN, deg_to_degE7

MAX_BYTES: Final = 8_000_000
MAX_FLOAT: Final = 3.4028234e38
"""What a field of a mission item can carry."""


class PlanFileError(ValueError):
    """Not a plan file that can be used; ``problems`` says why, one sentence each."""

    def __init__(self, *problems: str) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems


@dataclass(frozen=True, slots=True)
class PlanFile:
    """What a file holds, in canonical form. Kinds that the file does not mention are empty."""

    mission: tuple[PlanItem, ...] = ()
    fence: tuple[PlanItem, ...] = ()
    rally: tuple[PlanItem, ...] = ()
    home_rad: tuple[float, float] | None = None
    """The planned home, which only the operator's map needs."""
    format: str = ""
    notes: tuple[str, ...] = ()
    """What was understood in a way worth telling."""

    def items(self, kind: PlanKind) -> tuple[PlanItem, ...]:
        return (self.mission, self.fence, self.rally)[kind.value]


def make_item(command: int, frame: int, params: Sequence[float], autocontinue: int = 1) -> PlanItem:
    """An item from seven numbers, the fifth and sixth in degrees when the frame is a global one; NaN = not given.

    Raises PlanFileError for a number that no item can carry.
    """
    param1, param2, param3, param4, x, y, z = params
    if any(math.isfinite(value) and abs(value) > MAX_FLOAT for value in params):
        raise PlanFileError(f"an item of command {command} has a number that is too large")
    if frame in GLOBAL_FRAMES:
        return PlanItem(
            command=command,
            frame=frame,
            param1=param1,
            param2=param2,
            param3=param3,
            param4=param4,
            x=deg_to_degE7(x),
            y=deg_to_degE7(y),
            z=z,
            autocontinue=autocontinue,
        )
    return PlanItem(
        command=command,
        frame=frame,
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        x=_plain(x),
        y=_plain(y),
        z=z,
        autocontinue=autocontinue,
    )


def _plain(value: float) -> int:
    return round(value) if math.isfinite(value) and abs(value) < INT32_UNKNOWN else INT32_UNKNOWN


def coordinates(item: PlanItem) -> tuple[float, float]:
    """The fifth and sixth number of an item as files write them: degrees in a global frame; NaN when not given."""
    scale = E7 if item.frame in GLOBAL_FRAMES else 1.0
    x, y = (math.nan if value == INT32_UNKNOWN else value / scale for value in (item.x, item.y))
    return x, y
