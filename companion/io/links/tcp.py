"""TCP, both ends: a client that reconnects for ever, and a server that no client can slow down or fill up."""

from __future__ import annotations

import contextlib
import errno
import socket
from typing import Final, Self

from .link import Closed, LinkEvent, Opened, Received
from .own_socket import OwnSocket
from .places import LinkPlace, room_for_strangers, to_leave
from .resolve import Address, Resolver
from .stream import StreamLink, explain, read_some
from .url import LinkConfigError, LinkUrl

MAX_CLIENTS: Final = 16
MAX_BACKLOG_BYTES: Final = 256 * 1024
MAX_BACKLOG_US: Final = 2_000_000
CONNECT_LIMIT_US: Final = 3_000_000
_ACCEPT_PAUSE_US: Final = 1_000_000
_BACKLOG: Final = 128
"""Connections that wait between two polls: more than a crowd makes in a tick, or an operator's would have to try again."""
_SEND_BUFFER: Final = 64 * 1024


def _prepare(sock: socket.socket) -> None:
    sock.setblocking(False)
    with contextlib.suppress(OSError):
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 10_000)


class _Sender:
    """Bytes on their way into one socket: bounded in size and in age (fault row 45)."""

    def __init__(self, sock: socket.socket) -> None:
        self.sock = sock
        self.fault = ""
        self._waiting = bytearray()
        self._stuck_since_us: int | None = None

    def write(self, data: bytes) -> int:
        if self.fault:
            return 0
        if len(self._waiting) + len(data) > MAX_BACKLOG_BYTES:
            self.fault = f"reads too slowly: {len(self._waiting)} bytes waiting"
            return 0
        self._waiting += data
        self._push()
        return 0 if self.fault else len(data)

    def flush(self, now_us: int) -> None:
        """Send what waits; a peer that takes nothing for 2 s is a fault."""
        before = len(self._waiting)
        self._push()
        if not self._waiting or len(self._waiting) < before:
            self._stuck_since_us = None if not self._waiting else now_us
        elif self._stuck_since_us is None:
            self._stuck_since_us = now_us
        elif now_us - self._stuck_since_us > MAX_BACKLOG_US and not self.fault:
            self.fault = f"has read nothing for {MAX_BACKLOG_US / 1e6:g} s"

    def _push(self) -> None:
        try:
            while self._waiting:
                del self._waiting[: self.sock.send(self._waiting)]
        except (BlockingIOError, InterruptedError):
            pass
        except OSError as error:
            self.fault = explain(error)


class TcpClientLink(StreamLink):
    """``tcp://host:port?silence=5``: silence > 0 reconnects when a server brings nothing for so many seconds."""

    def __init__(self, name: str, host: str, port: int, silence_s: float = 0.0) -> None:
        super().__init__(name, f"tcp://{host}:{port}", silence_s)
        self._resolver = Resolver(host, port, socket.SOCK_STREAM)
        self._sender: _Sender | None = None
        self._deadline_us = 0

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        cls._arguments(url)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        return cls(name, *cls._arguments(url))

    @staticmethod
    def _arguments(url: LinkUrl) -> tuple[str, int, float]:
        url.allow("silence")
        host, port = url.host_port()
        if not host or not port:
            raise LinkConfigError(f"{url.text}: needs the server's host and port, like tcp://127.0.0.1:3000")
        return host, port, url.number("silence", 0.0, 0.0, 3600.0)

    def _connect(self, now_us: int) -> bool:
        if self._sender is None:
            found = self._resolver.poll()
            if found is None:
                return False
            family, address = found
            sock = socket.socket(family, socket.SOCK_STREAM)
            self._sender = _Sender(sock)
            self._fd = sock.fileno()
            self._deadline_us = now_us + CONNECT_LIMIT_US
            _prepare(sock)
            outcome = sock.connect_ex(address)
            if outcome not in (0, errno.EINPROGRESS):
                raise OSError(outcome, errno.errorcode.get(outcome, str(outcome)))
        return self._connected(self._sender.sock, now_us)

    def _connected(self, sock: socket.socket, now_us: int) -> bool:
        fault = sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if fault:
            raise ConnectionError(fault, "connection refused" if fault == errno.ECONNREFUSED else f"error {fault}")
        try:
            peer = sock.getpeername()
        except OSError:
            if now_us > self._deadline_us:
                raise TimeoutError(errno.ETIMEDOUT, "no answer") from None
            return False
        if peer == sock.getsockname():
            # A socket that dials a free local port can meet itself (simultaneous open).
            raise ConnectionError(errno.ECONNREFUSED, "connection refused")
        return True

    def _release(self) -> None:
        sender, self._sender, self._fd = self._sender, None, -1
        if sender is not None:
            sender.sock.close()

    def _after_read(self, now_us: int) -> str:
        if self._sender is None:
            return ""
        self._sender.flush(now_us)
        return self._sender.fault

    def write(self, channel: int, data: bytes) -> int:
        if not self._open or channel != 0 or not data or self._sender is None:
            return 0
        taken = self._sender.write(data)
        if self._sender.fault:
            self._drop(self._sender.fault)
        return taken

    def filenos(self) -> list[int]:
        return [self._fd] if self._fd >= 0 and self._open else []


