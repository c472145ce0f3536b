"""The way that a receiver's own speed leads: what its places are held against."""

from __future__ import annotations

from typing import Final

from ..antenna import Pair

_GAP_US: Final = 3_200_000
"""After a longer silence the way between is not known: three periods of the slowest receiver."""


class ReceiverWay:
    """From one fix to the next."""

    def __init__(self) -> None:
        self._last_us = 0
        self._last: complex | None = None

    def since(self, t_us: int, mps: Pair | None) -> complex | None:
        """Return the way since the fix before, m north and east; None where it is not known."""
        since_us, self._last_us = t_us - self._last_us, t_us
        before, self._last = self._last, None if mps is None else complex(*mps)
        if before is None or self._last is None or not 0 < since_us < _GAP_US:
            return None
        return 0.5e-6 * since_us * (before + self._last)
