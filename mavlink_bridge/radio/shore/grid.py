"""When the vessel's states are on the air and for how long, told from when they come here: the grid that orders keep clear of."""

from __future__ import annotations

from typing import Final

from ..air.rhythm import Rhythm
from ..codec.frames import RadioFrame
from ..codec.state import CHANGE_BYTES, DELTA_BYTES, KEY_BYTES, DeltaParts, delta_parts
from ..codec.state_fields import RadioState
from ..codec.threat import THREAT_BYTES
from ..codec.wire import BEACON_NAMES_KEY, OVERHEAD, Kind
from ..link import CompactLink
from ..reporter import CHAT_US
from .keys import HeardKeys

_DOUBT_US: Final = 500_000
"""So far the ends may differ about when an order was answered."""


class StateGrid:
    """Gives the link its rhythm, where each state is sent at once. It is told all from which the length of the next state follows."""

    def __init__(self, link: CompactLink, keys: HeardKeys) -> None:
        self._link = link
        self._keys = keys
        self._period_us = round(link.profile.link.state_s * 1e6)
        self._base_until_us = 0
        """How long the key will serve to which the vessel is known to refer."""
        self._is_changed = False
        """Whether the status is another than that key's."""
        self._threat_bytes = 0
        self._chat_until_us = 0
        if link.profile.link.batch == 1:
            link.way.rhythm = Rhythm(self._period_us, link.clock.airtime_us(KEY_BYTES + OVERHEAD))

    def heard(self, frame: RadioFrame, now_us: int) -> None:
        """A key or a difference came."""
        if self._link.way.rhythm is None or frame.kind not in (Kind.KEY, Kind.DELTA):
            return
        is_key = frame.kind is Kind.KEY
        self._base_until_us = 0 if is_key else self._keys.serves_until_us(frame)
        parts = DeltaParts(threatens=len(frame.body) > KEY_BYTES) if is_key else delta_parts(frame.body)
        self._is_changed = parts.changes
        self._threat_bytes = THREAT_BYTES * parts.threatens
        size = len(frame.body) + OVERHEAD
        start_us, end_us = self._link.clock.came_us(size, now_us)
        self._link.way.rhythm.heard(start_us - self._link.clock.line_us(size), end_us)
        self._foretell(now_us)

    def said(self, body: bytes, now_us: int) -> None:
        """A beacon went out; when it names the newest state, that one serves, and has the vessel's status as last told."""
        if body and body[0] & BEACON_NAMES_KEY and int.from_bytes(body[1:3], "big") == self._keys.to_name(now_us):
            self._base_until_us, self._is_changed = self._keys.newest_serves_until_us(), False
            self._foretell(now_us)

    def stands(self, before: RadioState, now: RadioState, now_us: int) -> None:
        """An answer has told of the vessel's status."""
        if now.status != before.status:
            self._is_changed = True
            self._foretell(now_us)

    def ordered(self, now_us: int) -> None:
        """The vessel has accepted an order: for a while it tells another status beside the difference, and sends no new key for it."""
        self._chat_until_us = now_us + CHAT_US - _DOUBT_US
        self._foretell(now_us)

    def _foretell(self, now_us: int) -> None:
        """How long the next state is on the air."""
        if self._link.way.rhythm is None:
            return
        due_us = now_us + self._period_us
        size = CHANGE_BYTES if self._is_changed else DELTA_BYTES
        is_whole_due = due_us >= max(self._keys.whole_due_us, self._chat_until_us)
        if due_us >= self._base_until_us or is_whole_due:
            size = KEY_BYTES
        size += self._threat_bytes + OVERHEAD
        self._link.way.rhythm.next_us, self._link.way.rhythm.lead_us = (
            self._link.clock.airtime_us(size),
            self._link.clock.line_us(size),
        )
