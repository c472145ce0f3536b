"""The log of a vessel's process, written so that it never waits for whoever reads it: a stopped pager must not stop a boat."""

from __future__ import annotations

import logging
import select
import sys
from typing import Final, TextIO

_AT_ONCE: Final = 4000
"""Bytes of one write; a pipe that can be written to takes 4096 without waiting (PIPE_BUF)."""


class NeverWaiting(logging.StreamHandler[TextIO]):
    """Writes a line if it can be taken now; else leaves it out, counts it, and says so with the next."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__(stream)
        self._lost = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write one record."""
        if not self._is_free():
            self._lost += 1
            return
        text = self.format(record)
        if self._lost:
            text = f"({self._lost} lines were left out: nobody read)\n{text}"
            self._lost = 0
        try:
            data = f"{text}\n".encode(errors="replace")
            self.stream.write(data[:_AT_ONCE].decode(errors="ignore"))
            self.stream.flush()
        except (OSError, ValueError):
            self._lost += 1

    def _is_free(self) -> bool:
        try:
            return bool(select.select([], [self.stream], [], 0.0)[1])
        except (OSError, ValueError):
            return True  # no file behind it: it takes all


def never_waiting() -> None:
    """Have the program's log lines written so."""
    root = logging.getLogger()
    for handler in root.handlers:
        if type(handler) is logging.StreamHandler and handler.stream is sys.stderr:
            ours = NeverWaiting(sys.stderr)
            ours.setFormatter(handler.formatter)
            ours.setLevel(handler.level)
            root.removeHandler(handler)
            root.addHandler(ours)
            return
