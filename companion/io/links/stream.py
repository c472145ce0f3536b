"""What every single-channel byte stream shares: back-off, silence, reading without waiting, orderly events."""

from __future__ import annotations

import os
from typing import Final

from .link import Closed, LinkEvent, Opened, Received

BACKOFF_FIRST_US: Final = 250_000
BACKOFF_LAST_US: Final = 2_000_000
READ_CHUNK: Final = 4096
READ_LIMIT: Final = 65536
"""At most this much from one channel per poll; the rest waits in the kernel."""


class Backoff:
    """Try again after 0.25 s, doubling to 2 s, for ever (firmware-reliability §B.6)."""

    def __init__(self) -> None:
        self._wait_us = BACKOFF_FIRST_US
        self._due_us: int | None = None

    def due(self, now_us: int) -> bool:
        return self._due_us is None or now_us >= self._due_us

    def failed(self, now_us: int) -> None:
        self._due_us = now_us + self._wait_us
        self._wait_us = min(2 * self._wait_us, BACKOFF_LAST_US)

    def worked(self) -> None:
        self._wait_us = BACKOFF_FIRST_US
        self._due_us = None


def explain(error: OSError) -> str:
    """One line about an operating-system error."""
    return error.strerror or str(error) or type(error).__name__


def read_some(fd: int) -> tuple[bytes, str]:
    """Read what is there, at most READ_LIMIT; return (bytes, reason), a reason meaning that the stream has ended."""
    chunks: list[bytes] = []
    size = 0
    reason = ""
    while size < READ_LIMIT:
        try:
            chunk = os.read(fd, READ_CHUNK)
        except BlockingIOError:
            break
        except InterruptedError:
            continue
        except OSError as error:
            reason = explain(error)
            break
        if not chunk:
            reason = "end of stream"
            break
        chunks.append(chunk)
        size += len(chunk)
        if len(chunk) < READ_CHUNK:
            break
    return b"".join(chunks), reason


class StreamLink:
    """Base of the serial port and the TCP client: one descriptor, channel 0, opened again for ever.

    ``silence_s`` > 0 closes and reopens a channel that has brought nothing for so long: a server that accepts and
    stays silent looks connected and is not (fault row 29).
    """

    datagrams = False

    def __init__(self, name: str, where: str, silence_s: float = 0.0) -> None:
        self.name = name
        self.where = where
        self._silence_us = round(silence_s * 1e6)
        self._backoff = Backoff()
        self._fd = -1
        self._open = False
        self._heard_us = 0
        self._fault = ""
        self._pending: list[LinkEvent] = []
        self._shut = False

    def _connect(self, now_us: int) -> bool:
        """Start or go on connecting; True once the channel is up. Raises OSError for a failed attempt."""
        raise NotImplementedError

    def _release(self) -> None:
        """Close the descriptor at once."""
        raise NotImplementedError

    def _changed(self, now_us: int) -> str:
        """Say why an open channel is no longer the right one, or nothing."""
        return ""

    def _appeared(self) -> bool:
        """True when there is a new reason to try before the back-off has run out."""
        return False

    def _after_read(self, now_us: int) -> str:
        """Look after what waits to be sent; say why the channel cannot stay, or nothing."""
        return ""

    def poll(self, now_us: int) -> list[LinkEvent]:
        if self._shut:
            return []
        if self._pending:
            self._backoff.failed(now_us)
        elif not self._open:
            self._try_open(now_us)
        if self._open:
            self._serve(now_us)
        events, self._pending = self._pending, []
        return events

    def _try_open(self, now_us: int) -> None:
        if not self._backoff.due(now_us) and not self._appeared():
            return
        try:
            if not self._connect(now_us):
                return
        except OSError as error:
            self._release()
            self._fault = explain(error)
            self._backoff.failed(now_us)
            return
        self._open = True
        self._fault = ""
        self._heard_us = now_us
        self._pending.append(Opened(0, self.where))

    def _serve(self, now_us: int) -> None:
        data, reason = read_some(self._fd)
        if data:
            self._heard_us = now_us
            self._backoff.worked()
            self._pending.append(Received(0, data))
        elif self._silence_us and now_us - self._heard_us > self._silence_us:
            reason = reason or f"silent for {self._silence_us / 1e6:g} s"
        reason = reason or self._changed(now_us) or self._after_read(now_us)
        if reason:
            self._drop(reason)
            self._backoff.failed(now_us)

    def _drop(self, reason: str) -> None:
        """Close the channel at once (a held descriptor would make the device come back under another name)."""
        if not self._open:
            return
        self._open = False
        self._fault = reason
        self._release()
        self._pending.append(Closed(0, reason))

    def write(self, channel: int, data: bytes) -> int:
        if not self._open or channel != 0 or not data:
            return 0
        try:
            return os.write(self._fd, data)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError as error:
            self._drop(explain(error))
            return 0

    def filenos(self) -> list[int]:
        return [self._fd] if self._open else []

    def describe(self) -> str:
        state = "connected" if self._open else f"waiting: {self._fault}" if self._fault else "connecting"
        return f"{self.where} ({state})"

    def close(self) -> None:
        self._shut = True
        self._open = False
        self._release()
