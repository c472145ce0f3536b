"""The sockets of an IMC system: datagrams, the announcing ports with their multicast group and broadcasts, and connections.

By default all of it stays on this computer. Discovery is LSTS' own: five ports, of which each system takes the first that is free,
and all five are sent to.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import logging
import socket
from collections.abc import Sequence
from typing import Final

from mavlink_bridge.imc import Destination, Discovery, Place, Tcp, Udp

from .interfaces import Interface, interfaces
from .links import Link, LinkConfigError, Opened, Received, open_link

log = logging.getLogger(__name__)

GROUP: Final = "224.0.75.69"
PORTS: Final = range(30100, 30105)
EVERYWHERE: Final = "0.0.0.0"
_TRIES: Final = 5
"""Ports upward from the wanted one, as LSTS' own programs do."""
_DATAGRAM: Final = 0xFFFF
_AT_ONCE: Final = 256
"""Datagrams per poll and socket."""
_ONLY_JOINED: Final = 49
"""IP_MULTICAST_ALL (Linux): without this a socket hears the groups that other programs have joined on other interfaces."""
_HOPS: Final = 1
"""Announcements stay in their network."""
_LOOPBACK: Final = "127.0.0.1"
_LOOK_US: Final = 10_000_000


class ImcSockets:
    """``listen``: own address, or 0.0.0.0 for every interface. ``tcp_port`` 0: no connections."""

    def __init__(self, listen: str, udp_port: int, tcp_port: int = 0) -> None:
        self.listen = listen
        self.is_local = ipaddress.ip_address(listen).is_loopback
        self._main, self.udp_port = _bound(listen, range(udp_port, udp_port + _TRIES) if udp_port else range(1))
        self._finders: list[socket.socket] = []
        self.finder_port = 0
        self._open_finders()
        self._server = _server(listen, tcp_port) if tcp_port else None
        self._channels: dict[int, Tcp] = {}
        self._interfaces: list[Interface] = []
        self._looked_us: int | None = None

    @property
    def tcp_port(self) -> int:
        """0 without a server."""
        return int(getattr(self._server, "port", 0))

    # ---- in -----------------------------------------------------------------------------------------------------

    def poll(self, now_us: int) -> list[tuple[Place, bytes | None]]:
        """What came: (from where, bytes), None when a connection was closed."""
        self._look(now_us)
        found: list[tuple[Place, bytes | None]] = []
        for sock in (self._main, *self._finders):
            found += self._datagrams(sock)
        if self._server is None:
            return found
        for event in self._server.poll(now_us):
            if isinstance(event, Opened):
                host, _, port = event.peer.rpartition(":")
                self._channels[event.channel] = Tcp(host, int(port))
            elif isinstance(event, Received):
                found.append((self._channels[event.channel], event.data))
            else:
                found.append((self._channels.pop(event.channel), None))
        return found

    def _datagrams(self, sock: socket.socket) -> list[tuple[Place, bytes | None]]:
        found: list[tuple[Place, bytes | None]] = []
        for _ in range(_AT_ONCE):
            try:
                data, (host, port) = sock.recvfrom(_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:
                continue  # an answer of the network to something sent before
            if not self.is_local or ipaddress.ip_address(host).is_loopback:
                found.append((Udp(host, port), data))
        return found

    # ---- out ----------------------------------------------------------------------------------------------------

    def send(self, packets: Sequence[tuple[Destination, bytes]]) -> None:
        """Send each packet; what the network does not take is lost, as datagrams are."""
        for destination, data in packets:
            if isinstance(destination, Discovery):
                self._announce(data)
            elif isinstance(destination, Udp):
                _send(self._main, data, (destination.host, destination.port))
            else:
                self._write(destination, data)

    def _write(self, destination: Tcp, data: bytes) -> None:
        channel = next((number for number, place in self._channels.items() if place == destination), None)
        if self._server is not None and channel is not None:
            self._server.write(channel, data)

    def _announce(self, data: bytes) -> None:
        for interface in self._interfaces:
            with contextlib.suppress(OSError):
                self._main.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface.address))
            for port in PORTS:
                _send(self._main, data, (GROUP, port))
                if interface.is_loopback:
                    _send(self._main, data, (_LOOPBACK, port))
                elif interface.broadcast:
                    _send(self._main, data, (interface.broadcast, port))
        if not self.is_local:
            for port in PORTS:
                _send(self._main, data, ("255.255.255.255", port))

    # ---- where --------------------------------------------------------------------------------------------------

    def addresses(self) -> list[str]:
        """Own addresses that a console can speak to: this computer's loopback only when nothing else is served."""
        if self.listen != EVERYWHERE:
            return [self.listen]
        found = [each.address for each in self._interfaces if not each.is_loopback]
        return found or [_LOOPBACK]

    def look(self) -> None:
        """Learn the interfaces, and join the group on each: networks come and go."""
        found = interfaces() or [Interface(_LOOPBACK)]
        if self.is_local:
            found = [Interface(self.listen)]
        elif self.listen != EVERYWHERE:
            found = [each for each in found if each.address == self.listen or each.is_loopback]
        self._interfaces = found
        for sock in self._finders:
            for interface in found:
                member = socket.inet_aton(GROUP) + socket.inet_aton(interface.address)
                with contextlib.suppress(OSError):  # joined already, or no multicast there
                    sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)

    def _look(self, now_us: int) -> None:
        if self._looked_us is None or now_us - self._looked_us >= _LOOK_US:
            self._looked_us = now_us
            self.look()

    def _open_finders(self) -> None:
        """The first announcing port that is free. On this computer alone: its loopback, and the group as it arrives there."""
        for port in PORTS:
            try:
                sock, self.finder_port = _bound(self.listen if self.is_local else EVERYWHERE, range(port, port + 1))
            except LinkConfigError:
                continue
            self._finders = [sock]
            if self.is_local:
                with contextlib.suppress(LinkConfigError):
                    self._finders.append(_bound(GROUP, range(port, port + 1))[0])
            for each in self._finders:
                with contextlib.suppress(OSError):
                    each.setsockopt(socket.IPPROTO_IP, _ONLY_JOINED, 0)
            return
        log.warning("ports %d...%d are all taken: announcements of consoles are not heard", PORTS[0], PORTS[-1])

    def filenos(self) -> list[int]:
        own = [sock.fileno() for sock in (self._main, *self._finders)]
        return [fileno for fileno in own if fileno >= 0] + (self._server.filenos() if self._server else [])

    def close(self) -> None:
        for sock in (self._main, *self._finders):
            sock.close()
        if self._server is not None:
            self._server.close()


def _bound(host: str, ports: range) -> tuple[socket.socket, int]:
    """A socket on the first free port of several. Raises LinkConfigError when none is."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, _HOPS)
    fault = OSError()
    for port in ports:
        try:
            sock.bind((host, port))
        except OSError as error:
            fault = error
            if error.errno != errno.EADDRINUSE:
                break
            continue
        return sock, int(sock.getsockname()[1])
    sock.close()
    mend = "stop the program that has them" if fault.errno == errno.EADDRINUSE else "check listen"
    raise LinkConfigError(f"imc+udp://{host}:{ports[0]}...{ports[-1]}: {fault.strerror}; {mend}")


def _server(listen: str, port: int) -> Link:
    """Connections on the wanted port, or on one of the next few."""
    for offset in range(_TRIES):
        try:
            return open_link("imc", f"tcp-listen://{listen}:{port + offset}")
        except LinkConfigError:
            if offset == _TRIES - 1:
                raise
    raise AssertionError


def _send(sock: socket.socket, data: bytes, address: tuple[str, int]) -> None:
    with contextlib.suppress(OSError):
        sock.sendto(data, address)
