"""Whether the heading that is told comes late: a compass that is damped, without a turn rate sensor beside it.

A hull is told to turn and is not seen to turn yet. What is missing of her turn is what her helm makes, less the same helm as late as the
heading: in a swing that goes against the helm as if it worked the wrong way round. One that does is seen at once, and no lateness makes
a hull turn against it.
"""

from __future__ import annotations

from typing import Final

_TAUS_S: Final = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Of compasses' damping: less does no harm, and with more nobody can steer."""
_NEVER_S: Final = 8.0
"""What this explains better is a helm that does nothing, not one that is seen late."""
_MEMORY_S: Final = 4.0
"""Half of a swing at a heading that is late: such a swing takes five to eight seconds."""
_LEFT: Final = 0.15
"""Share of what is missing that may be left. Late headings left 0.06 at most on the hulls that were tried, wires changed over 0.19
and more."""
_FORGETS: Final = 0.05
"""A swing that is not explained so takes back a twentieth of its time: in an hour of gusts each boat shows some."""
_SHOWN_S: Final = 12.0
"""So long in all it must look so until it is told: two swings, or three corners."""
_OWN_S: Final = 0.5
"""The estimate is so late by itself where no sensor tells the turn."""


class _Lag:
    """What one lateness leaves of what is missing."""

    def __init__(self, tau_s: float) -> None:
        self.tau_s, self._late_nm, self.left = tau_s, 0.0, 0.0

    def step(self, dt_s: float, helm_nm: float, missing_nm: float) -> None:
        self._late_nm += dt_s / self.tau_s * (helm_nm - self._late_nm)
        left_nm = missing_nm + helm_nm - self._late_nm
        self.left += dt_s / _MEMORY_S * (left_nm * left_nm - self.left)


class LateHeading:
    """One vessel; one call per tick."""

    def __init__(self, least_nm: float, set_s: float = 0.0) -> None:
        """``least_nm``: less that is missing is weather. ``set_s``: how late it is by the settings; no more than that is no news."""
        self._least, self._set_s = least_nm * least_nm, set_s
        self._lags = [_Lag(tau_s) for tau_s in _TAUS_S]
        self._never = _Lag(_NEVER_S)
        self._missing = self._shown_s = 0.0
        self.explains = False
        """A late heading is enough for what is missing now."""
        self.told_s = 0.0
        """By so much the heading is late; 0 while that is not certain."""

    @property
    def words(self) -> str:
        """What an operator is told; a compass that is late by so much without any damping has a delay."""
        late = f"Heading lags by about {self.told_s:.1f} s"
        return f"{late}: switch the compass's damping off, or set its heading_latency_s"

    def rest(self) -> None:
        """A sensor tells the turn: the heading is not late for those who steer by it."""
        self.explains = False

    def step(self, dt_s: float, helm_nm: float, missing_nm: float) -> None:
        """Take what thrusters and rudders should turn the hull by, and what is missing of all, after one low-pass."""
        for lag in (*self._lags, self._never):
            lag.step(dt_s, helm_nm, missing_nm)
        self._missing += dt_s / _MEMORY_S * (missing_nm * missing_nm - self._missing)
        best = min(self._lags, key=lambda lag: lag.left)
        self.explains = best.left < _LEFT * self._missing
        is_shown = self.explains and self._missing > self._least and best.left < self._never.left
        self._shown_s = self._shown_s + dt_s if is_shown else max(0.0, self._shown_s - _FORGETS * dt_s)
        late_s = best.tau_s - _OWN_S
        if self._shown_s > _SHOWN_S and not self.told_s and late_s > self._set_s:
            self.told_s = late_s
