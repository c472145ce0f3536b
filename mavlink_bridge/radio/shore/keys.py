"""The key states that the shore has, and which of them it may tell the vessel to refer to.

A beacon names a key by sixteen bits of its frame's counter, the vessel's clock in eighths of a second: two hours.
"""

from __future__ import annotations

from typing import Final

from ..air.profile import LinkSettings
from ..codec.frames import RadioFrame
from ..codec.state import decode_delta, decode_key, mark_of
from ..codec.state_fields import RadioState

_NAMES_S: Final = 4000.0
"""Half the time until the names come round."""
_SURE_US: Final = 1_000_000
"""A key is made before it comes."""


class HeardKeys:
    """Keys by mark, and the newest of them by its frame."""

    def __init__(self, settings: LinkSettings) -> None:
        self._limit_us = round(min(settings.key_s + 2.0 * settings.state_s, _NAMES_S) * 1e6)
        self._keys: dict[int, RadioState] = {}
        self._came_us: dict[int, int] = {}
        self._key_us = round(settings.key_s * 1e6)
        self._newest: tuple[int, int] | None = None
        """Counter of the newest key's frame, and when it came."""
        self._session: bytes | None = None

    def of_session(self, session: bytes | None) -> None:
        """Forget what an earlier start of the vessel sent."""
        if self._session is not None and session != self._session:
            self._keys.clear()
            self._newest = None
        self._session = session

    def take(self, frame: RadioFrame, now_us: int) -> RadioState:
        """Take a key. Raises BitsError."""
        state = decode_key(frame.body)
        self._keys[mark_of(frame.body)] = state
        self._came_us[mark_of(frame.body)] = now_us
        self._newest = frame.counter, now_us
        return state

    def apply(self, frame: RadioFrame) -> RadioState | None:
        """Rebuild the state behind a difference; None without its key. Raises BitsError."""
        key = self._keys.get(mark_of(frame.body))
        if key is None:
            self._newest = None
            return None
        return decode_delta(key, frame.body)

    def serves_until_us(self, frame: RadioFrame) -> int:
        """How long the key that a difference refers to will serve: the vessel sends another one when it is old."""
        return self._came_us.get(mark_of(frame.body), -self._key_us) + self._key_us - _SURE_US

    def newest_serves_until_us(self) -> int:
        """The same of the newest key, once the vessel has heard that it came."""
        return 0 if self._newest is None else self._newest[1] + self._key_us - _SURE_US

    def to_name(self, now_us: int) -> int | None:
        """Sixteen bits of the key that the vessel may refer to; None = it has to send one."""
        if self._newest is None or now_us - self._newest[1] > self._limit_us:
            return None
        return self._newest[0] & 0xFFFF
