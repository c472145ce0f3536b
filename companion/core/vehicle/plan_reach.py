"""How far away a plan lies: a plan of another place is not sailed by mistake.

Looked at when Auto is started, and when a plan is loaded (then it is only told); never when arming, by hand, for Hold or the way home;
an ordered go-to may be as far as a leg (``refusals.far_refusal``). The item to be sailed lies within one distance, and no leg is longer
than another; so it is with what a figure reaches from its middle and from side to side. An item that is nearer home than the vessel is
a way back and always near enough. A person may insist: ``PLAN_FAR_OK`` set to the number that the text names, over any link; it belongs
to that one plan. A speed beyond the hull's is refused when a plan is loaded.
Source: PX4's MIS_DIST_1WP (mission feasibility), whose limit is a switch for all plans.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.geodesy import LocalFrame, at_most_m, inverse
from mavlink_bridge.language.messages import EstimatedState, Goto, Jump, Loiter, Maneuver, PlanSpecification
from mavlink_bridge.language.points import LatLon

from ..config import Config, param

PLAN_NUMBERS: Final = 999_983
"""A prime below a million: a number of six digits crosses as REAL32 exactly, and is read out over a voice radio."""


FAR_OK: Final = "PLAN_FAR_OK"


class MissionConfig(Config):
    """How plans are sailed."""

    cruise_speed_mps: float = param(1.5, "CRUISE_SPEED", "Speed when a plan names none", unit="m/s", ge=0.1, le=20.0)
    approach_factor: float = param(
        4.0, "APPR_FACTOR", "An approach may last this many times its nominal time", unit="", ge=1.5, le=100.0
    )
    approach_extra_s: float = param(
        120.0, "APPR_EXTRA", "Time added to every approach's limit", unit="s", ge=10.0, le=3600.0
    )
    first_distance_m: float = param(
        1000.0,
        "MIS_DIST_1WP",
        "The item that is to be sailed when Auto is started lies within this",
        unit="m",
        ge=10.0,
        le=100_000.0,
    )
    """About what a person oversees from the pier, and what PX4 stores under this name (900 m). Farther: see `far_plan`."""
    leg_distance_m: float = param(
        5000.0,
        "MIS_DIST_WPS",
        "Longest leg of a plan that Auto starts, and farthest go-to",
        unit="m",
        ge=10.0,
        le=100_000.0,
    )
    """An hour at cruise speed without a waypoint. Farther: see `far_plan`."""
    rally_limit_km: float = param(
        5.0,
        "RALLY_LIMIT_KM",
        "Return leads to no rally point that is farther away than this; 0 = to any",
        unit="km",
        ge=0.0,
        le=100.0,
    )
    """As long as a leg may be: a rally point beyond was loaded for another water. ArduPilot has the name and 0.5 km for its rovers."""
    far_plan: int = param(
        0, "PLAN_FAR_OK", "Number of the one plan that may be sailed however far away it lies", ge=0, le=999_999
    )
    """The vessel's text names it. It counts for that plan only, and is 0 again as soon as another plan is loaded."""


def plan_number(plan_id: int) -> int:
    """Return the number by which a person names a plan: 1...999983, 0 for no plan."""
    return plan_id % PLAN_NUMBERS + 1 if plan_id else 0


@dataclass(frozen=True, slots=True)
class TooFar:
    """What lies farther than it may."""

    what: str
    distance_m: float
    parameter: str
    limit_m: float

    def text(self, number: int) -> str:
        """One sentence; what lets the plan sail comes first, because a radio cuts a text off."""
        mend = f"{FAR_OK}={number} accepts it: " if number else ""
        return f"Plan too far; {mend}{self.words}"

    @property
    def words(self) -> str:
        """What it is, with both numbers."""
        return f"{self.what} {shown(self.distance_m)}, limit {shown(self.limit_m)} ({self.parameter})"


