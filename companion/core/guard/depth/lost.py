"""When the sounder falls silent over a bottom that was closing: the last slope is reckoned on, by the way made since.

Nobody knows how the bottom goes on, but that it stops rising just then is the one guess that must not be made. The reckoning
ends when the vessel lies still: what happens then is an operator's decision.
"""

from __future__ import annotations

from typing import Final

_STILL_MPS: Final = 0.3
"""Slower, the bottom's slope is the change of depth over a way of nearly nothing."""


class LostBottom:
    """Keeps the last altitude and slope; ``seen`` while there is an altitude, ``reckon`` while there is none."""

    def __init__(self) -> None:
        self._altitude_m = self._slope = 0.0
        self._t_us = 0

    def seen(self, now_us: int, altitude_m: float, closing_mps: float, speed_mps: float) -> None:
        """Note the altitude of this moment, and how fast it falls at this speed."""
        self._t_us, self._altitude_m = now_us, altitude_m
        self._slope = closing_mps / speed_mps if speed_mps > _STILL_MPS else 0.0

    def reckon(self, now_us: int, speed_mps: float) -> tuple[float, float] | None:
        """Altitude in m and closing rate in m/s if the bottom goes on as it did; None when it was not closing."""
        way_m = speed_mps * (now_us - self._t_us) * 1e-6
        self._t_us = now_us
        if speed_mps <= _STILL_MPS:
            self._slope = 0.0
        if self._slope <= 0.0:
            return None
        self._altitude_m -= self._slope * way_m
        return self._altitude_m, self._slope * speed_mps
