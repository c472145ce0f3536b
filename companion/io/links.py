"""Links by name: one table from scheme to class, imported only when used."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Final, Protocol, cast

from companion.io.link import Link
from companion.io.link_url import LinkConfigError, LinkUrl, parse_link_url

__all__ = ["SCHEMES", "LinkConfigError", "LinkUrl", "check_link", "open_link", "parse_link_url"]

_SERIAL: Final = (
    "companion.io.link_serial:SerialLink" if find_spec("termios") is not None else "companion.io.link_com:ComLink"
)
SCHEMES: Final[dict[str, str]] = {
    "serial": _SERIAL,
    "tcp": "companion.io.link_tcp:TcpClientLink",
    "tcp-listen": "companion.io.link_tcp:TcpServerLink",
    "udp": "companion.io.link_udp_peer:UdpPeerLink",
    "udp-listen": "companion.io.link_udp:UdpLink",
    "udp-broadcast": "companion.io.link_udp:UdpLink",
    "pty": "companion.io.link_pty:PtyLink",
    "mem": "companion.io.link_mem:MemLink",
    "file": "companion.io.link_file:FileLink",
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
