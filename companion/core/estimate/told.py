"""What comes and goes many times a second is told at a bounded rate, so that it does not hide the alarms beside it."""

from __future__ import annotations

from typing import Final

_PAUSE_US: Final = 10_000_000
"""Between two beginnings that are told: six a minute are read, two compasses on one line made 222 texts in 22 s."""


class ComesAndGoes:
    """Whether to tell that something begins, and that it is over: no beginning soon after the last, no end without its beginning."""

    def __init__(self) -> None:
        self._told_us: int | None = None
        self._is_told = False

    def begins(self, t_us: int) -> bool:
        self._is_told = self._told_us is None or t_us - self._told_us >= _PAUSE_US
        if self._is_told:
            self._told_us = t_us
        return self._is_told

    def ends(self) -> bool:
        was_told, self._is_told = self._is_told, False
        return was_told
