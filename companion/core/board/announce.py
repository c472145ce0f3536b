"""What the operator is told of the actuator board's faults, and when: a new one at once, one that comes and goes now and then.

A fault that is away for shorter than ``CALM_US`` and comes again is the same: its second text says how often, and hides no other alarm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.language.messages import Severity

from . import times
from .texts import LEVEL0_TEXT

CALM_US: Final = 10_000_000
"""Away for so long, a fault that comes again is another one: time to look at the text, and to arm again."""
_TOLD_ELSEWHERE: Final = frozenset({"level0", "reset"})
"""Told when the board is ready, and when it restarts."""


class FaultNews:
    """One board's; forgotten with the port."""

    def __init__(self) -> None:
        self.shown: Sequence[str] = ()
        """The faults of the last look."""
        self._spells: dict[str, _Spell] = {}
        self._warned_us: int | None = None

    def look(self, faults: Sequence[str], now_us: int, sentence: Callable[[str], str]) -> list[tuple[Severity, str]]:
        """Return what is to be said of the faults that stand now; ``sentence`` words one."""
        names = [name for name in faults if name not in self.shown and name not in _TOLD_ELSEWHERE]
        texts = [(Severity.CRITICAL, words) for name in names if (words := self._begun(name, now_us, sentence(name)))]
        for name in faults:
            if name in self._spells:
                self._spells[name].seen_us = now_us
        self.shown = faults
        if "level0" not in faults:
            self._warned_us = None
        elif self._warned_us is None:
            self._warned_us = now_us
        elif now_us - self._warned_us >= times.WARN_EVERY_US:
            self._warned_us = now_us
            texts.append((Severity.WARNING, LEVEL0_TEXT))
        return texts

    def _begun(self, name: str, now_us: int, sentence: str) -> str:
        """What to say of a fault that was not there at the last look; empty when it has been said shortly before."""
        spell = self._spells.get(name)
        if spell is None or now_us - spell.seen_us >= CALM_US:
            self._spells[name] = _Spell(now_us)
            return _capital(sentence)
        spell.times += 1
        if now_us - spell.told_us < times.WARN_EVERY_US:
            return ""
        words = f"{_capital(sentence)}: {spell.times} times in {(now_us - spell.told_us) / 1e6:.0f} s"
        spell.told_us, spell.times = now_us, 0
        return words


class _Spell:
    """The time through which a fault comes and goes."""

    __slots__ = ("seen_us", "times", "told_us")

    def __init__(self, now_us: int) -> None:
        self.told_us = self.seen_us = now_us
        self.times = 0
        """How often it began since it was told."""


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]
