"""All simulated vessels of a world: moved with it, heard by its AIS receiver."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

from mavlink_bridge.language.geodesy import LocalFrame

from .target import Target, VesselText
from .transmitter import AisText, Transmitter


class Fleet:
    """``step`` moves them and returns what the boat's receiver hands on."""

    def __init__(self, texts: Sequence[VesselText], ais: AisText, frame: LocalFrame, seed: int | str) -> None:
        self.targets = [Target(text, number) for number, text in enumerate(texts)]
        self.air = [
            Transmitter(target, frame, ais, random.Random(f"{seed}/traffic/{number}"))
            for number, target in enumerate(self.targets)
        ]
        self.ais = ais
        self._last_us: int | None = None

    def step(self, now_us: int, utc_us: int, own: tuple[float, float, float, float]) -> bytes:
        """``own``: the boat's north, east and their rates, for those that give way to her."""
        dt_s = 0.0 if self._last_us is None else (now_us - self._last_us) * 1e-6
        self._last_us = now_us
        heard = []
        for target, air in zip(self.targets, self.air, strict=True):
            if dt_s:
                target.step(dt_s, own)
            heard.append(air.due(now_us * 1e-6, utc_us))
        return b"".join(heard)

    def nearest_m(self, north_m: float, east_m: float) -> float | None:
        """The true distance from a point to the nearest hull; None without vessels."""
        return min((hull_distance_m(target, north_m, east_m) for target in self.targets), default=None)

    def configure(self, ais: AisText) -> None:
        """Change how the receiver hears."""
        self.ais = ais
        for air in self.air:
            air.config = ais


def hull_distance_m(target: Target, north_m: float, east_m: float) -> float:
    """The true distance from a point to a vessel's hull, a stadium about her middle; below 0: inside."""
    dn, de = north_m - target.north_m, east_m - target.east_m
    cosine, sine = math.cos(target.course_rad), math.sin(target.course_rad)
    along, across = dn * cosine + de * sine, de * cosine - dn * sine
    half = target.text.width_m / 2.0
    reach = max(0.0, target.text.length_m / 2.0 - half)
    beyond = max(0.0, abs(along) - reach)
    return math.hypot(beyond, across) - half
