"""When a fix was valid: by the receiver's own clock, against jitter of arrival."""

from __future__ import annotations

from typing import Final

_CLOCK_DRIFT: Final = 2e-4
"""Crystals of computers and receivers run apart by up to 200 ppm."""
_CLOCK_STEP_US: Final = 150_000
"""More than a serial line delays a sentence by: the clock was set."""


class ClockAligner:
    """Times of validity from the receiver's own clock: arrival jitters and is never early, UTC does not.

    Keeps the least delay seen; it may grow by 200 ppm, more than two crystals drift apart.
    """

    def __init__(self) -> None:
        self._least_us: float | None = None
        self._at_us = 0

    def align(self, t_us: int, utc_us: int | None) -> int:
        if utc_us is None:
            return t_us
        offset, least = float(t_us - utc_us), self._least_us
        if least is None or abs(offset - least) > _CLOCK_STEP_US:
            least = offset
        since_us, self._at_us = t_us - self._at_us, t_us
        if since_us > 0:
            least += _CLOCK_DRIFT * since_us
        self._least_us = least = offset if offset < least else least
        return round(utc_us + least)