class PlanReach:
    """Holds the plan in force against the two distances."""

    def __init__(self, config: MissionConfig) -> None:
        self.config = config
        self.number = 0
        """The number of the plan in force; 0 = none, or not known yet."""
        self._plan = PlanSpecification()
        self._legs: tuple[tuple[int, TooFar], ...] = ()
        self._seen: PlanSpecification | None = None
        self._begun: tuple[Sequence[Maneuver], LatLon] | None = None

    @property
    def accepted(self) -> bool:
        return self.config.far_plan != 0 and self.config.far_plan == self.number

    def is_new(self, plan: PlanSpecification, number: int, state: EstimatedState) -> bool:
        """Whether a plan was loaded that has not been looked at from a known place; then it counts as looked at."""
        self.number = number
        if plan is self._seen or not state.position_valid:
            return False
        self._seen = plan
        return True

    def refusal(
        self,
        plan: PlanSpecification,
        first: int,
        state: EstimatedState,
        home: LatLon | None,
        *,
        goes_on: bool = False,
        under_way: bool = False,
    ) -> str:
        """Return why a plan is not sailed from item ``first`` on, or an empty string.

        ``goes_on``: it was begun and stopped at this item, so its leg may be joined where the vessel is. ``under_way``: it is
        being sailed, so the next item may be as far as any leg is long.
        """
        if self.accepted or state.lat_rad is None or state.lon_rad is None:
            return ""
        here = LatLon((state.lat_rad, state.lon_rad))
        found = self._first(plan.maneuvers, first, here, home, goes_on=goes_on, under_way=under_way)
        if found is None:
            back = min((item.target_seq for item in plan.maneuvers[first:] if isinstance(item, Jump)), default=first)
            found = next((leg for seq, leg in self._long_legs(plan) if seq > min(first, back)), None)
        return "" if found is None else found.text(self.number)

    def begin(self, plan: PlanSpecification, state: EstimatedState) -> None:
        """A plan was started here."""
        if state.lat_rad is not None and state.lon_rad is not None:
            self._begun = plan.maneuvers, LatLon((state.lat_rad, state.lon_rad))

    def goes_on(self, plan: PlanSpecification) -> None:
        """A plan has taken the place of the one that was begun, and goes on where that one is."""
        if self._begun is not None:
            self._begun = plan.maneuvers, self._begun[1]

    def _first(
        self,
        items: Sequence[Maneuver],
        first: int,
        here: LatLon,
        home: LatLon | None,
        *,
        goes_on: bool,
        under_way: bool,
    ) -> TooFar | None:
        item = next((item for item in items[first:] if isinstance(item, Goto | Loiter)), None)
        if item is None:
            return None
        distance_m, across_m = _away_m(item, here), _across_m(item)
        config = self.config
        name, limit_m = "MIS_DIST_1WP", config.first_distance_m
        if under_way and config.leg_distance_m > limit_m:
            name, limit_m = "MIS_DIST_WPS", config.leg_distance_m
        if 0.5 * across_m > limit_m:
            return TooFar(f"item {item.seq} reaches from its middle", 0.5 * across_m, name, limit_m)
        if distance_m <= limit_m or (home is not None and _is_nearer(home, item, here)):
            return None
        before = self._before(items, first) if goes_on else None
        if before is not None and _off_leg_m(here, before, item) <= limit_m:
            return None
        return TooFar(f"item {item.seq} is away", distance_m, name, limit_m)

    def _before(self, items: Sequence[Maneuver], first: int) -> LatLon | None:
        """Where the leg to an item began: the item before it, or for the first one the place of the start."""
        for item in reversed(items[:first]):
            if isinstance(item, Goto | Loiter):
                return LatLon((item.lat_rad, item.lon_rad))
        return self._begun[1] if self._begun is not None and self._begun[0] is items else None

    def _long_legs(self, plan: PlanSpecification) -> tuple[tuple[int, TooFar], ...]:
        """Every leg that is too long, with the item that it leads to; worked out once for a plan."""
        limit_m = self.config.leg_distance_m
        if plan is not self._plan or any(leg.limit_m != limit_m for _, leg in self._legs):
            self._plan, self._legs = plan, tuple(long_legs(plan.maneuvers, limit_m))
        return self._legs

    def configure(self, config: MissionConfig) -> None:
        if config.leg_distance_m != self.config.leg_distance_m:
            self._plan = PlanSpecification()
        self.config = config


