"""When the vessel will be shown, on a channel where each word is dear: told to the stations while they wait for it.

A vessel that has used up its hour can say nothing, not even when it will. The shore reckons it from what it has heard of the vessel,
as if the vessel had spent all that it may: so long it takes at most until enough of that is an hour old. It costs no air.
"""

from __future__ import annotations

import math
from typing import Final

from ..air.ledger import Ledger, Priority
from ..hello import HELLO_FRAME_BYTES, SHOWN_BYTES
from ..link import CompactLink

_PATIENCE_US: Final = 40_000_000
"""Both ends have said all that they say of themselves by then, and a station is told within a minute."""
_AGAIN_US: Final = 60_000_000
_PACKET_US: Final = 150_000
"""Frames that are whole within so short a time came in one packet; another one takes longer on the air."""


class Showing:
    """Call ``word`` a few times a second. ``heard``: what the vessel has had on the air, as far as it was heard."""

    def __init__(self, link: CompactLink, heard: Ledger, now_us: int = 0) -> None:
        self._link = link
        self._heard = heard
        self._packet_us, self._packet_bytes = now_us, 0
        self._starts: set[bytes] = set()
        self._state_us: int | None = None
        self._since_us: int | None = now_us
        """Since when the stations wait for a state; None = they see the vessel."""
        self._latest_us = self._said_us = 0
        link.opener.on_good = self._on_good

    def _on_good(self, size: int, now_us: int) -> None:
        """Note a frame of the vessel."""
        airtime_us = self._link.profile.airtime_us
        if now_us - self._packet_us > _PACKET_US:
            self._packet_us, self._packet_bytes = now_us, 0
        before_us = airtime_us(self._packet_bytes) if self._packet_bytes else 0
        self._packet_bytes += size
        self._heard.charge(airtime_us(self._packet_bytes) - before_us, now_us)

    def word(self, now_us: int, state_us: int | None) -> str:
        """What to tell now, "" for nothing. ``state_us``: when the newest state was true."""
        starts = {session.other for session in self._link.pairing.sessions}
        if not starts <= self._starts:
            self._starts |= starts
            self._since_us, self._latest_us = now_us, 0
        if state_us != self._state_us:
            self._state_us, self._since_us = state_us, None
        if self._link.profile.link.batch == 1 or self._since_us is None:
            return ""
        if now_us - self._since_us < _PATIENCE_US or (self._latest_us and now_us - self._said_us < _AGAIN_US):
            return ""
        self._said_us = now_us
        return self._words(now_us)

    def _words(self, now_us: int) -> str:
        is_answered = bool(self._starts)
        size = SHOWN_BYTES if is_answered else HELLO_FRAME_BYTES + SHOWN_BYTES
        if not self._latest_us:
            need_us = self._link.profile.airtime_us(size) + self._link.profile.stop_us
            self._latest_us = now_us + self._heard.surely_us(need_us, Priority.EVENT, now_us)
        minutes = math.ceil((self._latest_us - now_us) / 60e6)
        if minutes <= 0:
            return "Radio: nothing from the vessel: it is off, or out of range"
        if is_answered:
            return f"Radio: the vessel answers; its airtime of this hour is used: it is shown in {minutes} min at the latest"
        return f"Radio: no word of the vessel. If it is on, its airtime of this hour is used: it is shown in {minutes} min at the latest"
