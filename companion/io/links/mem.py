"""Links inside one process: a pair of ends, each a full link. Simulator and tests use them as others use a cable."""

from __future__ import annotations

from collections import deque
from typing import Final, Self

from .link import Closed, LinkEvent, Opened, Received
from .url import LinkConfigError, LinkUrl

CAPACITY: Final = 65536
"""Bytes that wait for a reader before a writer is told 0, as a device's buffer would."""

_waiting: dict[str, MemLink] = {}


class MemLink:
    """One end. ``unplug`` and ``plug`` act on the cable: both ends see it at their next poll."""

    def __init__(self, name: str, *, datagrams: bool = False, capacity: int = CAPACITY) -> None:
        self.name = name
        self.datagrams = datagrams
        self.capacity = capacity
        self._peer: MemLink | None = None
        self._label = name
        self._inbox: deque[bytes] = deque()
        self._size = 0
        self._plugged = True
        self._open = False
        self._reason = "unplugged"
        self._shut = False
        self._joined = False
        """The cable is in, and neither end is shut."""

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        url.allow("capacity", "datagrams")
        if not url.where:
            raise LinkConfigError(f"{url.text}: needs a name, like mem:radio")
        url.number("capacity", CAPACITY, 1, 1 << 24)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        cls.check(url)
        datagrams = url.choice("datagrams", "0", {"0": "0", "1": "1"}) == "1"
        link = cls(name, datagrams=datagrams, capacity=int(url.number("capacity", CAPACITY, 1, 1 << 24)))
        link._label = url.where
        other = _waiting.pop(url.where, None)
        if other is None or other._shut:
            _waiting[url.where] = link
        else:
            link.connect(other)
        return link

    def connect(self, other: MemLink) -> None:
        """Join two ends."""
        self._peer, other._peer = other, self
        self._look()

    def _look(self) -> None:
        """Work out anew whether the ends are joined."""
        peer = self._peer
        self._joined = peer is not None and self._plugged and not self._shut and not peer._shut
        if peer is not None:
            peer._joined = peer._plugged and not self._shut and not peer._shut

    def unplug(self, reason: str = "unplugged") -> None:
        """Pull the cable; what was under way is lost."""
        for end in (self, self._peer):
            if end is not None:
                end._plugged, end._reason = False, reason
                end._inbox.clear()
                end._size = 0
        self._look()

    def plug(self) -> None:
        """Put the cable back."""
        for end in (self, self._peer):
            if end is not None:
                end._plugged = True
        self._look()

    @property
    def waiting(self) -> int:
        """Bytes that wait to be polled here."""
        return self._size

    def poll(self, now_us: int) -> list[LinkEvent]:
        joined = self._joined
        if self._open is joined and not self._inbox:
            return []
        if not joined and not self._open:
            return []
        events: list[LinkEvent] = []
        if not self._open:
            self._open = True
            events.append(Opened(0, f"mem:{self._label}"))
        if self._inbox:
            if self.datagrams:
                events.extend(Received(0, data) for data in self._inbox)
            else:
                events.append(Received(0, b"".join(self._inbox)))
            self._inbox.clear()
            self._size = 0
        if not joined:
            self._open = False
            events.append(Closed(0, self._reason if not self._plugged else "the other end closed"))
        return events

    def discard(self, now_us: int) -> None:
        """Poll, and throw away what came: a reader who does not listen."""
        if not self._open or not self._joined:
            self.poll(now_us)
        elif self._inbox:
            self._inbox.clear()
            self._size = 0

    def write(self, channel: int, data: bytes) -> int:
        peer = self._peer
        if channel != 0 or not self._open or not self._joined or peer is None:
            return 0
        size, room = len(data), peer.capacity - peer._size
        if size > room:
            if self.datagrams:
                return 0
            data, size = data[:room], room
        if size:
            peer._inbox.append(bytes(data))
            peer._size += size
        return size

    def filenos(self) -> list[int]:
        return []

    def describe(self) -> str:
        return f"mem:{self._label} ({'connected' if self._open else 'open end'})"

    def close(self) -> None:
        self._shut = True
        self._open = False
        self._look()
        if _waiting.get(self._label) is self:
            del _waiting[self._label]


def pair(name: str, *, datagrams: bool = False, capacity: int = CAPACITY) -> tuple[MemLink, MemLink]:
    """Make two joined ends."""
    one = MemLink(name, datagrams=datagrams, capacity=capacity)
    other = MemLink(f"{name}-far", datagrams=datagrams, capacity=capacity)
    one.connect(other)
    return one, other
