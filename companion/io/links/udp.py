"""UDP that anybody may speak to: listening, and broadcasting until somebody answers. What a sender may do, the endpoint's class says.

Every sender becomes a channel of its own, in a bounded table; answers go back to where the question came from. A
source that floods is muted before anybody parses a byte of it (fault row 44). A link to one peer is ``link_udp_peer``.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import socket
from dataclasses import dataclass
from typing import Final, Self

from .link import Closed, LinkEvent, Opened, Received
from .own_socket import OwnSocket
from .places import NEWCOMERS_AT_ONCE, NEWCOMERS_PER_S, STRANGER_IDLE_US, LinkPlace, room_for_strangers, to_leave
from .resolve import Address, Resolver
from .stream import Backoff, explain
from .url import LinkConfigError, LinkUrl

MAX_PEERS: Final = 16
PEER_IDLE_US: Final = 60_000_000
"""A learned peer that has sent nothing for so long is forgotten."""
EVICT_IDLE_US: Final = 10_000_000
"""With a full table, a peer idle for so long makes room for a new one."""
MAX_DATAGRAMS: Final = 512
"""Per poll."""
FLOOD_RATE: Final = 2000.0
FLOOD_BURST: Final = 4000.0
"""Datagrams per second and at once that one source may send; more than any ground station's full-rate streams."""
MUTE_US: Final = 5_000_000
_EVERYBODY: Final = 0


@dataclass(slots=True)
class Flood:
    """How much one source may send before it is muted."""

    tokens: float = FLOOD_BURST
    filled_us: int = 0
    muted_until_us: int = 0
    rate: float = FLOOD_RATE
    burst: float = FLOOD_BURST
    mute_us: int = MUTE_US

    def allows(self, now_us: int) -> bool:
        """Count one datagram; False when it is one too many."""
        if now_us < self.muted_until_us:
            return False
        self.tokens = min(self.burst, self.tokens + (now_us - self.filled_us) * 1e-6 * self.rate)
        self.filled_us = now_us
        if self.tokens < 1.0:
            self.muted_until_us = now_us + self.mute_us
            return False
        self.tokens -= 1.0
        return True


@dataclass(slots=True, eq=False)
class _Peer:
    channel: int
    address: Address
    heard_us: int
    flood: Flood
    place: LinkPlace


def check_target(url: LinkUrl) -> None:
    """Raise LinkConfigError unless the address names a host and a port to send to."""
    host, port = url.host_port()
    if not host or not port:
        raise LinkConfigError(f"{url.text}: needs the peer's host and port, like {url.scheme}://127.0.0.1:14550")


def send_datagram(sock: socket.socket, data: bytes, address: Address) -> tuple[int, str]:
    """Send; return the bytes that count as taken, and the fault.

    No route, no network: datagrams are lost, which is what datagrams do; the channel stays.
    """
    try:
        return sock.sendto(data, address), ""
    except (BlockingIOError, InterruptedError):
        return 0, ""
    except OSError as error:
        return (len(data) if error.errno != errno.EMSGSIZE else 0), explain(error)


def _listening(family: socket.AddressFamily, address: Address) -> socket.socket:
    sock = socket.socket(family, socket.SOCK_DGRAM)
    try:
        sock.setblocking(False)
        sock.bind(address)
    except OSError:
        sock.close()
        raise
    return sock


