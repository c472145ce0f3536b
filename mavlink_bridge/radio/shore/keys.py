"""The key states that the shore has, and which of them it may tell the vessel to refer to.

A beacon names a key by six bits of its frame's counter. After a silence of 64 frames those bits are another key's, so
only a key that is young enough to be alone with them is named.
"""

from __future__ import annotations

from typing import Final

from ..air.profile import LinkSettings
from ..codec.frames import Frame
from ..codec.state import RadioState, decode_delta, decode_key, mark_of

_ALONE_FRAMES: Final = 48
_ALONE_STATES: Final = 24
"""As many states may have been lost since, with other frames between them, until the six bits come round."""


class HeardKeys:
    """Keys by mark, and the newest of them by its frame."""

    def __init__(self, settings: LinkSettings) -> None:
        until_next_s = settings.key_s + 2.0 * settings.state_s
        self._limit_us = round(min(until_next_s, _ALONE_STATES * settings.state_s) * 1e6)
        self._keys: dict[int, RadioState] = {}
        self._newest: tuple[int, int] | None = None
        """Counter of the newest key's frame, and when it came."""
        self._session: int | None = None

    def of_session(self, session: int | None) -> None:
        """Forget what an earlier start of the vessel sent."""
        if self._session is not None and session != self._session:
            self._keys.clear()
            self._newest = None
        self._session = session

    def take(self, frame: Frame, now_us: int) -> RadioState:
        """Take a key. Raises BitsError."""
        state = decode_key(frame.body)
        self._keys[mark_of(frame.body)] = state
        self._newest = frame.counter, now_us
        return state

    def apply(self, frame: Frame) -> RadioState | None:
        """Rebuild the state behind a difference; None without its key. Raises BitsError."""
        key = self._keys.get(mark_of(frame.body))
        if key is None:
            self._newest = None
            return None
        return decode_delta(key, frame.body)

    def to_name(self, counter: int, now_us: int) -> int | None:
        """Six bits of the key that the vessel may refer to; ``counter``: of the last frame heard."""
        if self._newest is None:
            return None
        number, at_us = self._newest
        if counter - number >= _ALONE_FRAMES or now_us - at_us > self._limit_us:
            return None
        return number & 0x3F
