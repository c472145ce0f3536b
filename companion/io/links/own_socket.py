"""A socket at an address of our own. The address may come later, a VPN's or a Wi-Fi's: then it is tried again for ever, as a device is."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable
from typing import Final

from .resolve import Address, Resolver
from .stream import Backoff, explain
from .url import LinkConfigError

_ANY: Final = "0.0.0.0"
_MAY_COME: Final = (errno.EADDRNOTAVAIL, socket.EAI_AGAIN)
"""What is said of an address that no interface has now, and of a name while there is no network to ask in."""


class OwnSocket:
    """``make`` gives a bound socket. Raises LinkConfigError for what a person must mend: no such name, a port that another program has."""

    def __init__(
        self,
        place: tuple[str, str, int],
        kind: socket.SocketKind,
        make: Callable[[socket.AddressFamily, Address], socket.socket],
    ) -> None:
        scheme, host, port = place
        self.socket: socket.socket | None = None
        self.fault = ""
        """Why there is no socket yet."""
        self._make = make
        self._resolver = Resolver(host or _ANY, port, kind)
        self._backoff = Backoff()
        try:
            family, _, _, _, address = socket.getaddrinfo(host or _ANY, port, type=kind)[0]
            self.socket = make(family, address)
        except OSError as error:
            self.fault = explain(error)
            if error.errno not in _MAY_COME:
                taken = error.errno == errno.EADDRINUSE
                mend = "choose another port, or stop the program that has it" if taken else "check the address"
                raise LinkConfigError(f"{scheme}://{host}:{port}: {self.fault}; {mend}") from error

    def poll(self, now_us: int) -> socket.socket | None:
        """Try again when due; return the socket."""
        if self.socket is None and self._backoff.due(now_us):
            try:
                found = self._resolver.poll()
                if found is not None:
                    self.socket, self.fault = self._make(*found), ""
            except OSError as error:
                self.fault = explain(error)
                self._backoff.failed(now_us)
        return self.socket
