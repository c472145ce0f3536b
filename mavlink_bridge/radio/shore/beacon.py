"""The gateway's signs of life: whether its commanding station is alive, and to which key state the vessel may refer.

The first frame of a session goes at once, whatever the profile says of beacons: by it the vessel believes that we are here.
"""

from __future__ import annotations

from typing import Final

from ..air.ledger import Priority
from ..codec.frames import RadioFrame
from ..codec.state_fields import RadioState
from ..codec.wire import BEACON_COMMANDED, BEACON_NAMES_KEY, Kind
from ..link import CompactLink
from ..reporter import CHAT_US
from .keys import HeardKeys

_KEYS_WITHOUT_WORD: Final = 1
"""The vessel sends keys until it hears which one it may refer to: a word at once costs less air than the next two of them."""

_WORD_GAP_US: Final = 10_000_000
"""A word that makes differences shorter is worth its air when more of them come than one or two."""
_UNHEARD_S: Final = 2.0
"""More than two states that do not come: the vessel speaks to another gateway, or the air loses. She shall hear soon that we are here,
and speak to us again: where two gateways talk a beacon is easily lost, and the next one is half the time away after which the boat holds.
"""
_GIVEN_UP_US: Final = 120_000_000
"""Of so long a silence the boat has drawn her conclusions; out of reach the usual beacons are enough."""
_GREET_GAP_US: Final = 1_000_000
_SHOWN_US: Final = 12_000_000
"""The vessel shows itself to a new start within some seconds of its first word; who waited longer says it once more."""


class Beacons:
    """Keeps the keys that have come, and the time of the next beacon. Call ``tick`` a few times a second."""

    def __init__(self, link: CompactLink) -> None:
        self._link = link
        self._period_us = round(link.profile.link.beacon_s * 1e6)
        self._unheard_us = round((2.0 * link.profile.link.state_s + _UNHEARD_S) * 1e6)
        self.keys = HeardKeys(link.profile.link)
        self._sent_us: int | None = None
        self._greeted: bytes | None = None
        """The start of the vessel that has had a word from us."""
        self._again_us: int | None = None
        """When the first word is said again, unless a state has come: where no later beacon would do it."""
        self._station_present = False
        self._new_keys = 0
        self._chat_until_us = 0

    def key(self, frame: RadioFrame, now_us: int) -> RadioState:
        """Take a key state. Raises BitsError."""
        is_first = self.keys.to_name(now_us) is None
        state = self.keys.take(frame, now_us)
        self._new_keys += 1
        self._again_us = None
        if self._sent_us is not None and (is_first or self._new_keys >= _KEYS_WITHOUT_WORD):
            # a word from here lets the vessel send differences again
            self._sent_us = now_us - self._period_us
        return state

    def obeyed(self, now_us: int) -> None:
        """The vessel has accepted an order, and so knows that its commanding station is there: no beacon in the way of the next one."""
        self._chat_until_us = now_us + CHAT_US
        if self._station_present and self._sent_us is not None and now_us - self._sent_us < self._period_us:
            self._sent_us = now_us

    def tick(self, now_us: int, *, station_present: bool) -> None:
        """Post what is due."""
        pairing = self._link.pairing
        session = pairing.current or pairing.rival
        is_new = session is not None and session.other != self._greeted and self._is_time(now_us)
        is_again = self._again_us is not None and now_us >= self._again_us
        if session is not None and is_new:
            self._greeted = session.other
        if is_new or is_again:
            self._again_us = now_us + _SHOWN_US if is_new and not self._period_us else None
        is_due = self._sent_us is None or now_us - self._sent_us >= self._period_us or self._wants_word(now_us)
        is_due = is_due or (station_present and self._is_unheard(now_us))
        changed = station_present != self._station_present
        may = self._period_us and self._link.heard_us is not None
        if not is_new and not is_again and not (may and (is_due or changed)):
            return
        self._sent_us, self._station_present, self._new_keys = now_us, station_present, 0
        self.keys.promote()
        key = self.keys.to_name(now_us)
        flags = (BEACON_COMMANDED if station_present else 0) | (0 if key is None else BEACON_NAMES_KEY)
        name = b"" if key is None else key.to_bytes(2, "big")
        self._link.post(Kind.BEACON, bytes((flags,)) + name, Priority.COMMAND)

    def _wants_word(self, now_us: int) -> bool:
        """Whether the vessel should hear of a newer state to refer to before the next beacon; while orders come it can wait."""
        is_time = self._sent_us is None or now_us - self._sent_us >= _WORD_GAP_US
        return is_time and now_us >= self._chat_until_us and self.keys.wants_word

    def _is_unheard(self, now_us: int) -> bool:
        """Whether neither we nor, as it seems, the vessel has heard the other for a while."""
        heard_us, sent_us = self._link.heard_us, self._sent_us
        if heard_us is None or sent_us is None or now_us < self._chat_until_us:
            return False
        return now_us - max(heard_us, sent_us) >= self._unheard_us and now_us - heard_us < _GIVEN_UP_US

    def _is_time(self, now_us: int) -> bool:
        """Old greetings, one after the other, must not make the gateway speak each time."""
        return self._sent_us is None or now_us - self._sent_us >= _GREET_GAP_US
