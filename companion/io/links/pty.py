"""A pseudo-terminal that looks like a serial device to other programs: what ``socat`` did for the seed's bench.

The channel is open while another program has the device open, so an Arduino twin can reset on opening as a real
board does, and nothing stale waits for who comes late.
"""

from __future__ import annotations

import contextlib
import os
import select
import tty
from pathlib import Path
from typing import Self

from .link import Closed, LinkEvent, Opened, Received
from .stream import explain, read_some
from .url import LinkConfigError, LinkUrl


class PtyLink:
    """``pty:PATH``: makes a pseudo-terminal and a symbolic link to it at PATH (``pty:`` alone: no link)."""

    datagrams = False

    def __init__(self, name: str, path: str = "") -> None:
        self.name = name
        self.path = path
        self._fd, slave = os.openpty()
        self.device = os.ttyname(slave)
        tty.setraw(slave)
        # Until somebody has opened and left the other end, the kernel does not report "nobody there".
        os.close(slave)
        os.set_blocking(self._fd, False)
        self._open = False
        self._poller = select.poll()
        self._poller.register(self._fd, select.POLLIN)
        if path:
            try:
                self._make_link(Path(path))
            except LinkConfigError:
                os.close(self._fd)
                raise

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        url.allow()

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        cls.check(url)
        return cls(name, url.path() if url.where else "")

    def _make_link(self, path: Path) -> None:
        if path.exists() and not path.is_symlink():
            raise LinkConfigError(f"pty:{path}: something else is there; choose another path, or remove it")
        temporary = path.with_name(f".{path.name}.new")
        try:
            temporary.unlink(missing_ok=True)
            temporary.symlink_to(self.device)
            temporary.replace(path)
        except OSError as error:
            raise LinkConfigError(
                f"pty:{path}: {explain(error)}; choose a folder that exists and is writable"
            ) from error

    def poll(self, now_us: int) -> list[LinkEvent]:
        events: list[LinkEvent] = []
        if self._fd < 0:
            return events
        ready = dict(self._poller.poll(0)).get(self._fd, 0)
        hung_up = bool(ready & select.POLLHUP)
        if not self._open and (not hung_up or ready & select.POLLIN):
            self._open = True
            events.append(Opened(0, self.path or self.device))
        if ready & select.POLLIN:
            data, _ = read_some(self._fd)
            if data:
                events.append(Received(0, data))
        if self._open and hung_up:
            self._open = False
            events.append(Closed(0, "the other program closed the device"))
        return events

    def write(self, channel: int, data: bytes) -> int:
        if not self._open or channel != 0 or not data:
            return 0
        try:
            return os.write(self._fd, data)
        except OSError:
            return 0

    def filenos(self) -> list[int]:
        return [self._fd] if self._open and self._fd >= 0 else []

    def describe(self) -> str:
        return f"pty:{self.path or self.device} ({'in use' if self._open else 'nobody has it open'})"

    def close(self) -> None:
        if self._fd < 0:
            return
        if self.path:
            with contextlib.suppress(OSError):
                if Path(self.path).readlink() == Path(self.device):
                    Path(self.path).unlink()
        os.close(self._fd)
        self._fd, self._open = -1, False
