"""What a system of ours is made of: parts that answer consoles, and the words they exchange with the node that hosts them.

A part never sees an address that it could send to by itself, and never a header: the node knows who asked, on which
transport, and answers there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from .fields import Message


@dataclass(frozen=True)
class Udp:
    """A datagram's other end."""

    host: str
    """Numeric IPv4 address."""
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


@dataclass(frozen=True)
class Tcp:
    """A connection that somebody opened to us."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"tcp {self.host}:{self.port}"


@dataclass(frozen=True)
class Discovery:
    """Everybody within reach who listens on the announcing ports."""


Place = Udp | Tcp
Destination = Udp | Tcp | Discovery


@dataclass(frozen=True)
class Asker:
    """Who sent a packet. Nothing of it is proven: IMC knows no keys."""

    imc_id: int
    entity: int
    """Source entity of the packet; the answer goes to it."""
    name: str
    """From its Announce; ``0x4001`` before that."""
    place: Place
    direct: bool = True
    """The packet names us as its destination; False: it goes to everybody."""
    sent_utc_s: float = 0.0
    """The packet's time by the sender's clock, since 1970."""
    age_s: float | None = None
    """How long ago it was sent, by the sender's clock as far as it is known; None unknown."""

    @property
    def address(self) -> str:
        return str(self.place)

    def __str__(self) -> str:
        return f"IMC, {self.address}, {self.name} (0x{self.imc_id:04X})"


@dataclass(frozen=True)
class Outgoing:
    """A message that a part wants sent."""

    message: Message
    to: Asker | None = None
    """An answer goes to its asker, once, on the transport he asked by; None: to every console."""
    label: str = ""
    """The entity that says it; empty: the system itself."""
    age_s: float = 0.0
    """How old what it says is: a console shows that by the packet's time."""


class SystemPart(Protocol):
    """A part of the system."""

    def receive(self, message: Message, asker: Asker, now_us: int) -> bool:
        """A message for this system. True: it was this part's, nobody else need look."""
        ...

    def heard(self, asker: Asker, now_us: int) -> None:
        """A console is alive; called for each of its packets, before ``receive``."""
        ...

    def met(self, asker: Asker, now_us: int) -> None:
        """A console is new, or back after a silence: it knows nothing yet."""
        ...

    def take(self, now_us: int) -> list[Outgoing]:
        """What is due. Called after each packet and at least every 20 ms."""
        ...

    def entities(self) -> Sequence[str]:
        """The labels under which this part speaks; the same as long as the process lives."""
        ...
