"""Every way in which bytes enter and leave: serial, TCP, UDP, pseudo-terminals, files, memory. One contract, one file a kind."""

from __future__ import annotations

from .link import Closed, Link, LinkEvent, Opened, Received
from .table import check_link, open_link
from .url import LinkConfigError, parse_link_url

__all__ = [
    "Closed",
    "Link",
    "LinkConfigError",
    "LinkEvent",
    "Opened",
    "Received",
    "check_link",
    "open_link",
    "parse_link_url",
]
