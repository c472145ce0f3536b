"""The states that the shore has and that differences may refer to, and which of them it tells the vessel: keys, and differences themselves.

A beacon names one by sixteen bits of its frame's counter, the vessel's clock in eighths of a second: two hours. A difference that is
named serves as a key under the mark that ``as_key_mark`` gives it. So the beacons that go anyway keep fresh what differences refer to,
and no key, half as long again on the air, comes in the way of an order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ..air.profile import LinkSettings
from ..codec.frames import RadioFrame
from ..codec.state import as_key_mark, decode_delta, decode_key, is_near_the_end, mark_of
from ..codec.state_fields import RadioState
from ..reporter import WHOLE_KEYS

_NAMES_S: Final = 4000.0
"""Half the time until the names come round."""
_SURE_US: Final = 1_000_000
"""A key is made before it comes."""


@dataclass(frozen=True, slots=True)
class _Named:
    """A state that the vessel may refer to: the counter of its frame, its mark, and when it came."""

    counter: int
    mark: int
    came_us: int


@dataclass(frozen=True, slots=True)
class _Successor:
    """A difference to the newest key that could take its place. ``is_wanted``: differences to it would be shorter, or last longer."""

    named: _Named
    state: RadioState
    is_wanted: bool


class HeardKeys:
    """Keys by mark, and the newest of them by its frame."""

    def __init__(self, settings: LinkSettings) -> None:
        self._limit_us = round(min(settings.key_s + 2.0 * settings.state_s, _NAMES_S) * 1e6)
        self._keys: dict[int, RadioState] = {}
        self._came_us: dict[int, int] = {}
        self._key_us = round(settings.key_s * 1e6)
        self._newest: _Named | None = None
        self._successor: _Successor | None = None
        self._is_unheard = False
        """Whether the vessel refers to another one than was named: that word, or the one before the state on the air, was lost."""
        self._whole_us: int | None = None
        """When a key last came."""
        self._session: bytes | None = None

    def of_session(self, session: bytes | None) -> None:
        """Forget what an earlier start of the vessel sent."""
        if self._session is not None and session != self._session:
            self._keys.clear()
            self._newest = self._successor = self._whole_us = None
        self._session = session

    def take(self, frame: RadioFrame, now_us: int) -> RadioState:
        """Take a key. Raises BitsError."""
        state = decode_key(frame.body)
        self._keys[mark_of(frame.body)] = state
        self._came_us[mark_of(frame.body)] = now_us
        self._newest, self._whole_us = _Named(frame.counter, mark_of(frame.body), now_us), now_us
        self._successor, self._is_unheard = None, False
        return state

    def apply(self, frame: RadioFrame, now_us: int) -> RadioState | None:
        """Rebuild the state behind a difference; None without its key. Raises BitsError."""
        mark = mark_of(frame.body)
        key = self._keys.get(mark)
        if key is None:
            self._newest = self._successor = None
            return None
        state = decode_delta(key, frame.body)
        self._is_unheard = self._newest is not None and mark != self._newest.mark
        if self._newest is not None and mark == self._newest.mark:
            # the vessel is known to refer to it, and to nothing older any more: its other marks are free
            named = _Named(frame.counter, as_key_mark(mark), now_us)
            self._successor = _Successor(named, state, state.status != key.status or is_near_the_end(key, state))
        return state

    @property
    def wants_word(self) -> bool:
        """Whether the vessel should soon hear of a state that serves better than the one it refers to."""
        return self._is_unheard or (self._successor is not None and self._successor.is_wanted)

    def promote(self) -> None:
        """Let the newest difference take the place of its key; the vessel hears of it by the name."""
        if self._successor is not None:
            named = self._newest = self._successor.named
            self._keys[named.mark], self._came_us[named.mark] = self._successor.state, named.came_us
            self._successor = None

    def serves_until_us(self, frame: RadioFrame) -> int:
        """How long the key that a difference refers to will serve: the vessel sends another one when it is old."""
        return self._came_us.get(mark_of(frame.body), -self._key_us) + self._key_us - _SURE_US

    def newest_serves_until_us(self) -> int:
        """The same of the newest key, once the vessel has heard that it came."""
        return 0 if self._newest is None else self._newest.came_us + self._key_us - _SURE_US

    @property
    def whole_due_us(self) -> int:
        """From when on the vessel may send a key for what only a key tells."""
        return 0 if self._whole_us is None else self._whole_us + WHOLE_KEYS * self._key_us - _SURE_US

    def to_name(self, now_us: int) -> int | None:
        """Sixteen bits of the key that the vessel may refer to; None = it has to send one."""
        if self._newest is None or now_us - self._newest.came_us > self._limit_us:
            return None
        return self._newest.counter & 0xFFFF
