"""Links by name: one table from scheme to kind. A kind's class is imported only when used; who may be at its far end, and so whom
the vessel must suspect there, is a property of the kind and written nowhere else."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from importlib.util import find_spec
from typing import Final, Literal, Protocol, cast

from .link import Link
from .url import LinkConfigError, LinkUrl, parse_link_url

__all__ = [
    "SCHEMES",
    "LinkConfigError",
    "LinkKind",
    "LinkUrl",
    "Reach",
    "check_link",
    "kind_of",
    "open_link",
    "parse_link_url",
]


class Reach(Enum):
    """Who may be at the far end."""

    WIRED = "what is wired to the port"
    HERE = "programs of this computer"
    CALLED = "the one peer that is called"
    ANYBODY = "whoever speaks to the port"
    NETWORK = "everybody in the network"


@dataclass(frozen=True, slots=True)
class LinkKind:
    """One kind of link."""

    made_by: str
    """Module and class."""
    reach: Reach
    transport: Literal["", "tcp", "udp"] = ""
    """Empty: no network."""
    is_path: bool = False
    """The address is a device or a file."""


_SERIAL: Final = (
    "companion.io.links.serial:SerialLink" if find_spec("termios") is not None else "companion.io.links.com:ComLink"
)
SCHEMES: Final[dict[str, LinkKind]] = {
    "serial": LinkKind(_SERIAL, Reach.WIRED, is_path=True),
    "tcp": LinkKind("companion.io.links.tcp:TcpClientLink", Reach.CALLED, "tcp"),
    "tcp-listen": LinkKind("companion.io.links.tcp:TcpServerLink", Reach.ANYBODY, "tcp"),
    "udp": LinkKind("companion.io.links.udp_peer:UdpPeerLink", Reach.CALLED, "udp"),
    "udp-listen": LinkKind("companion.io.links.udp:UdpLink", Reach.ANYBODY, "udp"),
    "udp-broadcast": LinkKind("companion.io.links.udp:UdpLink", Reach.NETWORK, "udp"),
    "pty": LinkKind("companion.io.links.pty:PtyLink", Reach.HERE, is_path=True),
    "mem": LinkKind("companion.io.links.mem:MemLink", Reach.HERE),
    "file": LinkKind("companion.io.links.file:FileLink", Reach.HERE, is_path=True),
}


class LinkClass(Protocol):
    """What every class in the table offers beside being a Link."""

    def check(self, url: LinkUrl) -> None:
        """Raise LinkConfigError when the address is wrong, opening nothing."""
        ...

    def from_url(self, name: str, url: LinkUrl) -> Link:
        """Make the link."""
        ...


def open_link(name: str, url: str, **options: object) -> Link:
    """Make the link that ``url`` describes; it connects at its first poll.

    ``options`` are the configuration's own keys (baud=115200, ...) and stand before those in the address. Raises
    LinkConfigError for an address that cannot be meant, or for a port or file of our own that cannot be had.
    """
    parsed = parse_link_url(url, options)
    return _class_of(parsed).from_url(name, parsed)


def check_link(url: str, **options: object) -> None:
    """Raise LinkConfigError when ``url`` is wrong, opening nothing."""
    parsed = parse_link_url(url, options)
    _class_of(parsed).check(parsed)


def kind_of(parsed: LinkUrl) -> LinkKind:
    """What kind of link an address means. Raises LinkConfigError when there is none."""
    kind = SCHEMES.get(parsed.scheme)
    if kind is None:
        raise LinkConfigError(f"{parsed.text}: unknown kind {parsed.scheme!r}; known: {', '.join(SCHEMES)}")
    return kind


def _class_of(parsed: LinkUrl) -> LinkClass:
    module, _, class_name = kind_of(parsed).made_by.partition(":")
    return cast(LinkClass, getattr(import_module(module), class_name))
