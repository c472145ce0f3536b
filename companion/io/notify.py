"""A word to systemd (sd_notify): ready, still steering, stopping. Without systemd it says nothing."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Mapping


class Notifier:
    """Sends datagrams to the socket that NOTIFY_SOCKET names; ``watchdog_us`` is systemd's limit, None when unset."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        env = os.environ if environment is None else environment
        self._address = env.get("NOTIFY_SOCKET", "")
        if self._address.startswith("@"):
            self._address = "\0" + self._address[1:]
        limit = env.get("WATCHDOG_USEC", "")
        self.watchdog_us: int | None = int(limit) if limit.isdigit() and int(limit) > 0 else None

    def send(self, message: str) -> None:
        if not self._address:
            return
        with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.setblocking(False)
            sock.sendto(message.encode(), self._address)
