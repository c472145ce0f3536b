"""What the gateway tells stations in words: its own, and the vessel's that came over the radio."""

from __future__ import annotations

from typing import Final

from ...language.messages import LogText, Severity

_MAX_TEXTS: Final = 16
SAID_GAP_US: Final = 10_000_000


class Sayings:
    """Texts that wait for the next picture, or for who asks."""

    def __init__(self) -> None:
        self._texts: list[tuple[Severity, str]] = []
        self._said: dict[str, int] = {}
        self._number = 0

    def say(self, severity: Severity, text: str, now_us: int, *, gap_us: int = SAID_GAP_US) -> None:
        """Queue a text; the same one at most every ``gap_us``."""
        last_us = self._said.get(text)
        if last_us is not None and now_us - last_us < gap_us:
            return
        if len(self._said) > 2 * _MAX_TEXTS:
            self._said.pop(next(iter(self._said)))
        self._said[text] = now_us
        self._texts = [*self._texts[-_MAX_TEXTS:], (severity, text)]

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Texts since the last call."""
        found, self._texts = self._texts, []
        return found

    def logged(self, now_us: int) -> tuple[LogText, ...]:
        """The same, numbered, for a picture."""
        found = []
        for severity, text in self.drain_texts():
            self._number += 1
            found.append(LogText(self._number, now_us, severity, text))
        return tuple(found)