class UdpLink:
    """``udp-listen://host:port`` and ``udp-broadcast://addr:port``.

    The broadcast's channel 0 closes while an answering peer is known, so that nobody hears everything twice, and opens again when
    the last one has gone silent.
    """

    datagrams = True

    def __init__(self, name: str, kind: str, host: str, port: int, local_port: int = 0) -> None:
        self.name = name
        self.where = f"{kind}://{host}:{port}"
        self._kind = kind
        self._resolver = Resolver(host, port, socket.SOCK_DGRAM)
        self._local_port = port if kind == "udp-listen" else local_port
        self._backoff = Backoff()
        self._target: Address | None = None
        self._target_open = False
        self._guarded = False
        self._newcomers = Flood(NEWCOMERS_AT_ONCE, rate=NEWCOMERS_PER_S, burst=NEWCOMERS_AT_ONCE, mute_us=0)
        self._peers: dict[Address, _Peer] = {}
        self._by_channel: dict[int, _Peer] = {}
        self._next = 1
        self._fault = ""
        self._shut = False
        self._buffer = bytearray(9216)
        self.dropped = 0
        """Datagrams not passed on: a muted source, or no room in the table."""
        self._own = OwnSocket((kind, host, port), socket.SOCK_DGRAM, _listening) if kind == "udp-listen" else None
        self._socket = self._own.socket if self._own is not None else None
        self.port = port if self._socket is None else int(self._socket.getsockname()[1])

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        url.allow(*(() if url.scheme == "udp-listen" else ("local",)))
        host, _ = url.host_port()
        if url.scheme == "udp-broadcast":
            check_target(url)
            try:
                ipaddress.IPv4Address(host)
            except ValueError:
                raise LinkConfigError(
                    f"{url.text}: needs a broadcast address in numbers, like udp-broadcast://192.168.1.255:14550"
                ) from None
        url.number("local", 0, 0, 65535)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        cls.check(url)
        return cls(name, url.scheme, *url.host_port(), local_port=int(url.number("local", 0, 0, 65535)))

    def poll(self, now_us: int) -> list[LinkEvent]:
        events: list[LinkEvent] = []
        if self._shut:
            return events
        if self._own is not None:
            self._socket = self._own.poll(now_us)
        elif self._socket is None and self._backoff.due(now_us):
            self._try_open(now_us)
        if self._socket is not None:
            self._receive(self._socket, now_us, events)
            self._forget_idle(now_us, events)
            if self._kind == "udp-broadcast":
                answered = any(peer.place.trusted for peer in self._peers.values()) if self._guarded else self._peers
                self._show_target(not answered, "a peer has answered", events)
        return events

    def _try_open(self, now_us: int) -> None:
        try:
            found = self._resolver.poll()
            if found is None:
                return
            family, self._target = found
            sock = socket.socket(family, socket.SOCK_DGRAM)
            try:
                sock.setblocking(False)
                if self._kind == "udp-broadcast":
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
                sock.bind(("::" if family == socket.AF_INET6 else "", self._local_port))
            except OSError:
                sock.close()
                raise
            self._socket, self._fault = sock, ""
        except OSError as error:
            self._fault = explain(error)
            self._backoff.failed(now_us)

    def _show_target(self, want: bool, reason: str, events: list[LinkEvent]) -> None:
        if want and not self._target_open:
            events.append(Opened(_EVERYBODY, self.where))
        elif not want and self._target_open:
            events.append(Closed(_EVERYBODY, reason))
        self._target_open = want

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
            peer = self._peers.get(address) or self._learn(address, now_us, events)
            if peer is None or not peer.flood.allows(now_us):
                self.dropped += 1
                continue
            peer.heard_us = now_us
            if size:
                events.append(Received(peer.channel, bytes(buffer[:size])))

    def _learn(self, address: Address, now_us: int, events: list[LinkEvent]) -> _Peer | None:
        if not self._has_room(now_us, events):
            return None
        peer = _Peer(self._next, address, now_us, Flood(filled_us=now_us), LinkPlace(str(address[0]), now_us))
        self._next += 1
        self._peers[address] = self._by_channel[peer.channel] = peer
        events.append(Opened(peer.channel, f"{address[0]}:{address[1]}"))
        return peer

    def _has_room(self, now_us: int, events: list[LinkEvent]) -> bool:
        """Whether one more may come; on a guarded link a stranger leaves for him."""
        full = len(self._by_channel) >= MAX_PEERS
        if self._guarded:
            if not self._newcomers.allows(now_us):
                return False
            strangers = sum(not peer.place.trusted for peer in self._by_channel.values())
            if strangers and (full or strangers >= room_for_strangers(MAX_PEERS)):
                leaves = to_leave(((peer, peer.place) for peer in self._by_channel.values()), now_us)
                if leaves is not None:
                    self._forget(leaves, "made room for a newcomer", events)
                return leaves is not None
        return not full or self._evict(now_us, events)

    def guard(self) -> None:
        self._guarded = True

    def trust(self, channel: int) -> None:
        peer = self._by_channel.get(channel)
        if peer is not None:
            peer.place.trusted = True

    def _evict(self, now_us: int, events: list[LinkEvent]) -> bool:
        oldest = min(self._by_channel.values(), key=lambda peer: peer.heard_us)
        if now_us - oldest.heard_us < EVICT_IDLE_US:
            return False
        self._forget(oldest, "made room for a new peer", events)
        return True

    def _forget_idle(self, now_us: int, events: list[LinkEvent]) -> None:
        for peer in list(self._by_channel.values()):
            limit_us = STRANGER_IDLE_US if self._guarded and not peer.place.trusted else PEER_IDLE_US
            if now_us - peer.heard_us > limit_us:
                self._forget(peer, f"silent for {limit_us / 1e6:g} s", events)

    def _forget(self, peer: _Peer, reason: str, events: list[LinkEvent]) -> None:
        del self._peers[peer.address], self._by_channel[peer.channel]
        events.append(Closed(peer.channel, reason))

    def write(self, channel: int, data: bytes) -> int:
        if self._socket is None or not data:
            return 0
        peer = self._by_channel.get(channel)
        if peer is not None:
            address = peer.address
        elif channel == _EVERYBODY and self._target_open and self._target is not None:
            address = self._target
        else:
            return 0
        taken, fault = send_datagram(self._socket, data, address)
        self._fault = fault or self._fault
        return taken

    @property
    def is_listening(self) -> bool:
        return self._own is None or self._own.socket is not None

    def filenos(self) -> list[int]:
        return [] if self._socket is None else [self._socket.fileno()]

    def describe(self) -> str:
        if self._own is not None and self._own.fault:
            return f"{self.where} (waiting: {self._own.fault})"
        state = f"{len(self._peers)} peers heard" + (f", {self.dropped} dropped" if self.dropped else "")
        return f"{self.where} ({state}{', ' + self._fault if self._fault else ''})"

    def close(self) -> None:
        self._shut = True
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.close()
        self._socket = None
