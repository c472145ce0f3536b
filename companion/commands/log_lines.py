"""The log of a vessel's process, written so that it never waits for whoever reads it: a stopped pager must not stop a boat."""

from __future__ import annotations

import logging
import sys
from typing import TextIO

from ..io.outlet import Outlet


class NeverWaiting(logging.StreamHandler[TextIO]):
    """Hands a line over if it is taken now; else leaves it out, counts it, and says so with the next."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__(stream)
        self._outlet = Outlet(stream)
        self._lost = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write one record."""
        text = self.format(record)
        if self._lost:
            text = f"({self._lost} lines were left out: nobody read)\n{text}"
        self._lost = 0 if self._outlet.write(f"{text}\n") else self._lost + 1

    def close(self) -> None:
        """Give the last lines a moment to go out."""
        self._outlet.close()
        super().close()


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
