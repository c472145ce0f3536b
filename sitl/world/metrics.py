"""How well the vessel sailed: for each plan item the error against truth and against its own estimate.

Circles count from the moment their path was first reached; legs while they are sailed. What ``--json`` prints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Goto, Loiter, Mode, PlanSpecification
from mavlink_bridge.language.snapshot import Snapshot

from ..plant import Truth


@dataclass(slots=True)
class RunningError:
    """Running RMS, mean and maximum of an error in metres."""

    count: int = 0
    total: float = 0.0
    squares: float = 0.0
    worst: float = 0.0

    def add(self, error_m: float) -> None:
        self.count += 1
        self.total += error_m
        self.squares += error_m * error_m
        size_m = error_m if error_m > 0.0 else -error_m
        if size_m > self.worst:
            self.worst = size_m

    def summary(self) -> dict[str, float] | None:
        if not self.count:
            return None
        return {
            "rms_m": round(math.sqrt(self.squares / self.count), 4),
            "max_m": round(self.worst, 4),
            "mean_m": round(self.total / self.count, 4),
        }


@dataclass(slots=True)
class ItemErrors:
    """One plan item's errors."""

    kind: str
    truth: RunningError = field(default_factory=RunningError)
    estimate: RunningError = field(default_factory=RunningError)


class Metrics:
    """Fed once per tick; cheap."""

    def __init__(self, frame: LocalFrame) -> None:
        self._frame = frame
        self._plan: PlanSpecification | None = None
        self._points: dict[int, tuple[float, float]] = {}
        self.items: dict[int, ItemErrors] = {}
        self.distance_m = 0.0
        self._last: tuple[float, float] | None = None

    def add(self, truth: Truth, snapshot: Snapshot, plan: PlanSpecification) -> None:
        """Take one tick."""
        here = (truth.north_m, truth.east_m)
        if self._last is not None:
            self.distance_m += math.dist(here, self._last)
        self._last = here
        path = snapshot.path
        if snapshot.mode is not Mode.AUTO or not snapshot.armed or path.cross_track_m is None:
            return
        if plan is not self._plan:
            self._plan = plan
            self._points = {
                item.seq: self._frame.to_local(item.lat_rad, item.lon_rad)
                for item in plan.maneuvers
                if isinstance(item, Goto | Loiter)
            }
        seq = snapshot.progress.seq
        item = plan.maneuvers[seq] if seq < len(plan.maneuvers) else None
        if isinstance(item, Loiter):
            if path.on_path:
                self._loiter(item, here, path.cross_track_m, path.orbit_radius_m)
        elif isinstance(item, Goto):
            self._leg(item, here, path.cross_track_m)

    def summary(self) -> list[dict[str, Any]]:
        return [
            {"item": seq, "kind": errors.kind, "truth": errors.truth.summary(), "estimate": errors.estimate.summary()}
            for seq, errors in sorted(self.items.items())
        ]

    def _errors(self, seq: int, kind: str) -> ItemErrors:
        errors = self.items.get(seq)
        if errors is None:
            errors = self.items[seq] = ItemErrors(kind)
        return errors

    def _loiter(self, item: Loiter, here: tuple[float, float], cross_m: float, radius_m: float | None) -> None:
        errors = self._errors(item.seq, item.figure.name)
        errors.estimate.add(cross_m)
        if isinstance(item.figure, Circle) and radius_m is not None:
            errors.truth.add(math.dist(here, self._points[item.seq]) - abs(radius_m))

    def _leg(self, item: Goto, here: tuple[float, float], cross_m: float) -> None:
        errors = self._errors(item.seq, "leg")
        errors.estimate.add(cross_m)
        begin, end = self._points.get(item.seq - 1), self._points[item.seq]
        if begin is None:
            return
        north, east = end[0] - begin[0], end[1] - begin[1]
        length = math.hypot(north, east)
        if length > 1e-6:
            errors.truth.add((north * (here[1] - begin[1]) - east * (here[0] - begin[0])) / length)
