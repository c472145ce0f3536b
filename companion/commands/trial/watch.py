"""Staying with a trial: what the vessel says is shown, what the person types is ordered, until it is over.

The vessel's texts decide, not a count of our own; should the last one be lost on the way, the vessel is asked every half minute.
"""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Callable
from typing import Final, Protocol, TextIO

from mavlink_bridge.language.trials import NO_TRIAL, TRIAL_DONE, TRIAL_ENDED, TrialOrder

from ..plan.link import LinkError

_LOOK_S: Final = 0.2
_ASK_S: Final = 30.0
"""A trial says something every half minute by itself; asked as often, a lost word costs no more than that."""


class WatchedVessel(Protocol):
    """What of a vessel is watched."""

    heard: list[str]
    shows_again: bool

    @property
    def is_heard(self) -> bool: ...


class TrialWatch:
    """One trial's."""

    def __init__(self, vessel: WatchedVessel, order: Callable[[TrialOrder], None]) -> None:
        """``order`` gives an order to the vessel; raises LinkError."""
        self._vessel, self._order = vessel, order
        self._seen = len(vessel.heard)
        self._typed: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._is_silent = False

    def stay(self, keys: TextIO) -> bool:
        """Stay until the trial is over; return whether it was done. Ctrl-C ends it."""
        self._vessel.shows_again = True
        threading.Thread(target=self._listen, args=(keys,), daemon=True).start()
        asked_s = time.monotonic()
        try:
            while (done := self.look()) is None:
                if time.monotonic() - asked_s > _ASK_S:
                    asked_s = time.monotonic()
                    self._try(TrialOrder.TELL)
                time.sleep(_LOOK_S)
        except KeyboardInterrupt:
            self._try(TrialOrder.END)
            raise
        return done

    def look(self) -> bool | None:
        """Take what has come since the last look; return whether the trial is done, None while it goes on."""
        while not self._typed.empty():
            self._obey(self._typed.get())
        if self._is_silent != (not self._vessel.is_heard):
            self._is_silent = not self._is_silent
            print("the vessel is not heard" if self._is_silent else "the vessel is heard again", file=sys.stderr)
        texts = self._vessel.heard
        while self._seen < len(texts):
            text, self._seen = texts[self._seen], self._seen + 1
            if text.startswith(TRIAL_DONE):
                return True
            if text.startswith(TRIAL_ENDED) or NO_TRIAL in text.lower():
                return False
        return None

    def type(self, line: str) -> None:
        """Take a line that a person typed."""
        self._typed.put(line)

    def _listen(self, keys: TextIO) -> None:
        for line in keys:
            self.type(line)

    def _obey(self, line: str) -> None:
        match line.strip().lower():
            case "full":
                self._try(TrialOrder.CONFIRM)
            case "stop":
                self._try(TrialOrder.END)
            case "":
                pass
            case _:
                print("type 'full' for the whole throttle, or 'stop'", file=sys.stderr)

    def _try(self, order: TrialOrder) -> None:
        try:
            self._order(order)
        except LinkError as error:
            print(error, file=sys.stderr)
