"""What the vessel says to its operators: numbered texts, in the order in which they were said, until the tick's picture takes them."""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_bridge.language.messages import LogText, Severity


class Voice:
    """One vessel's. Parts return or collect (severity, text); the vessel says them here, and nobody else numbers texts."""

    def __init__(self) -> None:
        self.now_us = 0
        """Time of the newest tick: what is said between two ticks has the time of the one before."""
        self._number = 0
        self._texts: list[LogText] = []

    def say(self, severity: Severity, text: str) -> None:
        """Queue a text for every operator."""
        self._number += 1
        self._texts.append(LogText(self._number, self.now_us, severity, text))

    def say_all(self, texts: Sequence[tuple[Severity, str]]) -> None:
        for severity, text in texts:
            self.say(severity, text)

    def take(self) -> tuple[LogText, ...]:
        """Return what was said since the last call."""
        if not self._texts:
            return ()
        texts, self._texts = tuple(self._texts), []
        return texts