def _listening(family: socket.AddressFamily, address: Address) -> socket.socket:
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.setblocking(False)
        sock.bind(address)
        sock.listen(_BACKLOG)
    except OSError:
        sock.close()
        raise
    return sock


class TcpServerLink:
    """``tcp-listen://host:port``: one channel for each client, at most 16; numbers are never used twice."""

    datagrams = False

    def __init__(self, name: str, host: str, port: int, max_clients: int = MAX_CLIENTS) -> None:
        self.name = name
        self._max_clients = max_clients
        self._clients: dict[int, _Sender] = {}
        self._guarded = False
        self._places: dict[int, LinkPlace] = {}
        self._next = 0
        self._paused_until_us = 0
        self._accepting = True
        self.refused = 0
        self._own = OwnSocket(("tcp-listen", host, port), socket.SOCK_STREAM, _listening)
        self._shut = False
        self.host, self.port = host, port
        if self._own.socket is not None:
            self.host, self.port = self._own.socket.getsockname()[:2]

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        url.allow("max")
        url.host_port()
        url.number("max", MAX_CLIENTS, 1, 64)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        cls.check(url)
        return cls(name, *url.host_port(), max_clients=int(url.number("max", MAX_CLIENTS, 1, 64)))

    def poll(self, now_us: int) -> list[LinkEvent]:
        events: list[LinkEvent] = []
        sock = None if self._shut else self._own.poll(now_us)
        if sock is not None and now_us >= self._paused_until_us:
            self._accept(sock, now_us, events)
        for channel, sender in list(self._clients.items()):
            data, reason = read_some(sender.sock.fileno())
            if data:
                events.append(Received(channel, data))
            sender.flush(now_us)
            reason = sender.fault or reason
            if reason:
                self._let_go(channel, reason, events)
        return events

    def _let_go(self, channel: int, reason: str, events: list[LinkEvent]) -> None:
        self._clients.pop(channel).sock.close()
        self._places.pop(channel, None)
        events.append(Closed(channel, reason))

    def guard(self) -> None:
        self._guarded = True

    def trust(self, channel: int) -> None:
        if channel in self._places:
            self._places[channel].trusted = True

    def _has_room(self, now_us: int, events: list[LinkEvent]) -> bool:
        """Whether one more may come; on a guarded link a stranger leaves for him."""
        full = len(self._clients) >= self._max_clients
        if not self._guarded:
            return not full
        strangers = sum(not place.trusted for place in self._places.values())
        if not full and strangers < room_for_strangers(self._max_clients):
            return True
        leaves = to_leave(self._places.items(), now_us)
        if leaves is not None:
            self._let_go(leaves, "made room for a newcomer", events)
        return leaves is not None

    def _accept(self, listener: socket.socket, now_us: int, events: list[LinkEvent]) -> None:
        self._accepting = True
        for _ in range(2 * self._max_clients):
            try:
                sock, address = listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionError):
                return
            except OSError:
                # Out of descriptors: the waiting client would wake the loop without end (fault row 7).
                self._paused_until_us = now_us + _ACCEPT_PAUSE_US
                self._accepting = False
                return
            if not self._has_room(now_us, events):
                self.refused += 1
                sock.close()
                continue
            _prepare(sock)
            self._clients[self._next] = _Sender(sock)
            self._places[self._next] = LinkPlace(str(address[0]), now_us)
            events.append(Opened(self._next, f"{address[0]}:{address[1]}"))
            self._next += 1

    def write(self, channel: int, data: bytes) -> int:
        sender = self._clients.get(channel)
        return sender.write(data) if sender is not None and data else 0

    @property
    def is_listening(self) -> bool:
        return self._own.socket is not None

    def filenos(self) -> list[int]:
        if self._shut:
            return []
        own = [self._own.socket.fileno()] if self._own.socket is not None and self._accepting else []
        return own + [sender.sock.fileno() for sender in self._clients.values()]

    def describe(self) -> str:
        state = f"waiting: {self._own.fault}" if self._own.fault else f"{len(self._clients)} clients"
        return f"tcp-listen://{self.host}:{self.port} ({state})"

    def close(self) -> None:
        for sender in self._clients.values():
            sender.sock.close()
        self._clients.clear()
        self._shut = True
        if self._own.socket is not None:
            self._own.socket.close()
