"""Whether the vessel can stem what carries it: at all, or at the speed at which it is steered with safe margins."""

from __future__ import annotations

from typing import Final

from ..hull import Handling

SPARED: Final = 0.96
"""Share of the top speed that is sailed: the rest is what steering needs."""
_LASTS_S: Final = 5.0
"""A gust is over by then."""
_BACK: Final = 0.8
"""Share of the speed below which what carries it is stemmed again."""


class Stemmed:
    """Holds the speed at which wind and current carry the vessel, m/s, against what it makes through the water."""

    def __init__(self, handling: Handling) -> None:
        self._top_mps = self._most_mps = self._fast_mps = SPARED * handling.top_mps
        self._outrun_s = 0.0
        self._told = False

    def limit(self, fast_mps: float, *, is_whole: bool) -> None:
        """Take the speed through the water that is not sailed beyond. ``is_whole``: for its margins' sake, not for want of thrust."""
        self._fast_mps = min(fast_mps, self._top_mps)
        self._most_mps = self._top_mps if is_whole else self._fast_mps

    def can(self, drift_mps: float) -> bool:
        """Whether the hull is faster than what carries it: one that is merely steered slower makes less leeway than one that lets go."""
        return drift_mps < self._most_mps

    def step(self, dt_s: float, drift_mps: float) -> str:
        """Return what to tell the operator, empty when there is nothing."""
        self._outrun_s = self._outrun_s + dt_s if drift_mps > self._fast_mps else 0.0
        if drift_mps < _BACK * self._fast_mps:
            self._told = False
        if self._told or self._outrun_s < _LASTS_S or not self.can(drift_mps):
            return ""
        self._told = True
        return (
            f"wind and current carry it at {drift_mps:.1f} m/s, and faster than {self._fast_mps:.1f} m/s it is not steered safely: "
            "it goes on trying, and loses ground"
        )
