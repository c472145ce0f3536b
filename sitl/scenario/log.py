"""What a scenario keeps of its run: one row for each tick, of the truth, of the board's pins and of the vessel's own picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.figures import Circle, Hover, radius_of, sense_of
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Goto, Loiter, Maneuver, Mode, PlanState
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.snapshot import Snapshot

from ..plant import Truth

NEUTRAL_US: Final = 1500.0
STILL_US: Final = 10.0
"""A pulse this near to the middle turns nothing."""


@dataclass(frozen=True, slots=True)
class TickRow:
    """One tick."""

    t_s: float
    north_m: float
    east_m: float
    speed_mps: float
    altitude_m: float | None
    pulses_us: tuple[float, ...]
    """At the board's pins: thrusters port and starboard, rudders port and starboard."""
    snapshot: Snapshot
    loiter: Loiter | None
    leg: tuple[NorthEast, NorthEast] | None
    path_error_m: float | None
    """To the figure of a loiter once it has been reached; outside a circle is positive."""
    clearance_m: float | None
    """To the nearest other vessel's hull; None: there is none."""
    bearing_rad: float | None
    """From the centre of the circle that is sailed."""

    @property
    def neutral(self) -> bool:
        """Thrusters stopped and rudders centred."""
        return all(abs(pulse - NEUTRAL_US) < STILL_US for pulse in self.pulses_us)


class Logbook:
    """Rows of a run. ``keel_m`` is the keel's depth below the surface."""

    def __init__(self, frame: LocalFrame, keel_m: float) -> None:
        self.rows: list[TickRow] = []
        self.frame = frame
        self._keel_m = keel_m
        self._reached = self._current = -1
        self._plan: Sequence[Maneuver] = ()

    def add(
        self,
        truth: Truth,
        snapshot: Snapshot,
        plan: Sequence[Maneuver],
        pulses_us: Sequence[float],
        clearance_m: float | None = None,
    ) -> None:
        """Take one tick. ``clearance_m``: to the nearest hull of another vessel."""
        if plan is not self._plan:
            self._plan, self._reached, self._current = plan, -1, -1
        here = NorthEast((truth.north_m, truth.east_m))
        item = self._item(snapshot)
        loiter = item if isinstance(item, Loiter) and self._joined(item, snapshot) else None
        self.rows.append(
            TickRow(
                t_s=truth.t_us * 1e-6,
                north_m=truth.north_m,
                east_m=truth.east_m,
                speed_mps=math.hypot(truth.vn_mps, truth.ve_mps),
                altitude_m=None if truth.depth_m is None else truth.depth_m - self._keel_m,
                pulses_us=tuple(pulses_us),
                snapshot=snapshot,
                loiter=loiter,
                leg=self._leg(item) if isinstance(item, Goto) else None,
                path_error_m=None if loiter is None else self._path_error_m(loiter, here, snapshot),
                clearance_m=clearance_m,
                bearing_rad=None if loiter is None else self._bearing_rad(loiter, here),
            )
        )

    def _item(self, snapshot: Snapshot) -> Maneuver | None:
        seq = snapshot.progress.seq
        under_way = snapshot.mode is Mode.AUTO and snapshot.armed and snapshot.progress.state is PlanState.ACTIVE
        steady = under_way and seq == self._current and seq < len(self._plan)
        self._current = seq  # in the tick of a change the path is still the old item's
        item = self._plan[seq] if steady else None
        return item if snapshot.path.cross_track_m is not None or _hovers(item) else None

    def _joined(self, item: Loiter, snapshot: Snapshot) -> bool:
        if snapshot.path.on_path:
            self._reached = item.seq
        return self._reached == item.seq

    def _leg(self, item: Goto) -> tuple[NorthEast, NorthEast] | None:
        before = next((other for other in reversed(self._plan[: item.seq]) if isinstance(other, Goto | Loiter)), None)
        if not isinstance(before, Goto):
            return None
        return self._point(before), self._point(item)

    def _point(self, item: Goto | Loiter) -> NorthEast:
        return self.frame.to_local(item.lat_rad, item.lon_rad)

    def _bearing_rad(self, item: Loiter, here: NorthEast) -> float | None:
        if not isinstance(item.figure, Circle):
            return None
        north_m, east_m = self._point(item)
        return math.atan2(here[1] - east_m, here[0] - north_m)

    def _path_error_m(self, item: Loiter, here: NorthEast, snapshot: Snapshot) -> float:
        centre = self._point(item)
        figure, flown_m = item.figure, abs(snapshot.path.orbit_radius_m or 0.0)
        radius_m = flown_m or radius_of(figure, 0.0) if isinstance(figure, Circle) else radius_of(figure, flown_m)
        return figure.error_m(centre, radius_m, here, sense_of(figure))


def _hovers(item: Maneuver | None) -> bool:
    """A point has no track to be off: its error is the distance."""
    return isinstance(item, Loiter) and isinstance(item.figure, Hover)
