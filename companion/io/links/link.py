"""The contract of every link: non-blocking, polled, reconnecting for ever, one or many peers behind one name.

A link carries *channels*: a serial port has channel 0, a TCP server one per client, a UDP socket one per peer. The
app sees only the events here, so a recorded run can feed it the very same ones.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from mavlink_bridge.language.value import value


@value
class Opened:
    """A channel came up. ``peer`` is for people."""

    channel: int
    peer: str


@value
class Received:
    """Bytes from a channel, as read. For datagram links each event is one datagram."""

    channel: int
    data: bytes


@value
class Closed:
    """A channel went away."""

    channel: int
    reason: str


LinkEvent = Opened | Received | Closed


class Link(Protocol):
    """One configured link. No method blocks, none raises for a device's fault."""

    name: str
    datagrams: bool
    """True when one write is one datagram, so that a write should hold whole frames only."""

    def poll(self, now_us: int) -> list[LinkEvent]:
        """Reconnect when due and return what happened since the last call, oldest first."""
        ...

    def write(self, channel: int, data: bytes) -> int:
        """Hand bytes to the channel; return how many it took (0...len). A closed channel takes 0."""
        ...

    def filenos(self) -> list[int]:
        """Descriptors to select on for reading; may change after every poll."""
        ...

    def describe(self) -> str:
        """What and where, e.g. 'tcp://127.0.0.1:3000 (connected)'."""
        ...

    def close(self) -> None:
        """Release everything; may be called twice."""
        ...


@runtime_checkable
class GuardedLink(Protocol):
    """A link that anybody may speak to, and whose places strangers could fill."""

    def guard(self) -> None:
        """From now on whoever comes is a stranger until ``trust`` says otherwise: strangers go first, and leave places free."""
        ...

    def trust(self, channel: int) -> None:
        """Whoever is on this channel has proved that he belongs here: he keeps his place."""
        ...


@runtime_checkable
class Listening(Protocol):
    """A link that waits for others to come."""

    @property
    def is_listening(self) -> bool:
        """Whether any can: the address at which it listens may not be this computer's yet."""
        ...


@runtime_checkable
class Selective(Protocol):
    """A link that hears only whom its configuration names."""

    def take_stranger(self) -> str:
        """The URL by which one who spoke here since the last call, and was not heard, would be; empty when nobody did."""
        ...
