"""What guidance is given to sail, and what it says of that after a step: the two words between it and whoever works off a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from mavlink_bridge.language.messages import Goto, Loiter
from mavlink_bridge.language.points import LatLon


class GuidanceReport(Protocol):
    """What guidance says after a step."""

    @property
    def arrived(self) -> bool: ...
    @property
    def on_path(self) -> bool: ...
    @property
    def turns(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Leg:
    """One thing to sail. A new ``generation`` tells guidance to begin afresh."""

    generation: int
    maneuver: Goto | Loiter
    previous: LatLon | None
    following: Goto | Loiter | None
    speed_mps: float
