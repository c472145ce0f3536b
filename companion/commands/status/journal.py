"""What the journal of a service holds: every text for the operator, mode, arming, failsafe, and which device is missing.

A flood is bounded, and said to be.
"""

from __future__ import annotations

import logging
from typing import Final

from mavlink_bridge.language.messages import Action, Severity
from mavlink_bridge.language.snapshot import LinkHealth, Snapshot

from ...status.picture import is_missing
from ...status.words import cause

_SETTLE_US: Final = 2_000_000
"""Links are given so long to open before one that is not open counts as missing."""
_BURST: Final = 60
_BURST_US: Final = 10_000_000
"""Lines that a journal gets in so long: more than any day at sea has, less than what fills a card."""

log = logging.getLogger(__name__)


class LinkNotes:
    """Says in the log which device is missing, and when it is back."""

    def __init__(self) -> None:
        self._since_us: int | None = None
        self._seen: tuple[LinkHealth, ...] = ()
        self._missing: set[str] = set()

    def update(self, snapshot: Snapshot) -> None:
        """Take one tick's picture."""
        if self._since_us is None:
            self._since_us = snapshot.t_us
        if snapshot.links is self._seen or snapshot.t_us - self._since_us < _SETTLE_US:
            return
        self._seen = snapshot.links
        for link in snapshot.links:
            missing = is_missing(link)
            if missing == (link.name in self._missing):
                continue
            self._missing ^= {link.name}
            if missing:
                log.warning("%s is missing, tried again for ever: %s", link.name, link.text)
            else:
                log.info("%s is there: %s", link.name, link.text)

    def close(self) -> None:
        """Nothing to give back."""


class Journal:
    """Writes down what happens, one line each."""

    def __init__(self) -> None:
        self._links = LinkNotes()
        self._stance: tuple[str, bool] | None = None
        self._causes: tuple[str, ...] = ()
        self._action = Action.NONE
        self._begun_us = 0
        self._lines = 0

    def update(self, snapshot: Snapshot) -> None:
        """Take one tick's picture."""
        now_us = snapshot.t_us
        for text in snapshot.texts:
            self._write(now_us, _level(text.severity), f"{text.severity.name.lower()}: {text.text}")
        stance = (snapshot.mode.value, snapshot.armed)
        if stance != self._stance:
            before, self._stance = self._stance, stance
            was = f" (was {_stance(*before)})" if before is not None else ""
            self._write(now_us, logging.INFO, f"mode {_stance(*stance)}{was}")
        if snapshot.action is not self._action or snapshot.causes != self._causes:
            self._action, self._causes = snapshot.action, snapshot.causes
            self._write(now_us, *_failsafe(snapshot))
        self._links.update(snapshot)

    def close(self) -> None:
        """Nothing to give back."""

    def _write(self, now_us: int, level: int, line: str) -> None:
        if now_us - self._begun_us >= _BURST_US:
            if self._lines > _BURST:
                log.warning("%d more lines were left out here", self._lines - _BURST)
            self._begun_us, self._lines = now_us, 0
        self._lines += 1
        if self._lines <= _BURST:
            log.log(level, "%s", line)


def _stance(mode: str, armed: bool) -> str:
    return f"{mode}, {'armed' if armed else 'disarmed'}"


def _failsafe(s: Snapshot) -> tuple[int, str]:
    if s.action is Action.NONE:
        return logging.INFO, "failsafe NONE"
    if not s.causes:  # over the radio the action comes alone, and its words as texts
        return logging.WARNING, f"failsafe {s.action.name}"
    told = ". ".join(each.sentence() for each in s.outlook) or ", ".join(map(cause, s.causes))
    return logging.WARNING, f"failsafe {s.action.name}: {told}"


def _level(severity: Severity) -> int:
    if severity <= Severity.ERROR:
        return logging.ERROR
    return logging.WARNING if severity is Severity.WARNING else logging.INFO
