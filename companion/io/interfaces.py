"""The computer's own IPv4 addresses and their broadcast addresses, asked of the kernel."""

from __future__ import annotations

import ipaddress
import socket
import struct
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

_ADDRESS: Final = 0x8915
_BROADCAST: Final = 0x8919
"""SIOCGIFADDR, SIOCGIFBRDADDR (Linux, netdevice(7))."""
_NAME_BYTES: Final = 15


@dataclass(frozen=True)
class Interface:
    """One interface with an IPv4 address."""

    address: str
    broadcast: str = ""
    """Empty: it has none."""

    @property
    def is_loopback(self) -> bool:
        return ipaddress.ip_address(self.address).is_loopback


def interfaces() -> list[Interface]:
    """Every interface that is up now, one address each; elsewhere than on Linux what the host's own name leads to."""
    if sys.platform != "linux":
        with suppress(OSError):
            return [Interface(address) for address in socket.gethostbyname_ex(socket.gethostname())[2]]
        return []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        found = [(_ask(sock, name, _ADDRESS), _ask(sock, name, _BROADCAST)) for _, name in socket.if_nameindex()]
    return [Interface(address, "" if broadcast == "0.0.0.0" else broadcast) for address, broadcast in found if address]


def _ask(sock: socket.socket, name: str, what: int) -> str:
    import fcntl

    request = struct.pack("256s", name.encode()[:_NAME_BYTES])
    with suppress(OSError):
        return socket.inet_ntoa(fcntl.ioctl(sock.fileno(), what, request)[20:24])
    return ""
