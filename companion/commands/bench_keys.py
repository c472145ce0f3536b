"""A key that is held, read from a terminal: what keeps the actuators on the bench moving.

A terminal tells presses and repeats, never a release. So a key counts as held for a while after each character: long after the
first one, because keyboards repeat late, and short once it repeats. From a pipe every byte counts as a press.
"""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Any, Final

FIRST_US: Final = 800_000
"""Longer than any usual delay before the first repeat (X11: 660 ms, Linux console: 250 ms)."""
REPEAT_US: Final = 350_000
"""Ten usual repeats, so that a jerk of the network under a remote shell does not stop the bench."""
_AT_ONCE: Final = 256


class Keyboard:
    """The keyboard while a ``with`` block lasts: single characters, without echo."""

    def __init__(self) -> None:
        self.closed = False
        """Nobody can press anything any more."""
        self._fd = -1
        self._before: list[Any] | None = None
        self._pressed_us: int | None = None
        self._repeats = False

    def __enter__(self) -> Keyboard:
        try:
            self._fd = sys.stdin.fileno()
        except (OSError, ValueError):
            self.closed = True
            return self
        if os.isatty(self._fd):
            self._before = termios.tcgetattr(self._fd)
            tty.setcbreak(self._fd)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._before)

    def read(self, now_us: int) -> str:
        """Return what was typed since the last call, lower case, and take note of a key that is held."""
        if self.closed or not select.select([self._fd], [], [], 0)[0]:
            return ""
        data = os.read(self._fd, _AT_ONCE)
        if not data:
            self.closed = True
            return ""
        text = data.decode("ascii", "replace").lower()
        if any(letter not in "ynq\r\n" for letter in text):
            self._repeats = self.held(now_us)
            self._pressed_us = now_us
        else:
            self._pressed_us = None
        return text

    def held(self, now_us: int) -> bool:
        """Whether a key is being held down."""
        if self._pressed_us is None:
            return False
        return now_us - self._pressed_us < (REPEAT_US if self._repeats else FIRST_US)
