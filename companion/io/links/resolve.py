"""Host names to addresses without making the loop wait: numbers at once, names in a short-lived thread."""

from __future__ import annotations

import errno
import socket
import threading
from typing import Any

Address = tuple[Any, ...]


class Resolver:
    """Looks up one host and port, again at every new start.

    The system's resolver has no form that does not wait, and a boat without a network may wait ten seconds for its
    answer; hence the thread, which touches nothing but its own result.
    """

    def __init__(self, host: str, port: int, kind: socket.SocketKind) -> None:
        self.host = host
        self.port = port
        self._kind = kind
        self._result: tuple[socket.AddressFamily, Address] | OSError | None = None
        self._thread: threading.Thread | None = None

    def poll(self) -> tuple[socket.AddressFamily, Address] | None:
        """Return (family, address), or None while looking. Raises OSError when the look-up failed."""
        if self._thread is None:
            try:
                return self._look_up(socket.AI_NUMERICHOST)
            except OSError:
                self._thread = threading.Thread(target=self._work, name=f"resolve-{self.host}", daemon=True)
                self._thread.start()
        if self._thread.is_alive():
            return None
        self._thread = None
        result, self._result = self._result, None
        if isinstance(result, OSError):
            raise result
        return result

    def _work(self) -> None:
        try:
            self._result = self._look_up(0)
        except OSError as error:
            self._result = OSError(errno.EHOSTUNREACH, f"no address for {self.host}: {error.strerror or error}")

    def _look_up(self, flags: int) -> tuple[socket.AddressFamily, Address]:
        try:
            family, _, _, _, address = socket.getaddrinfo(
                self.host or "127.0.0.1", self.port, type=self._kind, flags=flags
            )[0]
        except ValueError:  # from Python's own encoding of the name
            raise OSError(errno.EINVAL, "not a host's name") from None
        return family, address
