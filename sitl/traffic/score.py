"""What truly happened in an encounter, vessel by vessel: the judge that knows the truth and nothing of the boat's own reckoning.

Distances to hulls by small steps, roles by its own angles, risk by sailing the present courses on. Where angles lie so near a limit that
two honest judges may differ (the grey zones), it says so and takes no side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from .fleet import hull_distance_m
from .target import Target

COLLISION_M: Final = 2.0
"""To the hull; holds our own boat, which is a point here."""
LOOK_S: Final = 180.0
_STEP_S: Final = 2.0
SURELY_CLOSE: Final = 0.25
"""Of the wanted clearance: who comes so near was close by any honest reckoning; close itself begins at half of it."""


@dataclass(slots=True)
class VesselTruth:
    """One vessel's."""

    wanted_m: float
    least_m: float = math.inf
    least_s: float = 0.0
    near_s: float | None = None
    """When her hull first came surely close."""
    risk_s: float | None = None
    """When her true course and ours first led within the wanted clearance, inside the look-ahead."""
    predicted: list[tuple[float, float]] = field(default_factory=list)
    """Time, and the least distance to her hull if both went straight on from then, every two seconds."""

    @property
    def collision(self) -> bool:
        return self.least_m < COLLISION_M

    @property
    def close(self) -> bool:
        """Within half of the wanted clearance."""
        return self.least_m < 0.5 * self.wanted_m

    @property
    def within(self) -> bool:
        return self.least_m < self.wanted_m

    def least_predicted_m(self, from_s: float, to_s: float) -> float:
        """The least clearance that straight courses promised in a span of time."""
        return min((metres for at_s, metres in self.predicted if from_s <= at_s <= to_s), default=math.inf)


def wanted_m(target: Target) -> float:
    """40 m for ships of 20 m and more, 20 m for others."""
    return 40.0 if target.text.length_m >= 20.0 else 20.0


class Scorer:
    """Fed with the truth as it happens: ``step`` after each step of the world."""

    def __init__(self, targets: list[Target], own_mps: float) -> None:
        self._targets = targets
        self._own_mps = own_mps
        self.truths = [VesselTruth(wanted_m(target)) for target in targets]
        self._last: list[tuple[float, float]] = []
        self._looked_s = -math.inf

    def step(self, now_s: float, own: tuple[float, float], own_velocity: tuple[float, float]) -> None:
        """``own``: our true north and east, m; ``own_velocity``: over ground, m/s."""
        places = [(own[0] - each.north_m, own[1] - each.east_m) for each in self._targets]
        for number, (target, truth) in enumerate(zip(self._targets, self.truths, strict=True)):
            metres = self._between(target, places[number], self._last[number] if self._last else places[number])
            if metres < truth.least_m:
                truth.least_m, truth.least_s = metres, now_s
            if truth.near_s is None and metres < SURELY_CLOSE * truth.wanted_m:
                truth.near_s = now_s
        self._last = places
        if now_s - self._looked_s >= _STEP_S - 1e-9:
            self._looked_s = now_s
            for target, truth in zip(self._targets, self.truths, strict=True):
                self._look(now_s, target, truth, (own, own_velocity))

    @staticmethod
    def _between(target: Target, now: tuple[float, float], before: tuple[float, float]) -> float:
        """The least distance to her hull since the last step; near her in tenths of it."""
        reach = target.text.length_m
        if math.hypot(*now) > reach + 100.0:
            return math.hypot(*now) - reach
        parts = 10
        steps = [
            (now[0] + (before[0] - now[0]) * n / parts, now[1] + (before[1] - now[1]) * n / parts) for n in range(parts)
        ]
        return min(hull_distance_m(target, target.north_m + n, target.east_m + e) for n, e in steps)

    def _look(
        self, now_s: float, target: Target, truth: VesselTruth, us: tuple[tuple[float, float], tuple[float, float]]
    ) -> None:
        own, velocity = us
        north, east = own[0] - target.north_m, own[1] - target.east_m
        vn = velocity[0] - target.speed_mps * math.cos(target.course_rad)
        ve = velocity[1] - target.speed_mps * math.sin(target.course_rad)
        if math.hypot(north, east) - math.hypot(vn, ve) * LOOK_S > target.text.length_m + 200.0:
            return
        least = _least_ahead(target, (north, east), (vn, ve))
        truth.predicted.append((now_s, least))
        if truth.risk_s is None and least < truth.wanted_m:
            truth.risk_s = now_s


def _least_ahead(target: Target, place: tuple[float, float], rate: tuple[float, float]) -> float:
    """The least distance to her hull within the look-ahead on straight courses: coarse steps, then fine ones about the least."""

    def at(seconds: float) -> float:
        north, east = place[0] + rate[0] * seconds, place[1] + rate[1] * seconds
        return hull_distance_m(target, target.north_m + north, target.east_m + east)

    coarse = min(range(0, round(LOOK_S) + 1, 6), key=at)
    low, high = max(0.0, coarse - 6.0), min(LOOK_S, coarse + 6.0)
    for _ in range(12):  # the distance to a convex hull has one least along a straight line
        third = (high - low) / 3.0
        if at(low + third) < at(high - third):
            high -= third
        else:
            low += third
    return at((low + high) / 2.0)


ROLES: Final = ("head-on", "give way", "stand on", "overtaking", "overtaken")


def true_role(target: Target, own: tuple[float, float], own_course_rad: float, own_mps: float) -> tuple[str, bool]:
    """Our role towards her by the truth, and whether its angles or speeds lie in a grey zone."""
    if target.speed_mps < 0.4:
        return "obstacle", target.speed_mps > 0.1
    bearing_deg = math.degrees(math.atan2(target.east_m - own[1], target.north_m - own[0]))
    beta = (bearing_deg - math.degrees(own_course_rad) + 180.0) % 360.0 - 180.0
    alpha = (bearing_deg - math.degrees(target.course_rad)) % 360.0 - 180.0
    gamma = abs((math.degrees(target.course_rad - own_course_rad) + 180.0) % 360.0 - 180.0)
    faster = own_mps > target.speed_mps
    grey = min(abs(abs(alpha) - 112.5), abs(abs(beta) - 112.5)) < 5.0
    grey = grey or (abs(own_mps - target.speed_mps) < 0.3 and max(abs(alpha), abs(beta)) > 107.5)
    if faster and abs(alpha) > 112.5:
        return "overtaking", grey
    if not faster and abs(beta) > 112.5:
        return "overtaken", grey
    nearly = abs(beta) <= 22.5 + 5.0 and gamma >= 157.5 - 5.0
    surely = abs(beta) <= 6.0 and gamma >= 174.0
    if nearly:
        return "head-on", grey or not surely
    return ("give way" if beta > 0.0 else "stand on"), grey or abs(beta) < 5.0 or abs(beta) > 175.0
