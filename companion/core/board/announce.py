"""What the operator is told of the actuator board's faults, and when: a new one once, level 0 again and again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.language.messages import Severity

from . import times
from .texts import LEVEL0_TEXT

_TOLD_ELSEWHERE: Final = frozenset({"level0", "reset"})
"""Told when the board is ready, and when it restarts."""


class FaultNews:
    """One board's; forgotten with the port."""

    def __init__(self) -> None:
        self.shown: Sequence[str] = ()
        """The faults of the last look."""
        self._warned_us: int | None = None

    def look(self, faults: Sequence[str], now_us: int, sentence: Callable[[str], str]) -> list[tuple[Severity, str]]:
        """Return what is to be said of the faults that stand now; ``sentence`` words one."""
        texts = [
            (Severity.CRITICAL, _capital(sentence(name)))
            for name in faults
            if name not in self.shown and name not in _TOLD_ELSEWHERE
        ]
        self.shown = faults
        if "level0" not in faults:
            self._warned_us = None
        elif self._warned_us is None:
            self._warned_us = now_us
        elif now_us - self._warned_us >= times.WARN_EVERY_US:
            self._warned_us = now_us
            texts.append((Severity.WARNING, LEVEL0_TEXT))
        return texts


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