def speed_refusal(items: Sequence[Maneuver], top_mps: float) -> str:
    """Why a plan is too fast for a hull, or an empty string."""
    for item in items:
        speed_mps = getattr(item, "speed_mps", None)
        if speed_mps is not None and speed_mps > top_mps:
            return f"item {item.seq}: {speed_mps:.1f} m/s is more than the vessel's {top_mps:.1f} m/s"
    return ""


def long_legs(items: Sequence[Maneuver], limit_m: float) -> Iterator[tuple[int, TooFar]]:
    """Yield each leg and figure that is longer than ``limit_m``, with the number of the item that it leads to; jumps back count."""
    last: LatLon | None = None
    for item in items:
        found = item
        if isinstance(item, Jump):
            ahead = (other for other in items[item.target_seq :] if isinstance(other, Goto | Loiter))
            found = next(ahead, item)
        if not isinstance(found, Goto | Loiter):
            continue
        if last is not None and at_most_m(*last, found.lat_rad, found.lon_rad) > limit_m:
            length_m = inverse(*last, found.lat_rad, found.lon_rad)[0]
            if length_m > limit_m:
                yield item.seq, TooFar(f"leg to item {found.seq} is", length_m, "MIS_DIST_WPS", limit_m)
        if found is item and _across_m(item) > limit_m:
            yield item.seq, TooFar(f"item {item.seq} measures", _across_m(item), "MIS_DIST_WPS", limit_m)
        if found is item:
            last = LatLon((item.lat_rad, item.lon_rad))


def _away_m(item: Goto | Loiter, here: LatLon) -> float:
    """How far a waypoint, or a circle's line, is away."""
    distance_m = inverse(*here, item.lat_rad, item.lon_rad)[0]
    if isinstance(item, Loiter) and isinstance(item.figure, Circle):
        return abs(distance_m - abs(item.figure.radius_m or 0.0))
    return distance_m


def _across_m(item: Goto | Loiter) -> float:
    """From end to end of an item's figure; a radius that nobody names is the default one, and no mistake of the plan's."""
    figure = item.figure if isinstance(item, Loiter) else None
    if figure is None or isinstance(figure, Hover):
        return 0.0
    width_m = 2.0 * abs(figure.radius_m or 0.0)
    return width_m if isinstance(figure, Circle) else width_m + max(abs(figure.length_m or 0.0), width_m)


def _is_nearer(home: LatLon, item: Goto | Loiter, here: LatLon) -> bool:
    return inverse(*home, item.lat_rad, item.lon_rad)[0] < inverse(*home, *here)[0]


def _off_leg_m(here: LatLon, begin: LatLon, item: Goto | Loiter) -> float:
    """How far the vessel is from the way between two places, m."""
    frame = LocalFrame(*here)
    (x1, y1), (x2, y2) = frame.to_local(*begin), frame.to_local(item.lat_rad, item.lon_rad)
    length2 = (x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1)
    share = 0.0 if length2 == 0.0 else min(max(-(x1 * (x2 - x1) + y1 * (y2 - y1)) / length2, 0.0), 1.0)
    return math.hypot(x1 + share * (x2 - x1), y1 + share * (y2 - y1))


def shown(distance_m: float) -> str:
    """A distance as the texts tell it."""
    return f"{distance_m:.0f} m" if distance_m < 10_000.0 else f"{distance_m / 1000.0:.0f} km"
