"""Whether one source tells two values in turn: two devices of one maker on one line, under one name, that would be averaged.

The sentences of such two are alike to the last letter, so only what they say parts them: values that go to and fro faster than any
vessel moves, and come back to where they were.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import Severity

from ..sources import SAY_EVERY_US, SOURCES_MAX, Key, Texts

_WINDOW_US: Final = 10_000_000
_RETURNS: Final = 8
"""So many returns within ten seconds: one at each second of the slower device, less those that a lost sentence hides."""
_SHARE: Final = 1.0 / 3.0
"""A return ends within this share of the way to and fro: the vessel has moved meanwhile."""


class _Told:
    """The last values of one source."""

    __slots__ = ("returns", "said_us", "values")

    def __init__(self) -> None:
        self.values: deque[tuple[int, complex]] = deque(maxlen=3)
        self.returns: deque[int] = deque(maxlen=_RETURNS)
        self.said_us: int | None = None


class InTurn:
    """The sources of one quantity whose values are points of a plane: m, or on the circle of radius 1."""

    def __init__(
        self, texts: Texts, words: tuple[str, str], least: float, fastest: float, figure: Callable[[float], str]
    ) -> None:
        """``words``: of what, and what tells it. ``least``: how far apart is no noise; ``fastest``: of any vessel, in a second."""
        self._texts, self._words, self._figure = texts, words, figure
        self._least, self._fastest = least, fastest
        self._sources: dict[Key, _Told] = {}

    def take(self, key: Key, name: str, t_us: int, value: complex) -> None:
        """Take a value of a source; tell, once a minute at most, that it is two."""
        told = self._sources.get(key)
        if told is None:
            if len(self._sources) >= SOURCES_MAX:
                return
            told = self._sources[key] = _Told()
        if told.values:
            self._weigh(told, name, t_us, value)
        told.values.append((t_us, value))

    def _weigh(self, told: _Told, name: str, t_us: int, value: complex) -> None:
        before_us, before = told.values[-1]
        apart = abs(value - before)
        if apart < max(self._least, self._fastest * (t_us - before_us) * 1e-6):
            return
        if not any(abs(value - earlier) < _SHARE * apart for _, earlier in list(told.values)[:-1]):
            return
        told.returns.append(t_us)
        if len(told.returns) < _RETURNS or t_us - told.returns[0] > _WINDOW_US:
            return
        if told.said_us is None or t_us - told.said_us >= SAY_EVERY_US:
            told.said_us = t_us
            what, whose = self._words
            text = f"{what}: {name} says two in turn, {self._figure(apart)} apart: two {whose} on one line? Part them"
            self._texts.append((Severity.WARNING, text))
