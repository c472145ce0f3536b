"""How many texts are said in a time: in a crowd, and in a flood that somebody makes, words are noise. Memory is bounded."""

from __future__ import annotations

from typing import Final

TEXTS_MAX: Final = 10
TEXTS_US: Final = 10_000_000
"""After so many texts in this time the rest wait or are left out: a link of some kbit/s carries no more beside the boat's state."""


class Throttle:
    """Counts what was said."""

    def __init__(self) -> None:
        self._spoken_us: list[int] = []

    def has_room(self, now_us: int) -> bool:
        """Whether one more may be said."""
        self._spoken_us = [at_us for at_us in self._spoken_us if now_us - at_us < TEXTS_US]
        return len(self._spoken_us) < TEXTS_MAX

    def spend(self, now_us: int) -> None:
        """One was said, with room or without."""
        self._spoken_us.append(now_us)
