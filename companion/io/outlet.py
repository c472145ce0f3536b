"""What a person reads, written by a thread of its own: a terminal that stands (Ctrl-S, a stalled ssh line, a stopped pager) stops no boat.

Asking first whether a write would wait is not enough: a terminal that takes one more byte is called free, and waits for the rest.
"""

from __future__ import annotations

import contextlib
import os
from typing import Final, TextIO

from .writer import Writer

_CLOSE_WAIT_S: Final = 0.5
"""What is still queued at the end is waited for so long: time enough for a reader that reads."""


class Outlet:
    """Takes texts for a stream and never waits; a stream without a file behind it is written to at once."""

    def __init__(self, stream: TextIO, most: int = 512) -> None:
        """``most``: texts that are kept for a reader who is slow."""
        self._stream = stream
        self._is_gone = False
        self._writer = Writer(most) if _has_file(stream) else None

    def write(self, text: str) -> bool:
        """Take a text; False: it was left out, since nobody reads."""
        if self._is_gone:
            return False
        if self._writer is None:
            self._write_here(text)
            return not self._is_gone
        data = text.encode(self._stream.encoding or "utf-8", self._stream.errors or "replace")
        return self._writer.post(lambda: self._write_out(data))

    def close(self) -> None:
        """Give what is queued a moment to go out."""
        if self._writer is not None and not self._is_gone:
            self._writer.close(_CLOSE_WAIT_S)

    def _write_here(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):
            self._is_gone = True

    def _write_out(self, data: bytes) -> None:
        # Past the stream's own buffer: a thread that stands in it would not let the program end.
        try:
            while data:
                data = data[os.write(self._stream.fileno(), data) :]
        except BlockingIOError:
            pass  # somebody else has made it so; the rest of this text is left out
        except (OSError, ValueError):
            self._is_gone = True


def _has_file(stream: TextIO) -> bool:
    with contextlib.suppress(OSError, ValueError):
        stream.flush()
        return stream.fileno() >= 0
    return False
