"""Links by name: one table from scheme to class, imported only when used."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Final, Protocol, cast

from .link import Link
from .url import LinkConfigError, LinkUrl, parse_link_url

__all__ = ["SCHEMES", "LinkConfigError", "LinkUrl", "check_link", "open_link", "parse_link_url"]

_SERIAL: Final = (
    "companion.io.links.serial:SerialLink" if find_spec("termios") is not None else "companion.io.links.com:ComLink"
)
SCHEMES: Final[dict[str, str]] = {
    "serial": _SERIAL,
    "tcp": "companion.io.links.tcp:TcpClientLink",
    "tcp-listen": "companion.io.links.tcp:TcpServerLink",
    "udp": "companion.io.links.udp_peer:UdpPeerLink",
    "udp-listen": "companion.io.links.udp:UdpLink",
    "udp-broadcast": "companion.io.links.udp:UdpLink",
    "pty": "companion.io.links.pty:PtyLink",
    "mem": "companion.io.links.mem:MemLink",
    "file": "companion.io.links.file:FileLink",
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


def _class_of(parsed: LinkUrl) -> LinkClass:
    entry = SCHEMES.get(parsed.scheme)
    if entry is None:
        raise LinkConfigError(f"{parsed.text}: unknown kind {parsed.scheme!r}; known: {', '.join(SCHEMES)}")
    module, _, class_name = entry.partition(":")
    return cast(LinkClass, getattr(import_module(module), class_name))
