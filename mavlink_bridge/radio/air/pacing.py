"""When a host may give its module the next bytes: not before the last packet is off the air, and after a least time of silence.

The module says nothing of what it does, so the time of each packet is computed.
"""

from __future__ import annotations

from typing import Final

from .airtime import PACKET_BYTES
from .profile import MODULE_US, RadioProfile

_WAY_US: Final = 25_000
"""From the end of a packet on the air to the first of its bytes here: the module, and this program's waking."""


class AirClock:
    """Computes when this end's packets leave the air."""

    def __init__(self, profile: RadioProfile) -> None:
        self.profile = profile
        self.off_us = 0
        """End of what this end last sent."""
        self._airtimes: dict[int, int] = {}
        self._gap_us = round(profile.link.gap_ms * 1e3)

    def airtime_us(self, size: int) -> int:
        """Airtime of a write, cut into packets as the module does."""
        known = self._airtimes.get(size)
        if known is None:
            whole, rest = divmod(size, PACKET_BYTES)
            airtime = self.profile.airtime_us
            known = self._airtimes[size] = whole * airtime(PACKET_BYTES) + (airtime(rest) if rest else 0)
        return known

    def line_us(self, size: int) -> int:
        """What a write takes on the serial line."""
        return round(size * self.profile.serial_byte_us)

    def span_us(self, size: int) -> int:
        """From the write to the end on the air."""
        return self.line_us(size) + MODULE_US + self.airtime_us(size)

    def came_us(self, size: int, now_us: int) -> tuple[int, int]:
        """First and last moment on the air of a packet of so many bytes that is whole here now."""
        end_us = now_us - _WAY_US - self.line_us(size)
        return end_us - self.airtime_us(size), end_us

    def sent(self, size: int, now_us: int) -> None:
        self.off_us = now_us + self.span_us(size)

    def is_free(self, now_us: int, lead_us: int = 0) -> bool:
        """True when a write now keeps the least time off the air; ``lead_us`` is what the write itself takes."""
        return now_us + lead_us >= self.off_us + self._gap_us
