"""When the vessel's states are on the air, told from when they come here: the grid that orders keep clear of."""

from __future__ import annotations

from ..air.rhythm import Rhythm
from ..codec.frames import Frame
from ..codec.state import KEY_BYTES
from ..codec.state_fields import RadioState
from ..codec.wire import OVERHEAD, Kind
from ..link import CompactLink
from .keys import HeardKeys


class StateGrid:
    """Gives the link its rhythm, where each state is sent at once. Call ``heard`` for every key and difference."""

    def __init__(self, link: CompactLink, keys: HeardKeys) -> None:
        self._link = link
        self._keys = keys
        self._period_us = round(link.profile.link.state_s * 1e6)
        if link.profile.link.batch == 1:
            link.rhythm = Rhythm(self._period_us, link.clock.airtime_us(KEY_BYTES + OVERHEAD))

    def heard(self, frame: Frame, now_us: int) -> None:
        """Note when it was on the air, and how long the next one will be if nothing changes."""
        if self._link.rhythm is None or frame.kind not in (Kind.KEY, Kind.DELTA):
            return
        start_us, end_us = self._link.clock.came_us(len(frame.body) + OVERHEAD, now_us)
        is_short = frame.kind is Kind.DELTA and self._keys.serves(frame, now_us + self._period_us)
        self._link.rhythm.heard(start_us, end_us, end_us - start_us if is_short else None)

    def stands(self, before: RadioState, now: RadioState) -> None:
        """An answer has told of the vessel's status."""
        if self._link.rhythm is not None and now.status != before.status:
            self._link.rhythm.changed()
