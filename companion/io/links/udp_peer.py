"""UDP with one peer, written in the configuration: ``udp://host:port``. Nobody else is heard, however he got the port.

The socket is bound to the loopback address when the peer is on this machine, so that another machine cannot reach it at all. A
peer answers from the address and port that the vessel sends to, as QGroundControl, MAVProxy and MAVSDK do; whoever sends from
another port, behind an address translation for one, is not the peer and needs a ``udp-listen`` link with signing. A name is looked
up again while its holder is silent, because a computer on a boat's network gets new addresses.
"""

from __future__ import annotations

import contextlib
import ipaddress
import socket
from typing import Final, Self

from .link import Closed, LinkEvent, Opened, Received
from .resolve import Address, Resolver
from .stream import Backoff, explain
from .udp import MAX_DATAGRAMS, Flood, check_target, send_datagram
from .url import LinkConfigError, LinkUrl

RELOOK_US: Final = 10_000_000
"""A named peer that has been silent for so long, and was not looked up for so long, is looked up again. Ten lost heartbeats: a
station that moved is followed before an operator gives up, and a resolver is not asked more often than stations try by themselves."""
_CHANNEL: Final = 0
_OWN: Final = {
    (socket.AF_INET, True): "127.0.0.1",
    (socket.AF_INET, False): "0.0.0.0",
    (socket.AF_INET6, True): "::1",
    (socket.AF_INET6, False): "::",
}
"""Our own address, by family and whether the peer is on this machine."""


class UdpPeerLink:
    """``udp://host:port?local=port``: datagrams to and from one peer, channel 0, which is open whether or not it answers."""

    datagrams = True

    def __init__(self, name: str, host: str, port: int, local_port: int = 0) -> None:
        self.name = name
        self.where = f"udp://{host}:{port}"
        self.strangers = 0
        """Datagrams from somebody else, not passed on."""
        self._stranger: Address = ()
        self.dropped = 0
        """Datagrams of the peer not passed on: it floods."""
        self._host = host
        self._named = not _is_number(host)
        self._local_port = local_port
        self._resolver = Resolver(host, port, socket.SOCK_DGRAM)
        self._backoff = Backoff()
        self._socket: socket.socket | None = None
        self._family = socket.AF_INET
        self._target: Address = ()
        self._on_loopback = False
        self._flood = Flood()
        self._heard_us = self._looked_us = 0
        self._looking = self._shut = False
        self._fault = ""
        self._buffer = bytearray(9216)

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        url.allow("local")
        check_target(url)
        host, port = url.host_port()
        if _is_number(host) and ipaddress.ip_address(_plain(host)).is_unspecified:
            raise LinkConfigError(
                f"{url.text}: {host} is nobody's address; name the peer, or listen with udp-listen://{host}:{port}"
            )
        url.number("local", 0, 0, 65535)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        cls.check(url)
        return cls(name, *url.host_port(), local_port=int(url.number("local", 0, 0, 65535)))

    def poll(self, now_us: int) -> list[LinkEvent]:
        events: list[LinkEvent] = []
        if self._shut:
            return events
        if self._socket is not None and self._named:
            self._follow(now_us, events)
        if self._socket is None and self._backoff.due(now_us):
            self._look(now_us, events)
        if self._socket is not None:
            self._receive(self._socket, now_us, events)
        return events

    def _follow(self, now_us: int, events: list[LinkEvent]) -> None:
        """Look a silent peer's name up again."""
        if self._looking or now_us - max(self._heard_us, self._looked_us) >= RELOOK_US:
            self._look(now_us, events)

    def _look(self, now_us: int, events: list[LinkEvent]) -> None:
        """Find the peer's address, and open a socket for it unless it is the one that is open."""
        self._looking = True
        try:
            found = self._resolver.poll()
            if found is None:
                return
            self._looking, self._looked_us = False, now_us
            if self._socket is None or found != (self._family, self._target):
                self._move(*found, events)
            self._fault = ""
        except OSError as error:
            self._looking, self._looked_us = False, now_us
            self._fault = explain(error)
            self._backoff.failed(now_us)

    def _move(self, family: socket.AddressFamily, target: Address, events: list[LinkEvent]) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
            events.append(Closed(_CHANNEL, f"{self._host} is at {target[0]} now"))
        on_loopback = ipaddress.ip_address(_plain(target[0])).is_loopback
        sock = socket.socket(family, socket.SOCK_DGRAM)
        try:
            sock.setblocking(False)
            sock.bind((_OWN[family, on_loopback], self._local_port))
        except OSError:
            sock.close()
            raise
        self._socket, self._family, self._target, self._on_loopback = sock, family, target, on_loopback
        events.append(Opened(_CHANNEL, self.where))

    def _is_peer(self, address: Address) -> bool:
        """On the loopback network any of this machine's own addresses is the peer's, if the port is."""
        if address[:2] == self._target[:2]:
            return True
        return self._on_loopback and address[1] == self._target[1]

    def _receive(self, sock: socket.socket, now_us: int, events: list[LinkEvent]) -> None:
        buffer = self._buffer
        for _ in range(MAX_DATAGRAMS):
            try:
                size, address = sock.recvfrom_into(buffer)
            except (BlockingIOError, InterruptedError):
                return
            except OSError as error:
                # A refused earlier datagram is reported here; the next call goes on.
                self._fault = explain(error)
                continue
            if not self._is_peer(address):
                self.strangers += 1
                self._stranger = address
            elif not self._flood.allows(now_us):
                self.dropped += 1
            else:
                self._heard_us = now_us
                if size:
                    events.append(Received(_CHANNEL, bytes(buffer[:size])))

    def write(self, channel: int, data: bytes) -> int:
        if self._socket is None or channel != _CHANNEL or not data:
            return 0
        taken, fault = send_datagram(self._socket, data, self._target)
        self._fault = fault or self._fault
        return taken

    def take_stranger(self) -> str:
        """The URL by which one who spoke here since the last call, and was not heard, would be; empty when nobody did."""
        address, self._stranger = self._stranger, ()
        if not address:
            return ""
        host = f"[{address[0]}]" if ":" in address[0] else address[0]
        return f"udp://{host}:{address[1]}"

    def filenos(self) -> list[int]:
        return [] if self._socket is None else [self._socket.fileno()]

    def describe(self) -> str:
        notes = [f"from port {self._socket.getsockname()[1]}" if self._socket is not None else "not open"]
        notes += [f"{self.strangers} datagrams of strangers not heard"] if self.strangers else []
        notes += [f"{self.dropped} dropped"] if self.dropped else []
        notes += [self._fault] if self._fault else []
        return f"{self.where} ({', '.join(notes)})"

    def close(self) -> None:
        self._shut = True
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.close()
        self._socket = None


def _plain(host: str) -> str:
    """An address without its zone."""
    return host.partition("%")[0]


def _is_number(host: str) -> bool:
    try:
        ipaddress.ip_address(_plain(host))
    except ValueError:
        return False
    return True
