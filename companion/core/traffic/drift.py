"""Whether one who says that she lies still goes somewhere: a straight line through her last places, and how sure it is.

A vessel drags at anchor, drifts slower than her receiver's noise of speed, or goes on under a status that her crew has left standing.
Her places tell it. What wanders about one place, or swings a little, gives no line. All in metres from her newest report.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.value import value

Velocity = tuple[float, float]
"""North and east, m/s."""
_HELD: Final = 24
"""Places: four minutes at a report each 10 s, in which the slowest drift that matters shows."""
_MADE_M: Final = 30.0
"""Made good along the line at least: boats sheer 12 m to either side of their anchor, and noise comes on top."""
_SURE_SIGMAS: Final = 4.0
"""Noise gives such a line once in three thousand times."""
_WANDER_S: Final = 60.0
"""So long a receiver is off to the same side: places closer together are no more proof than one."""
_TOLD_SIGMAS: Final = 2.5
"""And this is enough where her own speed and course say the same."""
_TOLD_SHARE: Final = 0.5
"""Of the line's speed: so near her own word is the same."""
_PAIR_MPS: Final = 0.4
"""Two places are a line for one who says that she is faster: at anchor none swings so fast."""
_BENT: Final = 2.5
"""Mean square of what the places are off their line, in sigmas: more is no straight line."""
_CHANGE_MPS: Final = 0.6
"""Four sigmas of a reported speed. Who differs so much from what she told before goes a new way: her places before say nothing."""
_GOES_ON: Final = 0.5
"""Of the proof: who was found to go is held to go on, for noise makes nobody stop."""


@value
class DriftLine:
    """The straight line that she goes."""

    north_m: float
    """From the newest report to where the line puts her."""
    east_m: float
    vn_mps: float
    ve_mps: float
    rate_mps: float
    """One sigma of the velocity, each axis."""
    place_m: float
    """One sigma of the place, each axis."""

    @property
    def speed_mps(self) -> float:
        return math.hypot(self.vn_mps, self.ve_mps)


_Place = tuple[float, float, float, Velocity | None]
"""Seconds, north and east from the newest report, and what she told there."""


class Places:
    """Her last places on what may be one line."""

    __slots__ = ("_goes", "_held")

    def __init__(self, told: Velocity | None) -> None:
        self._goes = False
        self._held: list[_Place] = [(0.0, 0.0, 0.0, told)]

    def add(self, moved_m: tuple[float, float], dt_s: float, told: Velocity | None) -> None:
        """A further report. ``moved_m``: from the report before to this one; ``told``: its speed and course."""
        before = self._told()
        if told is not None and before is not None and _apart(told, before) > _CHANGE_MPS:
            self._goes = False
            self._held = [(0.0, 0.0, 0.0, told)]
            return
        held = self._held[1 - _HELD :]
        self._held = [(at_s - dt_s, north - moved_m[0], east - moved_m[1], said) for at_s, north, east, said in held]
        self._held.append((0.0, 0.0, 0.0, told))

    def line(self, sigma_m: float) -> DriftLine | None:
        """The line that her places surely make; None: she may as well lie still. ``sigma_m``: of a place, each axis."""
        while len(self._held) >= 2:
            line, off2 = self._fit(sigma_m)
            if off2 <= _BENT * sigma_m * sigma_m:
                self._goes = self._is_sure(line)
                return line if self._goes else None
            del self._held[0]
        return None

    def _fit(self, sigma_m: float) -> tuple[DriftLine, float]:
        """Least squares, and the mean square of what is left, m2 each axis."""
        count = len(self._held)
        middle = [math.fsum(each) / count for each in zip(*(place[:3] for place in self._held), strict=True)]
        parts = [(at_s - middle[0], north - middle[1], east - middle[2]) for at_s, north, east, _ in self._held]
        spread = max(math.fsum(at_s * at_s for at_s, _, _ in parts), 1e-9)
        vn = math.fsum(at_s * north for at_s, north, _ in parts) / spread
        ve = math.fsum(at_s * east for at_s, _, east in parts) / spread
        off = [each for at_s, north, east in parts for each in (north - vn * at_s, east - ve * at_s)]
        left = math.fsum(each * each for each in off)
        line = DriftLine(
            north_m=middle[1] - vn * middle[0],
            east_m=middle[2] - ve * middle[0],
            vn_mps=vn,
            ve_mps=ve,
            rate_mps=sigma_m / math.sqrt(spread),
            place_m=sigma_m * math.sqrt(1.0 / count + middle[0] * middle[0] / spread),
        )
        return line, left / (2 * (count - 2)) if count > 2 else 0.0

    def _is_sure(self, line: DriftLine) -> bool:
        speed, told = line.speed_mps, self._told()
        agrees = told is not None and _apart(told, (line.vn_mps, line.ve_mps)) <= _TOLD_SHARE * speed
        if len(self._held) == 2 and not (agrees and speed >= _PAIR_MPS):
            return False
        span_s = -self._held[0][0]
        gap_s = span_s / (len(self._held) - 1)
        sigmas = _TOLD_SIGMAS if agrees else _SURE_SIGMAS * math.sqrt(max(1.0, _WANDER_S / max(gap_s, 1.0)))
        share = _GOES_ON if self._goes else 1.0
        return speed * span_s >= share * _MADE_M and speed >= share * sigmas * line.rate_mps

    def _told(self) -> Velocity | None:
        """The mean of what she told."""
        told = [said for *_, said in self._held if said is not None]
        if not told:
            return None
        return math.fsum(north for north, _ in told) / len(told), math.fsum(east for _, east in told) / len(told)


def _apart(one: Velocity, other: Velocity) -> float:
    return math.hypot(one[0] - other[0], one[1] - other[1])
